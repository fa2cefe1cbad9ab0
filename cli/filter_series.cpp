#include "cli/filter_series.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/job_words.hpp"
#include "cli/session/report.hpp"
#include "cli/session/typed_request.hpp"
#include "cli/verbs/verbs.hpp"
#include "engine/filter_result.hpp"
#include "engine/kept_padding.hpp"
#include "engine/reached.hpp"
#include "graph/errors.hpp"
#include "measure/machine.hpp"
#include "request/outputs.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise::cli {
namespace {

/// What is about one run is not there for several.
void expect_nothing_of_one_run(const JobOptions& options) {
    for (const auto& [option, file] : {std::pair{"--trace", &options.trace},
                                       {"--flow", &options.flow},
                                       {"--report", &options.report}})
        if (*file)
            throw RequestError(fmt::format(
                "{}: is about one run, and each time point has its own; name one by --time",
                option));
    if (options.explain)
        throw RequestError(
            "--explain: shows one plan, and each time point has its own; name one "
            "by --time");
}

/// Time points, one after another, as the file has them.
class FilteredSeries {
 public:
    FilteredSeries(const JobOptions& options, int times)
        : options_(options), times_(times), startup_seconds_(process_seconds()) {
        configure(messages_, options);
    }

    void take(int time) {
        JobOptions one = options_;
        one.put("time", std::to_string(time));
        Query query = spec_of(one, catalogue());
        if (!engine_) engine_ = engine_of(one, query, true, messages_);
        last_.emplace(ask(*engine_, std::move(query), {.runs = true}));
        Effort effort;
        if (!one.has("verify")) effort.errors = ErrorsWanted::for_choice;
        last_->open_all(messages_);
        last_->look_at(effort, messages_);
        const bool none = last_->looked()->outputs->none();
        if (!none) expect_alike(last_->looked()->written.header);
        last_->price_all(effort, messages_);
        expect_plan(*last_->planned());
        const auto take = [&](int /*frame*/, const Data& result) {
            if (!none) keep(*last_->planned(), result, time);
        };
        last_->run_all({.frames = take, .files = false}, messages_);
        add(last_->run->measured);
    }
    void write() {
        if (!header_) return;
        store::write(*options_.out, *header_, samples_.data());
        last_->run->files = {*options_.out};
        messages_.result(fmt::format("{}: {} time points", *options_.out, times_));
    }
    /// Of all time points: the plan of the last, and what all took together.
    nlohmann::ordered_json report(const std::optional<Failure>& failure) const {
        if (!last_ && failure) return failure_of(failure->code, failure->message);
        nlohmann::ordered_json report =
            report_of(of_all(!failure), messages_, startup_seconds_, !failure.has_value(), failure);
        report["times"] = times_;
        return report;
    }

 private:
    /// The last time point, with what all took.
    Reached of_all(bool measured) const {
        Reached all = *last_;
        if (measured) all.run->measured = *measured_;
        return all;
    }
    void expect_alike(const store::Header& header) {
        if (header_) {
            if (header.type != header_->type || header.values != header_->values)
                throw RequestError(
                    fmt::format("--time all: time points would be written as {} and {}; --bits 32 "
                                "writes all as f32",
                                name_of(header_->type), name_of(header.type)));
            return;
        }
        header_ = header;
        header_->times = times_;
        if (const std::string why = store::cannot_write(*options_.out, *header_); !why.empty())
            throw RequestError(fmt::format("-o {}: {}", *options_.out, why));
    }
    void keep(const Planned& planned, const Data& result, int time) {
        const Tail& tail = planned.written.tail;
        if (tail.view)
            throw RequestError(
                "--time all: a view has a window of its own for each time point; "
                "leave out --bits, or say --bits 32");
        if (const auto cut = cut_off_text(planned.want, result, tail))
            messages_.warning(message("time {}: {}", time, *cut));
        Array samples = finished(result, tail, {}, planned.memory.get());
        const std::string kept = keep_padding(planned.want, planned.input, tail, samples);
        if (!kept.empty()) messages_.warning(kept);
        const auto* first = static_cast<const std::byte*>(samples.data());
        samples_.insert(samples_.end(), first, first + samples.bytes());
    }

    /// Seconds are sums, the error is the largest.
    void add(const Measured& one) {
        if (!measured_) {
            measured_ = one;
            return;
        }
        for (std::size_t i = 0; i < measured_->seconds.size(); ++i)
            measured_->seconds[i] += one.seconds[i];
        if (one.steps == measured_->steps)
            for (std::size_t i = 0; i < measured_->step_seconds.size(); ++i)
                measured_->step_seconds[i] += one.step_seconds[i];
        measured_->bytes = std::max(measured_->bytes, one.bytes);
        if (one.kept == false || (measured_->kept == true && !one.kept)) measured_->kept = one.kept;
        if (one.error && (!measured_->error || one.error->nrmse > measured_->error->nrmse))
            measured_->error = one.error;
    }

    const JobOptions& options_;
    int times_;
    double startup_seconds_;
    Messages messages_;
    std::optional<Engine> engine_;
    std::optional<Reached> last_;  // time point
    std::optional<Measured> measured_;
    std::optional<store::Header> header_;
    std::vector<std::byte> samples_;
};

}  // namespace

int do_filter_series(const JobOptions& options) {
    std::optional<FilteredSeries> series;
    return guarded(
        [&] {
            expect_nothing_of_one_run(options);
            check_outputs(options);
            JobOptions still = options;
            still.drop("time");
            const int times = store::inspect(options.input, selection_of(still)).times;
            if (times > 1 && options.out) {
                const store::Format* format = store::format_of(*options.out);
                if (format && format->name != "NIfTI" && format->name != "NRRD")
                    throw RequestError(
                        fmt::format("-o {}: {} holds no time series here; .nii.gz, .nii and .nrrd "
                                    "do",
                                    *options.out, format->name));
            }
            series.emplace(options, times);
            for (int time = 0; time < times; ++time) series->take(time);
            series->write();
            if (options.json) write_text(*options.json, text_of(series->report({})));
            return 0;
        },
        [&](int code, const std::string& message) {
            if (!options.json) return;
            write_text(*options.json, text_of(series ? series->report(Failure{code, message})
                                                     : failure_of(code, message)));
        });
}

}  // namespace edgewise::cli
