#include "transitions/project/gaussian_sums.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "transitions/kernels/ray_path.hpp"

namespace edgewise {
namespace {

constexpr double kReach = 4;  // deviations

/// Sum at x of kernels at 0, -1, -2 ...
double before_and_at_zero(double x, double deviation) {
    // A sum over many is an integral, by Euler and Maclaurin within 1e-3.
    constexpr double kWide = 1.2;
    if (deviation > kWide) return 0.5 * std::erfc((x - 0.5) / (std::numbers::sqrt2 * deviation));
    const double first = x + kReach * deviation, last = x - kReach * deviation;
    double sum = 0;
    for (double i = std::min(0.0, std::floor(first)); i >= last; --i)
        sum += std::exp(-0.5 * std::pow((x - i) / deviation, 2));
    return sum / (deviation * std::sqrt(2 * std::numbers::pi));
}

/// Sum at x of n kernels at 0, 1, 2 ...; kernels at all integers would sum to 1.
double of_lattice(double x, std::int64_t n, double deviation) {
    const double last = static_cast<double>(n - 1), reach = kReach * deviation;
    double sum = 1;
    if (x < reach) sum -= before_and_at_zero(x + 1, deviation);
    if (x > last - reach) sum -= before_and_at_zero(last + 1 - x, deviation);
    return std::max(0.0, sum);
}

}  // namespace

struct GaussianSums::Ray {
    std::array<double, 3> origin, direction;
};

GaussianSums::GaussianSums(const kernels::Rays& rays, const Extent& volume, double variance,
                           double low_pass)
    : rays_(rays), volume_(volume), variance_(variance) {
    kernels::RayCast cast;
    cast.rays = rays;
    parallel_ = kernels::ParallelRays(cast).parallel;
    const kernels::Rays::Field& field = parallel_ ? rays.origin : rays.direction;
    for (std::size_t axis = 0; axis < 3; ++axis)
        wider_[axis] = low_pass * (std::pow(field.x[axis], 2) + std::pow(field.y[axis], 2));
    // The part of the way at which the farthest corner lies: depths are linear in index space, and
    // are 1 in the plane of the pixels. d . (x cross y) is the same for all pixels.
    double farthest = 1;
    if (!parallel_) {
        const auto &x = rays.direction.x, &y = rays.direction.y, &d = rays.direction.base;
        std::array<double, 3> normal;
        for (std::size_t a = 0; a < 3; ++a)
            normal[a] = x[(a + 1) % 3] * y[(a + 2) % 3] - x[(a + 2) % 3] * y[(a + 1) % 3];
        double plane = 0, depth = 0;
        for (std::size_t a = 0; a < 3; ++a) plane += normal[a] * d[a];
        for (std::size_t a = 0; a < 3; ++a) {
            const double low = (-0.5 - rays.origin.base[a]) * normal[a] / plane;
            const double size = static_cast<double>(volume[static_cast<int>(a)]);
            depth += std::max(low, low + size * normal[a] / plane);
        }
        farthest = depth;
    }
    for (std::size_t axis = 0; axis < 3; ++axis) greatest_[axis] = deviation(axis, farthest);
}

double GaussianSums::deviation(std::size_t axis, double part) const {
    const double larger = parallel_ ? 1 : part;
    return std::sqrt(variance_ + wider_[axis] * larger * larger);
}

double GaussianSums::at(const Ray& ray, double part) const {
    double product = 1;
    for (std::size_t axis = 0; axis < 3; ++axis)
        product *= of_lattice(ray.origin[axis] + part * ray.direction[axis],
                              volume_[static_cast<int>(axis)], deviation(axis, part));
    return product;
}

double GaussianSums::along(double px, double py) const {
    const Ray ray{rays_.origin.at(px, py), rays_.direction.at(px, py)};
    const std::array<double, 3> m = rays_.measure.at(px, py);
    const double length = std::hypot(m[0], m[1], m[2]);
    constexpr double kAny = std::numeric_limits<double>::infinity();
    // Intervals of the ray: within reach of a kernel; inside the volume; beyond reach of its faces.
    double low = parallel_ ? -kAny : 0, high = kAny;
    double enters = low, leaves = high, inner_low = low, inner_high = high;
    double steepest = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double inverse = kernels::inverse_stride(ray.direction[axis]);
        const double last = static_cast<double>(volume_[static_cast<int>(axis)] - 1);
        const double reach = kReach * greatest_[axis], origin = ray.origin[axis];
        kernels::clip(origin, inverse, -reach, last + reach, low, high);
        kernels::clip(origin, inverse, -0.5, last + 0.5, enters, leaves);
        kernels::clip(origin, inverse, reach, last - reach, inner_low, inner_high);
        steepest = std::max(steepest, std::abs(ray.direction[axis]));
    }
    if (!(low < high) || !std::isfinite(high - low)) return 0;
    const auto integral = [&](double from, double to) {
        // The midpoint rule is exact for a Gaussian within exp(-2 (2 pi)^2).
        const double step = 0.5 * std::sqrt(variance_) / steepest;
        const auto count = static_cast<std::int64_t>(std::ceil((to - from) / step));
        double sum = 0;
        for (std::int64_t i = 0; i < count; ++i)
            sum += at(ray, from + (static_cast<double>(i) + 0.5) / static_cast<double>(count) *
                                      (to - from));
        return count > 0 ? sum * (to - from) / static_cast<double>(count) : 0;
    };
    if (!(inner_low < inner_high)) return integral(low, high) * length;
    // Across a single face the loss inside equals the gain outside, so the length inside counts.
    const auto by_one_face = [&](double from, double to) {
        int near = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double last = static_cast<double>(volume_[static_cast<int>(axis)] - 1);
            bool inside = true;
            for (const double part : {from, to}) {
                const double at = ray.origin[axis] + part * ray.direction[axis];
                const double reach = kReach * greatest_[axis] * (1 - 1e-9);
                inside = inside && at >= reach && at <= last - reach;
            }
            near += !inside;
        }
        return near == 1;
    };
    const double begin =
        by_one_face(low, inner_low) ? inner_low - enters : integral(low, inner_low);
    const double end =
        by_one_face(inner_high, high) ? leaves - inner_high : integral(inner_high, high);
    return (begin + (inner_high - inner_low) + end) * length;
}

}  // namespace edgewise
