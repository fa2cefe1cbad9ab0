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

/// Colour of a ray through an edge, sampled at (k + phase) step.
std::array<double, 3> entering(const Request& want, double low, double high, double slope,
                               double step, double phase) {
    constexpr double kInside = 8;          // samples behind the edge
    constexpr double kOpaque = 1.0 / 256;  // what is left to see
    const double length = (high - low) / slope + kInside;
    const double power = step * want.unit / want.transfer.unit;
    const double edge = want.transfer.edge_at(slope / want.unit);
    std::array<double, 3> light{};
    double left = 1;
    for (double t = phase * step; t < length && left > kOpaque; t += step) {
        const std::array<double, 4> seen = want.transfer.at(std::min(high, low + slope * t));
        const double caught = left * (1 - std::pow(1 - edge * seen[3], power));
        for (std::size_t c = 0; c < 3; ++c) light[c] += caught * seen[c];
        left -= caught;
    }
    return light;
}

/// By how much colours differ by where samples begin, of 255 levels.
double levels_between_phases(const Request& want, double low, double high, double slope,
                             double step) {
    constexpr int kPhases = 8;
    constexpr double kNever = std::numeric_limits<double>::infinity();
    std::array<double, 3> least{kNever, kNever, kNever}, most{-kNever, -kNever, -kNever};
    for (int phase = 0; phase < kPhases; ++phase) {
        const std::array<double, 3> light =
            entering(want, low, high, slope, step, (phase + 0.5) / kPhases);
        for (std::size_t c = 0; c < 3; ++c) {
            least[c] = std::min(least[c], light[c]);
            most[c] = std::max(most[c], light[c]);
        }
    }
    double levels = 0;
    for (std::size_t c = 0; c < 3; ++c) levels = std::max(levels, 255 * (most[c] - least[c]));
    return levels;
}

/// Of the slope and of gentler ones.
bool shows_rings(const Request& want, double low, double high, double slope, double step) {
    for (const double share : {1.0, 0.5, 0.25, 0.125})
        if (levels_between_phases(want, low, high, share * slope, step) > kRingLevels) return true;
    return false;
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

    /// A sample, with what the transfer function makes of it.
    struct Seen {
        double value = 0, opacity = 0;
    };
    Seen seen(double value) const {
        return {value, std::isfinite(value) ? want_.transfer.at(value)[3] : 0};
    }

    void add(const Seen& one, const Seen& other, int axis) {
        if (!std::isfinite(one.value) || !std::isfinite(other.value)) return;
        const bool shown = std::max(one.opacity, other.opacity) > least_opaque_;
        const bool full = std::min(one.opacity, other.opacity) >= most_opaque_;
        if (shown && !full) all_.push_back(std::abs(other.value - one.value) * per_spacing_[axis]);
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
            // Each sample is looked up once, and is in up to six pairs.
            std::array<Differences::Seen, kSide * kSide * kSide> seen;
            const std::int64_t nx = to[0] - from[0], ny = to[1] - from[1], nz = to[2] - from[2];
            const auto at = [&](std::int64_t x, std::int64_t y, std::int64_t z) -> auto& {
                return seen[static_cast<std::size_t>((z * kSide + y) * kSide + x)];
            };
            for (std::int64_t z = 0; z < nz; ++z)
                for (std::int64_t y = 0; y < ny; ++y)
                    for (std::int64_t x = 0; x < nx; ++x)
                        at(x, y, z) = found.seen(value(from[0] + x, from[1] + y, from[2] + z));
            for (std::int64_t z = 0; z < nz; ++z)
                for (std::int64_t y = 0; y < ny; ++y)
                    for (std::int64_t x = 0; x < nx; ++x) {
                        if (x + 1 < nx) found.add(at(x, y, z), at(x + 1, y, z), 0);
                        if (y + 1 < ny) found.add(at(x, y, z), at(x, y + 1, z), 1);
                        if (z + 1 < nz) found.add(at(x, y, z), at(x, y, z + 1), 2);
                    }
        }
    });
    return found.quantile(kShare);
}

double ring_free_step(const Request& want, double low, double high, double slope) {
    if (want.mode->first_hit) return 1.0 / 4;
    if (!want.mode->takes_transfer) return 1;
    if (want.transfer.table) return 0.5;
    if (!(slope > 0) || !(high > low)) return want.shading.on() ? 0.5 : 1;
    constexpr double kNarrow = 4;  // spacings that an edge takes
    double step = !want.shading.on() ? 1 : high - low < kNarrow * slope ? 0.25 : 0.5;
    while (step > kLeastStep && shows_rings(want, low, high, slope, step)) step /= 2;
    return step;
}

}  // namespace edgewise
