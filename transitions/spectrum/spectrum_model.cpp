#include "transitions/spectrum/spectrum_model.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "reference/stored.hpp"
#include "scene/scene.hpp"
#include "transitions/kernels/spectrum.hpp"
#include "transitions/spectrum/forward.hpp"
#include "transitions/spectrum/lost_band.hpp"
#include "transitions/spectrum/pixel_of_sum.hpp"
#include "transitions/spectrum/projection.hpp"

namespace edgewise {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kFine = 64;  // places a sample at which a step is tabulated
// Of a spectrum of 256^3 samples, over its root mean square: 1.7e-7 (benchmarks/transforms.cpp).
constexpr double kSpectrumRounding = 2e-7;
constexpr double kFaceStep = 0.125;  // [sample]: the error changes its sign every sample

/// Sum of the window's transform over all x + m, m whole, by Poisson's rule: of a window that lies
/// on samples.
double faded_everywhere(const kernels::KaiserBessel& window, double x) {
    const int half = window.width() / 2;
    double sum = 0;
    for (int k = -half; k <= half; ++k) {
        // At its ends an even window is cut: a jump counts half.
        const bool end = 2 * std::abs(k) == window.width();
        sum += window(k) * (end ? 0.5 : 1) * std::cos(2 * kPi * k * x);
    }
    return sum;
}

/// What the last tap adds that has no other to make it symmetric, where all taps fall on samples.
double turned(const kernels::KaiserBessel& window, double x) {
    if (window.width() % 2 != 0) return 0;
    return std::sin(kPi * window.width() * x) * window(0.5 * window.width());
}

/// Mean square of a window over that of its transform in the middle: what reading between the
/// samples of a spectrum leaves of the variance of white noise, along one axis.
double read_noise(const kernels::KaiserBessel& window) {
    constexpr int kPlaces = 512;
    double sum = 0;
    for (int i = 0; i < kPlaces; ++i)
        sum += std::pow(window(window.width() * ((i + 0.5) / kPlaces - 0.5)), 2);
    return sum * window.width() / kPlaces / std::pow(window.transform(0), 2);
}

/// The field through samples that are 1 at u <= 0 and 0 at u >= 1, as the slice has it.
double step_through_samples(double u, Field field, int reach) {
    if (field == Field::linear) return std::clamp(1 - u, 0.0, 1.0);
    if (field != Field::spline) {
        // Of a field without samples the band-limited one, whose ringing ends nowhere: it is faded.
        double sum = 0;
        const int first = static_cast<int>(std::floor(u)) - reach;
        for (int n = first; n <= 0; ++n) {
            const double d = kPi * (u - n), fade = std::cos(0.5 * kPi * (u - n) / (reach + 1));
            if (std::abs(u - n) < reach + 1)
                sum += (std::abs(d) < 1e-9 ? 1 : std::sin(d) / d) * fade * fade;
        }
        return sum;
    }
    const double pole = std::numbers::sqrt3 - 2;
    const auto coefficient = [pole](std::int64_t i) {
        // Sums of the inverse kernel sqrt(3) pole^|k| over the samples that are 1.
        const double tail = std::numbers::sqrt3 / (1 - pole);
        return i > 0 ? tail * std::pow(pole, static_cast<double>(i))
                     : 1 - tail * std::pow(pole, static_cast<double>(1 - i));
    };
    const double cell = std::floor(u), f = u - cell, g = 1 - f;
    const auto i = static_cast<std::int64_t>(cell);
    return (g * g * g * coefficient(i - 1) + (4 - 6 * f * f + 3 * f * f * f) * coefficient(i) +
            (4 - 6 * g * g + 3 * g * g * g) * coefficient(i + 1) + f * f * f * coefficient(i + 2)) /
           6;
}

/// The same of the slice, which knows a field up to 3/4 of a cycle a sample: the integral of the
/// field's response times the spectrum of the samples, 1 / (1 - exp(2 pi i f)), up to there.
/// @param places  u, kFine of them a sample
std::vector<double> cut_step(Field field, const std::vector<double>& places) {
    constexpr double kCutoff = 0.75;
    constexpr int kFrequencies = 400;  // midpoints; leave 1e-7
    std::vector<double> step(places.size(), 0.5);
    for (int i = 0; i < kFrequencies; ++i) {
        const double f = (i + 0.5) / kFrequencies * kCutoff;
        const double sinc = std::sin(kPi * f) / (kPi * f), square = sinc * sinc;
        const double response =
            field == Field::linear ? square : 3 * square * square / (2 + std::cos(2 * kPi * f));
        const double weight = response * kCutoff / kFrequencies, slope = 1 / std::tan(kPi * f);
        const std::complex<double> turn = std::polar(1.0, 2 * kPi * f / kFine);
        std::complex<double> wave = std::polar(1.0, 2 * kPi * f * places.front());
        for (double& sum : step) {
            sum += weight * (wave.real() - slope * wave.imag());
            wave *= turn;
        }
    }
    return step;
}

/// Where a box lies on the screen along x or y [pixel].
struct Along {
    double low = 1e300, high = -1e300;
};
Along shadow_of(const Mat4& view, const Region& box, int along) {
    Along shadow;
    for (int corner = 0; corner < 8; ++corner) {
        double seen = view(along, 3);
        for (int axis = 0; axis < 3; ++axis)
            seen +=
                view(along, axis) *
                (static_cast<double>(corner >> axis & 1 ? box.end[axis] : box.begin[axis]) - 0.5);
        shadow.low = std::min(shadow.low, seen);
        shadow.high = std::max(shadow.high, seen);
    }
    return shadow;
}

std::int64_t size_along(const Region& box, int axis) { return box.end[axis] - box.begin[axis]; }

}  // namespace

