#include "transitions/project/adaptive_cast.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fmt/format.h>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <tbb/parallel_for.h>
#include <vector>

#include "graph/spread.hpp"
#include "transitions/filters/field_filter.hpp"
#include "transitions/filters/filter.hpp"
#include "transitions/kernels/pmr_block.hpp"
#include "transitions/kernels/ray_cast.hpp"
#include "transitions/kernels/ray_path.hpp"
#include "transitions/kernels/tap_polynomials.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/ray_cast.hpp"
#include "transitions/trials/trials.hpp"

namespace edgewise {
namespace {

// Pixels (4 i, 4 j) are corners. Square (i, j) has pixels 4 i <= x < 4 i + 4, 4 j <= y < 4 j + 4,
// and corners i, i + 1 and j, j + 1; it is judged, and interpolated, from corners i - 1 to i + 2
// and j - 1 to j + 2. Some of these lie beyond the picture: rays do not end there.
constexpr int kEvery = 4;
constexpr std::int64_t kTile = 64;     // pixels along each side of a tile
constexpr std::int64_t kCorners = 16;  // the same of corners: their rays lie far apart

/// The edge whose rays are cast.
Transition plain_cast() { return ray_cast(); }

/// Corners of one square and around it: 4 x 4, of so many channels.
struct Around {
    const float* first;  // corner (i - 1, j - 1)
    std::ptrdiff_t row;  // floats
    int channels;

    float at(int i, int j, int channel) const { return first[j * row + i * channels + channel]; }
};

/// What linear interpolation between the corners of a square errs by, judged by second differences.
float difference_of(const Around& around) {
    const auto second = [](float before, float here, float behind) {
        return std::abs((before - here) + (behind - here));
    };
    float most = 0;
    for (int c = 0; c < around.channels; ++c) {
        float across = 0, down = 0;
        bool known = true;
        for (int j = 1; j <= 2; ++j)
            for (int i = 1; i <= 2; ++i) {
                const float here = around.at(i, j, c);
                const float x = second(around.at(i - 1, j, c), here, around.at(i + 1, j, c));
                const float y = second(around.at(i, j - 1, c), here, around.at(i, j + 1, c));
                known = known && std::isfinite(x) && std::isfinite(y);
                across = std::max(across, x);
                down = std::max(down, y);
            }
        if (!known) return std::numeric_limits<float>::infinity();
        most = std::max(most, 0.125f * (across + down));
    }
    return most;
}

/// Keys' weights of the first, third and fourth of four corners at f = 0, 1/4, 1/2, 3/4 behind the
/// second, whose weight is 1 less these. All are exact in f32.
constexpr std::array<std::array<float, 3>, kEvery> kWeights = [] {
    std::array<std::array<float, 3>, kEvery> weights{};
    for (int i = 0; i < kEvery; ++i) {
        const float f = static_cast<float>(i) / kEvery, g = 1 - f;
        weights[static_cast<std::size_t>(i)] = {
            -0.5f * f * g * g, 1 - 2.5f * g * g + 1.5f * g * g * g, -0.5f * f * f * g};
    }
    return weights;
}();

/// What all four have, and what the second has where it is met, comes out as it is.
float weighed(int place, float a, float b, float c, float d) {
    const auto& weights = kWeights[static_cast<std::size_t>(place)];
    return b + (weights[0] * (a - b) + weights[1] * (c - b) + weights[2] * (d - b));
}

/// Pixels [left, right) x [top, bottom) of a square, counted from its corner.
struct Within {
    int left = 0, right = kEvery, top = 0, bottom = kEvery;
};

/// @param out  pixel (left, top)
void interpolate(const Around& around, const Within& within, float* out, std::ptrdiff_t row) {
    for (int c = 0; c < around.channels; ++c) {
        float along[4][kEvery];
        for (int j = 0; j < 4; ++j)
            for (int x = within.left; x < within.right; ++x)
                along[j][x] = weighed(x, around.at(0, j, c), around.at(1, j, c), around.at(2, j, c),
                                      around.at(3, j, c));
        for (int y = within.top; y < within.bottom; ++y)
            for (int x = within.left; x < within.right; ++x)
                out[(y - within.top) * row + (x - within.left) * around.channels + c] =
                    weighed(y, along[0][x], along[1][x], along[2][x], along[3][x]);
    }
}

/// The rays through every fourth pixel. A product with a power of two is exact, so that a corner is
/// what its pixel would be.
kernels::Rays rays_of_corners(kernels::Rays rays) {
    for (kernels::Rays::Field* field : {&rays.origin, &rays.direction, &rays.measure})
        for (std::size_t axis = 0; axis < 3; ++axis) {
            field->x[axis] *= kEvery;
            field->y[axis] *= kEvery;
        }
    return rays;
}

/// A cast of all rays of a view, and of the corners. Lives as long as its parts are used.
class Casts {
 public:
    Casts(const Data& in, const Request& want, int view, const Filter& filter, double step)
        : optics_(optics_of(want, in.what.values)),
          kept_(kept_of(in.what, want, view)),
          cue_(cue_of(want, view, -0.5)) {
        all_ = {.volume = rule_grid(in, want),
                .hold = kernels::hold_of(filter),
                .rule = want.mode->combine,
                .other = want.mode->rule,
                .rays = rays_of(in.what, want, view, -0.5),
                .kept = kept_ ? &*kept_ : nullptr,
                .step = step,
                .unit = want.unit,
                .zero = want.zero,
                .miss = rule_miss(want),
                .level = want.level(),
                .optics = &optics_,
                .cue = cue_ ? &*cue_ : nullptr,
                .bound = kTerminated};
        if (all_.hold == kernels::Hold::weighted)
            all_.weights = &kernels::TapPolynomials::of(filter);
        corners_ = all_;
        corners_.rays = rays_of_corners(all_.rays);
    }
    Casts(const Casts&) = delete;
    Casts& operator=(const Casts&) = delete;

