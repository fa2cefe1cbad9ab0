#include "cli/request/make_request.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fmt/format.h>

#include "cli/machine/machine.hpp"
#include "cli/request/numbers.hpp"
#include "cli/request/percentile.hpp"
#include "graph/errors.hpp"
#include "graph/words.hpp"
#include "transitions/filters/like_linear.hpp"

namespace edgewise::cli {
namespace {

constexpr const char* kLinear = "linear";  // of --max-error: its default
constexpr std::int64_t kMostThreads = 1024;

/// The place of a word, in any case, in a list. @throws RequestError naming the nearest
int chosen(const char* option, const std::optional<std::string>& word,
           std::initializer_list<const char*> words, int otherwise) {
    if (!word) return otherwise;
    const auto found = std::find_if(words.begin(), words.end(),
                                    [&](const char* name) { return same_word(*word, name); });
    if (found != words.end()) return static_cast<int>(found - words.begin());
    throw RequestError(fmt::format("{}: '{}' is not known; {}", option, *word,
                                   instead_of(*word, {words.begin(), words.end()})));
}

void take_budgets(Wish& wish, const JobOptions& o) {
    Request& want = wish.want;
    Budget& budget = want.budget;
    if (o.max_time) budget.seconds = time_budget(*o.max_time);
    if (o.max_memory) budget.bytes = memory_budget(*o.max_memory);
    wish.memory_given = o.max_memory.has_value();
    // "The best in 50 ms": a time alone asks for the least error within it.
    const bool best_in_time = o.max_time && !o.max_error;
    want.minimize = static_cast<Minimize>(
        chosen("--minimize", o.minimize, {"time", "error", "memory"}, best_in_time ? 1 : 0));
    const bool by_default = !o.max_error && !o.max_time && want.minimize != Minimize::error;
    if (by_default || o.max_error == kLinear)
        budget.like.emplace();  // which one hangs on what the samples are
    else if (o.max_error)
        budget.error = error_budget(*o.max_error);
    if (o.range) {
        want.range = number_of("--range", *o.range);
        if (!(*want.range > 0))
            throw RequestError(fmt::format("--range: {} is not greater than 0", *o.range));
    }
    const char* variable = std::getenv("EDGEWISE_THREADS");
    const std::string threads = o.threads ? *o.threads : variable ? variable : "";
    want.threads = threads.empty()
                       ? usable_cores()
                       : static_cast<int>(whole_of(o.threads ? "--threads" : "EDGEWISE_THREADS",
                                                   threads, 1, kMostThreads));
    wish.planner = static_cast<Planner>(
        chosen("--planner", o.planner, {"estimate", "pilot", "exhaustive"}, 0));
    if (o.planning_time) {
        wish.planning_time = time_budget(*o.planning_time);
        if (wish.planner == Planner::estimate)
            throw RequestError("--planning-time: of --planner pilot and exhaustive only");
    }
    wish.strict = o.strict;
}

void take_mode(Wish& wish, const JobOptions& o) {
    Request& want = wish.want;
    if (o.mode) want.mode = mode_named(*o.mode);
    const auto only = [&](const char* option, const std::optional<std::string>& value,
                          bool ModeTraits::*takes) {
        const ModeTraits& mode = *want.mode;
        if (!value || mode.*takes) return;
        std::vector<std::string_view> names;
        for (const Mode other : modes())
            if ((*other).*takes) names.push_back(other->name);
        throw RequestError(fmt::format("{}: of --mode {} only, not of {}", option,
                                       fmt::join(names, ", "), mode.name));
    };
    only("--zero", o.zero, &ModeTraits::takes_zero);
    only("--background", o.background, &ModeTraits::takes_transfer);
    only("--transfer", o.transfer, &ModeTraits::takes_transfer);
    if (o.background) want.background = background_of(*o.background);
    if (o.zero) want.zero = number_of("--zero", *o.zero);
    if (o.outside) want.outside = number_of("--outside", *o.outside);
}

}  // namespace

Wish wish_of(const JobOptions& o) {
    Wish wish;
    wish.want.job = o.job;
    take_mode(wish, o);
    take_budgets(wish, o);
    if (o.window) wish.window = window_of(*o.window);
    if (o.verify) wish.verify = verify_count(*o.verify);
    if (o.seed) wish.seed = static_cast<std::uint64_t>(whole_of("--seed", *o.seed, 0, INT64_MAX));
    if (o.repeat) wish.repeat = static_cast<int>(whole_of("--repeat", *o.repeat, 1, 1'000'000));
    if (o.quality) wish.quality = static_cast<int>(whole_of("--quality", *o.quality, 1, 100));
    if (o.bits) {
        constexpr int kBits[] = {8, 16, 32};
        wish.bits = kBits[chosen("--bits", o.bits, {"8", "16", "32"}, 0)];
    }
    chosen("--reference", o.reference, {"spline", "linear", "nearest"}, 0);
    wish.selection = selection_of(o.selection);
    // Padding of DICOM is no measurement: rays must not take it for one. A warp keeps it as stored.
    if (o.job == Job::render)
        wish.selection.padding = wish.want.mode->takes_zero ? store::Padding::nothing
                                 : wish.want.mode->miss == ModeTraits::Miss::highest
                                     ? store::Padding::largest
                                     : store::Padding::smallest;
    if (o.zero) wish.selection.nothing = wish.want.zero;
    return wish;
}

Geometry take_geometry(Request& want, const JobOptions& o, const Input& input,
                       const std::optional<Outputs>& outputs) {
    const InputGrid grid = grid_of(input);
    if (want.job == Job::render && grid.axes == 2)
        throw RequestError(fmt::format(
            "render: {} is an image; expected a volume (warp turns images)", input.name));
    if (want.job == Job::render && input.channels() > 1)
        throw RequestError(fmt::format("render: {} has {} channels, from 0; say which by --channel",
                                       input.name, input.channels()));
    if (input.channels() > 4)
        throw RequestError(fmt::format(
            "warp: {} has {} channels, from 0, and at most 4 are kept; say which by --channel",
            input.name, input.channels()));
    GeometryWords words = o.geometry;
    // A picture of a plane through a grid that leans must not lean.
    words.upright = outputs && !outputs->none() && !outputs->format().volumes;
    const Geometry geometry = geometry_of(words, grid, want.job);
    want.axes = grid.axes;
    want.input = grid.extent;
    want.spacing = grid.spacing;
    want.frames = static_cast<int>(geometry.views.size());
    want.views =
        geometry.views.size() == 1 ? Placement(geometry.views[0]) : Placement::each(geometry.views);
    want.screen = geometry.grid.extent;
    want.unit = geometry.unit;
    want.eye = geometry.eye;
    const int named = chosen("--reference", o.reference, {"spline", "linear", "nearest"}, -1);
    if (o.labels && named >= 0 && static_cast<Field>(named) != Field::nearest)
        throw RequestError(
            fmt::format("--labels: of labels the reference is nearest, not {}; "
                        "leave out one of the two",
                        *o.reference));
    if (o.labels)
        want.field = Field::nearest;
    else if (named >= 0)
        want.field = static_cast<Field>(named);
    else if (input.phantom)
        want.field = Field::formula;
    else
        want.field = input.header.labels ? Field::nearest : Field::spline;
    if (want.budget.like) want.budget.like = like_linear(want.field);
    return geometry;
}

void take_values(Wish& wish, const JobOptions& o, const Data& data, const Statistics& statistics) {
    Request& want = wish.want;
    want.miss = want.mode->miss == ModeTraits::Miss::lowest    ? statistics.low
                : want.mode->miss == ModeTraits::Miss::highest ? statistics.high
                                                               : 0;
    want.magnitude = std::max(std::abs(statistics.low), std::abs(statistics.high));
    if (!o.zero) want.zero = std::min(0.0, statistics.low);
    if (want.job != Job::render || !want.mode->takes_transfer) return;
    const double unit = want.spacing.minCoeff();
    if (o.transfer) {
        want.transfer = load_transfer(*o.transfer, unit);
        return;
    }
    // Without a transfer function the window is where the grey ramp runs, so it is no view of the
    // result as well.
    double low = statistics.low, high = statistics.high;
    if (wish.window) {
        const auto value = [&](const WindowEnd& end) {
            if (end.percentile && !data.samples.data())
                throw RequestError("--window: percentiles need samples; give values");
            return end.percentile
                       ? percentile_of(data, statistics.low, statistics.high, end.at / 100)
                       : end.at;
        };
        low = value(wish.window->low), high = value(wish.window->high);
        wish.window.reset();
    }
    want.transfer = grey_ramp(low, high, unit);
}

}  // namespace edgewise::cli
