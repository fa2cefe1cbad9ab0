#include "cli/session/series_report.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/request/spoken.hpp"
#include "cli/session/explain.hpp"
#include "measure/quantiles.hpp"
#include "presentation/sheet.hpp"
#include "request/quantities.hpp"

namespace edgewise::cli {
namespace {

using Json = nlohmann::ordered_json;

/// Seconds of one time point become those of all; null stays.
void take_all(Json& predicted, int times) {
    for (const char* key : {"seconds", "seconds_low", "seconds_high"})
        if (predicted.contains(key) && predicted[key].is_number())
            predicted[key] = predicted[key].get<double>() * times;
}

}  // namespace

Json series_report(const Series& series, double startup_seconds, bool with_run,
                   const std::optional<Failure>& failure) {
    if (!series.first) {
        Json report = failure_of(failure ? failure->code : 1, failure ? failure->message : "");
        report["warnings"] = spoken(series.messages.warnings());
        return report;
    }
    Json report = report_of(*series.first, series.messages, startup_seconds, with_run, failure);
    report["warnings"] = spoken(series.messages.warnings());
    report["request"]["frames"] = series.times;
    report["request"]["time"] = "all";
    const auto& limit = series.query.max_time;
    report["request"]["budget"]["seconds"] = limit ? Json(*limit) : Json();
    if (report["plan"].is_object()) {
        take_all(report["plan"]["predicted"], series.times);
        for (Json& step : report["plan"]["steps"]) take_all(step["predicted"], series.times);
    }
    Json& planning = report["planning"];
    if (planning.is_object() && planning["saved_seconds"].is_number())
        planning["saved_seconds"] = series.times * planning["saved_seconds"].get<double>();
    for (Json& plan : report["front"]) take_all(plan["predicted"], series.times);
    if (!with_run) return report;
    report["outputs"] = series.files;
    if (!series.measured) return report;
    const Measured& all = *series.measured;
    Json& measured = report["measured"];
    measured["seconds"] = all.seconds;
    measured["bytes"] = all.bytes;
    measured["read_seconds"] = series.read_seconds;
    measured["write_seconds"] = all.write_seconds;
    measured["kept"] = all.kept ? Json(*all.kept) : Json();
    measured["error"] = to_json(all.error);
    for (std::size_t i = 0; i < std::min(measured["steps"].size(), all.step_seconds.size()); ++i)
        measured["steps"][i]["seconds"] = all.step_seconds[i];
    return report;
}

std::string result_of(const Series& series) {
    const auto& files = series.files;
    std::vector<std::string> parts{files.empty() ? "nothing written"
                                   : files.size() == 1
                                       ? files[0]
                                       : fmt::format("{} to {}", files.front(), files.back())};
    const Extent picture = series.first->planned()->want.output();
    parts.push_back(series.first->planned()->query.look.montage && !files.empty()
                        ? text_of(sheet_extent(series.first->planned()->query.look, picture), 2)
                        : fmt::format("{} time points of {}", series.times, text_of(picture, 2)));
    parts.push_back(fmt::format("{}", fmt::join(series.measured->steps, " > ")));
    parts.push_back(seconds_text(median(series.measured->seconds)));
    if (series.measured->error)
        parts.push_back(
            fmt::format("error {} measured", error_text({.error = series.measured->error->nrmse})));
    else if (const auto& like = series.first->planned()->want.budget.like;
             like && series.first->planned()->answer.plan->predicted.likeness == Likeness::alike)
        parts.push_back(fmt::format("as good as {}", like->name));
    return fmt::format("{}", fmt::join(parts, ", "));
}

}  // namespace edgewise::cli
