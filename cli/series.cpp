#include "cli/series.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "cli/job_words.hpp"
#include "cli/request/channel_words.hpp"
#include "cli/request/messages.hpp"
#include "cli/session/explain.hpp"
#include "cli/session/report.hpp"
#include "cli/session/series_report.hpp"
#include "cli/session/typed_request.hpp"
#include "cli/verbs/verbs.hpp"
#include "engine/rivals.hpp"
#include "engine/series.hpp"
#include "graph/errors.hpp"
#include "measure/machine.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise::cli {
namespace {

/// What shows one run is not there for several.
void expect_no_files_of_one_run(const JobOptions& options) {
    for (const auto& [option, file] : {std::pair{"--trace", &options.trace},
                                       {"--flow", &options.flow},
                                       {"--report", &options.report},
                                       {"--stop-after", &options.stop_after}})
        if (*file)
            throw RequestError(fmt::format(
                "{}: is about one picture, and --time all makes one for each time point; name one "
                "by --time N",
                option));
    if (options.progressive)
        throw RequestError(
            "--progressive: shows one picture, and --time all makes one for each time point; name "
            "one by --time N");
    if (names_colours(options))
        throw RequestError(
            "--channel: channels are merged at one time point; name one by --time N, or one "
            "channel");
}

Query series_spec(const JobOptions& options, Messages& messages) {
    configure(messages, options);
    JobOptions without = options;
    without.drop("time");
    return spec_of(without, catalogue());
}

/// The work and its messages, as TypedRequest has them of one.
struct TypedSeries {
    explicit TypedSeries(const JobOptions& options)
        : series(series_spec(options, messages),
                 engine_of(options, series_spec(options, messages), true, messages), messages) {}

    double startup_seconds = process_seconds();
    Messages messages;
    Series series;
};

std::string times_heading(const Series& series) {
    return fmt::format("{} time points, each by the plan of the first:\n", series.times);
}

}  // namespace

int do_series(const JobOptions& options, bool runs) {
    std::optional<TypedSeries> typed;
    const auto write_report = [&](const std::optional<Failure>& failure) {
        if (options.json)
            write_text(*options.json, text_of(series_report(typed->series, typed->startup_seconds,
                                                            runs, failure)));
    };
    return guarded(
        [&] {
            expect_no_files_of_one_run(options);
            check_outputs(options);
            typed.emplace(options);
            Series& series = typed->series;
            series.runs = runs;
            typed->messages.announces_planning(runs);
            if (runs && !options.explain && !options.has("verify"))
                series.effort.errors = ErrorsWanted::for_choice;
            series.effort.front = !runs || options.explain || options.json;
            perform(series, [&](Planned& first) {
                if (options.explain || options.json || !runs) weigh(first);
                forget_errors(first);
                if (options.explain || (!runs && options.json != "-"))
                    explain(options,
                            times_heading(series) + explanation_of(first, options.explain_all));
            });
            if (runs) {
                if (options.explain || (options.has("verify") && options.json != "-"))
                    explain(options, measurement_of(*series.first->planned(), *series.first->run,
                                                    options.explain));
                typed->messages.result(result_of(series));
            }
            write_report({});
            return 0;
        },
        [&](int code, const std::string& message) {
            if (!typed) {
                if (options.json) write_text(*options.json, text_of(failure_of(code, message)));
                return;
            }
            typed->messages.ends(Listener::State::planning);
            typed->messages.end_progress();
            auto& first = typed->series.first;
            if (first && first->planned()) {
                Planned& planned = first->plan();
                forget_errors(planned);
                if (!planned.answer.plan && (options.explain || !runs))
                    explain(options, explanation_of(planned, options.explain_all));
            }
            write_report(Failure{code, message});
        });
}

}  // namespace edgewise::cli
