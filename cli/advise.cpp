#include "cli/advise.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "cli/request/request_options.hpp"
#include "cli/session/report.hpp"
#include "cli/session/typed_request.hpp"
#include "cli/verbs/verbs.hpp"
#include "engine/paths.hpp"
#include "engine/rivals.hpp"
#include "graph/kinds.hpp"
#include "graph/version.hpp"
#include "planner/advise.hpp"
#include "request/outputs.hpp"
#include "request/quantities.hpp"

namespace edgewise::cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostRows = 12;

/// One request, and what is advised for it.
struct Advised {
    std::string request;
    std::vector<std::string> plan;
    Advice advice;
};

Advised advise_on(const JobOptions& options, const std::string& text) {
    TypedRequest typed(options, false);
    typed.reached().prepare({}, typed.messages());
    const Planned& planned = *typed.reached().planned();
    const Plan& plan = *planned.answer.plan;
    return {text, plan.texts(),
            advise(*candidates_of(planned), plan, planned.engine.machine(), version())};
}

std::string costs_text(const std::vector<AdvisedCost>& costs) {
    if (costs.empty()) return {};
    std::string text = fmt::format("  {:>11} {:>7} {:>11} {:>11}  {:9} {}\n", "one run", "within",
                                   "regret", "to measure", "known as", "cost");
    for (std::size_t i = 0; i < costs.size() && i < kMostRows; ++i) {
        const CostAdvice& one = costs[i].advice;
        text +=
            fmt::format("  {:>11} {:>6.2f}x {:>11} {:>11}  {:9} {}\n", seconds_text(one.seconds),
                        std::exp(one.spread), seconds_text(one.regret), seconds_text(one.measuring),
                        one.state, one.name);
    }
    if (costs.size() > kMostRows) text += fmt::format("  and {} more\n", costs.size() - kMostRows);
    return text + "`edgewise calibrate` measures them\n";
}

std::string arcs_text(const std::vector<AdvisedArc>& arcs, std::size_t requests) {
    std::string text;
    for (std::size_t i = 0; i < arcs.size() && i < kMostRows; ++i) {
        const ArcAdvice& one = arcs[i].advice;
        text += fmt::format("  {} -> {}\n    known: {} in {}{}; bound: {} ({:.3g} times less)\n",
                            one.from, one.to, path_text(one.best), seconds_text(one.seconds),
                            one.serves ? "" : ", which breaks a budget", seconds_text(one.bound),
                            one.seconds / one.bound);
        text += requests == 1
                    ? fmt::format("    with an edge at the bound the plan takes {}, {} less\n",
                                  seconds_text(one.plan), seconds_text(one.gain))
                    : fmt::format(
                          "    edges at the bound make the plans of {} of {} requests {} "
                          "faster\n",
                          arcs[i].requests, requests, seconds_text(arcs[i].gain));
    }
    if (arcs.size() > kMostRows) text += fmt::format("  and {} more\n", arcs.size() - kMostRows);
    return text;
}

std::string report_text(const std::vector<Advised>& all, const Summary& summary) {
    std::string text = "plans\n";
    for (const Advised& each : all)
        text +=
            fmt::format("  {}: {}\n    {}, {:.3g} times the bound of {}\n", each.request,
                        path_text(each.plan), seconds_text(each.advice.seconds),
                        each.advice.seconds / each.advice.bound, seconds_text(each.advice.bound));
    text += fmt::format("\ncosts worth measuring ({}; {} are measured, {} cannot change a plan)\n",
                        summary.costs.size(), summary.measured, summary.idle);
    text += costs_text(summary.costs);
    text += fmt::format("\nmissing edges ({})\n", summary.arcs.size());
    return text + arcs_text(summary.arcs, all.size());
}

