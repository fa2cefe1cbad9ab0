#include "cli/merge.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "cli/job_words.hpp"
#include "cli/request/channel_words.hpp"
#include "cli/request/messages.hpp"
#include "cli/session/explain.hpp"
#include "cli/session/merge_report.hpp"
#include "cli/session/report.hpp"
#include "cli/session/typed_request.hpp"
#include "cli/verbs/verbs.hpp"
#include "engine/rivals.hpp"
#include "graph/errors.hpp"
#include "measure/machine.hpp"
#include "request/outputs.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise::cli {
namespace {

/// What is about one plan is not there for several.
void expect_no_files_of_one_plan(const JobOptions& options) {
    for (const auto& [option, file] : {std::pair{"--trace", &options.trace},
                                       {"--flow", &options.flow},
                                       {"--report", &options.report},
                                       {"--stop-after", &options.stop_after}})
        if (*file)
            throw RequestError(fmt::format(
                "{}: is about one plan, and each of several channels has its own; name one channel",
                option));
    if (options.progressive)
        throw RequestError(
            "--progressive: shows one picture, and each of several channels has "
            "its own; name one channel");
}

Query merged_spec(const JobOptions& options, Messages& messages) {
    configure(messages, options);
    JobOptions without = options;
    without.drop("channel");
    return spec_of(without, catalogue());
}

/// The work and its messages, as TypedRequest has them of one.
struct TypedMerge {
    explicit TypedMerge(const JobOptions& options)
        : merge(merged_spec(options, messages),
                channels_of(options.text("channel").value_or("all")),
                engine_of(options, merged_spec(options, messages), true, messages), messages) {}

    double startup_seconds = process_seconds();
    Messages messages;
    Merge merge;
};

void take_options(Merge& merge, const JobOptions& options, bool runs) {
    merge.runs = runs;
    if (runs && !options.explain && !options.has("verify"))
        merge.effort.errors = ErrorsWanted::for_choice;
    merge.effort.front = !runs || options.explain || options.json;
}

std::string heading(const MergedChannel& channel) {
    return fmt::format("channel {} in {}\n", channel.channel, store::text_of(channel.colour));
}

}  // namespace

int do_merge(const JobOptions& options, bool runs) {
    std::optional<TypedMerge> typed;
    const auto write_report = [&](const std::optional<Failure>& failure) {
        if (options.json)
            write_text(*options.json,
                       text_of(merge_report(typed->merge, typed->startup_seconds, runs, failure)));
    };
    return guarded(
        [&] {
            expect_no_files_of_one_plan(options);
            check_outputs(options);
            typed.emplace(options);
            Merge& merge = typed->merge;
            take_options(merge, options, runs);
            typed->messages.announces_planning(runs);
            perform(merge, [&](MergedChannel& channel) {
                Planned& planned = channel.request->plan();
                if (options.explain || options.json || !runs) weigh(planned);
                forget_errors(planned);
                if (options.explain || (!runs && options.json != "-"))
                    explain(options,
                            heading(channel) + explanation_of(planned, options.explain_all) + "\n");
            });
            if (runs) {
                if (options.explain || (options.has("verify") && options.json != "-"))
                    for (const MergedChannel& channel : merge.channels)
                        explain(options,
                                heading(channel) + measurement_of(*channel.request->planned(),
                                                                  *channel.request->run,
                                                                  options.explain));
                typed->messages.result(result_of(merge));
            }
            write_report({});
            return 0;
        },
        [&](int code, const std::string& message) {
            if (!typed) {
                if (options.json) write_text(*options.json, text_of(failure_of(code, message)));
                return;
            }
            for (MergedChannel& channel : typed->merge.channels)
                if (channel.request && channel.request->planned())
                    forget_errors(channel.request->plan());
            typed->messages.ends(Listener::State::planning);
            typed->messages.end_progress();
            const auto& channels = typed->merge.channels;
            const Planned* last = channels.empty() || !channels.back().request
                                      ? nullptr
                                      : channels.back().request->planned();
            if (last && !last->answer.plan && (options.explain || !runs))
                explain(options,
                        heading(channels.back()) + explanation_of(*last, options.explain_all));
            write_report(Failure{code, message});
        });
}

}  // namespace edgewise::cli
