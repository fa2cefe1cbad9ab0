#include "request/make_request.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <functional>
#include <string_view>
#include <utility>

#include "graph/errors.hpp"
#include "graph/label_surface.hpp"
#include "graph/range.hpp"
#include "graph/transfer_table.hpp"
#include "io/channel_colours.hpp"
#include "io/geometry.hpp"
#include "measure/machine.hpp"
#include "reference/jumps.hpp"
#include "request/clip.hpp"
#include "request/filtering.hpp"
#include "request/percentile.hpp"
#include "request/radon.hpp"
#include "request/windows.hpp"
#include "surface/finish.hpp"
#include "surface/lids.hpp"
#include "transfer/drawn.hpp"
#include "transfer/kinds.hpp"
#include "transfer/noise.hpp"
#include "transfer/presets.hpp"
#include "transfer/suited.hpp"
#include "transitions/filters/like_linear.hpp"

namespace edgewise {
namespace {

void take_budgets(Request& want, const Query& query) {
    Budget& budget = want.budget;
    budget.seconds = query.max_time;
    budget.bytes = query.max_memory;
    // "The best in 50 ms": a time alone asks for the least error within it.
    const bool best_in_time = query.max_time && !query.max_error && !query.like_linear;
    want.minimize = query.minimize.value_or(best_in_time ? Minimize::error : Minimize::time);
    const bool by_default = !query.max_error && !query.max_time && want.minimize != Minimize::error;
    if (by_default || query.like_linear)
        budget.like.emplace();  // which one hangs on what the samples are
    else
        budget.error = query.max_error;
    if (query.range && !(*query.range > 0))
        throw RequestError(message("@range: {} is not greater than 0", *query.range));
    want.range = query.range;
    want.threads = query.threads.value_or(usable_cores());
    if (query.planning_time && query.planner == Planner::estimate)
        throw RequestError(message("@planning_time: of @planner(pilot) and exhaustive only"));
}

/// The key light of portraits: over the viewer's left shoulder.
const Light kKeyLight{Vec3(-0.5, -0.5, -1)};
constexpr Material kMaterial{0.2, 0.9, 0.2, 20};

/// A material that the request did not name, under its lights. Samples throw shadows on themselves
/// as well, so little of a light arrives: ambient light, which throws none, fills them.
Material filled(Material material, bool shadows) {
    constexpr double kFill = 0.25;
    if (shadows) material.ambient = std::min(1.0, material.ambient + kFill);
    return material;
}

void take_light(Request& want, const Query& query) {
    want.shading.by = query.shade.value_or(want.mode->shade);
    const auto rules_of = [&](auto&& is_one) {
        std::vector<std::string_view> names;
        for (const Shade by : want.mode->shades)
            if (is_one(Shading{.by = by})) names.push_back(name_of(by));
        return fmt::to_string(fmt::join(names, ", "));
    };
    const auto all = [](const Shading&) { return true; };
    if (want.shading.on() && std::find(want.mode->shades.begin(), want.mode->shades.end(),
                                       want.shading.by) == want.mode->shades.end())
        throw RequestError(message("@shade: {} is not of @mode({}); expected {} or none",
                                   name_of(want.shading.by), want.mode->name, rules_of(all)));
    const auto of_rules = [&](SettingName field, bool given, bool sensible, auto&& is_one) {
        if (!given || sensible) return;
        const std::string rules = rules_of(is_one);
        if (rules.empty())
            throw RequestError(message("{}: of modes that light falls on, not of {}",
                                       setting(field), want.mode->name));
        throw RequestError(message("{}: of @shade({}) only", setting(field), rules));
    };
    of_rules("lights", !query.lights.empty(), want.shading.on(), all);
    of_rules("material", query.material.has_value(), want.shading.has_normals(),
             [](const Shading& by) { return by.has_normals(); });
    if (query.phase && want.shading.by != Shade::particles)
        throw RequestError(message("@phase: of @mode(composite) with @shade(particles) only"));
    const auto falls_on_samples = [&](SettingName field, bool given, bool sensible) {
        if (given && (!sensible || !want.mode->takes_transfer))
            throw RequestError(message("{}: of @mode(composite) with {} only", setting(field),
                                       field.name == "shadows"
                                           ? message("@shade(phong), torrance-sparrow or particles")
                                           : message("@shade(phong) or torrance-sparrow")));
    };
    falls_on_samples("shadows", query.shadows, want.shading.on());
    falls_on_samples("occlusion", query.occlusion.has_value(), want.shading.has_normals());
    if (query.shadows && query.lights.size() > Arriving::kMostLights)
        throw RequestError(message("@shadows: {} lights; expected at most {}", query.lights.size(),
                                   Arriving::kMostLights));
    want.shading.shadows = query.shadows;
    want.shading.occlusion = query.occlusion.value_or(0);
    if (query.phase) want.shading.phase = *query.phase;
    if (!want.shading.on()) return;
    want.shading.material = query.material ? *query.material : filled(kMaterial, query.shadows);
    want.shading.lights = query.lights.empty() ? std::vector<Light>{kKeyLight} : query.lights;
    for (Light& light : want.shading.lights) light.towards.normalize();
}

void take_mode(Request& want, const Query& query) {
    // Of what has no rays the mode means nothing, and no edge looks at what belongs to it.
    if (want.job->of_rays()) want.mode = query.mode;
    const auto only = [&](const Message& what, bool given, auto takes) {
        const ModeTraits& mode = *want.mode;
        if (!given || std::invoke(takes, mode)) return;
        std::vector<std::string_view> names;
        for (const Mode other : modes())
            if (std::invoke(takes, *other)) names.push_back(other->name);
        throw RequestError(
            message("{}: of @mode({}) only, not of {}", what, fmt::join(names, ", "), mode.name));
    };
    only(setting("zero"), query.zero.has_value(), &ModeTraits::takes_zero);
    only(setting("background"), query.background || query.keeps_alpha,
         &ModeTraits::over_background);
    if (query.transfer) only(query.transfer->from, true, &ModeTraits::takes_transfer);
    only(setting("preset"), query.suiting_preset, &ModeTraits::takes_transfer);
    only(setting("shade"), query.shade.has_value(), &ModeTraits::takes_light);
    only(setting("gradient"), query.gradient.has_value(), &ModeTraits::takes_light);
    only(setting("cue"), query.cue.has_value(), &ModeTraits::takes_cue);
    only(setting("exposure"), query.exposure.has_value(), &ModeTraits::over_background);
    if (want.job == Job::render) {
        only(setting("isovalue"), query.isovalue.has_value(), &ModeTraits::takes_level);
        const bool of_labels = query.labels && want.mode->first_hit;
        if (want.mode->takes_level && !query.isovalue && !of_labels)
            throw RequestError(message("@mode({}): at which value? Expected @isovalue V{}",
                                       want.mode->name,
                                       want.mode->first_hit ? message(", or @labels") : ""));
        if (want.mode->takes_level) want.surface = SurfaceOf{query.isovalue};
        want.cue = query.cue;
    }
    take_light(want, query);
    if (query.background) want.background = *query.background;
    want.keeps_alpha = query.keeps_alpha;
    if (query.gradient) want.gradient = *query.gradient;
    if (query.zero) want.zero = *query.zero;
    if (query.outside) want.outside = *query.outside;
}

/// Surfaces are made of the samples as they are, or not at all.
void take_surface(Request& want, const Query& query) {
    if (want.job != Job::mesh) return;
    if (query.isovalue.has_value() == query.labels)
        throw RequestError(
            query.labels
                ? message("@labels: surfaces of labels have no @isovalue; leave out one of them")
                : message("mesh: which surface? Expected @isovalue V, or @labels"));
    want.surface = SurfaceOf{query.isovalue};
    const SurfaceFinish& finish = query.finish;
    for (const auto& [option, share] : {std::pair{setting("decimate"), finish.decimate},
                                        std::pair{setting("smooth"), finish.smooth}})
        if (share && !(*share >= 0 && *share <= 1))
            throw RequestError(message("{}: expected a number from 0 to 1", option));
    if (finish.decimate && !surface::can_decimate())
        throw RequestError(
            message("@decimate: this build was made without meshoptimizer (libmeshoptimizer-dev)"));
    if (finish.lids && !query.labels) want.setting = JobSetting::of(surface::MeshSetting{true});
    want.minimize = query.minimize.value_or(Minimize::time);
    want.budget.like.reset();
    want.budget.error.reset();
    want.budget.copied = true;
}

/// Equal but for rounding: what f32 makes of a sum of some thousand products.
void take_filter_budget(Request& want, const Query& query) {
    if (want.job == radon_job() && !query.radon)
        throw RequestError(message("radon: which lines? Expected @angles N"));
    if (want.job != Job::filter && want.job != radon_job()) return;
    if (want.job == Job::filter && !query.filter)
        throw RequestError(message("filter: which one? Expected @op OP and @kernel KERNEL"));
    if (!want.budget.like) return;
    constexpr double kRounding = 1e-5;
    want.budget.like.reset();
    want.budget.error = kRounding;
    want.budget.error_yields = true;
}

void expect_material(const Message& what, const Material& material) {
    for (const double share : {material.ambient, material.diffuse, material.specular})
        if (!(share >= 0 && share <= 1))
            throw RequestError(message("{}: expected three shares of light from 0 to 1", what));
    if (!(material.exponent >= 1 && material.exponent <= 1024))
        throw RequestError(message("{}: expected an exponent from 1 to 1024", what));
}

void expect_transfer(const TransferSpec& spec) {
    const auto is_share = [](double part) { return part >= 0 && part <= 1; };
    const std::vector<Transfer::Point>& points = spec.transfer.points;
    const TransferTable* const table = spec.transfer.table.get();
    bool sensible =
        (table || !points.empty()) &&
        (!spec.unit_given || (spec.transfer.unit > 0 && std::isfinite(spec.transfer.unit)));
    for (std::size_t i = 0; i < points.size(); ++i) {
        sensible = sensible && std::isfinite(points[i].value) && is_share(points[i].opacity) &&
                   (i == 0 || points[i].value >= points[i - 1].value);
        for (const double part : points[i].color) sensible = sensible && is_share(part);
    }
    if (!sensible)
        throw RequestError(
            message("{}: expected points of ascending finite values, opacities and colours from 0 "
                    "to 1, and a length above 0",
                    spec.from));
    if (spec.material) expect_material(spec.from, *spec.material);
    if (!table) return;
    if (const std::string reason = no_table(*table, points.size()); !reason.empty())
        throw RequestError(message("{}: table: {}", spec.from, reason));
    if (!spec.transfer.edges.empty())
        throw RequestError(
            message("{}: a table tells opacities by gradient; leave out gradient", spec.from));
    if (spec.values == TransferValues::labels)
        throw RequestError(message("{}: labels have no gradients; leave out the table", spec.from));
}

/// What the command line cannot say, a program can.
void expect_sensible(const Query& query) {
    const auto expect = [](bool sensible, SettingName field, const char* expected) {
        if (!sensible) throw RequestError(message("{}: expected {}", setting(field), expected));
    };
    const auto at_least_0 = [](const std::optional<double>& value) {
        return !value || *value >= 0;  // false for NaN
    };
    const auto finite = [](const std::optional<double>& value) {
        return !value || std::isfinite(*value);
    };
    const auto is_within = [](const auto& value, auto low, auto high) {
        return !value || (*value >= low && *value <= high);
    };
    expect(at_least_0(query.max_error), "max_error", "an NRMSE, at least 0");
    expect(at_least_0(query.max_time), "max_time", "seconds, at least 0");
    expect(at_least_0(query.max_memory), "max_memory", "bytes, at least 0");
    expect(at_least_0(query.planning_time), "planning_time", "seconds, at least 0");
    expect(finite(query.isovalue), "isovalue", "a finite number");
    expect(finite(query.zero), "zero", "a finite number");
    expect(finite(query.outside), "outside", "a finite number");
    expect(is_within(query.threads, 1, 1024), "threads", "1 to 1024");
    expect(is_within(query.ranks, 1, 1 << 24), "ranks", "1 to 2^24");
    expect(is_within(query.quality, 1, 100), "quality", "1 to 100");
    expect(!query.bits || *query.bits == 8 || *query.bits == 16 || *query.bits == 32, "bits",
           "8, 16 or 32");
    expect(query.repeat >= 1, "repeat", "at least 1");
    expect(is_within(query.fps, 0.01, 100.0), "fps", "0.01 to 100 pictures a second");
    expect(!query.verify || *query.verify <= 1'000'000'000, "verify", "at most 10^9 samples");
    expect(finite(query.range), "range", "a finite number");
    for (const double step : query.geometry.spacing.value_or(std::vector<double>{}))
        expect(std::isfinite(step), "spacing", "finite numbers");
    if (query.transfer && query.mode->takes_transfer) {
        expect_transfer(*query.transfer);
        expect(!query.transfer->transfer.table || (!query.shadows && !query.occlusion),
               query.shadows ? SettingName("shadows") : SettingName("occlusion"),
               "opacities by value alone, which the transfer function's table does not have");
    }
    for (const double part : query.background.value_or(std::array<double, 3>{}))
        expect(part >= 0 && part <= 1, "background", "three numbers from 0 to 1");
    for (const Light& light : query.lights)
        expect(light.towards.allFinite() && light.towards.squaredNorm() > 0 &&
                   light.intensity >= 0 && std::isfinite(light.intensity),
               "lights", "a direction other than 0,0,0 and an intensity of at least 0");
    if (query.material) expect_material(setting("material"), *query.material);
    expect(!query.phase || std::abs(*query.phase) < 1, "phase", "a number between -1 and 1");
    expect(!query.occlusion || (*query.occlusion > 0 && std::isfinite(*query.occlusion)),
           "occlusion", "a radius above 0");
    expect(!query.cue || (query.cue->per_length >= 0 && std::isfinite(query.cue->per_length)),
           "cue", "K of at least 0");
    expect(!query.background || !query.keeps_alpha, "background", "colours, or none");
    expect(!query.exposure || (*query.exposure > 0 && std::isfinite(*query.exposure)), "exposure",
           "a number above 0");
    expect(!query.transfer || !query.suiting_preset, "preset", "one, or one that suits the data");
    expect_look(query);
    if (!query.window) return;
    const WindowEnd &low = query.window->low, &high = query.window->high;
    for (const WindowEnd& end : {low, high})
        expect(end.percentile ? end.at >= 0 && end.at <= 100 : std::isfinite(end.at), "window",
               "finite values, or percentiles from 0 to 100");
    expect(low.percentile != high.percentile || low.at != high.at, "window",
           "two ends that differ; the greater one first inverts");
    if (query.window->name.empty() || query.job != Job::render) return;
    const ModeTraits& mode = *query.mode;
    const bool of_values = mode.extreme != 0 || mode.slices == ModeTraits::Slices::mean ||
                           (mode.takes_transfer && !query.transfer);
    if (!of_values)
        throw RequestError(message(
            "@window({}): is of values in Hounsfield units, which pictures of @mode({}{}) do not "
            "show; expected LO,HI",
            query.window->name, mode.name, mode.takes_transfer ? " with a transfer function" : ""));
}

}  // namespace

Request request_of(const Query& query) {
    expect_sensible(query);
    Request want;
    want.job = query.job;
    take_mode(want, query);
    take_budgets(want, query);
    take_surface(want, query);
    take_filter_budget(want, query);
    return want;
}

Query with_smoothing(Query query, const Catalogue& edges) {
    if (!query.smooth) return query;
    const bool pictured = query.job == Job::render && query.mode->first_hit && !query.isovalue;
    if (!query.labels || (query.job != Job::mesh && !pictured))
        throw RequestError(message("@smooth: of surfaces of labels only (@labels)"));
    if (!(*query.smooth >= 0 && *query.smooth <= 1))
        throw RequestError(message("@smooth: expected a number from 0 to 1"));
    for (const Transition& edge : edges) {
        if (!edge.parameters.contains("smooth")) continue;
        Demand demand;
        demand.name = edge.name;
        demand.with.set("smooth", *query.smooth);
        query.demands.via.push_back(std::move(demand));
    }
    return query;
}

store::Selection selection_of(const Query& query) {
    store::Selection selection = query.selection;
    if (!query.channel_name.empty())
        selection.channel = store::channel_named(query.channel_name, query.input, selection);
    // Padding of DICOM is no measurement: rays, sums and filters must not take it for one. A warp
    // keeps it as stored.
    if (query.job == Job::filter || query.job == radon_job())
        selection.padding = store::Padding::nothing;
    if (query.filter && is_binary(query.filter->op)) selection.nothing = 0;  // outside a mask
    if (query.job == Job::mesh && !query.labels) selection.padding = store::Padding::smallest;
    const bool of_labels = query.labels && query.mode->first_hit && !query.isovalue;
    if (query.job == Job::render && !of_labels)
        selection.padding = query.mode->takes_zero ? store::Padding::nothing
                            : query.mode->miss == ModeTraits::Miss::highest
                                ? store::Padding::largest
                                : store::Padding::smallest;
    if (query.zero) selection.nothing = *query.zero;
    return selection;
}

namespace {

/// The result of a filter lies where its input does.
Geometry take_filter(Request& want, const Query& query, const Input& input) {
    const InputGrid grid = grid_of(input);
    const Geometry geometry = geometry_of({}, grid, Job::warp);
    want.axes = grid.axes;
    want.input = grid.extent;
    want.spacing = grid.spacing;
    want.frames = 1;
    want.views = Placement(Mat4::Identity());
    want.screen = grid.extent;
    want.field = Field::linear;
    want.setting = JobSetting::of(
        filtering_of(*query.filter, {.axes = grid.axes,
                                     .spacing = {grid.spacing[0], grid.spacing[1], grid.spacing[2]},
                                     .has_unit = !input.header.unit.empty()}));
    return geometry;
}

/// What to add to vertices so that f32 holds the rest to a thousandth of a sample, which rounding
/// to its 24 bits takes from 16777 samples away on; 0 where it holds all. It is a number of few
/// digits.
Vec3 far_offset(const Mat4& place, const Extent& n) {
    constexpr double kMost = 1e-3 * 0x1p24;  // [sample]
    Vec3 low = Vec3::Constant(INFINITY), high = -low;
    for (int corner = 0; corner < 8; ++corner) {
        Vec3 at;
        for (int axis = 0; axis < 3; ++axis)
            at[axis] = (corner >> axis & 1) ? static_cast<double>(n[axis] - 1) : 0;
        at = place.topLeftCorner<3, 3>() * at + place.topRightCorner<3, 1>();
        low = low.cwiseMin(at), high = high.cwiseMax(at);
    }
    const double sample = place.topLeftCorner<3, 3>().colwise().norm().minCoeff();
    const double farthest = std::max(-low.minCoeff(), high.maxCoeff());
    if (!(farthest > kMost * sample)) return Vec3::Zero();
    const double side = std::max((high - low).maxCoeff(), sample);
    const double step = std::pow(10.0, std::floor(std::log10(side)));
    return ((low + high) / 2 / step).array().round().matrix() * step;
}

/// A mesh has one view: from indices to where the file says that samples lie.
Geometry take_place(Request& want, const Query& query, const Input& input) {
    const InputGrid grid = grid_of(input);
    if (grid.axes == 2)
        throw RequestError(fmt::format(
            "mesh: {} is an image; expected a volume (of slices in files give the folder)",
            input.name));
    if (input.channels() > 1)
        throw RequestError(message("mesh: {} has {} channels, from 0; say which by @channel",
                                   input.name, input.channels()));
    const store::Header& header = input.header;
    Mat4 place = Mat4::Identity();
    for (int axis = 0; axis < 3; ++axis) {
        const auto k = static_cast<std::size_t>(axis);
        place.col(axis).head<3>() = Vec3(header.direction[k].data()) * header.spacing[k];
    }
    place.col(3).head<3>() = Vec3(header.origin.data());
    Geometry geometry;
    geometry.offset = far_offset(place, grid.extent);
    place.col(3).head<3>() -= geometry.offset;
    geometry.views = {place};
    want.axes = grid.axes;
    want.input = grid.extent;
    want.spacing = grid.spacing;
    want.frames = 1;
    want.views = Placement(place);
    want.screen = {1, 1, 1};
    want.field = query.labels ? Field::nearest : Field::linear;
    return geometry;
}

}  // namespace

Geometry take_geometry(Request& want, const Query& query, const Input& input,
                       const std::optional<Outputs>& outputs) {
    if (want.job == Job::mesh) return take_place(want, query, input);
    if (want.job == Job::filter) return take_filter(want, query, input);
    if (want.job == radon_job()) return take_radon(want, *query.radon, input);
    const InputGrid grid = grid_of(input);
    if (want.job == Job::render && grid.axes == 2)
        throw RequestError(fmt::format(
            "render: {} is an image; expected a volume (of slices in files give the folder; warp "
            "turns images)",
            input.name));
    if (want.job == Job::render && input.channels() > 1 && input.header.colour)
        throw ColoursToMerge(
            message("render: {} holds colours; @channel(all) shows them, @channel(0) one of red, "
                    "green and blue",
                    input.name));
    if (want.job == Job::render && input.channels() > 1)
        throw RequestError(
            message("render: {} has {} channels, from 0; say which by @channel, or @channel(all), "
                    "which merges them in colours",
                    input.name, input.channels()));
    if (input.channels() > 4)
        throw RequestError(message(
            "warp: {} has {} channels, from 0, and at most 4 are kept; say which by @channel",
            input.name, input.channels()));
    GeometrySpec seen = query.geometry;
    // A picture of a plane through a grid that leans must not lean.
    seen.upright = outputs && !outputs->none() && !outputs->format().volumes;
    take_usual_size(seen, grid, want.job);
    const Geometry geometry = geometry_of(seen, grid, want.job);
    want.axes = grid.axes;
    want.input = grid.extent;
    want.spacing = grid.spacing;
    want.frames = static_cast<int>(geometry.views.size());
    want.views =
        geometry.views.size() == 1 ? Placement(geometry.views[0]) : Placement::each(geometry.views);
    want.screen = geometry.grid.extent;
    want.unit = geometry.unit;
    if (want.job == Job::render)
        want.pixel = {geometry.grid.spacing.x() / geometry.unit,
                      geometry.grid.spacing.y() / geometry.unit};
    want.eye = geometry.eye;
    take_clip(want, query.clip, grid, geometry);
    if (query.labels && query.reference && *query.reference != Field::nearest)
        throw RequestError(message(
            "@labels: of labels the reference is nearest; leave out @reference, or @labels"));
    if (query.labels)
        want.field = Field::nearest;
    else if (query.reference)
        want.field = *query.reference;
    else if (input.phantom)
        want.field = Field::formula;
    else
        want.field = input.header.labels ? Field::nearest : Field::spline;
    if (want.budget.like) want.budget.like = like_linear(want.field);
    // No filter makes a surface of labels, which one could be held against.
    if (shows_labels(want)) want.budget.like.reset();
    return geometry;
}

namespace {

/// What a window means on some data; its own percentiles of samples.
std::array<double, 2> ends_of(const Window& window, const Data& data,
                              const Statistics& statistics) {
    const auto value = [&](const WindowEnd& end) {
        if (end.percentile && !data.samples.data())
            throw RequestError(message("@window: percentiles need samples; give values"));
        return end.percentile ? percentile_of(data, statistics.low, statistics.high, end.at / 100)
                              : end.at;
    };
    return {value(window.low), value(window.high)};
}

/// A transfer function, and the kind of data that it was chosen for; null: somebody named it.
struct ChosenTransfer {
    TransferSpec spec;
    const Kind* kind = nullptr;
    std::optional<ValueWindow> window = {};  // that it was put over
};

/// The preset that suits the data; over the window, where somebody gave one.
ChosenTransfer suiting(const std::optional<Window>& window, const Data& data,
                       const Statistics& statistics, const Look& look) {
    const Kind& kind = kind_of(look);
    ChosenTransfer chosen{preset_named(kind.preset), &kind, {}};
    if (!window || look.file.labels) return chosen;
    // What is in Hounsfield units cannot be stretched.
    if (kind.window == WindowRule::own) chosen.spec = preset_named("general");
    const auto [low, high] = ends_of(*window, data, statistics);
    std::vector<Transfer::Point>& points = chosen.spec.transfer.points;
    for (Transfer::Point& point : points) point.value = low + point.value * (high - low);
    if (high < low) std::reverse(points.begin(), points.end());
    chosen.spec.values = TransferValues::data;
    chosen.window = ValueWindow{low, high};
    return chosen;
}

/// What the file says of its samples.
FileFacts facts_of(const Input& input, bool labels) {
    const store::Header& header = input.header;
    // Who says how a volume lies in the body means millimetres, and so do all that write NIfTI.
    const bool means_mm = header.anatomical || header.format == "NIfTI";
    const double said = header.unit.empty() ? 0 : store::millimetres(header.unit);
    return {.modality = header.modality,
            .format = header.format,
            .millimetres = input.phantom ? 0
                           : said > 0    ? said
                           : means_mm    ? 1
                                         : 0,
            .channels = header.channels,
            .integers = is_integer(header.type),
            .labels = labels};
}

/// The share of a window that the noise of what is brighter than background is.
std::optional<double> noise_share(const Data& data, const Statistics& statistics,
                                  const ValueWindow& window) {
    const double width = std::abs(window.high - window.low);
    const std::optional<double> noise =
        noise_of(data, statistics, std::min(window.low, window.high) + kBody * width);
    if (!noise || !(width > 0)) return std::nullopt;
    return *noise / width;
}

/// The transfer function that somebody named, or that suits the data, as values of these.
Remarks take_preset(Request& want, std::optional<Window>& window, const Query& query,
                    const Input& input, const Statistics& statistics) {
    const Data& data = *input.data;
    const FileFacts facts = facts_of(input, want.field == Field::nearest);
    const double millimetres = facts.millimetres > 0 ? facts.millimetres : 1;
    const Glance glance = glance_at(data, statistics);
    ChosenTransfer chosen;
    if (query.transfer)
        chosen.spec = *query.transfer;
    else
        chosen = suiting(window, data, statistics,
                         look_of(data, statistics, want.spacing, facts, glance));
    if (!query.transfer) window.reset();
    const auto fitted = [&](const TransferSpec& asked) {
        return suited(asked, data, statistics, want.spacing, millimetres, &glance);
    };
    Suited found;
    try {
        found = fitted(chosen.spec);
    } catch (const RequestError& error) {
        // Where nobody named the preset for labels and they are none that it can show.
        if (query.transfer || chosen.spec.values != TransferValues::labels) throw;
        chosen.spec = preset_named("general");
        found = fitted(chosen.spec);
        found.warnings.push_back(message("{}; @preset(general) is taken", error.message()));
    }
    const TransferSpec& taken = chosen.spec;
    if (taken.values == TransferValues::labels && want.field != Field::nearest)
        found.warnings.push_back(message(
            "{}: between two labels values pass through others, whose colours appear; say @labels",
            taken.from));
    if (chosen.kind && chosen.kind->is_of_labels && want.field != Field::nearest)
        found.warnings.push_back(
            message("{} may hold labels (few different values): values between them appear; "
                    "@labels shows each in its colour",
                    input.name));
    want.transfer = std::move(found.transfer);
    std::optional<double> noise;
    if (!query.gradient && chosen.kind && is_mr_of_tissue(*chosen.kind, facts) &&
        want.needs_gradients())
        noise = noise_share(data, statistics, chosen.window.value_or(glance.window));
    const bool smooths = noise && turns_normals(*noise);
    if (smooths) want.gradient = GradientScheme::sobel;
    if (!query.material && taken.material)
        want.shading.material = filled(*taken.material, query.shadows);
    const bool named = !taken.preset.empty();
    return {std::move(found.warnings), std::move(found.notices),
            TakenPreset{.name = named ? Message(taken.preset) : taken.from,
                        .file = !named,
                        .kind = chosen.kind ? chosen.kind->what : "",
                        .window = chosen.window.value_or(found.window),
                        .noise = noise,
                        .smooths = smooths}};
}

/// What a level says of the values. That of a picture lies a little lower, by more than what values
/// are rounded by, so that a plateau at the level reaches it throughout, by all filters.
std::vector<Message> take_level(Request& want, const Statistics& statistics) {
    if (!want.surface || !want.surface->isovalue) return {};
    const double level = want.level(), low = statistics.low, high = statistics.high;
    const bool is_shown = want.job == Job::render;
    if (is_shown) *want.surface->isovalue -= lowered_by(want);
    if (level > low && level <= high) return {};
    const char* so = is_shown && !want.mode->first_hit
                         ? (level > high ? "no value reaches it" : "every value reaches it")
                         : "there is no surface";
    return {message("@isovalue({:.6g}): the values go from {:.6g} to {:.6g}, so {}", level, low,
                    high, so)};
}

/// How far a value lies on the way from one to another, 0 to 1; 1 where they are the same.
double share_between(double value, double low, double high) {
    return low == high ? 1 : std::clamp((value - low) / (high - low), 0.0, 1.0);
}

/// The mean of that over some of the samples; 1 without samples.
double mean_share(const Data& data, double low, double high) {
    constexpr std::int64_t kRuns = 1 << 10, kLength = 32;
    const Drawn drawn(data, Region::all(data.what.extent), kRuns, kLength);
    double sum = 0;
    std::size_t finite = 0;
    for (const float value : drawn.values()) {
        if (!std::isfinite(value)) continue;
        sum += share_between(value, low, high);
        ++finite;
    }
    return finite > 0 ? sum / static_cast<double>(finite) : 1;
}

void take_mask(Request& want, const Data& data) {
    const Filtering* filtering = want.setting.as<Filtering>();
    if (!filtering || !is_binary(filtering->op)) return;
    Filtering with = *filtering;
    with.inside = mask_value(data);
    want.setting = JobSetting::of(std::move(with));
}

}  // namespace

namespace {

Remarks take_all_values(Request& want, std::optional<Window>& window, const Query& query,
                        const Input& input, const Statistics& statistics) {
    const Data& data = *input.data;
    want.miss = want.mode->miss == ModeTraits::Miss::lowest    ? statistics.low
                : want.mode->miss == ModeTraits::Miss::highest ? statistics.high
                                                               : 0;
    want.magnitude = std::max(std::abs(statistics.low), std::abs(statistics.high));
    if (!query.zero) want.zero = std::min(0.0, statistics.low);
    take_mask(want, data);
    std::vector<Message> warnings = take_level(want, statistics);
    if (!warnings.empty()) return {warnings};
    if (shows_labels(want)) {
        const Segments segments(input);
        Suited colored = label_colors(setting("labels"), data, want.outside, [&](double value) {
            const store::Segment* segment = segments.of(value);
            return segment ? segment->color : std::nullopt;
        });
        want.transfer = std::move(colored.transfer);
        return {std::move(colored.warnings)};
    }
    if (want.job != Job::render || !want.mode->takes_transfer) return {};
    // Far below the noise of any scanner, far above the rounding of differences.
    constexpr double kNoSurface = 1e-4;
    want.shading.least = kNoSurface * range_between(statistics.low, statistics.high);
    if (query.transfer || query.suiting_preset)
        return take_preset(want, window, query, input, statistics);
    // Without a transfer function the window is where the grey ramp runs, so it is no view of the
    // result as well.
    double low = statistics.low, high = statistics.high;
    double share = share_between(statistics.mean, low, high);
    if (window) {
        const std::array<double, 2> ends = ends_of(*window, data, statistics);
        low = ends[0], high = ends[1];
        share = mean_share(data, low, high);
        window.reset();
    }
    const int part = ramp_part(share);
    want.transfer = grey_ramp(low, high, want.spacing.minCoeff() / part);
    if (part == 1) return {};
    return {{},
            {message("@mode({}): most of the volume is dark, so the grey ramp's opacities are "
                     "for 1/{} of the smallest spacing; @transfer and @preset have their own",
                     want.mode->name, part)}};
}

/// Somebody wants them smoothed.
void expect_gradients(const Request& want) {
    if (shows_labels(want))
        throw RequestError(message("@gradient: surfaces of labels are lit by their coverage"));
    if (!want.needs_gradients())
        throw RequestError(
            message("@gradient: neither light nor opacities go by gradients here; @mode(shaded) or "
                    "@shade(phong) has light that does"));
}

}  // namespace

Remarks take_values(Request& want, std::optional<Window>& window, const Query& query,
                    const Input& input, const Statistics& statistics, bool is_viewed) {
    const Data& data = *input.data;
    const store::Header& header = input.header;
    Message about_window;
    if (window)
        about_window = take_hounsfield(*window, header, data, statistics);
    else if (is_viewed)
        window = usual_window(want, header, data, statistics);
    Remarks remarks = take_all_values(want, window, query, input, statistics);
    if (query.gradient == GradientScheme::sobel) expect_gradients(want);
    if (!about_window.empty()) remarks.warnings.push_back(about_window);
    return remarks;
}

void take_values_of(const Request& from, Request& want) {
    want.miss = from.miss;
    want.magnitude = from.magnitude;
    want.zero = from.zero;
    want.surface = from.surface;
    want.transfer = from.transfer;
    want.shading = from.shading;
    want.gradient = from.gradient;
}

int ramp_part(double share) noexcept {
    constexpr int kMostParts = 16;
    constexpr double kSparse = 1.0 / 16;
    int part = 1;
    while (part < kMostParts && share * part < kSparse) part *= 2;
    return part;
}

Transfer grey_ramp(double low, double high, double unit) {
    constexpr double kMostOpacity = 0.05;
    // A step would tell a constant from its own rounding.
    if (low == high) high = low + range_between(low, low);
    if (high < low) return {{{high, kMostOpacity, {1, 1, 1}}, {low, 0, {0, 0, 0}}}, unit, {}};
    return {{{low, 0, {0, 0, 0}}, {high, kMostOpacity, {1, 1, 1}}}, unit, {}};
}

}  // namespace edgewise
