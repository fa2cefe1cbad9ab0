#include "scene/ring_free.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "graph/with_type.hpp"

namespace edgewise {
namespace {

constexpr double kLeastStep = 1.0 / 8;

/// Colour of a ray through an edge that faces the eye, sampled at (k + phase) step. The edge lies
/// between two bodies of even values, whose gradient is 0, so that light falls on the edge alone.
std::array<double, 3> entering(const Request& want, double low, double high, double slope,
                               double step, double phase) {
    constexpr double kAround = 8;          // samples on both sides of the edge
    constexpr double kOpaque = 1.0 / 256;  // what is left to see
    const double across = (high - low) / slope;
    const auto value = [&](double t) { return low + slope * std::clamp(t, 0.0, across); };
    const double power = step * want.unit / want.transfer.unit;
    std::array<double, 3> light{};
    double left = 1;
    const double begin = -1;  // the first differences of neighbours that are not 0
    for (double t = begin + phase * step; t < across + kAround && left > kOpaque; t += step) {
        const std::array<double, 4> seen = want.transfer.at(value(t));
        const double gradient = (value(t + 1) - value(t - 1)) / 2;
        const double edge = want.transfer.edge_at(gradient / want.unit);
        const double caught = left * (1 - std::pow(1 - edge * seen[3], power));
        if (!(caught > 0)) continue;
        const Lit lit = want.shading.at(Vec3(0, 0, gradient), Vec3(0, 0, -1));
        for (std::size_t c = 0; c < 3; ++c)
            light[c] += caught * (seen[c] * lit.diffuse + lit.specular);
        left -= caught;
    }
    return light;
}

/// How far a colour is from that of short steps, wherever samples begin, of 255 levels.
double levels_off(const Request& want, double low, double high, double slope, double step,
                  const std::array<double, 3>& fine) {
    constexpr int kPhases = 8;
    double levels = 0;
    for (int phase = 0; phase < kPhases; ++phase) {
        const std::array<double, 3> light =
            entering(want, low, high, slope, step, (phase + 0.5) / kPhases);
        for (std::size_t c = 0; c < 3; ++c)
            levels = std::max(levels, 255 * std::abs(light[c] - fine[c]));
    }
    return levels;
}

/// Differences of neighbours within boxes, along each axis [value per smallest spacing].
class Differences {
 public:
    explicit Differences(const Request& want) : want_(want) {
        const double smallest = want.spacing.minCoeff();
        for (int axis = 0; axis < 3; ++axis) per_spacing_[axis] = smallest / want.spacing[axis];
        for (const Transfer::Point& point : want.transfer.points) {
            least_opaque_ = std::min(least_opaque_, point.opacity);
            most_opaque_ = std::max(most_opaque_, point.opacity);
        }
    }

    void add(double a, double b, int axis) {
        const double one = want_.transfer.at(a)[3], other = want_.transfer.at(b)[3];
        const bool shown = std::max(one, other) > least_opaque_;
        const bool full = std::min(one, other) >= most_opaque_;
        if (shown && !full) all_.push_back(std::abs(b - a) * per_spacing_[axis]);
    }
    /// Of which so large a share is smaller; 0: there are none.
    double quantile(double share) {
        if (all_.empty()) return 0;
        const auto place = all_.begin() + static_cast<std::ptrdiff_t>(
                                              share * static_cast<double>(all_.size() - 1));
        std::nth_element(all_.begin(), place, all_.end());
        return *place;
    }

 private:
    const Request& want_;
    Vec3 per_spacing_;
    double least_opaque_ = 1, most_opaque_ = 0;
    std::vector<double> all_;
};

}  // namespace

double seen_slope(const Data& data, const Request& want) {
    constexpr std::int64_t kBoxes = 768, kSide = 4;
    constexpr double kShare = 0.999;
    constexpr std::array<double, 3> kRatio = {0.8191725, 0.6710436, 0.5497005};  // Roberts 2018
    if (!want.mode->takes_transfer || want.transfer.points.empty()) return 0;
    Differences found(want);
    const Extent& n = data.what.extent;
    with_type(data.what.type, [&](auto type) {
        const auto value = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
            return data.what.values.slope * static_cast<double>(*data.at<decltype(type)>(x, y, z)) +
                   data.what.values.offset;
        };
        for (std::int64_t box = 1; box <= kBoxes; ++box) {
            std::array<std::int64_t, 3> from, to;
            for (int axis = 0; axis < 3; ++axis) {
                const auto k = static_cast<std::size_t>(axis);
                const double at = std::fmod(0.5 + kRatio[k] * static_cast<double>(box), 1.0);
                const std::int64_t last = std::max<std::int64_t>(0, n[axis] - kSide);
                from[k] = static_cast<std::int64_t>(at * static_cast<double>(last + 1));
                to[k] = std::min(n[axis], from[k] + kSide);
            }
            for (std::int64_t z = from[2]; z < to[2]; ++z)
                for (std::int64_t y = from[1]; y < to[1]; ++y)
                    for (std::int64_t x = from[0]; x < to[0]; ++x) {
                        const double here = value(x, y, z);
                        if (!std::isfinite(here)) continue;
                        const auto pair = [&](double there, int axis) {
                            if (std::isfinite(there)) found.add(here, there, axis);
                        };
                        if (x + 1 < to[0]) pair(value(x + 1, y, z), 0);
                        if (y + 1 < to[1]) pair(value(x, y + 1, z), 1);
                        if (z + 1 < to[2]) pair(value(x, y, z + 1), 2);
                    }
        }
    });
    return found.quantile(kShare);
}

double ring_free_step(const Request& want, double low, double high, double slope) {
    if (want.mode->first_hit) return 1.0 / 4;
    if (!want.mode->takes_transfer) return 1;
    const bool turns = want.shading.on() || want.transfer.table;
    double step = turns ? 0.5 : 1;
    if (want.transfer.table || !(slope > 0) || !(high > low)) return step;
    for (const double share : {1.0, 0.5, 0.25, 0.125}) {
        constexpr double kFine = 1.0 / 32;
        const double gentle = share * slope;
        const std::array<double, 3> fine = entering(want, low, high, gentle, kFine, 0.5);
        while (step > kLeastStep && levels_off(want, low, high, gentle, step, fine) > kRingLevels)
            step /= 2;
    }
    return step;
}

}  // namespace edgewise