    const kernels::RayCast& all() const { return all_; }
    /// Whether rays through the corners of a square meet the data. Then all of the square do: what
    /// rays see of the data is convex.
    bool sees_square(std::int64_t i, std::int64_t j) const {
        for (const std::int64_t y : {j, j + 1})
            for (const std::int64_t x : {i, i + 1})
                if (!ray_path(all_, static_cast<double>(x * kEvery),
                              static_cast<double>(y * kEvery))
                         .hit())
                    return false;
        return true;
    }
    const kernels::RayCast& corners() const { return corners_; }

 private:
    kernels::Optics optics_;
    std::optional<kernels::Kept> kept_;
    std::optional<kernels::RayCue> cue_;
    kernels::RayCast all_, corners_;
};

// What is drawn of a picture, so that the planner knows how smooth it is. Facts:
//  - "adaptive/spread": the range of the values that were met;
//  - "adaptive/cast/K": of the lengths of all rays in the data those of squares that differ by more
//    than 2^-K of it;
//  - "adaptive/error/K": RMS error of a picture whose other squares are interpolated, an upper
//    estimate;
//  - "adaptive/missed": what squares that were not drawn may add to it. Detail may lie between the
//    corners of a square, so that they say nothing of it. Squares with such detail that are rarer
//    than three of those that were drawn may have been missed. One is taken to err as the worst of
//    all drawn squares within the data would, whatever its corners say.

constexpr int kFirstBound = 3, kLastBound = 14;
constexpr int kSquares = 128;  // drawn, that meet the data
constexpr int kTries = 16;     // for each of them

constexpr Fact kSpread{"adaptive/spread"}, kMissed{"adaptive/missed"};
constexpr FactFamily kShareCast{"adaptive/cast"}, kErrorOf{"adaptive/error"};

/// Between which two of the bounds a tolerance lies, and how far from the first, which is larger.
struct BoundsAround {
    int larger, smaller;
    double part;

