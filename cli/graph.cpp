#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/request/errors.hpp"
#include "cli/request/programs.hpp"
#include "cli/request/request_options.hpp"
#include "cli/request/spoken.hpp"
#include "cli/session/graph_picture.hpp"
#include "cli/session/report.hpp"
#include "cli/session/typed_request.hpp"
#include "cli/verbs/verbs.hpp"
#include "graph/errors.hpp"
#include "planner/cost.hpp"
#include "request/outputs.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise::cli {
namespace {

struct GraphOptions {
    std::optional<std::string> out;
    std::vector<JobOptions> jobs;
};

enum class Form { dot, json, svg };

Form form_of(const std::optional<std::string>& out) {
    if (out && out->ends_with(".json")) return Form::json;
    return out && out->ends_with(".svg") ? Form::svg : Form::dot;
}

void expect_ending(const std::optional<std::string>& out) {
    if (!out || *out == "-") return;
    if (!out->ends_with(".dot") && form_of(out) == Form::dot)
        throw RequestError(fmt::format("-o {}: a graph is written as .dot, .json or .svg", *out));
    expect_writable("-o", *out);
    if (form_of(out) == Form::svg && program_on_path("dot").empty())
        throw RunError(fmt::format(
            "-o {}: Graphviz draws it and is not installed; it is in the Debian package graphviz",
            *out));
}

/// A graph that shows what was chosen; without a plan within the budgets it shows the rest.
std::string picture_of(TypedRequest& typed) {
    typed.reached().price_all({}, typed.messages());
    const Planned& planned = *typed.reached().planned();
    const auto& plan = planned.answer.plan;
    if (!plan) typed.messages().warning("no plan keeps the budgets: nothing is bold");
    return laid_out(picture_dot(planned.graph()->spanned(), planned.engine.edges(),
                                cost_words(planned), plan ? &*plan : nullptr));
}

/// The graph of a request, with what its edges cost.
std::string graph_of(TypedRequest& typed, Form form) {
    typed.reached().open_all(typed.messages());
    typed.reached().look_at({}, typed.messages());
    if (form == Form::svg) return picture_of(typed);
    const Looked& looked = *typed.reached().looked();
    const TransformGraph spanned =
        expand(looked.engine.edges(), looked.ask(), looked.sources(), looked.query.demands);
    const auto cost = [&](const Arc& arc) {
        return cost_of(looked.engine.edges()[static_cast<std::size_t>(arc.edge)], arc.offer,
                       looked.ask(), looked.engine.machine(), looked.want.threads);
    };
    if (form == Form::dot)
        return to_dot(spanned, looked.engine.edges(), [&](const Arc& arc) {
            const StepCost c = cost(arc);
            return fmt::format("{:.3g} s, scratch {:.3g} MiB, error + {:.3g}", c.seconds,
                               c.scratch / 0x1p20, std::hypot(c.error.bias, c.error.noise));
        });
    const auto entry = [&](const Arc& arc) -> nlohmann::json {
        const StepCost c = cost(arc);
        return {{"seconds", c.seconds},
                {"scratch", c.scratch},
                {"gain", c.error.gain},
                {"noise_gain", c.error.noise_gain},
                {"bias", c.error.known ? nlohmann::json(c.error.bias) : nlohmann::json()},
                {"noise", c.error.known ? nlohmann::json(c.error.noise) : nlohmann::json()}};
    };
    nlohmann::json json = to_json(spanned, looked.engine.edges(), entry);
    for (std::size_t i = 0; i < spanned.refused.size(); ++i)
        json["refused"][i]["reason"] = spoken(spanned.refused[i].reason);
    return json.dump(2) + "\n";
}

std::string graph_without_request(Form form) {
    const Catalogue edges = catalogue();
    if (form == Form::svg) return laid_out(to_dot(edges));
    return form == Form::json ? to_json(edges).dump(2) + "\n" : to_dot(edges);
}

int do_graph(const GraphOptions& options, const JobOptions* job) {
    const auto body = [&] {
        expect_ending(options.out);
        std::string text;
        if (job) {
            TypedRequest typed(*job, false);
            text = graph_of(typed, form_of(options.out));
        } else {
            text = graph_without_request(form_of(options.out));
        }
        write_text(options.out.value_or("-"), text);
        return 0;
    };
    return guarded_with_json(job ? job->json : std::nullopt, body);
}

}  // namespace

Verb add_graph(CLI::App& main) {
    CLI::App* app =
        main.add_subcommand("graph", "the transform graph, of a request with its costs");
    auto options = std::make_shared<GraphOptions>();
    add_text(*app, "-o", options->out, "default: DOT to standard output")
        ->type_name("FILE.dot|.json|.svg");
    app->require_subcommand(0, 1);
    options->jobs.resize(jobs().size());
    std::vector<CLI::App*> subs;
    for (std::size_t i = 0; i < jobs().size(); ++i) {
        const Job job = jobs()[i];
        subs.push_back(app->add_subcommand(std::string(name_of(job)), std::string(job->help)));
        options->jobs[i].job = job;
        add_job_options(*subs.back(), options->jobs[i], OutNeeded::absent);
        subs.back()->fallthrough();
    }
    return {app, [options, subs] {
                for (std::size_t i = 0; i < subs.size(); ++i) {
                    if (!subs[i]->parsed()) continue;
                    take_given(*subs[i], options->jobs[i]);
                    return do_graph(*options, &options->jobs[i]);
                }
                return do_graph(*options, nullptr);
            }};
}

}  // namespace edgewise::cli
