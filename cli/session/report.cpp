#include "cli/session/report.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "cli/request/spoken.hpp"
#include "cli/session/margin_report.hpp"
#include "engine/guesses.hpp"
#include "engine/session.hpp"
#include "graph/filtering.hpp"
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

Json measured_json(const Session& session) {
    if (!session.measured) return nullptr;
    const Measured& measured = *session.measured;
    Json steps = Json::array();
    for (std::size_t i = 0; i < measured.steps.size(); ++i) {
        const std::string& step = measured.steps[i];
        const bool timed = i < measured.step_seconds.size();
        steps.push_back({{"transition", step.substr(0, step.find('/'))},
                         {"seconds", timed ? Json(measured.step_seconds[i]) : Json()}});
    }
    return {{"seconds", measured.seconds},
            {"bytes", measured.bytes},
            {"read_seconds", session.input ? Json(session.input->read_seconds) : Json()},
            {"write_seconds", measured.write_seconds},
            {"kept", measured.kept ? Json(*measured.kept) : Json()},
            {"error", to_json(measured.error)},
            {"refined", measured.refined ? refined_json(*measured.refined) : Json()},
            {"steps", steps}};
}

/// What was measured of the data for this request. Numbers of a ray are means over pixels.
Json scene_json(const Session& session) {
    const Scene& scene = session.scene;
    const auto corner = [&](const std::array<std::int64_t, 3>& at) {
        return std::vector<std::int64_t>(at.begin(), at.begin() + session.want().axes);
    };
    const std::optional<double> ended = scene.fact("picture/ended");
    const Json rays = {{"samples", or_null(scene.fact("cast/all"))},
                       {"taken", or_null(scene.fact("cast/taken"))},
                       {"taken_with_bricks", or_null(scene.fact("cast/bricks"))},
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

/// What would make a plan, with what edges refuse in the words of the command.
Json relax_json(const WayOut& way_out) {
    Json json = to_json(way_out);
    for (std::size_t i = 0; i < way_out.missing.size(); ++i)
        for (std::size_t k = 0; k < way_out.missing[i].size(); ++k)
            json["missing"][i][k]["reason"] = spoken(way_out.missing[i][k].reason);
    return json;
}

void add_answer(Json& report, const Session& session, double startup_seconds) {
    report["plan"] = nullptr;
    report["front"] = Json::array();
    report["refused"] = Json::array();
    report["planning"] = nullptr;
    if (!session.answer) return;
    const Answer& answer = *session.answer;
    if (answer.plan) report["plan"] = to_json(*answer.plan);
    for (const Plan& plan : answer.front) report["front"].push_back(short_plan(plan));
    for (const Refusal& refusal : answer.refused)
        report["refused"].push_back(
            {{"transition", refusal.transition}, {"reason", spoken(refusal.reason)}});
    if (session.margin) {
        report["margin"] = margin_json(*session.margin);
        report["rivals"] = rivals_json(*session.margin);
    }
    report["scene"] = scene_json(session);
    const Spent& spent = session.spent;
    report["planning"] = {{"seconds", answer.seconds},
                          {"parts",
                           {{"statistics", spent.statistics},
                            {"preset", spent.preset},
                            {"preview", spent.preview},
                            {"search", spent.search},
                            {"pilot", spent.pilot}}},
                          {"startup_seconds", startup_seconds},
                          {"planner", name_of(session.spec.planner)},
                          {"found_by", name_of(answer.search)},
                          {"machine", session.profile.name},
                          {"vertices", answer.vertices},
                          {"edges", answer.edges}};
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

Json request_json(const Session& session) {
    const Request& want = session.want();
    Json json = {{"job", name_of(want.job)}, {"input", session.spec.input}};
    if (want.job == Job::render) json["mode"] = name_of(want.mode);
    if (want.job == Job::warp && session.input) json["outside"] = or_null(filled_with(session));
    if (const auto& preset = session.preset) {
        json["preset"] = spoken(preset->name);
        json["preset_for"] = preset->kind.empty() ? Json() : Json(preset->kind);
        json["preset_window"] = {preset->window.low, preset->window.high};
    }
    if (want.needs_gradients()) json["gradient"] = name_of(want.gradient);
    if (session.preset && session.preset->noise) json["noise"] = *session.preset->noise;
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
    const bool asked = budget.error && !budget.error_yields;
    json["budget"] = {{"error", asked ? Json(*budget.error) : Json()},
                      {"default", budget.like           ? Json(budget.like->name)
                                  : budget.error_yields ? Json("rounding")
                                                        : Json()},
                      {"seconds", or_null(budget.seconds)},
                      {"bytes", session.spec.max_memory ? or_null(budget.bytes) : Json()}};
    json["minimize"] = name_of(want.minimize);
    json["frames"] = want.frames;
    json["threads"] = want.threads;
    json["threads_of"] = session.spec.threads         ? "option"
                         : session.threads_of_machine ? "machine"
                                                      : "process";
    json["ranks"] = want.ranks;
    return json;
}

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

Json report_of(const Session& session, double startup_seconds, bool with_run,
               const std::optional<Failure>& failure) {
    Json report = report_head();
    report["warnings"] = spoken(session.messages.warnings());
    report["request"] = request_json(session);
    add_answer(report, session, startup_seconds);
    if (with_run) {
        report["measured"] = measured_json(session);
        report["outputs"] = session.files;
        if (session.surface) add_surface(report, *session.surface);
    }
    if (!failure) return report;
    report["plan"] = nullptr;
    Json nearest = Json::array();
    if (session.answer)
        for (const Plan& plan : session.answer->nearest) nearest.push_back(short_plan(plan));
    report["error"] = {
        {"code", failure->code}, {"message", failure->message}, {"nearest", nearest}};
    if (session.way_out) report["error"]["relax"] = relax_json(*session.way_out);
    return report;
}

std::string text_of(const Json& json) {
    // Names of files are bytes: what is not UTF-8 becomes U+FFFD. Infinities become null.
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace edgewise::cli
