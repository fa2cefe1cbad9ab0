#include "transitions/reference/drawn_pixels.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <tbb/parallel_for.h>

#include "transitions/reference/preview_short.hpp"
#include "transitions/reference/stored_cast.hpp"

namespace edgewise {
namespace {

constexpr std::size_t kLooked = 1024;  // pixels that are looked at cheaply
constexpr int kTries = 16 * kLooked;
constexpr double kEven = 0.5;   // of the draws
constexpr double kStep = 1.5;   // samples
constexpr double kBend = 0.25;  // a bilinear picture is wrong by so much of a second difference

using Values = std::array<double, 4>;

double square_between(const Values& a, const Values& b) {
    double sum = 0;
    for (std::size_t c = 0; c < a.size(); ++c) sum += (a[c] - b[c]) * (a[c] - b[c]);
    return sum;
}

/// How rough data and picture are at a pixel.
template <class T>
class Roughness {
 public:
    Roughness(const Request& want, const Data& data, const ViewGeometry& geometry)
        : want_(want), geometry_(geometry), nearest_(data), linear_(data) {}

    /// A square, in the picture's values; 0 where the pixel's ray misses the input.
    double at(const OutputSample& pixel) const {
        const std::optional<RaySpan> ray = geometry_.ray(pixel);
        if (!ray) return 0;
        Values held{};
        cast_stored(nearest_, *ray, kStep, want_).result(want_, held.data());
        const Values middle = linear(ray);
        const double contrast = square_between(held, middle), bend = bend_at(pixel, *ray, middle);
        return std::isfinite(contrast + bend) ? std::max(contrast, kBend * kBend * bend) : 0;
    }

 private:
    /// Nothing where the input is missed, as in a picture.
    Values linear(const std::optional<RaySpan>& ray) const {
        Values values{};
        if (ray) cast_stored(linear_, *ray, kStep, want_).result(want_, values.data());
        return values;
    }
    /// The larger of the second differences along x and y, over one sample of the input.
    double bend_at(const OutputSample& pixel, const RaySpan& ray, const Values& middle) const {
        if (want_.eye) return 0;
        const auto x = static_cast<double>(pixel.x), y = static_cast<double>(pixel.y);
        double largest = 0;
        for (const auto& [dx, dy] : {std::pair{1.0, 0.0}, std::pair{0.0, 1.0}}) {
            const double step = samples_a_pixel(pixel.view, dx, dy, ray);
            if (!(step > 0)) continue;
            const Values before = linear(geometry_.ray(pixel.view, x - dx / step, y - dy / step));
            const Values after = linear(geometry_.ray(pixel.view, x + dx / step, y + dy / step));
            Values mean{};
            for (std::size_t c = 0; c < mean.size(); ++c) mean[c] = 0.5 * (before[c] + after[c]);
            largest = std::max(largest, 4 * square_between(mean, middle));
        }
        return largest;
    }
    double samples_a_pixel(int view, double dx, double dy, const RaySpan& ray) const {
        const Mat4& to_screen = want_.views.at(view);
        const Vec3 moved = to_screen.topLeftCorner<3, 3>().inverse() * Vec3(dx, dy, 0);
        // What of it is across the ray.
        const Vec3 along = ray.direction.normalized();
        return (moved - moved.dot(along) * along).norm();
    }