    BoundsAround(double tolerance, double spread) {
        const double exact =
            tolerance > 0 && spread > 0 ? std::log2(spread / tolerance) : kLastBound;
        const double k = std::clamp(exact, double(kFirstBound), double(kLastBound));
        larger = static_cast<int>(std::floor(k));
        smaller = static_cast<int>(std::ceil(k));
        part = k - larger;
    }
};

/// [value]. By the range of the drawn pixels, which are drawn for every request.
double tolerance_of(const Offer& offer, const Ask& ask) {
    return offer.with.number("tolerance") * ask.scene.fact(kSpread).value_or(ask.scene.range);
}

/// The share of rays that are cast for themselves, by their lengths.
std::optional<double> share_cast(double tolerance, const Scene& scene) {
    const auto spread = scene.fact(kSpread);
    if (!spread) return {};
    const BoundsAround bounds(tolerance, *spread);
    const double few = scene.fact(kShareCast(bounds.larger)).value_or(1),
                 many = scene.fact(kShareCast(bounds.smaller)).value_or(1);
    return std::clamp(few + bounds.part * (many - few), 0.0, 1.0);
}

std::string not_smooth(const Representation& from, const Ask& ask) {
    constexpr std::int64_t kLeast = 32;
    const Request& want = ask.want;
    const ModeTraits& mode = *want.mode;
    if (mode.first_hit || mode.skips != ModeTraits::Levels::none)
        return fmt::format("mode {} leaves out most samples already, and has edges", mode.name);
    if (want.shading.on()) return "light differs from pixel to pixel";
    if (is_spread(from)) return "over ranks: squares would be cast in pieces";
    if (std::min(want.screen.x, want.screen.y) < kLeast)
        return fmt::format("{} x {} pixels; fewer than {} have hardly a square between edges",
                           want.screen.x, want.screen.y, kLeast);
    return {};
}

Offer offer_adaptive(const Representation& from, const Ask& ask, const Parameters& with) {
    constexpr double kMost = 0.8;
    if (filter_named(with.word("filter")).taps == 1)
        return Offer::no("nearest samples have steps that are as steep as pixels are narrow");
    Offer offer = plain_cast().offer(from, ask, with);
    if (!offer.refused.empty()) return offer;
    if (std::string reason = not_smooth(from, ask); !reason.empty())
        return Offer::no(std::move(reason));
    if (const auto share = share_cast(tolerance_of(offer, ask), ask.scene); share && *share > kMost)
        return Offer::no(fmt::format("{:.0f} % of the rays differ by more than {:.3g}",
                                     100 * *share, tolerance_of(offer, ask)));
    return offer;
}

Work work_adaptive(const Offer& offer, const Ask& ask, int view) {
    // Rays of corners share few lines, and take about twice as long as others.
    constexpr double kRays = 2.2 / (kEvery * kEvery), kLines = 0.3, kGuess = 0.3;
    // Eight products and sums a pixel, second differences of a square.
    constexpr double kInterpolated = 12, kRound = 40;
    const double pixels = static_cast<double>(offer.to.samples()) * offer.to.channels;
    const double cast = share_cast(tolerance_of(offer, ask), ask.scene).value_or(kGuess);
    const double rays = std::min(1.0, cast + kRays);
    Work work = plain_cast().work(offer, ask, view);
    work.operations = rays * work.operations + kInterpolated * (1 - cast) * pixels +
                      kRound * pixels / (kEvery * kEvery);
    work.masked *= rays;
    work.gathers *= rays;
    work.streamed += 2 * kRays * offer.to.bytes();
    for (Lines* lines : {&work.lines, &work.other_lines})
        lines->count *= std::min(1.0, cast + kLines);
    work.workspace += kRays * offer.to.bytes();
    return work;
}

Error error_adaptive(const Offer& offer, const Ask& ask) {
    Error error = plain_cast().error(offer, ask);
    const double tolerance = tolerance_of(offer, ask);
    const auto spread = ask.scene.fact(kSpread);
    if (!spread) return Error::unknown();
    // Of the larger bound: more squares are interpolated.
    const int bound = BoundsAround(tolerance, *spread).larger;
    const double missed = std::max(2 * tolerance * std::sqrt(3.0 / kSquares),
                                   ask.scene.fact(kMissed).value_or(*spread));
    error.bias += std::hypot(ask.scene.fact(kErrorOf(bound)).value_or(tolerance), missed);
    return error;
}

/// What a square would be interpolated from, and how wrong that is.
struct Drawn {
    float difference = 0;
    double squares = 0;  // of the errors of its pixels, whose rays meet the data
    double pixels = 0;   // so many do
    double length = 0;   // of their rays in the data [cell]
    double low = std::numeric_limits<double>::infinity(), high = -low;  // of their values
};

Drawn drawn_square(const Casts& casts, int channels, std::int64_t i, std::int64_t j) {
    constexpr int kMostChannels = 4;
    std::array<float, kEvery * kEvery * kMostChannels> corners, exact, between;
    const std::ptrdiff_t row = kEvery * channels;
    kernels::ray_cast(casts.corners(), i - 1, j - 1, 4, 4, corners.data(), row);
    kernels::ray_cast(casts.all(), i * kEvery, j * kEvery, kEvery, kEvery, exact.data(), row);
    const Around around{corners.data(), row, channels};
    interpolate(around, {}, between.data(), row);
    Drawn drawn{.difference = casts.sees_square(i, j) ? difference_of(around)
                                                      : std::numeric_limits<float>::infinity()};
    for (int p = 0; p < kEvery * kEvery; ++p) {
        const double x = static_cast<double>(i * kEvery + p % kEvery),
                     y = static_cast<double>(j * kEvery + p / kEvery);
        const kernels::RayPath path = ray_path(casts.all(), x, y);
        if (!path.hit()) continue;
        ++drawn.pixels;
        drawn.length += path.length;
        for (int c = 0; c < channels; ++c) {
            const auto at = static_cast<std::size_t>(p * channels + c);
            const double error = double(between[at]) - exact[at];
            drawn.squares += error * error / channels;
            drawn.low = std::min(drawn.low, double(exact[at]));
            drawn.high = std::max(drawn.high, double(exact[at]));
        }
    }
    return drawn;
}

/// RMS error where squares that differ by no more than `most` are interpolated: an upper estimate.
/// @param jumps  pixels are one of two answers: a square with four equal corners may hide another
///               one, and as many as three of those that were drawn may do so beside what was seen.
///               Each errs as the wrong ones that were drawn do, and by one pixel at least.
double error_of_drawn(const std::vector<Drawn>& all, double most, bool jumps) {
    double squares = 0, pixels = 0, deviations = 0, wrong_pixels = 0;
    const auto wrong = [most](const Drawn& drawn) {
        return drawn.difference < most ? drawn.squares : 0;
    };
    for (const Drawn& drawn : all) {
        squares += wrong(drawn);
        pixels += drawn.pixels;
        if (wrong(drawn) > 0) wrong_pixels += drawn.pixels;
    }
    if (pixels == 0) return 0;
    double hidden = 1.0 / (kEvery * kEvery);
    if (wrong_pixels > 0) hidden = std::max(hidden, squares / wrong_pixels);
    const double missed = jumps ? 3.0 / static_cast<double>(all.size()) * hidden : 0;
    for (const Drawn& drawn : all)
        deviations += std::pow(wrong(drawn) - squares / pixels * drawn.pixels, 2);
    return std::sqrt((squares + 2 * std::sqrt(deviations)) / pixels + missed);
}

void count_adaptive(const Data& input, const Request& want, std::map<std::string, double>& facts,
                    std::pmr::memory_resource* /*memory*/) {
    if (!want.job->of_rays() || want.axes != 3 || input.what.channels != 1 ||
        input.what.type == Type::c64)
        return;
    const Scene unseen;
    if (!not_smooth(input.what, {want, unseen}).empty()) return;
    // As a filter reads samples; splines are smoother.
    const Filter& filter =
        field_filter(want.field == Field::nearest ? Field::nearest : Field::linear);
    std::vector<Drawn> drawn(kSquares);
    // Spread evenly (Roberts 2018).
    constexpr std::array<double, 3> ratio = {0.8191725, 0.6710436, 0.5497005};
    tbb::parallel_for(0, kSquares, [&](int n) {
        Drawn& square = drawn[static_cast<std::size_t>(n)];
        for (int round = 0; round < kTries && square.pixels == 0; ++round) {
            const auto at = [&](std::size_t axis, std::int64_t range) {
                const int place = n + round * kSquares + 1;
                return static_cast<std::int64_t>(std::fmod(0.5 + ratio[axis] * place, 1.0) *
                                                 static_cast<double>(range));
            };
            const Casts casts(input, want, static_cast<int>(at(2, want.frames)), filter, 1);
            square = drawn_square(casts, want.mode->channels, at(0, want.screen.x) / kEvery,
                                  at(1, want.screen.y) / kEvery);
        }
    });
    double low = std::numeric_limits<double>::infinity(), high = -low, length = 0, worst = 0;
    int met = 0;
    for (const Drawn& each : drawn) {
        length += each.length;
        met += each.pixels > 0;
        // At a face of the data all rays of a square are cast.
        if (each.pixels > 0 && std::isfinite(each.difference))
            worst = std::max(worst, each.squares / each.pixels);
        low = std::min(low, each.low);
        high = std::max(high, each.high);
    }
    if (!(high > low) || !std::isfinite(high - low)) return;
    facts[kSpread] = high - low;
    facts[kMissed] = std::sqrt(std::min(1.0, 3.0 / met) * worst);
    for (int bound = kFirstBound; bound <= kLastBound; ++bound) {
        const double most = std::ldexp(high - low, -bound);
        double cast = 0;
        for (const Drawn& each : drawn)
            if (!(each.difference < most)) cast += each.length;
        facts[kShareCast(bound)] = cast / length;
        facts[kErrorOf(bound)] = error_of_drawn(drawn, most, want.mode->threshold != nullptr);
    }
}

/// The corners that the squares of a region need.
class CornersOf {
 public:
    CornersOf(const Region& region, int channels, std::pmr::memory_resource* memory)
        : box_{{region.begin[0] / kEvery - 1, region.begin[1] / kEvery - 1, 0},
               {(region.end[0] - 1) / kEvery + 3, (region.end[1] - 1) / kEvery + 3, 1}},
          channels_(channels),
          row_(box_.extent().x * channels),
          values_(static_cast<std::size_t>(row_ * box_.extent().y), memory) {}
    void cast(const kernels::RayCast& by, const Context& context) {
        for_tiles(box_, kCorners, kCorners, context, [&](const Region& tile) {
            const Extent size = tile.extent();
            kernels::ray_cast(by, tile.begin[0], tile.begin[1], size.x, size.y,
                              at(tile.begin[0], tile.begin[1]), row_);
        });
    }
    Around around(std::int64_t i, std::int64_t j) { return {at(i - 1, j - 1), row_, channels_}; }

