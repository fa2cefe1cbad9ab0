#include "transitions/kernels/shears.hpp"

#include <algorithm>
#include <cmath>

namespace edgewise::kernels {

std::array<double, 3> line_of_pass(const ShearChain& chain, int k) noexcept {
    std::array<double, 3> step{0, 0, 0};
    step[chain.shears[k].axis] = 1;
    for (int j = k - 1; j >= 0; --j) {
        const Shear& shear = chain.shears[j];
        step[shear.axis] -= shear.step(step) - shear.offset;
    }
    std::array<double, 3> line{};
    for (int i = 0; i < 3; ++i) line[chain.from[i]] = chain.sign[i] * step[i];
    return line;
}

bool interpolates(const ShearChain& chain, int k) noexcept {
    constexpr double kWhole = 1e-9;
    const auto is_whole = [](double by) { return std::abs(by - std::round(by)) <= kWhole; };
    const Shear& shear = chain.shears[k];
    return !is_whole(shear.offset) || !std::ranges::all_of(shear.by, is_whole);
}

bool is_slanted_pass(const ShearChain& chain, int k) noexcept {
    constexpr double kAlongAnAxis = 1e-9;
    double sum = 0, largest = 0;
    for (double step : line_of_pass(chain, k)) {
        sum += std::abs(step);
        largest = std::max(largest, std::abs(step));
    }
    return sum - largest > kAlongAnAxis && interpolates(chain, k);
}

int slanted_passes(const ShearChain& chain) noexcept {
    int count = 0;
    for (int k = 0; k < chain.count; ++k) count += is_slanted_pass(chain, k);
    return count;
}

std::array<double, 3> displacement_bound(const ShearChain& chain) noexcept {
    std::array<double, 3> sum{0, 0, 0};
    for (int k = 0; k < chain.count; ++k) {
        std::array<double, 3> v{0, 0, 0};
        v[chain.shears[k].axis] = 1;
        for (int j = k; j >= 0; --j) {
            const Shear& shear = chain.shears[j];
            v[shear.axis] -= shear.by[0] * v[0] + shear.by[1] * v[1] + shear.by[2] * v[2];
        }
        for (int i = 0; i < 3; ++i) sum[chain.from[i]] += 0.5 * std::abs(v[i]);
    }
    return sum;
}

std::array<double, 3> screen_displacement_bound(const ShearChain& chain) noexcept {
    std::array<double, 3> sum{0, 0, 0};
    for (int k = 0; k < chain.count; ++k) {
        std::array<double, 3> v{0, 0, 0};
        v[chain.shears[k].axis] = 1;
        for (int j = k + 1; j < chain.count; ++j) {
            const Shear& shear = chain.shears[j];
            v[shear.axis] += shear.by[0] * v[0] + shear.by[1] * v[1] + shear.by[2] * v[2];
        }
        for (int i = 0; i < 3; ++i) sum[i] += 0.5 * std::abs(v[i]);
    }
    return sum;
}

}  // namespace edgewise::kernels
