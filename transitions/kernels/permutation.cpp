#include "transitions/kernels/permutation.hpp"

#include <cmath>

namespace edgewise::kernels {
namespace {

/// How an error of the k-th rounding moves the object point: E_1^-1 ... E_k^-1 of its unit vector,
/// in the axes of object space.
std::array<double, 3> moves_of(const ShearChain& chain, int k) {
    std::array<double, 3> v{0, 0, 0};
    v[chain.shears[k].axis] = 1;
    for (int j = k; j >= 0; --j) {
        const Shear& shear = chain.shears[j];
        v[shear.axis] -= shear.by[0] * v[0] + shear.by[1] * v[1] + shear.by[2] * v[2];
    }
    std::array<double, 3> object{};
    for (int i = 0; i < 3; ++i) object[chain.from[i]] = chain.sign[i] * v[i];
    return object;
}

bool gathers_can_take(const Grid& object) {
    if (object.channels != 1) return false;
    const double slice = double(object.extent.x) * double(object.extent.y);
    const double farthest = 8.0 * double(object.extent.x) + (object.extent.z > 1 ? 8 * slice : 0);
    if ((farthest + 4096) * double(bytes_of(object.type)) > 2147483647.0) return false;
    switch (object.type) {
        case Type::u8:
        case Type::i8:
        case Type::u16:
        case Type::i16:
        case Type::f32:
            return true;
        default:
            return false;
    }
}

}  // namespace

PermutationWarp::PermutationWarp(const Grid& object, const ShearChain& to_screen, Send send,
                                 const Extent& screen)
    : plan_{.object = object, .chain = to_screen, .send = send, .screen = screen} {
    plan_.reach = screen_displacement_bound(to_screen);
    for (int k = 0; k < to_screen.count; ++k) plan_.error_moves[k] = moves_of(to_screen, k);
    for (int i = 0; i < 3; ++i) {
        // A point in the input, at most half a sample beyond the centres, is this far from its
        // site.
        plan_.halo[i] = std::int64_t(std::floor(0.5 + to_screen.displacement[i] + 1e-6));
    }
    plan_.lanes = gathers_can_take(object);
}

Region PermutationWarp::sites() const noexcept {
    Region sites = Region::all(plan_.object.extent);
    for (int i = 0; i < 3; ++i) {
        sites.begin[i] -= plan_.halo[i];
        sites.end[i] += plan_.halo[i];
    }
    return sites;
}

void PermutationWarp::operator()(const Region& sites, float* screen) const noexcept {
    if (!sites.empty()) permute_simd(plan_, sites, screen);
}

Extent preferred_sites(const Extent& object) noexcept {
    if (object.z == 1) return {256, 64, 1};
    return {128, 16, 16};
}

}  // namespace edgewise::kernels
