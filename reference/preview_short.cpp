#include "reference/preview_short.hpp"

#include <algorithm>
#include <cmath>

namespace edgewise {
namespace {

constexpr double kShortest = 1, kShort = 8;  // [unit]
constexpr double kEdge = 1.5;                // [sample]
constexpr double kThick = 64;  // where inputs are thinner, all of these are less in proportion
constexpr double kLookedAt = 1 << 16;              // pixels; of more, every few
constexpr double kLooked = 1024;                   // cheaply, rays of a class
constexpr std::array<double, 2> kMost = {96, 32};  // rays of a class

}  // namespace

std::size_t ShortRays::class_of(const RaySpan& ray, const Request& want) noexcept {
    double low = ray.low, high = ray.high, thickness = HUGE_VAL;
    for (int axis = 0; axis < 3; ++axis) {
        const auto n = static_cast<double>(want.input[axis]);
        const double edge = kEdge * std::min(1.0, n / kThick);
        const double first = edge - 0.5 - ray.origin[axis], d = ray.direction[axis];
        const double last = n - 0.5 - edge - ray.origin[axis];
        thickness = std::min(thickness, n * want.spacing[axis] / want.unit);
        if (std::abs(d) < 1e-12) {
            if (first > 0 || last < 0) high = low;
            continue;
        }
        low = std::max(low, std::min(first / d, last / d));
        high = std::min(high, std::max(first / d, last / d));
    }
    const bool divides = want.mode->divides;
    double length = ray.high - ray.low;
    if (divides) length /= std::min(1.0, thickness / kThick);
    if (length < kShortest) return 0;
    return low < high && !(divides && length < kShort) ? kClasses : 1;
}

ShortRays draw_short_rays(const Request& want, const ReferenceField& field,
                          const ViewGeometry& geometry, double times) {
    const std::int64_t a_view = want.screen.x * want.screen.y, all = a_view * want.frames;
    // No whole number of rows, so that what is left out is spread over each view.
    const double step =
        std::max(1.0, static_cast<double>(all) / (kLookedAt * std::min(1.0, times)));
    std::array<std::vector<OutputSample>, ShortRays::kClasses> found;
    for (double k = 0; k < static_cast<double>(all); k += step) {
        const auto i = static_cast<std::int64_t>(k);
        const OutputSample at{static_cast<int>(i / a_view), i % a_view % want.screen.x,
                              i % a_view / want.screen.x, 0};
        const std::optional<RaySpan> ray = geometry.ray(at);
        if (!ray) continue;
        const std::size_t found_in = ShortRays::class_of(*ray, want);
        if (found_in < found.size()) found[found_in].push_back(at);
    }
    ShortRays rays;
    for (std::size_t c = 0; c < found.size(); ++c) {
        DrawnPixels& of = rays.classes[c];
        of = draw_rough(want, field, geometry,
                        some_of(found[c], static_cast<std::size_t>(kLooked * times)),
                        kMost[c] * times, 1);
        of.pixels = static_cast<double>(found[c].size()) * step;
        of.whole = step == 1 && of.drawn.size() == found[c].size();
    }
    return rays;
}

}  // namespace edgewise