const std::vector<kernels::KaiserBessel>& SpectrumRays::tried() {
    static const std::vector<kernels::KaiserBessel> all = {{4, kTriedPadding}, {6, kTriedPadding}};
    return all;
}

SpectrumRays::SpectrumRays(const Request& want, const Data& input, const Statistics& statistics,
                           const Region& box, std::vector<kernels::KaiserBessel> windows)
    : want_(want),
      input_(input),
      windows_(std::move(windows)),
      empty_(statistics.commonest),
      box_(box),
      // A step's error is 3e-4 there; that of a band-limited step hardly fades.
      reach_(want.field == Field::formula ? 16 : 6) {
    for (int view = 0; view < want.frames; ++view)
        to_input_.push_back(want.views.at(view).inverse().matrix());
    const Extent period = picture_period_of(want);
    period_ = {static_cast<double>(period.x), static_cast<double>(period.y)};
    std::vector<double> places;
    for (int i = 0; i <= (2 * reach_ + 2) * kFine; ++i) {
        places.push_back(static_cast<double>(i) / kFine - reach_ - 0.5);
        step_.push_back(step_through_samples(places.back(), want.field, reach_));
    }
    if (want.field == Field::spline || want.field == Field::linear) {
        lost_ = step_;
        step_ = cut_step(want.field, places);
        for (std::size_t i = 0; i < lost_.size(); ++i) lost_[i] = step_[i] - lost_[i];
    }
    for (int axis = 0; axis < 3; ++axis) weights_[axis] = weights_along(axis);
    for (std::size_t w = 0; w < windows_.size(); ++w) read_[w] = read_noise(windows_[w]);
}

SpectrumRays::Weights SpectrumRays::weights_along(int axis) const {
    const std::int64_t n = size_along(box_, axis);
    const kernels::SpectrumShape shape(box_.extent(), windows_.front());  // all pad alike
    Weights weights{.period = static_cast<double>(shape.period[axis]),
                    .of = {},
                    .turned = {},
                    .table = {},
                    .grown = {}};
    for (int repetition = -kRepetitions; repetition <= kRepetitions; ++repetition)
        for (std::int64_t i = 0; i < n; ++i) {
            const double x = static_cast<double>(i - n / 2) / weights.period;
            auto& of = weights.of.emplace_back();
            if (repetition == 0) {
                weights.turned.emplace_back();
                weights.table.emplace_back();
                weights.grown.emplace_back();
            }
            for (std::size_t w = 0; w < windows_.size(); ++w) {
                const kernels::KaiserBessel& window = windows_[w];
                const double here = window.transform(x);
                // In the middle stands what all repetitions together leave on one line.
                of[w] = repetition == 0 ? faded_everywhere(window, x) / here - 1
                                        : window.transform(x + repetition) / here;
                if (repetition != 0) continue;
                weights.turned.back()[w] = turned(window, x) / here;
                weights.grown.back()[w] = window.transform(0) / here;
                // Of the triangle the table is exact.
                if (window.shape() > 0)
                    weights.table.back()[w] =
                        -std::pow(kPi * x / (1 << kernels::tap_bits(window.width())), 2) / 3;
            }
        }
    return weights;
}

