#include <CLI/CLI.hpp>
#include <cstdio>
#include <fmt/format.h>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/request/outputs.hpp"
#include "cli/request/request_options.hpp"
#include "cli/session/report.hpp"
#include "cli/session/rivals.hpp"
#include "cli/session/run_page.hpp"
#include "cli/session/session.hpp"
#include "cli/verbs/verbs.hpp"

namespace edgewise::cli {
namespace {

/// Writes a part of the explanation; beside what was asked for on standard output it goes to
/// standard error.
void explain(const Session& session, const std::string& text) {
    const JobOptions& o = session.options;
    const bool taken = o.json == "-" || o.out == "-" || o.trace == "-" || o.flow == "-";
    std::FILE* out = taken ? stderr : stdout;
    std::fputs(text.c_str(), out);
    std::fflush(out);  // before what comes from the run on standard error
}

void report(const Session& session, bool with_run, const std::optional<Failure>& failure) {
    if (session.options.json)
        write_text(*session.options.json, text_of(report_of(session, with_run, failure)));
}

/// @param runs  else it is only planned, and explained
int do_job(const JobOptions& options, bool runs) {
    Session session(options);
    session.runs = session.announces = runs;
    if (runs && !options.explain && !options.verify && !options.report)
        session.errors = ErrorsWanted::for_choice;
    session.plan_options.front = !runs || options.explain || options.json || options.report;
    bool explained = false;
    return guarded(
        [&] {
            take_request(session);
            make_plan(session);
            if (options.explain || options.json || options.report || !runs) weigh(session);
            forget_errors(session);
            if (options.explain || (!runs && options.json != "-")) {
                explain(session, explanation_of(session));
                explained = true;
            }
            if (runs) perform(session);
            if (runs && (options.explain || (options.verify && options.json != "-")))
                explain(session, measurement_of(session));
            if (runs) session.messages.result(result_of(session));
            if (options.report) write_run_page(session);
            report(session, runs, {});
            return 0;
        },
        [&](int code, const std::string& message) {
            session.planning.reset();
            session.messages.end_progress();
            forget_errors(session);
            if (session.answer && (options.explain || !runs) && !explained)
                explain(session, explanation_of(session));
            report(session, runs, Failure{code, message});
        });
}

Verb add_job(CLI::App& parent, Job job, bool runs) {
    CLI::App* app = job == Job::warp
                        ? parent.add_subcommand("warp", "resample an image (2D) or a volume (3D)")
                        : parent.add_subcommand("render", "make pictures of a volume");
    auto options = std::make_shared<JobOptions>();
    options->job = job;
    add_job_options(*app, *options, runs ? OutNeeded::yes : OutNeeded::no);
    return {app, [app, options, runs] {
                options->words = typed_words(*app);
                order_geometry(*app, *options);
                return do_job(*options, runs);
            }};
}

}  // namespace

Verb add_warp(CLI::App& main) { return add_job(main, Job::warp, true); }
Verb add_render(CLI::App& main) { return add_job(main, Job::render, true); }

Verb add_plan(CLI::App& main) {
    CLI::App* app = main.add_subcommand("plan", "a request, planned and explained but not run");
    app->require_subcommand(1);
    const Verb warp = add_job(*app, Job::warp, false), render = add_job(*app, Job::render, false);
    return {app, [warp, render] { return warp.app->parsed() ? warp.run() : render.run(); }};
}

}  // namespace edgewise::cli
