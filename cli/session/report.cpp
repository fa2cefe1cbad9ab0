#include "cli/session/report.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "cli/request/spoken.hpp"
#include "cli/session/margin_report.hpp"
#include "engine/guesses.hpp"
#include "engine/reached.hpp"
#include "graph/filtering.hpp"
#include "graph/picture_facts.hpp"
#include "graph/radon.hpp"
#include "graph/version.hpp"

namespace edgewise::cli {
namespace {

using Json = nlohmann::ordered_json;

Json or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(); }

Json parameters_of(const Parameters& with) {
    Json json = Json::object();
    for (const auto& [key, value] : with.all())
        std::visit([&, &name = key](const auto& v) { json[name] = v; }, value);
    return json;
}

Json short_plan(const Plan& plan) {
    return {{"steps", plan.texts()}, {"predicted", to_json(plan.predicted)}};
}

/// Of one run, the mean over the views.
Json work_json(const Work& work) {
    const Traffic& traffic = work.traffic;
    return {{"operations", work.operations},
            {"masked", work.masked},
            {"streamed", work.streamed},
            {"gathers", work.gathers},
            {"lines", work.lines.count},
            {"other_lines", work.other_lines.count},
            {"local", traffic.local},
            {"global", traffic.global},
            {"congested", traffic.congested},
            {"messages", traffic.messages},
            {"sent", traffic.sent},
            {"scratch", work.scratch},
            {"workspace", work.workspace},
            {"span", work.lines.span},
            {"swept", work.swept},
            {"others", work.other_lines.span},
            {"way", work.variant}};
}

Json refined_json(const Refined& refined) {
    Json pictures = Json::array();
    for (const FrontSeen& seen : refined.pictures)
        pictures.push_back({{"view", seen.view},
                            {"slices", seen.slices},
                            {"depth", seen.depth},
                            {"seconds", seen.seconds},
                            {"bound", {{"most", seen.bound.most}, {"mean", seen.bound.mean}}}});
    return {{"stopped", refined.stopped}, {"pictures", pictures}};
}

Json measured_json(const Reached& reached) {
    if (!reached.run) return nullptr;
    const Measured& measured = reached.run->measured;
    Json steps = Json::array();
    for (std::size_t i = 0; i < measured.steps.size(); ++i) {
        const std::string& step = measured.steps[i];
        const bool timed = i < measured.step_seconds.size();
        steps.push_back({{"transition", step.substr(0, step.find('/'))},
                         {"seconds", timed ? Json(measured.step_seconds[i]) : Json()}});
    }
    return {{"seconds", measured.seconds},
            {"bytes", measured.bytes},
            {"read_seconds", reached.planned()->input.read_seconds},
            {"write_seconds", measured.write_seconds},
            {"kept", measured.kept ? Json(*measured.kept) : Json()},
            {"error", to_json(measured.error)},
            {"refined", measured.refined ? refined_json(*measured.refined) : Json()},
            {"steps", steps}};
}

/// What was measured of the data for this request. Numbers of a ray are means over pixels.
Json scene_json(const Looked& looked) {
    const Scene& scene = looked.scene;
    const auto corner = [&](const std::array<std::int64_t, 3>& at) {
        return std::vector<std::int64_t>(at.begin(), at.begin() + looked.want.axes);
    };
    const std::optional<double> ended = scene.fact(kEnded);
    const Json rays = {{"samples", or_null(scene.fact(kCastAll))},
                       {"taken", or_null(scene.fact(kCastTaken))},
                       {"taken_with_bricks", or_null(scene.fact(kCastBricks))},
                       {"opaque", ended ? Json(*ended * *ended) : Json()}};
    return {{"values", {scene.low, scene.high}},
            {"mean", scene.mean},
            {"non_finite", scene.non_finite},
            {"commonest", scene.commonest},
            {"occupied_box", {corner(scene.occupied.begin), corner(scene.occupied.end)}},
            {"occupied_fraction", scene.occupied_fraction},
            {"range", scene.range},
            {"draws", scene.draws},
            {"exhausted", scene.exhausted},
            {"rays", rays}};
}

/// What would make a plan: {"budgets": [{"--max-error": "0.0123"}],
/// "demands": [[{"option", "value"}]], "then_budgets", "missing": [[{"transition", "reason"}]]}
Json relax_json(const WayOut& way_out) {
    Json budgets = Json::array(), demands = Json::array(), missing = Json::array();
    for (const auto& changes : way_out.budgets) {
        Json one = Json::object();
        for (const SettingChange& change : changes)
            one[option_of(change.setting.name)] = change.value ? Json(*change.value) : Json();
        budgets.push_back(one);
    }
    for (const auto& changes : way_out.demands) {
        Json set = Json::array();
        for (const SettingChange& change : changes)
            set.push_back({{"option", option_of(change.setting.name)}, {"value", change.instead}});
        demands.push_back(set);
    }
    for (const auto& refusals : way_out.missing) {
        Json set = Json::array();
        for (const Refusal& refusal : refusals)
            set.push_back({{"transition", refusal.transition}, {"reason", spoken(refusal.reason)}});
        missing.push_back(set);
    }
    return {{"budgets", budgets},
            {"demands", demands},
            {"then_budgets", way_out.then_budgets},
            {"missing", missing}};
}

void add_answer(Json& report, const Planned* planned, double startup_seconds) {
    report["plan"] = nullptr;
    report["front"] = Json::array();
    report["refused"] = Json::array();
    report["planning"] = nullptr;
    if (!planned) return;
    const Answer& answer = planned->answer;
    if (answer.plan) {
        report["plan"] = to_json(*answer.plan);
        report["plan"]["plain"] = answer.plain ? Json(answer.plain->step) : Json();
    }
    for (const Plan& plan : answer.front) report["front"].push_back(short_plan(plan));
    for (const Refusal& refusal : answer.refused)
        report["refused"].push_back(
            {{"transition", refusal.transition}, {"reason", spoken(refusal.reason)}});
    if (planned->margin) {
        report["margin"] = margin_json(*planned->margin);
        report["rivals"] = rivals_json(*planned->margin);
    }
    report["scene"] = scene_json(*planned);
    const Spent& spent = planned->spent;
    report["planning"] = {{"seconds", answer.seconds},
                          {"parts",
                           {{"statistics", spent.statistics},
                            {"preset", spent.preset},
                            {"preview", spent.preview},
                            {"search", spent.search},
                            {"pilot", spent.pilot}}},
                          {"saved_seconds", or_null(planned->saved_seconds())},
                          {"startup_seconds", startup_seconds},
                          {"planner", name_of(planned->query.planner)},
                          {"found_by", name_of(answer.search)},
                          {"machine", planned->engine.machine().name},
                          {"vertices", answer.vertices},
                          {"edges", answer.edges}};
}

/// @param opened, looked  null: not yet
Json request_json(const Asked& asked, const Opened* opened, const Looked* looked) {
    const Request& want = asked.want;
    Json json = {{"job", name_of(want.job)}, {"input", asked.query.input}};
    if (want.job->of_rays()) json["mode"] = name_of(want.mode);
    if (want.job->of_points() && opened) json["outside"] = or_null(filled_with(*opened));
    if (looked && looked->preset) {
        const auto& preset = looked->preset;
        json["preset"] = spoken(preset->name);
        json["preset_for"] = preset->kind.empty() ? Json() : Json(preset->kind);
        json["preset_window"] = {preset->window.low, preset->window.high};
    }
    if (want.needs_gradients()) json["gradient"] = name_of(want.gradient);
    if (looked && looked->preset && looked->preset->noise) json["noise"] = *looked->preset->noise;
    if (const Filtering* filtering = want.setting.as<Filtering>()) {
        json["op"] = name_of(filtering->op);
        json["kernel"] = filtering->stencil.name;
        json["border"] = name_of(filtering->border);
    }
    if (const RadonSetting* radon = want.setting.as<RadonSetting>()) {
        const bool votes = radon->to == RadonSetting::To::hough;
        json["angles"] = radon->angles;
        json["to"] = votes ? "hough" : radon->to == RadonSetting::To::image ? "image" : "sinogram";
        if (!radon->degrees.empty()) json["degrees"] = radon->degrees;
        if (votes) json["threshold"] = radon->threshold;
    }
    if (want.surface) json["isovalue"] = or_null(want.surface->isovalue);  // null: labels
    const Budget& budget = want.budget;
    // What nobody asked for is no budget.
    const bool limited = budget.error && !budget.error_yields;
    json["budget"] = {{"error", limited ? Json(*budget.error) : Json()},
                      {"default", budget.like           ? Json(budget.like->name)
                                  : budget.error_yields ? Json("rounding")
                                                        : Json()},
                      {"seconds", or_null(budget.seconds)},
                      {"bytes", asked.query.max_memory ? or_null(budget.bytes) : Json()}};
    json["minimize"] = name_of(want.minimize);
    json["frames"] = want.frames;
    json["threads"] = want.threads;
    json["threads_of"] = asked.query.threads        ? "option"
                         : asked.threads_of_machine ? "machine"
                                                    : "process";
    json["ranks"] = want.ranks;
    return json;
}

void add_surface(Json& report, const surface::Measures& measures) {
    report["vertices"] = measures.vertices;
    report["triangles"] = measures.triangles;
    report["closed"] = measures.closed;
    report["area"] = measures.area;
    report["volume"] = or_null(measures.volume);
}

}  // namespace

