#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <fmt/format.h>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/filter_series.hpp"
#include "cli/job_words.hpp"
#include "cli/merge.hpp"
#include "cli/mpr.hpp"
#include "cli/request/channel_words.hpp"
#include "cli/request/programs.hpp"
#include "cli/request/request_options.hpp"
#include "cli/series.hpp"
#include "cli/session/explain.hpp"
#include "cli/session/report.hpp"
#include "cli/session/run_page.hpp"
#include "cli/session/typed_request.hpp"
#include "cli/verbs/verbs.hpp"
#include "engine/rivals.hpp"
#include "graph/errors.hpp"
#include "graph/kinds.hpp"
#include "request/outputs.hpp"
#include "runtime/runtime.hpp"

namespace edgewise::cli {

void check_outputs(const JobOptions& o) {
    if (o.out)
        Outputs checked(*o.out,
                        makes_surface(o.job) ? Outputs::Holds::surface : Outputs::Holds::samples,
                        film_encoder());
    if (o.report && !o.report->ends_with(".html"))
        throw RequestError(
            fmt::format("--report {}: expected a name that ends in .html", *o.report));
    std::string printed;  // the option whose words go to standard output
    for (const auto& [option, file] : {std::pair{"-o", &o.out},
                                       {"--json", &o.json},
                                       {"--trace", &o.trace},
                                       {"--flow", &o.flow},
                                       {"--report", &o.report}}) {
        if (!*file) continue;
        if (**file != "-") {
            if (file != &o.out) expect_writable(option, **file);
            continue;
        }
        if (!printed.empty())
            throw RequestError(
                fmt::format("{} and {}: only one goes to standard output", printed, option));
        printed = option;
    }
}

void explain(const JobOptions& o, const std::string& text) {
    const bool taken = o.json == "-" || o.out == "-" || o.trace == "-" || o.flow == "-";
    std::FILE* out = taken ? stderr : stdout;
    std::fputs(text.c_str(), out);
    std::fflush(out);  // before what comes from the run on standard error
}

namespace {

void report(const TypedRequest& typed, bool with_run, const std::optional<Failure>& failure) {
    if (typed.options().json)
        write_text(*typed.options().json,
                   text_of(report_of(typed.reached(), typed.messages(), typed.startup_seconds(),
                                     with_run, failure)));
}

/// Runs the plan, with a drawing of what is about to run and a trace of what ran.
void run(TypedRequest& typed) {
    Reached& reached = typed.reached();
    const JobOptions& o = typed.options();
    const Planned& planned = *reached.planned();
    if (o.flow) write_text(*o.flow, flow_dot(*planned.answer.plan, planned.ask()));
    reached.run_all({}, typed.messages());
    if (o.trace)
        write_text(*o.trace, chrome_trace(*planned.answer.plan, reached.run->measured.trace));
    if (o.explain || (o.has("verify") && o.json != "-"))
        explain(o, measurement_of(planned, *reached.run, o.explain));
    typed.messages().result(result_of(planned, *reached.run));
}

/// How much is worked out for what the words want to see.
Effort effort_of(const JobOptions& o, bool runs) {
    Effort effort;
    if (runs && !o.explain && !o.has("verify") && !o.report)
        effort.errors = ErrorsWanted::for_choice;
    effort.front = !runs || o.explain || o.json || o.report;
    return effort;
}

/// @param runs  else it is only planned, and explained
int do_job(const JobOptions& options, bool runs) {
    std::optional<TypedRequest> typed;
    bool explained = false;
    return guarded(
        [&] {
            check_outputs(options);
            typed.emplace(options, runs);
            Messages& messages = typed->messages();
            messages.announces_planning(runs);
            try {
                typed->reached().open_all(messages);
            } catch (const ColoursToMerge&) {
                typed.reset();
                return do_merge(options, runs);
            }
            const Effort effort = effort_of(options, runs);
            typed->reached().look_at(effort, messages);
            typed->reached().price_all(effort, messages);
            Planned& planned = typed->reached().plan();
            expect_plan(planned);
            if (options.explain || options.json || options.report || !runs) weigh(planned);
            forget_errors(planned);
            if (options.explain || (!runs && options.json != "-")) {
                explain(options, explanation_of(planned, options.explain_all));
                explained = true;
            }
            if (runs) run(*typed);
            if (options.report) write_run_page(*typed);
            report(*typed, runs, {});
            return 0;
        },
        [&](int code, const std::string& message) {
            if (!typed) {
                if (options.json) write_text(*options.json, text_of(failure_of(code, message)));
                return;
            }
            typed->messages().ends(Listener::State::planning);
            typed->messages().end_progress();
            if (typed->reached().planned()) {
                Planned& planned = typed->reached().plan();
                forget_errors(planned);
                if ((options.explain || !runs) && !explained)
                    explain(options, explanation_of(planned, options.explain_all));
            }
            report(*typed, runs, Failure{code, message});
        });
}

Verb add_job(CLI::App& parent, Job job, bool runs) {
    CLI::App* app = parent.add_subcommand(std::string(name_of(job)), std::string(job->help));
    auto options = std::make_shared<JobOptions>();
    options->job = job;
    add_job_options(*app, *options, runs ? OutNeeded::yes : OutNeeded::no);
    return {app, [app, options, job, runs] {
                options->words = typed_words(*app);
                take_given(*app, *options);
                if (options->mpr) return do_planes(*options, runs);
                if (job->of_rays() && names_all_times(*options)) return do_series(*options, runs);
                if (job->of_rays() && names_colours(*options)) return do_merge(*options, runs);
                if (job == Job::filter && names_all_times(*options)) {
                    if (runs) return do_filter_series(*options);
                    options->put("time", "0");  // all have one shape
                }
                return do_job(*options, runs);
            }};
}

std::vector<Verb> add_all(CLI::App& parent, bool runs) {
    std::vector<Verb> all;
    for (const Job job : jobs()) all.push_back(add_job(parent, job, runs));
    return all;
}

}  // namespace

std::vector<Verb> add_jobs(CLI::App& main) { return add_all(main, true); }

Verb add_plan(CLI::App& main) {
    CLI::App* app = main.add_subcommand("plan", "a request, planned and explained but not run");
    app->require_subcommand(1);
    return {app, [all = add_all(*app, false)] {
                return std::ranges::find_if(all,
                                            [](const Verb& verb) { return verb.app->parsed(); })
                    ->run();
            }};
}

}  // namespace edgewise::cli