SpectrumRays::Stretch1d SpectrumRays::within(const Line& line, const Region& box,
                                             double wider) const {
    Stretch1d span{-std::numeric_limits<double>::infinity(),
                   std::numeric_limits<double>::infinity()};
    for (int axis = 0; axis < 3; ++axis) {
        const double first = static_cast<double>(box.begin[axis]) - 0.5 - wider - line.origin[axis];
        const double last = static_cast<double>(box.end[axis]) - 0.5 + wider - line.origin[axis];
        const double d = line.direction[axis];
        if (first > last) return {1, 0};
        if (std::abs(d) < 1e-12) {
            if (first > 0 || last < 0) return {1, 0};
            continue;
        }
        span.low = std::max(span.low, std::min(first / d, last / d));
        span.high = std::min(span.high, std::max(first / d, last / d));
    }
    return span;
}

template <class Body>
void SpectrumRays::each_sample(const Line& line, const Body& body) const {
    const Stretch1d inside = within(line, box_, 0);
    const double low = inside.low, high = inside.high;
    if (!(low < high)) return;
    const double pieces = std::max(1.0, std::ceil(high - low)), piece = (high - low) / pieces;
    const Extent& n = want_.input;
    with_stored_type(input_.what.type, [&](auto zero) {
        const auto* stored = input_.as<decltype(zero)>();
        for (double k = 0.5; k < pieces; ++k) {
            const Vec3 p = line.origin + (low + k * piece) * line.direction;
            std::array<std::int64_t, 3> at;
            for (int i = 0; i < 3; ++i)
                at[i] = std::clamp(static_cast<std::int64_t>(std::floor(p[i] + 0.5)), box_.begin[i],
                                   box_.end[i] - 1);
            const double value =
                input_.what.values(as_double(stored[at[0] + n.x * (at[1] + n.y * at[2])]));
            for (int i = 0; i < 3; ++i) at[i] -= box_.begin[i];
            body(at, (value - empty_) * piece);
        }
    });
}

void SpectrumRays::add_ghost(const Line& line, int axis, int repetition, Ghosts& sum) const {
    // The line, seen from the repetition, through the box itself.
    const Weights& weights = weights_[axis];
    Line through = line;
    through.origin[axis] -= repetition * weights.period;
    const auto* of = weights.of.data() + (repetition + kRepetitions) * size_along(box_, axis);
    each_sample(through, [&](const std::array<std::int64_t, 3>& at, double value) {
        const auto& weight = of[at[axis]];
        for (std::size_t w = 0; w < weight.size(); ++w) sum.seen[w] += value * weight[w];
        if (repetition != 0) return;
        const auto& across = weights.turned[at[axis]];
        for (std::size_t w = 0; w < across.size(); ++w) sum.turned[w] += value * across[w];
    });
}

void SpectrumRays::add_itself(const Line& line, const std::array<bool, 3>& between,
                              Ghosts& sum) const {
    each_sample(line, [&](const std::array<std::int64_t, 3>& at, double value) {
        for (std::size_t w = 0; w < windows_.size(); ++w) {
            double less = 0, grown = 1;
            for (int axis = 0; axis < 3; ++axis) {
                if (between[axis]) less += weights_[axis].table[at[axis]][w];
                grown *= weights_[axis].grown[at[axis]][w];
            }
            sum.seen[w] += value * less;
            sum.noise[w] += std::pow(kSpectrumRounding * value * grown, 2) * read_[w];
        }
    });
}

