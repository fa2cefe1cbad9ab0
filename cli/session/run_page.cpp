#include "cli/session/run_page.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fmt/format.h>
#include <set>

#include "charts/report.hpp"
#include "charts/scales.hpp"
#include "cli/request/spoken.hpp"
#include "cli/session/explain.hpp"
#include "cli/session/graph_picture.hpp"
#include "cli/session/report.hpp"
#include "cli/session/typed_request.hpp"
#include "engine/paths.hpp"
#include "graph/errors.hpp"
#include "graph/filtering.hpp"
#include "graph/version.hpp"
#include "measure/machine.hpp"
#include "measure/quantiles.hpp"
#include "planner/cost.hpp"
#include "request/quantities.hpp"

namespace edgewise::cli {
namespace {

using charts::Fact;

/// A word as a shell takes it.
std::string shell_word(const std::string& word) {
    constexpr const char* kPlain =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789@%+=:,./_-";
    if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
    std::string quoted = "'";
    for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return quoted + "'";
}

std::string command_of(const std::vector<std::string>& words) {
    std::string command;
    for (const std::string& word : words)
        command += (command.empty() ? "" : " ") + shell_word(word);
    return command;
}

std::string title_of(const Planned& planned) {
    const Request& want = planned.want;
    const std::string& input = planned.query.input;
    const std::filesystem::path path(input.ends_with('/') ? input.substr(0, input.size() - 1)
                                                          : input);
    return fmt::format("edgewise {} of {}{}", name_of(want.job), path.filename().string(),
                       want.job->of_rays() ? fmt::format(", {}", name_of(want.mode)) : "");
}

std::string numbers(const Vec3& values, int axes, const std::string& unit) {
    std::string text;
    for (int k = 0; k < axes; ++k) text += fmt::format("{}{:.6g}", k ? " x " : "", values[k]);
    return text + (unit.empty() ? "" : " " + unit);
}

std::vector<Fact> input_facts(const Planned& planned) {
    const Input& input = planned.input;
    const store::Header& h = input.header;
    const Request& want = planned.want;
    std::vector<Fact> facts = {
        {"input",
         fmt::format("{}: {} ({}), {} {}{}", input.name, h.volume ? "volume" : "image", h.format,
                     text_of(h.extent, want.axes), name_of(h.type),
                     input.channels() > 1 ? fmt::format(", {} channels", input.channels()) : "")},
        {"spacing", numbers(want.spacing, want.axes, h.unit)}};
    if (!h.orientation.empty()) facts.emplace_back("orientation", h.orientation);
    facts.emplace_back(
        "values", fmt::format("{:.6g} to {:.6g}", planned.statistics.low, planned.statistics.high));
    return facts;
}

const char* reference_text(const Request& want) {
    if (want.setting.as<Filtering>()) return "the kernel written out, place by place, in f64";
    if (const auto* lines = want.setting.as<RadonSetting>())
        return lines->to == RadonSetting::To::image
                   ? "filtered backprojection, offset by offset, in f64"
               : lines->to == RadonSetting::To::hough
                   ? "votes counted sample by sample, in f64"
                   : "the bilinear field, integrated from grid line to grid line in f64";
    switch (want.field) {
        case Field::linear:
            return "the linear interpolation of the samples";
        case Field::nearest:
            return "labels: the nearest sample";
        case Field::formula:
            return "the phantom's formula";
        case Field::spline:
            break;
    }
    return "the cubic B-spline through the samples";
}

std::string outputs_text(const Run& run) {
    const auto& files = run.files;
    if (files.empty()) return "none is written";
    if (files.size() == 1) return files[0];
    return fmt::format("{} to {}, {} files", files.front(), files.back(), files.size());
}

std::vector<Fact> request_facts(const Planned& planned, const Run& run) {
    const Request& want = planned.want;
    std::vector<Fact> facts = input_facts(planned);
    facts.emplace_back("output",
                       fmt::format("{}{}", text_of(want.output(), want.output().z > 1 ? 3 : 2),
                                   want.frames > 1 ? fmt::format(", {} frames", want.frames) : ""));
    if (planned.preset) facts.emplace_back("colours", preset_text(*planned.preset));
    facts.emplace_back("written to", outputs_text(run));
    Request asked = want;
    if (!planned.query.max_memory) asked.budget.bytes.reset();  // what is free is no demand
    facts.emplace_back("budget", budget_text(asked));
    facts.emplace_back("errors are against", reference_text(want));
    return facts;
}

std::string times_text(const std::vector<double>& seconds) {
    constexpr std::size_t kMost = 8;
    std::string text;
    for (std::size_t i = 0; i < std::min(seconds.size(), kMost); ++i)
        text += (i ? ", " : "") + charts::seconds_text(seconds[i]);
    return text + (seconds.size() > kMost ? fmt::format(" ... ({} runs)", seconds.size()) : "");
}

std::vector<Fact> machine_facts(const Planned& planned, const Run& run) {
    const Measured& measured = run.measured;
    const std::string cpu = cpu_name();
    std::vector<Fact> facts = {
        {"version", "edgewise " + version()},
        {"profile", planned.engine.machine().name},
        {"processor", cpu.empty() ? "not known" : cpu},
        {"threads", fmt::format("{} of {} cores", planned.want.threads, usable_cores())},
        {"planned",
         fmt::format("in {}, by {}: {} vertices, {} edges",
                     charts::seconds_text(planned.answer.seconds), name_of(planned.query.planner),
                     planned.answer.vertices, planned.answer.edges)},
        {"read, written", fmt::format("{}, {}", charts::seconds_text(planned.input.read_seconds),
                                      charts::seconds_text(measured.write_seconds))},
        {measured.seconds.size() > 1 ? "runs took" : "run took", times_text(measured.seconds)}};
    if (measured.error) {
        const Verified& e = *measured.error;
        facts.emplace_back(
            "verified",
            fmt::format("error {}, 95 % from {:.3g} to {:.3g}; largest difference "
                        "{:.4g} of {:.4g}; {} samples",
                        error_text({.error = e.nrmse}), e.low, e.high, e.max, e.range, e.samples));
    }
    return facts;
}

charts::Values values_of(const Predicted& predicted, double bytes) {
    charts::Values values{predicted.seconds, {}, bytes};
    if (predicted.known) values.error = predicted.error;
    return values;
}

/// Steps that ran; those of a plan that took over were not predicted.
std::vector<charts::ReportStep> steps_of(const Planned& planned, const Run& run) {
    const Plan& plan = *planned.answer.plan;
    const Measured& measured = run.measured;
    std::vector<charts::ReportStep> steps;
    for (std::size_t i = 0; i < measured.steps.size(); ++i) {
        charts::ReportStep& step = steps.emplace_back();
        step.name = measured.steps[i];
        if (i < measured.step_seconds.size()) step.measured.seconds = measured.step_seconds[i];
        if (i >= plan.steps.size() || plan.steps[i].text() != measured.steps[i]) {
            step.no_prediction = "not planned";
            continue;
        }
        const Step& its = plan.steps[i];
        step.predicted = values_of(its.predicted, its.predicted.expected_bytes());
        step.note = fmt::format("{} → {}{}", its.offer.from.text(), its.offer.to.text(),
                                its.runs() > 1 ? fmt::format(", {} runs", its.runs()) : "");
    }
    return steps;
}

charts::ReportStep total_of(const Planned& planned, const Run& run) {
    const Predicted& predicted = planned.answer.plan->predicted;
    const Measured& measured = run.measured;
    charts::ReportStep total;
    total.name = "all steps";
    total.predicted = values_of(predicted, predicted.expected_bytes());
    total.measured = {median(measured.seconds), {}, measured.bytes};
    if (measured.error)
        total.measured.error = measured.error->nrmse;
    else
        total.no_error = "not verified";
    return total;
}

std::vector<charts::ReportPath> front_of(const Planned& planned) {
    const Answer& answer = planned.answer;
    std::vector<charts::ReportPath> front;
    for (const Plan& plan : answer.front) {
        const bool chosen = plan.texts() == answer.plan->texts();
        front.push_back(
            {plan.steps.empty() ? "(the input itself)" : path_text(plan.texts()),
             values_of(plan.predicted, plan.predicted.expected_bytes()), chosen,
             chosen ? "" : why_not(plan.predicted, answer.plan->predicted, planned.want)});
    }
    return front;
}

/// As `edgewise graph -o g.svg` draws it.
void take_graph(charts::Report& report, const Planned& planned) {
    try {
        report.graph = laid_out(picture_dot(planned.answer.graph->spanned(), planned.engine.edges(),
                                            cost_words(planned), &*planned.answer.plan));
    } catch (const std::runtime_error& error) {
        report.no_graph = fmt::format("There is no drawing of it: {}.", error.what());
    }
}

}  // namespace

void write_run_page(const TypedRequest& typed) {
    const Planned& planned = *typed.reached().planned();
    const Run& run = *typed.reached().run;
    charts::Report report;
    report.title = title_of(planned);
    report.command = command_of(typed.options().words);
    report.request = request_facts(planned, run);
    report.machine = machine_facts(planned, run);
    if (run.shown) {
        report.picture = run.shown->picture;
        report.difference = run.shown->difference;
        report.difference_scale = run.shown->difference_scale;
        report.no_difference = run.shown->no_difference;
    }
    report.steps = steps_of(planned, run);
    report.total = total_of(planned, run);
    report.front = front_of(planned);
    for (const Refusal& refusal : planned.answer.refused)
        report.refused.emplace_back(refusal.transition, spoken(refusal.reason));
    take_graph(report, planned);
    report.warnings = spoken(typed.messages().warnings());
    report.document =
        report_of(typed.reached(), typed.messages(), typed.startup_seconds(), true, {});
    if (typed.messages().stop()) throw Cancelled();
    write_text(*typed.options().report, charts::page_of(report));
}

}  // namespace edgewise::cli