Json to_json(const Predicted& predicted) {
    // 90 % of runs lie between: a log-normal distribution around the prediction.
    const double reach = std::exp(1.645 * predicted.spread);
    return {{"seconds", predicted.seconds},
            {"seconds_low", predicted.seconds / reach},
            {"seconds_high", predicted.seconds * reach},
            {"bytes", predicted.expected_bytes()},
            {"bytes_high", predicted.bytes},
            {"error", predicted.known ? Json(predicted.error) : Json()}};
}

Json request_json(const Reached& reached) {
    return request_json(*reached.asked(), reached.opened(), reached.looked());
}

Json request_json(const Looked& looked) { return request_json(looked, &looked, &looked); }

Json to_json(const Plan& plan) {
    Json steps = Json::array();
    for (const Step& step : plan.steps)
        steps.push_back({{"transition", step.by->name},
                         {"from", step.offer.from.text()},
                         {"to", step.offer.to.text()},
                         {"parameters", parameters_of(step.offer.with)},
                         {"work", work_json(step.work)},
                         {"predicted", to_json(step.predicted)}});
    return {{"steps", steps}, {"boxes", plan.boxes}, {"predicted", to_json(plan.predicted)}};
}

Json to_json(const std::optional<Verified>& error) {
    if (!error) return nullptr;
    return {{"nrmse", error->nrmse}, {"low", error->low},     {"high", error->high},
            {"max", error->max},     {"range", error->range}, {"samples", error->samples}};
}