SpectrumRays::Ghosts SpectrumRays::ghosts(int view, double x, double y) const {
    const Mat4 &map = to_input_[static_cast<std::size_t>(view)],
               &to_screen = want_.views.at(view).matrix();
    const std::array<Along, 2> shadow = {shadow_of(to_screen, box_, 0),
                                         shadow_of(to_screen, box_, 1)};
    const Vec3 along = map.topLeftCorner<3, 3>().col(2);
    const auto line_at = [&](double u, double v) {
        return Line{map.topLeftCorner<3, 3>() * Vec3(u, v, 0) + map.topRightCorner<3, 1>(), along};
    };
    Ghosts sum{};
    std::array<bool, 3> between{};  // samples of the spectrum; else on them, where tables are exact
    for (int axis = 0; axis < 3; ++axis) {
        const double moved_x = to_screen(0, axis) * weights_[axis].period;
        const double moved_y = to_screen(1, axis) * weights_[axis].period;
        if (std::hypot(moved_x, moved_y) < 0.1) {  // rays along the axis meet all repetitions
            add_ghost(line_at(x, y), axis, 0, sum);
            continue;
        }
        between[axis] = true;
        for (int m = -kRepetitions; m <= kRepetitions; ++m) {
            if (m == 0) continue;
            // Pixels a period of the picture apart, of which the repetition's shadow covers some.
            const double last_x = std::floor((shadow[0].high + m * moved_x - x) / period_[0]);
            const double last_y = std::floor((shadow[1].high + m * moved_y - y) / period_[1]);
            for (double i = std::ceil((shadow[0].low + m * moved_x - x) / period_[0]); i <= last_x;
                 ++i)
                for (double j = std::ceil((shadow[1].low + m * moved_y - y) / period_[1]);
                     j <= last_y; ++j)
                    add_ghost(line_at(x + i * period_[0], y + j * period_[1]), axis, m, sum);
        }
    }
    add_itself(line_at(x, y), between, sum);
    return sum;
}

double SpectrumRays::step_at(double u) const {
    const double at = (u + reach_ + 0.5) * kFine;
    if (at < 0) return 1;
    if (at + 1 >= static_cast<double>(step_.size())) return 0;
    const auto i = static_cast<std::size_t>(at);
    return step_[i] + (at - static_cast<double>(i)) * (step_[i + 1] - step_[i]);
}

double SpectrumRays::lost_at(double u) const {
    const auto of_step = [&](double at) {
        const double i = (at + reach_ + 0.5) * kFine;
        return i < 0 || i + 0.5 >= static_cast<double>(lost_.size())
                   ? 0
                   : lost_[static_cast<std::size_t>(i + 0.5)];
    };
    return of_step(u) - of_step(u + 1);
}

double SpectrumRays::line_sum(int axis, std::array<std::int64_t, 3> at) const {
    const Extent& n = want_.input;
    const std::int64_t stride = axis == 0 ? 1 : axis == 1 ? n.x : n.x * n.y;
    at[axis] = 0;
    const std::int64_t first = at[0] + n.x * (at[1] + n.y * at[2]);
    double sum = 0;
    for (std::int64_t i = 0; i < n[axis]; ++i) sum += value_at(input_, first + i * stride) - empty_;
    return sum;
}

std::optional<double> SpectrumRays::beyond(const RaySpan& ray) const {
    int along = 0;
    for (int axis = 1; axis < 3; ++axis)
        if (std::abs(ray.direction[axis]) > std::abs(ray.direction[along])) along = axis;
    const double speed = std::abs(ray.direction[along]);
    for (int axis = 0; axis < 3; ++axis)
        if (axis != along && std::abs(ray.direction[axis]) > 1e-6 * speed) return {};
    if (lost_.empty()) return {};
    std::array<std::int64_t, 3> nearest{};
    for (int axis = 0; axis < 3; ++axis)
        nearest[axis] =
            std::clamp<std::int64_t>(std::llround(ray.origin[axis]), 0, want_.input[axis] - 1);
    double sum = 0;
    for (int axis = 0; axis < 3; ++axis) {
        if (axis == along) continue;
        const double p = ray.origin[axis];
        for (auto i = static_cast<std::int64_t>(std::ceil(p)) - reach_;
             i <= static_cast<std::int64_t>(std::floor(p)) + reach_; ++i) {
            std::array<std::int64_t, 3> at = nearest;
            at[axis] = std::clamp<std::int64_t>(i, 0, want_.input[axis] - 1);
            sum += lost_at(p - static_cast<double>(i)) * line_sum(along, at);
        }
    }
    return sum / speed;
}

double SpectrumRays::sample(const std::array<std::int64_t, 3>& at) const {
    const Extent& n = want_.input;
    return value_at(input_, at[0] + n.x * (at[1] + n.y * at[2])) - empty_;
}

