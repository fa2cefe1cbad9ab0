#include "cli/session/merge_report.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "cli/request/spoken.hpp"
#include "cli/session/explain.hpp"
#include "graph/version.hpp"
#include "measure/quantiles.hpp"
#include "presentation/sheet.hpp"
#include "request/quantities.hpp"

namespace edgewise::cli {
namespace {

using Json = nlohmann::ordered_json;

/// Keys of a channel's own report that stay at the channel.
constexpr const char* kOwn[] = {"plan",   "front", "refused",  "margin",
                                "rivals", "scene", "planning", "measured"};

Json channel_json(const MergedChannel& channel, const Listener& messages, double startup_seconds,
                  bool with_run) {
    Json json = {{"channel", channel.channel}, {"colour", store::text_of(channel.colour)}};
    json["window"] = channel.shades ? Json{channel.shades->black, channel.shades->white} : Json();
    if (!channel.request) return json;
    const Json own = report_of(*channel.request, messages, startup_seconds, with_run, {});
    for (const char* key : kOwn)
        if (own.contains(key)) json[key] = own[key];
    return json;
}

bool is_planned(const MergedChannel& channel) {
    const Planned* planned = channel.request ? channel.request->planned() : nullptr;
    return planned && planned->answer.plan;
}

/// The plain path of all channels, where it is the same.
Json plain_json(const Merge& merge) {
    const auto plain_of = [](const MergedChannel& channel) {
        const auto& plain = channel.request->planned()->answer.plain;
        return plain ? plain->step : std::string();
    };
    const std::string first = plain_of(merge.channels.front());
    const bool same =
        std::all_of(merge.channels.begin(), merge.channels.end(),
                    [&](const MergedChannel& channel) { return plain_of(channel) == first; });
    return same && !first.empty() ? Json(first) : Json();
}

/// The steps of all channels, one channel after another.
Json plan_json(const Merge& merge) {
    if (merge.channels.empty() ||
        !std::all_of(merge.channels.begin(), merge.channels.end(), is_planned))
        return nullptr;
    Json steps = Json::array();
    for (const MergedChannel& channel : merge.channels) {
        const Json own = to_json(*channel.request->planned()->answer.plan);
        for (const Json& step : own["steps"]) steps.push_back(step);
    }
    return {{"steps", steps},
            {"predicted", to_json(predicted_of(merge))},
            {"plain", plain_json(merge)}};
}

/// Seconds of all channels; parts that add up to them, as of one.
Json planning_json(const Merge& merge, double startup_seconds) {
    Spent spent;
    double seconds = 0;
    std::optional<double> saved = 0;  // where all channels have a plain path
    const Planned* any = nullptr;
    int vertices = 0, edges = 0;
    for (const MergedChannel& channel : merge.channels) {
        if (!channel.request || !channel.request->planned()) continue;
        any = channel.request->planned();
        const Answer& answer = any->answer;
        seconds += answer.seconds;
        const std::optional<double> own = any->saved_seconds();
        saved = saved && own ? std::optional(*saved + *own) : std::nullopt;
        spent.statistics += any->spent.statistics;
        spent.preset += any->spent.preset;
        spent.preview += any->spent.preview;
        spent.search += any->spent.search;
        spent.pilot += any->spent.pilot;
        vertices += answer.vertices;
        edges += answer.edges;
    }
    if (!any) return nullptr;
    return {{"seconds", seconds},
            {"parts",
             {{"statistics", spent.statistics},
              {"preset", spent.preset},
              {"preview", spent.preview},
              {"search", spent.search},
              {"pilot", spent.pilot}}},
            {"saved_seconds", saved ? Json(*saved) : Json()},
            {"startup_seconds", startup_seconds},
            {"planner", name_of(any->query.planner)},
            {"machine", any->engine.machine().name},
            {"vertices", vertices},
            {"edges", edges}};
}

Json request_of_all(const Merge& merge) {
    Json json = {{"job", name_of(merge.query.job)}, {"input", merge.query.input}};
    for (const MergedChannel& channel : merge.channels)
        if (channel.request) {
            json = request_json(*channel.request);
            break;
        }
    if (json.contains("budget"))
        json["budget"]["seconds"] = merge.query.max_time ? Json(*merge.query.max_time) : Json();
    json["frames"] = merge.frames;
    json["channels"] = Json::array();
    for (const ChannelSpec& wanted : merge.wanted) json["channels"].push_back(wanted.channel);
    if (merge.wanted.empty())
        for (const MergedChannel& channel : merge.channels)
            json["channels"].push_back(channel.channel);
    return json;
}

Json measured_json(const Merge& merge) {
    if (!merge.measured) return nullptr;
    const Measured& all = *merge.measured;
    double read = 0;
    Json steps = Json::array();
    for (const MergedChannel& channel : merge.channels) {
        read += channel.request->planned()->input.read_seconds;
        const Json own = report_of(*channel.request, merge.messages, 0, true, {});
        for (const Json& step : own["measured"]["steps"]) steps.push_back(step);
    }
    return {{"seconds", all.seconds},
            {"bytes", all.bytes},
            {"read_seconds", read},
            {"write_seconds", all.write_seconds},
            {"kept", all.kept ? Json(*all.kept) : Json()},
            {"error", to_json(all.error)},
            {"steps", steps}};
}

/// What ran, and the channels that it ran for: "0 in #ff0000".
std::vector<std::pair<std::string, std::vector<std::string>>> paths_of(const Merge& merge) {
    std::vector<std::pair<std::string, std::vector<std::string>>> paths;
    for (const MergedChannel& channel : merge.channels) {
        const std::string path =
            fmt::format("{}", fmt::join(channel.request->run->measured.steps, " > "));
        auto same = std::find_if(paths.begin(), paths.end(),
                                 [&](const auto& known) { return known.first == path; });
        if (same == paths.end()) same = paths.insert(paths.end(), {path, {}});
        same->second.push_back(
            fmt::format("{} in {}", channel.channel, store::text_of(channel.colour)));
    }
    return paths;
}

/// Of a channel that has no plan: the plans that come nearest, and what would do.
Json error_json(const Merge& merge, const Failure& failure) {
    Json error = {{"code", failure.code}, {"message", failure.message}};
    error["nearest"] = Json::array();
    if (merge.channels.empty() || !merge.channels.back().request) return error;
    const Json own =
        report_of(*merge.channels.back().request, merge.messages, 0, false, failure)["error"];
    error["nearest"] = own["nearest"];
    if (own.contains("relax")) error["relax"] = own["relax"];
    return error;
}

}  // namespace

Json merge_report(const Merge& merge, double startup_seconds, bool with_run,
                  const std::optional<Failure>& failure) {
    Json report = {{"schema", 1}, {"version", version()}};
    report["warnings"] = spoken(merge.messages.warnings());
    report["request"] = request_of_all(merge);
    report["plan"] = failure ? Json() : plan_json(merge);
    // Each channel has its own.
    report["front"] = Json::array();
    report["refused"] = Json::array();
    report["planning"] = planning_json(merge, startup_seconds);
    report["channels"] = Json::array();
    for (const MergedChannel& channel : merge.channels)
        report["channels"].push_back(
            channel_json(channel, merge.messages, startup_seconds, with_run));
    if (with_run) {
        report["measured"] = measured_json(merge);
        report["outputs"] = merge.files;
    }
    if (failure) report["error"] = error_json(merge, *failure);
    return report;
}

std::string result_of(const Merge& merge) {
    const auto& files = merge.files;
    std::vector<std::string> parts{files.empty() ? "nothing written"
                                   : files.size() == 1
                                       ? files[0]
                                       : fmt::format("{} to {}", files.front(), files.back())};
    const bool sheet = merge.query.look.montage && !files.empty();
    parts.push_back(
        (merge.frames > 1 && !sheet ? fmt::format("{} of ", merge.frames) : "") +
        text_of(sheet ? sheet_extent(merge.query.look, merge.extent) : merge.extent, 2));
    for (const auto& [path, channels] : paths_of(merge))
        parts.push_back(fmt::format("channel{} {} by {}", channels.size() > 1 ? "s" : "",
                                    fmt::join(channels, " and "), path));
    parts.push_back(seconds_text(median(merge.measured->seconds)));
    const Predicted predicted = predicted_of(merge);
    const Planned& first = *merge.channels.front().request->planned();
    const auto is_alike = [&](const MergedChannel& channel) {
        return channel.request->planned()->answer.plan->predicted.likeness == Likeness::alike;
    };
    const auto& like = first.want.budget.like;
    if (merge.measured->error)
        parts.push_back(
            fmt::format("error {} measured", error_text({.error = merge.measured->error->nrmse})));
    else if (predicted.known)
        parts.push_back(fmt::format("error {} predicted", error_text(predicted)));
    else if (like && std::all_of(merge.channels.begin(), merge.channels.end(), is_alike))
        parts.push_back(first.want.field == Field::nearest
                            ? "no new value"
                            : fmt::format("as good as {}", like->name));
    return fmt::format("{}", fmt::join(parts, ", "));
}

}  // namespace edgewise::cli
