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
#include "cli/session/typed_session.hpp"
#include "cli/verbs/verbs.hpp"
#include "engine/filter_result.hpp"
#include "engine/kept_padding.hpp"
#include "engine/measure/machine.hpp"
#include "engine/request/outputs.hpp"
#include "engine/session.hpp"
#include "graph/errors.hpp"
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
        one.selection.time = std::to_string(time);
        const Catalogue edges = catalogue();
        session_ = std::make_unique<Session>(spec_of(one, edges), edges,
                                             chosen_profile(one.machine), messages_);
        Session& session = *session_;
        session.runs = true;
        session.writes = false;
        session.explained = time > 0;  // notices of the machine are told once
        if (!one.verify) session.errors = ErrorsWanted::for_choice;
        take_request(session);
        const bool none = session.outputs->none();
        if (!none) expect_alike(session.written.header);
        make_plan(session);
        perform(session, [&](int /*frame*/, const Data& result) {
            if (!none) keep(session, result, time);
        });
        add(*session.measured);
    }
    void write() {
        if (!header_) return;
        store::write(*options_.out, *header_, samples_.data());
        session_->files = {*options_.out};
        messages_.result(fmt::format("{}: {} time points", *options_.out, times_));
    }
    /// Of all time points: the plan of the last, and what all took together.
    nlohmann::ordered_json report(const std::optional<Failure>& failure) const {
        if (!session_ && failure) return failure_of(failure->code, failure->message);
        if (!failure) session_->measured = measured_;
        nlohmann::ordered_json report =
            report_of(*session_, startup_seconds_, !failure.has_value(), failure);
        report["times"] = times_;
        return report;
    }

 private:
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
    void keep(Session& session, const Data& result, int time) {
        const Tail& tail = session.written.tail;
        if (tail.view)
            throw RequestError(
                "--time all: a view has a window of its own for each time point; "
                "leave out --bits, or say --bits 32");
        if (const auto cut = cut_off_text(session.want(), result, tail))
            session.messages.warning(fmt::format("time {}: {}", time, *cut));
        Array samples = finished(result, tail, {}, session.memory.get());
        const std::string kept = keep_padding(session.want(), *session.input, tail, samples);
        if (!kept.empty()) session.messages.warning(kept);
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
    std::unique_ptr<Session> session_;  // of the last time point
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
            still.selection.time.reset();
            const int times = store::inspect(options.input, selection_of(still.selection)).times;
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