double SpectrumRays::weight_at(double u) const { return step_at(u) - step_at(u + 1); }

double SpectrumRays::wrong_along(int axis, const Vec3& p, std::array<std::int64_t, 3> at) const {
    const std::int64_t last = want_.input[axis] - 1;
    const bool formula = want_.field == Field::formula;
    // Beyond the outermost centres the field keeps its value, and samples are mirrored there. A
    // formula has no samples and is continued.
    const double held = formula ? p[axis] : std::clamp(p[axis], 0.0, static_cast<double>(last));
    double sum = 0;
    const auto middle = static_cast<std::int64_t>(std::floor(p[axis]));
    for (std::int64_t n = middle - reach_; n <= middle + reach_ + 1; ++n) {
        const bool inside = n >= 0 && n <= last;
        const auto place = static_cast<double>(n);
        const double weight = (inside ? weight_at(p[axis] - place) : 0) - weight_at(held - place);
        if (weight == 0) continue;
        std::int64_t from = std::clamp<std::int64_t>(n, 0, last);
        if (!formula && last > 0) {
            const std::int64_t period = 2 * last, k = ((n % period) + period) % period;
            from = k > last ? period - k : k;
        }
        at[axis] = from;
        sum += weight * sample(at);
    }
    return sum;
}

double SpectrumRays::wrong_inside(const Vec3& p) const {
    // The slice's value is a product over the axes, and so is the field's. Their difference is a
    // sum over axes: the error along one axis, times the slice's factors along the following axes.
    std::array<bool, 3> near;
    std::array<double, 3> held;
    std::array<std::int64_t, 3> nearest;
    for (int axis = 0; axis < 3; ++axis) {
        const std::int64_t last = want_.input[axis] - 1;
        const double before = -p[axis], after = p[axis] - static_cast<double>(last);
        near[axis] = std::max(before, after) > -reach_;
        held[axis] = near[axis] ? step_at(before) + step_at(after) - 1 : 1;
        nearest[axis] = std::clamp<std::int64_t>(std::llround(p[axis]), 0, last);
    }
    double sum = 0, behind = 1;
    for (int axis = 2; axis >= 0; --axis) {
        if (near[axis]) sum += behind * wrong_along(axis, p, nearest);
        behind *= held[axis];
    }
    return sum;
}

double SpectrumRays::spilled_outside(const Vec3& p) const {
    // Across the face that is farthest the layers count one by one; along it, as they lie.
    int across = 0;
    double farthest = -std::numeric_limits<double>::infinity(), weight = 1;
    std::array<std::int64_t, 3> at;
    std::array<double, 3> held;
    for (int axis = 0; axis < 3; ++axis) {
        const std::int64_t last = want_.input[axis] - 1;
        const double before = -p[axis], after = p[axis] - static_cast<double>(last);
        held[axis] = step_at(before) + step_at(after) - 1;
        at[axis] = std::clamp<std::int64_t>(std::llround(p[axis]), 0, last);
        if (std::max(before, after) > farthest) {
            farthest = std::max(before, after);
            across = axis;
        }
    }
    for (int axis = 0; axis < 3; ++axis)
        if (axis != across) weight *= held[axis];
    if (weight == 0) return 0;
    const std::int64_t n = want_.input[across];
    const bool first = p[across] < 0;
    double sum = 0;
    for (std::int64_t layer = 0; layer < std::min<std::int64_t>(n, reach_); ++layer) {
        at[across] = first ? layer : n - 1 - layer;
        sum += weight_at(farthest + static_cast<double>(layer)) * sample(at);
    }
    return weight * sum;
}

double SpectrumRays::faces_between(const RaySpan& ray, double from, double to, bool inside) const {
    if (!(from < to)) return 0;
    const double pieces = std::ceil((to - from) * ray.direction.cwiseAbs().maxCoeff() / kFaceStep);
    const double piece = (to - from) / pieces;
    double sum = 0;
    for (double k = 0.5; k < pieces; ++k) {
        const Vec3 p = ray.origin + (from + k * piece) * ray.direction;
        sum += inside ? wrong_inside(p) : spilled_outside(p);
    }
    return sum * piece;
}