Json report_json(const std::vector<Advised>& all, const Summary& summary) {
    Json requests = Json::array(), costs = Json::array(), arcs = Json::array();
    for (const Advised& each : all)
        requests.push_back({{"request", each.request},
                            {"plan", each.plan},
                            {"seconds", each.advice.seconds},
                            {"bound", each.advice.bound}});
    for (const AdvisedCost& each : summary.costs) {
        const CostAdvice& one = each.advice;
        costs.push_back({{"cost", one.name},
                         {"state", one.state},
                         {"when", one.when.empty() ? Json() : Json(one.when)},
                         {"seconds", one.seconds},
                         {"spread", one.spread},
                         {"regret", one.regret},
                         {"measuring", one.measuring},
                         {"requests", each.requests}});
    }
    for (const AdvisedArc& each : summary.arcs) {
        const ArcAdvice& one = each.advice;
        arcs.push_back({{"from", one.from},
                        {"to", one.to},
                        {"best", one.best},
                        {"serves", one.serves},
                        {"seconds", one.seconds},
                        {"bound", one.bound},
                        {"plan_seconds", one.plan},
                        {"gain", each.gain},
                        {"requests", each.requests}});
    }
    return {{"schema", 1},         {"version", version()},         {"requests", requests},
            {"costs", costs},      {"measured", summary.measured}, {"idle", summary.idle},
            {"missing_arcs", arcs}};
}

/// Requests of the usual kinds and sizes, of data that are not there.
std::vector<JobOptions> usual_requests() {
    std::vector<JobOptions> all;
    const auto add = [&](Job job, const char* input, const char* rotate) -> JobOptions& {
        JobOptions& options = all.emplace_back();
        options.job = job;
        options.input = input;
        options.put("rotate", rotate);
        return options;
    };
    const Job render = job_to("screen/picture"), warp = job_to("screen/scalar");
    for (const Combine loop : {Combine::max, Combine::sum, Combine::mean, Combine::over}) {
        const std::string mode(name_of(mode_by(loop)));
        add(render, "describe:256x256x256:u8", "20,30,0").put("mode", mode);
        JobOptions& table = add(render, "describe:128x128x128:u16", "10,0,0");
        table.put("mode", mode);
        table.put("turntable", "36");
    }
    add(warp, "describe:256x256x256:u16", "10,20,30");
    add(warp, "describe:128x128x128:f32", "60,5,0");
    add(warp, "describe:2048x2048:u8", "15");
    add(warp, "describe:1024x1024:f32", "70");
    return all;
}

std::string request_text(const JobOptions& options) {
    std::string text = fmt::format("{} {}", name_of(options.job), options.input);
    for (const Given& one : options.given)
        if (setting_named(one.name, options.job)->kind() == Reader::Kind::step)
            text += fmt::format(" --{} {}", one.name, one.value.text());
    for (const char* name : {"mode", "op", "kernel", "border"})
        if (const auto value = options.text(name)) text += fmt::format(" --{} {}", name, *value);
    return text;
}

/// @param job  or the usual ones
int do_advise(const JobOptions* job, const std::optional<std::string>& json) {
    return guarded_with_json(json, [&] {
        std::vector<Advised> all;
        if (job) {
            all.push_back(advise_on(*job, request_text(*job)));
        } else {
            for (const JobOptions& each : usual_requests())
                all.push_back(advise_on(each, request_text(each)));
        }
        std::vector<Advice> advices;
        for (const Advised& each : all) advices.push_back(each.advice);
        const Summary summary = summary_of(advices);
        if (json) write_text(*json, text_of(report_json(all, summary)));
        if (json != "-") write_text("-", report_text(all, summary));
        return 0;
    });
}

/// Advice on one job.
struct AdviseOptions {
    CLI::App* app;
    JobOptions job;
};

}  // namespace

Verb add_advise(CLI::App& main) {
    CLI::App* app = main.add_subcommand(
        "advise", "costs worth measuring and edges worth having, for a request or the usual ones");
    auto json = std::make_shared<std::optional<std::string>>();
    add_text(*app, "--json", *json, "report")->type_name("FILE|-");
    app->require_subcommand(0, 1);
    std::vector<std::shared_ptr<AdviseOptions>> all;
    for (const Job job : jobs()) {
        if (!is_charted(job)) continue;
        const std::string name(name_of(job));
        const auto options = std::make_shared<AdviseOptions>();
        options->app = app->add_subcommand(name, "for a " + name);
        options->job.job = job;
        add_job_options(*options->app, options->job, OutNeeded::absent);
        all.push_back(options);
    }
    return {app, [all, json] {
                for (const auto& options : all) {
                    if (!options->app->parsed()) continue;
                    JobOptions& job = options->job;
                    take_given(*options->app, job);
                    return do_advise(&job, job.json ? job.json : *json);
                }
                return do_advise(nullptr, *json);
            }};
}

}  // namespace edgewise::cli