 private:
    float* at(std::int64_t i, std::int64_t j) {
        return values_.data() + (j - box_.begin[1]) * row_ + (i - box_.begin[0]) * channels_;
    }
    Region box_;
    int channels_;
    std::ptrdiff_t row_;
    kernels::Block<float> values_;
};

void run_adaptive(const Offer& offer, const Ask& ask, const Data& in, Data& out,
                  const Region& region, Context& context) {
    const Request& want = ask.want;
    const int channels = out.what.channels;
    const Casts casts(in, want, context.view, filter_named(offer.with.word("filter")),
                      offer.with.number("step"));
    CornersOf corners(region, channels, context.memory);
    corners.cast(casts.corners(), context);
    const auto tolerance = static_cast<float>(tolerance_of(offer, ask));
    const std::int64_t row = out.row();
    for_tiles(region, kTile, kTile, context, [&](const Region& tile) {
        const auto cast = [&](std::int64_t left, std::int64_t right, std::int64_t top,
                              std::int64_t bottom) {
            if (left < right)
                kernels::ray_cast(casts.all(), left, top, right - left, bottom - top,
                                  out.at<float>(left, top, 0), row);
        };
        for (std::int64_t j = tile.begin[1] / kEvery; j * kEvery < tile.end[1]; ++j) {
            const std::int64_t top = std::max(j * kEvery, tile.begin[1]),
                               bottom = std::min((j + 1) * kEvery, tile.end[1]);
            // Squares beside one another are cast together.
            std::int64_t waiting = tile.begin[0];
            for (std::int64_t i = tile.begin[0] / kEvery; i * kEvery < tile.end[0]; ++i) {
                const Around around = corners.around(i, j);
                if (!(difference_of(around) < tolerance) || !casts.sees_square(i, j)) continue;
                const std::int64_t left = std::max(i * kEvery, tile.begin[0]),
                                   right = std::min((i + 1) * kEvery, tile.end[0]);
                cast(waiting, left, top, bottom);
                const auto inside = [&](std::int64_t pixel, std::int64_t square) {
                    return static_cast<int>(pixel - square * kEvery);
                };
                interpolate(around,
                            {inside(left, i), inside(right, i), inside(top, j), inside(bottom, j)},
                            out.at<float>(left, top, 0), row);
                waiting = right;
            }
            cast(waiting, tile.end[0], top, bottom);
        }
        const Extent size = tile.extent();
        give_sign(want, out.at<float>(tile.begin[0], tile.begin[1], 0), size.x, size.y, row);
    });
}

}  // namespace

Transition adaptive_cast() {
    Transition edge;
    edge.name = "project.adaptive_cast";
    edge.source = "Levoy 1990; Keys 1981";
    edge.joins = plain_cast().joins;
    edge.parameters = {
        {"filter", any_filter({"foh", "bspline3"})},
        {"step", number(0.01, 4, {1}, "distance of samples, in the smallest spacing")},
        {"tolerance",
         number(0, 1, {0.0003, 0.004},
                "what linear interpolation of a square may err by, share of the range")}};
    edge.offer = offer_adaptive;
    edge.work = work_adaptive;
    edge.error = error_adaptive;
    edge.count = count_adaptive;
    edge.parts = [](const Offer& offer, const Ask&) {
        return Partition{.kind = Partition::output,
                         .leaf = {offer.to.extent.x, offer.to.extent.y, 1}};
    };
    edge.run = run_adaptive;
    edge.trials = [] { return picture_trials(Combine::over); };
    edge.factors = {{"", 0.53}};  // a guess: as project.ray_cast, whose samples it shares
    return edge;
}

}  // namespace edgewise