double SpectrumRays::faces(const RaySpan& ray) const {
    const Region all = Region::all(want_.input);
    const Line line{ray.origin, ray.direction};
    const Stretch1d wide = within(line, all, reach_);
    Stretch1d deep = within(line, all, -reach_);
    deep.low = std::clamp(deep.low, ray.low, ray.high);
    deep.high = std::clamp(deep.high, ray.low, ray.high);
    double sum = faces_between(ray, wide.low, ray.low, false) +
                 faces_between(ray, ray.high, wide.high, false);
    if (deep.low < deep.high)
        sum += faces_between(ray, ray.low, deep.low, true) +
               faces_between(ray, deep.high, ray.high, true);
    else
        sum += faces_between(ray, ray.low, ray.high, true);
    return sum;
}

namespace {

/// What lies beyond the cutoff, over the difference of a linear and a spline picture, where no
/// power of the samples tells: of the spline at most 0.06, since response(1 - f) over |response(f)
/// - sinc(f)^2| is at most that for f < 1/4; of the trilinear field 0.3 to 0.45.
constexpr double kBeyond = 0.05, kBeyondLinear = 0.4, kBeyondBand = 0.6;
/// The power at a frequency is a mean over at most 16 bricks: its standard error is a quarter of
/// it.
constexpr double kOfBricks = 1.5;
/// All ghosts over the modelled ones: farther ghosts, and those along two axes at once.
constexpr double kAllGhosts = 1.15;
/// The same of radiographs. Their errors are largest on rays through little material, where ghosts
/// of dense parts along two axes matter too.
constexpr double kAllOfBright = 2;
/// Of pixels that are divided by a length, or are other functions of a sum: what one ray has of all
/// rounding, over the values of the longest ray.
constexpr double kRounding = 3e-7;
/// Of a sum: rounding of its slice and of the transform that makes it a picture, over the pixel.
constexpr double kPixelRounding = 2e-7;
/// Windows that amplify the spectrum's rounding by less, along one axis, add nothing to that.
constexpr double kAmplified = 2.55;

/// Cast through the spline and through the trilinear field, as the picture's own frequencies have
/// it: what lies beyond the cutoff is told from their difference.
constexpr double kKnownStep = 0.25;

/// Whether neighbouring pixels see the same samples, and are so many that one may stand for some.
bool are_alike(const Request& want) {
    constexpr std::int64_t kMany = 2048;
    if (want.screen.x * want.screen.y < kMany) return false;
    for (int variant = 0; variant < want.views.different(); ++variant) {
        const Mat4 map = want.views.at(want.views.first_view(variant)).matrix().inverse();
        if (map.topLeftCorner<3, 2>().colwise().norm().maxCoeff() > 1) return false;
    }
    return true;
}

/// Windows of spectra that paths make, of one padding and at most kWindows a group: those that are
/// tried, and those that are asked for.
std::vector<std::vector<kernels::KaiserBessel>> measured_windows(const ModelSetting& setting) {
    std::vector<std::vector<kernels::KaiserBessel>> groups = {SpectrumRays::tried()};
    const auto has = [&](int width, double padding) {
        for (const auto& group : groups)
            for (const kernels::KaiserBessel& window : group)
                if (window.width() == width && window.padding() == padding) return true;
        return false;
    };
    if (!setting.asked) return groups;
    const Transition forward = spectrum_forward();
    for (const Demand& demand : setting.asked->via) {
        if (!demand.names(forward)) continue;
        const auto number = [&](const char* key, double tried) {
            return demand.with.contains(key) ? demand.with.number(key) : tried;
        };
        const double padding = number("padding", kTriedPadding);
        std::vector<kernels::KaiserBessel> group;
        for (const kernels::KaiserBessel& tried : SpectrumRays::tried()) {
            const double width = number("width", tried.width());
            if (width == std::floor(width) &&
                kernels::KaiserBessel::known(static_cast<int>(width), padding) &&
                !has(static_cast<int>(width), padding) &&
                (group.empty() || group.back().width() != width))
                group.emplace_back(static_cast<int>(width), padding);
        }
        if (!group.empty()) groups.push_back(std::move(group));
    }
    return groups;
}

class SpectrumModel final : public Model {
 public:
    explicit SpectrumModel(const ModelSetting& setting)
        : want_(setting.want),
          low_(setting.statistics.low),
          high_(setting.statistics.high),
          empty_(setting.statistics.commonest),
          alike_(are_alike(setting.want)),
          curved_(setting.want.mode->slices == ModeTraits::Slices::integral &&
                  !grows_with_length(setting.want)),
          beyond_(static_cast<std::size_t>(setting.want.frames)) {
        for (std::atomic<double>& each : beyond_) each = -1;
        for (int axis = 0; axis < 3; ++axis)
            longest_ = std::max(longest_, static_cast<double>(want_.input[axis]));
        if (want_.field == Field::spline || want_.field == Field::linear)
            lost_.emplace(
                setting.field.samples(), setting.statistics.occupied,
                want_.field == Field::spline ? kernels::Between::spline : kernels::Between::linear);
        facts_.push_back({.name = kSpectrumEnds, .like = RayLook::kFoh1});
        const std::vector<std::vector<kernels::KaiserBessel>> groups = measured_windows(setting);
        boxes_.reserve(setting.boxes.size() * groups.size());
        for (const Region& box : setting.boxes)
            for (const auto& windows : groups) {
                boxes_.emplace_back(want_, setting.field.samples(), setting.statistics, box,
                                    windows);
                for (const kernels::KaiserBessel& window : windows)
                    facts_.push_back({.name = fact_of_spectrum(window, box.extent(), want_),
                                      .like = RayLook::kFoh1});
            }
    }
    std::vector<double> steps() const override { return {kKnownStep}; }
    bool stands_for_neighbours() const override { return alike_; }
    std::unique_ptr<RayModel> follow(const RaySpan& ray, const OutputSample& at) const override;