    const Request& want_;
    const ViewGeometry& geometry_;
    NearestStored<T> nearest_;
    LinearStored<T> linear_;
};

struct Candidate {
    OutputSample at;
    double rough = 0;
};

/// How often each is drawn on average, at most once: those that would be drawn more often are
/// certain, and leave the others more.
std::vector<double> expected_draws(std::span<const double> rough, double draws) {
    std::vector<double> share(rough.size()), expected(rough.size(), 0);
    const double sum = std::accumulate(rough.begin(), rough.end(), 0.0);
    const double even = 1 / static_cast<double>(rough.size());
    for (std::size_t i = 0; i < rough.size(); ++i)
        share[i] = sum > 0 ? kEven * even + (1 - kEven) * rough[i] / sum : even;
    double left = draws, rest = 1;  // of draws, and of shares, for those that are not certain
    for (bool again = true; again && rest > 0;) {
        again = false;
        const double scale = left / rest;
        for (std::size_t i = 0; i < rough.size(); ++i)
            if (expected[i] < 1 && share[i] * scale >= 1) {
                expected[i] = 1;
                left -= 1;
                rest -= share[i];
                again = true;
            }
    }
    for (std::size_t i = 0; i < rough.size(); ++i)
        if (expected[i] < 1) expected[i] = std::clamp(share[i] * left / rest, 0.0, 1.0);
    return expected;
}

/// At most so many of a list, at equal distances.
std::vector<Candidate> some_of(std::span<const OutputSample> from, std::size_t most) {
    std::vector<Candidate> some(std::min(from.size(), most));
    for (std::size_t i = 0; i < some.size(); ++i)
        some[i].at = from[(2 * i + 1) * from.size() / (2 * some.size())];
    return some;
}

}  // namespace

std::vector<DrawnPixels::Pixel> draw_rough(const Request& want, const ReferenceField& field,
                                           const ViewGeometry& geometry,
                                           std::span<const OutputSample> from, double draws,
                                           int times) {
    draws *= times;
    std::vector<DrawnPixels::Pixel> drawn;
    if (static_cast<double>(from.size()) <= draws) {
        for (const OutputSample& at : from) drawn.push_back({at});
        return drawn;
    }
    std::vector<Candidate> rays = some_of(from, kLooked * times);
    with_stored_type(field.samples().what.type, [&](auto zero) {
        const Roughness<decltype(zero)> roughness(want, field.samples(), geometry);
        tbb::parallel_for(std::size_t{0}, rays.size(),
                          [&](std::size_t i) { rays[i].rough = roughness.at(rays[i].at); });
    });
    std::vector<double> rough;
    for (const Candidate& ray : rays) rough.push_back(ray.rough);
    for (const auto& [place, weight] : draw_in_proportion(rough, draws))
        drawn.push_back({rays[place].at, weight});
    return drawn;
}

std::vector<RoughDraw> draw_in_proportion(std::span<const double> rough, double draws) {
    // At equal distances along the sorted ones, so that rough and smooth are met in proportion.
    std::vector<std::size_t> order(rough.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return rough[a] < rough[b]; });
    std::vector<double> sorted;
    for (const std::size_t place : order) sorted.push_back(rough[place]);
    const std::vector<double> expected = expected_draws(sorted, draws);
    std::vector<RoughDraw> drawn;
    double passed = 0;
    for (std::size_t i = 0; i < sorted.size(); ++i) {
        const double before = std::floor(passed + 0.5);
        passed += expected[i];
        if (std::floor(passed + 0.5) > before)
            drawn.push_back({order[i], draws / (static_cast<double>(sorted.size()) * expected[i])});
    }
    return drawn;
}

DrawnPixels draw_pixels(const Request& want, const ReferenceField& field,
                        const ViewGeometry& geometry, int fewest, int most, double length,
                        int times) {
    // Spread evenly over views and pixels by the additive recurrence of the generalised golden
    // ratio (Roberts 2018).
    constexpr std::array<double, 3> ratio = {0.8191725, 0.6710436, 0.5497005};
    std::vector<OutputSample> met;
    double reach = 0;
    int tries = 0;
    for (; tries < kTries * times && met.size() < kLooked * static_cast<std::size_t>(times);
         ++tries) {
        std::array<double, 3> u;
        for (int axis = 0; axis < 3; ++axis)
            u[axis] = std::fmod(0.5 + ratio[axis] * (tries + 1), 1.0);
        const OutputSample at{static_cast<int>(u[2] * want.frames),
                              static_cast<std::int64_t>(u[0] * static_cast<double>(want.screen.x)),
                              static_cast<std::int64_t>(u[1] * static_cast<double>(want.screen.y)),
                              0};
        const std::optional<RaySpan> ray = geometry.ray(at);
        if (!ray || ShortRays::class_of(*ray, want) != ShortRays::kClasses) continue;
        met.push_back(at);
        reach += ray->high - ray->low;
    }
    const auto count = static_cast<double>(met.size());
    const double draws = std::clamp(std::ceil(length * count / std::max(reach, 1e-9)),
                                    static_cast<double>(fewest), static_cast<double>(most));
    return {.drawn = draw_rough(want, field, geometry, met, draws, times),
            .pixels = static_cast<double>(want.screen.x * want.screen.y) * want.frames * count /
                      std::max(1, tries)};
}

}  // namespace edgewise
