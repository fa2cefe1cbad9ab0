#include "cli/session/explain.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <map>
#include <set>
#include <utility>

#include "cli/request/spoken.hpp"
#include "cli/session/margin_report.hpp"
#include "cli/session/refusals.hpp"
#include "engine/guesses.hpp"
#include "engine/rivals.hpp"
#include "engine/run.hpp"
#include "measure/machine.hpp"
#include "planner/alike.hpp"
#include "presentation/sheet.hpp"
#include "request/quantities.hpp"
#include "transitions/filters/filter.hpp"

namespace edgewise::cli {
namespace {

constexpr const char* kNoBetter = "no better";
constexpr std::size_t kMostPaths = 2000, kMostRows = 40;

std::string plan_text(const Plan& plan) {
    return plan.steps.empty() ? "(the input itself)"
                              : fmt::format("{}", fmt::join(plan.texts(), " > "));
}

std::string row(const std::string& mark, const Predicted& predicted, const std::string& path,
                const std::string& why) {
    return fmt::format("{:1} {:>11} {:>12} {:>19}  {}{}\n", mark, seconds_text(predicted.seconds),
                       bytes_text(predicted.expected_bytes()), error_text(predicted), path,
                       why.empty() ? "" : "  [" + why + "]");
}

}  // namespace

std::string why_not(const Predicted& other, const std::optional<Predicted>& chosen,
                    const Request& want) {
    const Budget& budget = want.budget;
    if (budget.like && other.likeness == Likeness::barred)
        return fmt::format("no filter or step of {}", budget.like->name);
    if (budget.like && other.likeness == Likeness::worse)
        return other.known ? fmt::format("less accurate than {}", budget.like->name)
                           : "its error is unknown";
    if (budget.error && !other.known) return "its error is unknown";
    if (budget.error && other.error > *budget.error)
        return fmt::format("error above {:.3g}", *budget.error);
    if (budget.seconds && other.seconds > *budget.seconds)
        return "slower than " + seconds_text(*budget.seconds);
    if (budget.bytes && other.bytes > *budget.bytes)
        return "larger than " + bytes_text(*budget.bytes);
    if (!chosen) return {};
    switch (want.minimize) {
        case Minimize::time:
            if (other.seconds > chosen->seconds)
                return fmt::format("takes {:.2f} times as long", other.seconds / chosen->seconds);
            break;
        case Minimize::error:
            if (other.error > chosen->error) return "less accurate";
            break;
        case Minimize::memory:
            if (other.bytes > chosen->bytes) return "takes more memory";
            break;
    }
    return kNoBetter;
}

namespace {

/// All paths, those of the front first.
std::vector<Plan> paths_of(const Planned& planned) {
    std::vector<Plan> plans = all_paths(planned.answer.graph->real(), planned.engine.edges(),
                                        planned.ask(), planned.plan_options, kMostPaths);
    std::set<std::string> front;
    for (const Plan& plan : planned.answer.front) front.insert(plan_text(plan));
    std::stable_sort(plans.begin(), plans.end(), [](const Plan& a, const Plan& b) {
        return a.predicted.seconds < b.predicted.seconds;
    });
    std::stable_partition(plans.begin(), plans.end(),
                          [&](const Plan& plan) { return front.contains(plan_text(plan)); });
    return plans;
}

/// Filters of these paths, in words that who does not know the names knows.
std::string filters_text(const std::vector<Plan>& plans) {
    std::set<std::string> read;
    for (const Plan& plan : plans)
        for (const Step& step : plan.steps)
            if (step.offer.with.contains("filter")) read.insert(step.offer.with.word("filter"));
    std::vector<std::string> said;
    for (const Filter& filter : filters())
        if (read.contains(filter.name))
            said.push_back(fmt::format("{} is {}", filter.name, filter.help));
    if (read.contains("me")) said.push_back("me is samples sent on as they are");  // no filter
    return said.empty() ? "" : fmt::format("filters: {}\n", fmt::join(said, ", "));
}

/// What paths take on all processors of the profile, by which a plan is chosen, where the threads
/// given are others; by their texts.
std::map<std::string, double> seconds_on_all(const Planned& planned) {
    std::map<std::string, double> seconds;
    Request want = planned.want;
    if (want.threads == planned.engine.machine().processors) return seconds;
    want.threads = planned.engine.machine().processors;
    const Ask ask{want, planned.scene};
    for (const Plan& plan : all_paths(planned.answer.graph->choice(), planned.engine.edges(), ask,
                                      planned.plan_options, kMostPaths))
        seconds.emplace(plan_text(plan), plan.predicted.seconds);
    return seconds;
}

std::string machine_text(const Planned& planned) {
    const std::string& name = planned.engine.machine().name;
    return is_built_in(planned.engine.machine())
               ? name +
                     " (built in: seconds are guesses, `edgewise calibrate` measures this machine)"
               : name;
}

/// Whose threads they are.
std::string threads_text(const Planned& planned) {
    const Request& want = planned.want;
    const std::string whose = planned.query.threads        ? "(--threads)"
                              : planned.threads_of_machine ? "(the machine's)"
                                                           : "(of this process)";
    if (want.ranks == 1) return whose;
    return fmt::format("on each of {} ranks {}", want.ranks, whose);
}

std::string steps_text(const Plan& plan) {
    std::string text;
    for (const Step& step : plan.steps)
        text += fmt::format("  {:>11} {:>12} {:>19}  {}{}\n    {} -> {}\n",
                            seconds_text(step.predicted.seconds), bytes_text(step.predicted.bytes),
                            error_text(step.predicted), step.text(),
                            step.runs() > 1 ? fmt::format(" x {}", step.runs()) : "",
                            step.offer.from.text(), step.offer.to.text());
    return text;
}

/// @param all  one by one, else folded by reason
std::string refused_text(const std::vector<Refusal>& refused, const Catalogue& catalogue,
                         bool all) {
    if (refused.empty()) return {};
    const Refusals by_reason = folded(refused, catalogue);
    std::string text = fmt::format("\nrefused: {}{}\n", count_text(by_reason),
                                   all ? "" : " (--explain=all lists all)");
    constexpr std::size_t kNames = 3;
    if (all)
        for (const Refusal& refusal : refused)
            text += fmt::format("  {}: {}\n", refusal.transition, spoken(refusal.reason));
    else
        for (const auto& [reason, names] : by_reason.reasons)
            text += fmt::format("  {}: {}\n", few_of(names, kNames), reason);
    return text;
}

double median(std::vector<double> values) {
    std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
    return values[values.size() / 2];
}

}  // namespace

std::string budget_text(const Request& want) {
    const Budget& budget = want.budget;
    std::vector<std::string> parts;
    if (budget.error && budget.error_yields)
        parts.push_back("equal but for rounding (default)");
    else if (budget.error)
        parts.push_back(fmt::format("error {:.3g}", *budget.error));
    if (budget.like) {
        const double step = budget.like->step;
        const std::string steps =
            step < 1 ? fmt::format(", steps of {:g} at most: longer ones show rings", step) : "";
        parts.push_back(fmt::format("as good as {} (default{})", budget.like->name, steps));
    }
    if (budget.seconds) parts.push_back("time " + seconds_text(*budget.seconds));
    if (budget.bytes) parts.push_back("memory " + bytes_text(*budget.bytes));
    if (parts.empty()) parts.push_back("none");
    return fmt::format("{}; least {}", fmt::join(parts, ", "), name_of(want.minimize));
}

namespace {

std::string measured_row(const std::string& predicted, const std::string& measured, double ratio,
                         const std::string& what) {
    return fmt::format("  {:>19} {:>19} {:>7}  {}\n", predicted, measured,
                       std::isfinite(ratio) ? fmt::format("{:.2f}", ratio) : "", what);
}

/// Prediction against measurement, of steps those of the last run; steps of a plan that took over
/// were not predicted.
std::string measured_table(const Planned& planned, const Run& run) {
    const Plan& plan = *planned.answer.plan;
    const Measured& measured = run.measured;
    std::string text = measured_row("predicted", "measured", NAN, "step");
    for (std::size_t i = 0; i < measured.steps.size() && i < measured.step_seconds.size(); ++i) {
        const double took = measured.step_seconds[i];
        const bool was_planned = i < plan.steps.size() && plan.steps[i].text() == measured.steps[i];
        const double expected = was_planned ? plan.steps[i].predicted.seconds : NAN;
        text += measured_row(was_planned ? seconds_text(expected) : "not planned",
                             seconds_text(took), took / expected, measured.steps[i]);
    }
    const Predicted& all = plan.predicted;
    const double seconds = median(measured.seconds);
    text += measured_row(seconds_text(all.seconds), seconds_text(seconds), seconds / all.seconds,
                         "all steps");
    text += measured_row(bytes_text(all.expected_bytes()), bytes_text(measured.bytes),
                         measured.bytes / all.expected_bytes(), "peak memory");
    text += measured_row(
        error_text(all),
        measured.error ? error_text({.error = measured.error->nrmse}) : "not verified",
        measured.error && all.known ? measured.error->nrmse / all.error : NAN, "error");
    return text;
}

/// What linear interpolation is likely to do to these data, and the plan beside it. Both are likely
/// errors, as plans are compared by them; all others that are told are upper estimates, which lie
/// above.
std::string comparison_text(const Planned& planned) {
    const Answer& answer = planned.answer;
    const Like& like = *planned.want.budget.like;
    std::string text = fmt::format("{} on these data: error {} by {}", like.name,
                                   error_text({.error = *answer.plain->error}), answer.plain->step);
    const std::optional<double> own =
        answer.plan ? likely_error(*answer.plan, planned.ask(), planned.sources()) : std::nullopt;
    if (own) {
        const Likeness likeness = answer.plan->predicted.likeness;
        text += fmt::format("; of the plan {}, ", error_text({.error = *own}));
        if (likeness == Likeness::alike)
            text += fmt::format("as good: at most {:g} times that", like.times);
        else if (likeness == Likeness::worse)
            text += "less accurate: no path that may be taken is as good";
        else
            text += fmt::format("by no filter or step of {}", like.name);
    }
    return text + "\nthat is likely; errors of steps and paths below are upper estimates\n";
}

/// What choosing took, and what it is expected to save against the plain path.
std::string choosing_text(const Planned& planned) {
    const std::optional<double> saved = planned.saved_seconds();
    if (!saved) return {};
    const std::string took = "choosing took " + seconds_text(planned.choosing_seconds());
    const std::string& plain = planned.answer.plain->step;
    if (planned.answer.plan->texts() == std::vector<std::string>{plain})
        return fmt::format("{}; the plan is the plain path, {}\n", took, plain);
    const int runs = planned.query.repeat;
    const std::string expected = *saved < 0
                                     ? fmt::format("take {} more than", seconds_text(-*saved))
                                     : fmt::format("save {} against", seconds_text(*saved));
    return fmt::format("{}; the plan is expected to {} the plain path, {}{}\n", took, expected,
                       plain, runs > 1 ? fmt::format(", over {} runs", runs) : "");
}

/// Why a path is not taken although the preview shows it to be better.
std::string seen_better_text(const Planned& planned) {
    const Plan& better = *planned.seen_better;
    return fmt::format(
        "\n{} would do as well and takes {} less. Only a preview shows that, which takes longer "
        "than "
        "it saves: without --explain none is drawn here. Over more runs (--repeat) one is.\n",
        plan_text(better),
        seconds_text(planned.answer.plan->predicted.seconds - better.predicted.seconds));
}

}  // namespace

std::string explanation_of(const Planned& planned, bool all_refused) {
    const Answer& answer = planned.answer;
    const Request& want = planned.want;
    std::string text = fmt::format(
        "{} {}: {} view{}, {} thread{} {}, machine {}\nbudget: {}\nplanned in {}: {} vertices, {} "
        "edges; found by {}\n",
        name_of(want.job), planned.query.input, want.frames, want.frames > 1 ? "s" : "",
        want.threads, want.threads > 1 ? "s" : "", threads_text(planned), machine_text(planned),
        budget_text(want), seconds_text(answer.seconds), answer.vertices, answer.edges,
        name_of(answer.search));
    if (const auto& preset = planned.preset)
        text +=
            preset_text(*preset) +
            (preset->kind.empty() ? "\n" : fmt::format(", as it seems to be {}\n", preset->kind));
    const std::map<std::string, double> on_all = seconds_on_all(planned);
    if (!on_all.empty())
        text += fmt::format(
            "chosen for the {} processors of machine {}, so that threads do not change the result; "
            "seconds are those of {} thread{}\n",
            planned.engine.machine().processors, planned.engine.machine().name, want.threads,
            want.threads > 1 ? "s" : "");
    if (planned.drawn > 1)
        text += fmt::format("errors from {} clusters of samples, {} times the usual draws\n",
                            planned.scene.draws, planned.drawn);
    if (answer.plain && answer.plain->error) text += comparison_text(planned);
    text += choosing_text(planned);
    std::optional<Predicted> chosen;
    if (answer.plan) {
        chosen = answer.plan->predicted;
        const int boxes = answer.plan->boxes;
        text += "\nplan\n" + steps_text(*answer.plan) +
                row("=", *chosen,
                    boxes > 1 ? fmt::format("all steps, the last of them in {} boxes", boxes)
                              : "all steps",
                    "");
    } else {
        text += "\nno plan: " + answer.problem + "\n";
    }
    if (planned.seen_better) text += seen_better_text(planned);
    text += margin_text(planned);
    const std::vector<Plan> plans = paths_of(planned);
    text += fmt::format("\npaths ({}{}; > chosen, * on the front)\n", plans.size(),
                        plans.size() == kMostPaths ? " and more" : "");
    std::set<std::string> front;
    for (const Plan& plan : answer.front) front.insert(plan_text(plan));
    const bool compared = answer.plain && answer.plain->error;
    const auto reason = [&](const Plan& plan, const std::string& path) {
        std::string why = why_not(plan.predicted, chosen, want);
        // Upper estimates of paths may lie in another order than what they are likely to do.
        if (compared && plan.predicted.likeness == Likeness::worse && plan.predicted.known)
            if (const auto likely = likely_error(plan, planned.ask(), planned.sources()))
                why += fmt::format(": likely {:.3g}", *likely);
        if (planned.seen_better && why == kNoBetter)
            return std::string("faster, as a preview shows");
        const auto its = on_all.find(path);
        if (why != kNoBetter || its == on_all.end() || want.minimize != Minimize::time) return why;
        const auto mine = on_all.find(plan_text(*answer.plan));
        if (mine == on_all.end() || its->second <= mine->second) return why;
        return fmt::format("takes {:.2f} times as long on {} processors",
                           its->second / mine->second, planned.engine.machine().processors);
    };
    for (std::size_t i = 0; i < plans.size() && i < kMostRows; ++i) {
        const std::string path = plan_text(plans[i]);
        const bool is_plan = answer.plan && path == plan_text(*answer.plan);
        text += row(is_plan                ? ">"
                    : front.contains(path) ? "*"
                                           : "",
                    plans[i].predicted, path, is_plan ? "" : reason(plans[i], path));
    }
    if (plans.size() > kMostRows) text += fmt::format("  and {} more\n", plans.size() - kMostRows);
    text += filters_text(plans);
    return text + refused_text(answer.refused, planned.engine.edges(), all_refused);
}

std::string preset_text(const TakenPreset& preset) {
    std::string text = fmt::format("{}{} over {:.5g} to {:.5g}", preset.file ? "" : "preset ",
                                   spoken(preset.name), preset.window.low, preset.window.high);
    if (preset.smooths)
        text +=
            fmt::format(", gradients smoothed (noise {:.2g} % of the window)", 100 * *preset.noise);
    return text;
}

std::string result_of(const Planned& planned, const Run& run) {
    const Measured& measured = run.measured;
    const Request& want = planned.want;
    const auto& files = run.files;
    std::vector<std::string> parts{files.empty() ? "nothing written"
                                   : files.size() == 1
                                       ? files[0]
                                       : fmt::format("{} to {}", files.front(), files.back())};
    const bool sheet = planned.query.look.montage && !files.empty();
    const Extent out = sheet ? sheet_extent(planned.query.look, want.output()) : want.output();
    if (run.surface)
        parts.push_back(fmt::format("{} triangles, {} vertices, {}", run.surface->triangles,
                                    run.surface->vertices,
                                    run.surface->closed ? "closed" : "open"));
    else
        parts.push_back((want.frames > 1 && !sheet ? fmt::format("{} of ", want.frames) : "") +
                        text_of(out, want.job->samples && !sheet ? want.axes : 2));
    if (looks_along_z(planned)) parts.push_back("seen along z, as no orientation is known");
    if (planned.preset) parts.push_back(preset_text(*planned.preset));
    if (const std::optional<double> filled = filled_with(planned))
        parts.push_back(fmt::format("{:g} beyond the input", *filled));
    parts.push_back(measured.steps.empty() ? "the input itself"
                                           : fmt::format("{}", fmt::join(measured.steps, " > ")));
    parts.push_back(seconds_text(median(measured.seconds)));
    const Predicted& predicted = planned.answer.plan->predicted;
    const auto& like = want.budget.like;
    if (measured.error)
        parts.push_back(
            fmt::format("error {} measured", error_text({.error = measured.error->nrmse})));
    else if (measured.refined && measured.refined->stopped)
        parts.push_back("stopped on the way");  // what is predicted is of all slices
    else if (predicted.known && !run.surface)
        parts.push_back(fmt::format("error {} predicted", error_text(predicted)));
    else if (like && predicted.likeness == Likeness::alike)
        parts.push_back(want.field == Field::nearest ? "no new value"
                                                     : fmt::format("as good as {}", like->name));
    return fmt::format("{}", fmt::join(parts, ", "));
}

std::string measurement_of(const Planned& planned, const Run& run, bool explained) {
    const Measured& measured = run.measured;
    std::string text;
    if (explained && planned.answer.plan) text = measured_table(planned, run) + "\n";
    text += fmt::format("measured: {}, peak {}", seconds_text(median(measured.seconds)),
                        bytes_text(measured.bytes));
    if (measured.error) {
        const Verified& e = *measured.error;
        text += fmt::format(
            ", error {}, 95 % from {:.3g} to {:.3g}; largest difference {:.4g} of {:.4g}, {} "
            "samples",
            error_text({.error = e.nrmse}), e.low, e.high, e.max, e.range, e.samples);
    }
    return text + "\n";
}

}  // namespace edgewise::cli
