#include "transitions/kernels/shears.hpp"

namespace edgewise::kernels {

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