Json report_head() { return {{"schema", 1}, {"version", version()}}; }

Json failure_of(int code, const std::string& message) {
    Json report = report_head();
    report["warnings"] = Json::array();
    report["error"] = {{"code", code}, {"message", message}, {"nearest", Json::array()}};
    report["plan"] = nullptr;
    return report;
}

Json report_of(const Reached& reached, const Listener& messages, double startup_seconds,
               bool with_run, const std::optional<Failure>& failure) {
    Json report = report_head();
    report["warnings"] = spoken(messages.warnings());
    report["request"] = request_json(reached);
    add_answer(report, reached.planned(), startup_seconds);
    if (with_run) {
        report["measured"] = measured_json(reached);
        report["outputs"] = reached.run ? reached.run->files : std::vector<std::string>();
        if (reached.run && reached.run->surface) add_surface(report, *reached.run->surface);
    }
    if (!failure) return report;
    report["plan"] = nullptr;
    Json nearest = Json::array();
    if (reached.planned())
        for (const Plan& plan : reached.planned()->answer.nearest)
            nearest.push_back(short_plan(plan));
    report["error"] = {
        {"code", failure->code}, {"message", failure->message}, {"nearest", nearest}};
    if (reached.way_out) report["error"]["relax"] = relax_json(*reached.way_out);
    return report;
}

std::string text_of(const Json& json) {
    // Names of files are bytes: what is not UTF-8 becomes U+FFFD. Infinities become null.
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace edgewise::cli