    /// What is known of a ray already [value of the picture].
    struct Known {
        double expected = 0;  // the reference
        double spline = 0;    // cast through the spline, and through the trilinear field
        double linear = 0;
        // What the field adds up to through either, no value cut off [value x step of screen z].
        double spline_sum = 0, linear_sum = 0;
    };
    bool curved() const noexcept { return curved_; }
    void finish(const RaySpan& ray, const OutputSample& at, const Known& known,
                RaySquares& squares) const {
        const bool mean = want_.mode->slices == ModeTraits::Slices::mean;
        const double length = ray.high - ray.low, divisor = std::max(length, kShortestRay);
        const double scale = curved_ ? 1 : mean ? 1 / divisor : want_.unit;
        const std::optional<double> lost = boxes_.front().beyond(ray);
        const double beyond =
            lost ? *lost * scale
                 : (curved_ ? known.linear_sum - known.spline_sum : known.linear - known.spline) *
                       beyond_of(at.view);
        const double spread = high_ - low_;
        double clean = want_.field == Field::formula ? known.spline : known.expected;
        if (mean) clean = empty_ + (clean - empty_) * length / divisor;
        const bool by_line = want_.field == Field::linear;
        const double sum = by_line ? known.linear_sum : known.spline_sum;
        const double read = by_line ? known.linear : known.spline;
        const auto square = [&](double wrong, double turned, double rounding) {
            if (curved_)
                return square_of_curve(sum + wrong, length, read, known.expected,
                                       std::hypot(beyond, rounding, turned));
            double got = clean + wrong * scale;
            if (mean) got = std::clamp(got, low_, high_);
            const double noise = std::hypot(beyond, rounding, turned * scale);
            return std::pow(got - known.expected, 2) +
                   std::pow(mean ? std::min(noise, spread) : noise, 2);
        };
        const double ends = boxes_.front().faces(ray);
        std::size_t fact = 0;
        // Rounding is white: where a pixel is the sum itself, rays together have all of it. Of
        // other pixels those have most that have little in their way, and a bound counts.
        const bool sums = !mean && !curved_;
        const double bound = kRounding * spread * longest_ * scale;
        const double of_pixel = sums ? kPixelRounding * clean : bound;
        squares.add(fact++, square(ends, 0, of_pixel));
        for (const SpectrumRays& box : boxes_) {
            const SpectrumRays::Ghosts ghosts =
                box.ghosts(at.view, static_cast<double>(at.x), static_cast<double>(at.y));
            for (std::size_t w = 0; w < box.windows().size(); ++w) {
                const double grown = box.windows()[w].amplified() / kAmplified;
                const double all = curved_ ? kAllOfBright : kAllGhosts;
                const double rounding =
                    sums ? std::hypot(of_pixel, std::sqrt(ghosts.noise[w]) * scale)
                         : bound * std::pow(std::max(1., grown), 3);
                squares.add(fact++,
                            square(ends + all * ghosts.seen[w], all * ghosts.turned[w], rounding));
            }
        }
    }

 private:
    /// What lies beyond the cutoff, over the difference of a linear and a spline picture.
    double beyond_of(int view) const {
        if (!lost_) return kBeyondBand;
        std::atomic<double>& known = beyond_[static_cast<std::size_t>(view)];
        if (known < 0) {
            const Vec3 along = want_.views.at(view).inverse().matrix().block<3, 1>(0, 2);
            const double told = lost_->over_difference(along);
            known = told >= 0                      ? kOfBricks * told
                    : want_.field == Field::spline ? kBeyond
                                                   : kBeyondLinear;
        }
        return known;
    }
    /// The same of a mode whose pixels are another function of the sum, as exp(-x) is: the sum is
    /// wrong first, and the function passes it on. What values are cut off in the field's own
    /// reading counts too, since no sum has that.
    /// @param sum    as the slice has it [value x step of screen z]
    /// @param read   the pixel by the field as it was read here: between it and `sum` quadrature
    ///               is alike
    /// @param noise  of the sum, of either sign
    double square_of_curve(double sum, double length, double read, double expected,
                           double noise) const {
        const double got = pixel_of_sum(want_, sum, length);
        const double around = std::max(std::abs(pixel_of_sum(want_, sum + noise, length) - got),
                                       std::abs(pixel_of_sum(want_, sum - noise, length) - got));
        const double off = want_.field == Field::formula ? read - expected : 0;
        constexpr double kStored = 0x1p-24;  // a pixel near 1 is rounded to f32
        return std::pow(got - read + off, 2) + std::pow(around, 2) + std::pow(got * kStored, 2);
    }

    const Request& want_;
    double low_, high_, empty_, longest_ = 0;
    bool alike_, curved_;
    std::optional<LostBand> lost_;
    // By view; negative: not asked for yet. Threads that ask at once find the same.
    mutable std::vector<std::atomic<double>> beyond_;
    std::vector<SpectrumRays> boxes_;  // the whole first
};

class SpectrumRay final : public RayModel {
 public:
    SpectrumRay(const SpectrumModel& model, const RaySpan& ray, const OutputSample& at,
                const Request& want)
        : model_(model), ray_(ray), at_(at), want_(want) {
        cast_.fill(Stretch::empty(want.mode));
    }
    void take(double, RayPiece& piece) override {
        piece.add(piece.held(kSpline), cast_[0], want_);
        piece.add(piece.held(kFoh), cast_[1], want_);
        if (!model_.curved()) return;
        const auto &spline = piece.held(kSpline), &linear = piece.held(kFoh);
        for (std::size_t i = 0; i < piece.count(); ++i) {
            spline_sum_ += spline[i] * piece.cells().length[i];
            linear_sum_ += linear[i] * piece.cells().length[i];
        }
    }
    void finish(const RayAnswer& answer, RaySquares& squares) override {
        model_.finish(ray_, at_,
                      {.expected = answer.expected()[0],
                       .spline = answer.written(cast_[0])[0],
                       .linear = answer.written(cast_[1])[0],
                       .spline_sum = spline_sum_,
                       .linear_sum = linear_sum_},
                      squares);
    }

 private:
    const SpectrumModel& model_;
    RaySpan ray_;
    OutputSample at_;
    const Request& want_;
    std::array<Stretch, 2> cast_;  // spline, trilinear
    double spline_sum_ = 0, linear_sum_ = 0;
};

std::unique_ptr<RayModel> SpectrumModel::follow(const RaySpan& ray, const OutputSample& at) const {
    return std::make_unique<SpectrumRay>(*this, ray, at, want_);
}

}  // namespace

std::shared_ptr<const Model> spectrum_model(const ModelSetting& setting) {
    const Scene scene = unseen_scene(setting.statistics);
    if (setting.want.axes != 3 || !no_projection({setting.want, scene}).empty()) return nullptr;
    return std::make_shared<SpectrumModel>(setting);
}

}  // namespace edgewise
