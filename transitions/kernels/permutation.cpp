#include "transitions/kernels/permutation.hpp"

#include <Eigen/LU>
#include <algorithm>
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
    const double slice = double(object.slice_step());
    const double farthest = 8.0 * double(object.row_step()) + (object.extent.z > 1 ? 8 * slice : 0);
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
    : PermutationWarp(object, to_screen, send, screen, Region::all(screen)) {}

PermutationWarp::PermutationWarp(const Grid& object, const ShearChain& to_screen, Send send,
                                 const Extent& screen, const Region& box)
    : plan_{.object = object, .chain = to_screen, .send = send, .screen = screen, .box = box} {
    plan_.reach = screen_displacement_bound(to_screen);
    for (int k = 0; k < to_screen.count; ++k) plan_.error_moves[k] = moves_of(to_screen, k);
    for (int i = 0; i < 3; ++i) {
        // A point in the input, at most half a sample beyond the centres, is this far from its
        // site.
        plan_.halo[i] = std::int64_t(std::floor(0.5 + to_screen.displacement[i] + 1e-6));
    }
    const std::array<double, 3> origin = sheared(to_screen, {0, 0, 0});
    plan_.along_x = sheared(to_screen, {1, 0, 0});
    for (int i = 0; i < 3; ++i) plan_.along_x[i] -= origin[i];
    plan_.lanes = gathers_can_take(object);
}

Region PermutationWarp::sites() const noexcept {
    Region sites = Region::all(plan_.object.extent);
    for (int i = 0; i < 3; ++i) {
        sites.begin[i] -= plan_.halo[i];
        sites.end[i] += plan_.halo[i];
    }
    if (plan_.box == Region::all(plan_.screen)) return sites;
    // Those whose screen sites lie in the box, but for what the rule moves them by.
    const std::array<double, 3> origin = sheared(plan_.chain, {0, 0, 0});
    Eigen::Matrix3d forward;
    for (int k = 0; k < 3; ++k) {
        std::array<double, 3> unit{};
        unit[k] = 1;
        const std::array<double, 3> at = sheared(plan_.chain, unit);
        for (int i = 0; i < 3; ++i) forward(i, k) = at[i] - origin[i];
    }
    const Eigen::Matrix3d inverse = forward.inverse();
    for (int i = 0; i < 3; ++i) {
        double low = 0, high = 0;
        for (int k = 0; k < 3; ++k) {
            const double first = double(plan_.box.begin[k]) - plan_.reach[k] - origin[k];
            const double last = double(plan_.box.end[k] - 1) + plan_.reach[k] - origin[k];
            const double a = inverse(i, k) * first, b = inverse(i, k) * last;
            low += std::min(a, b);
            high += std::max(a, b);
        }
        const auto begin = static_cast<std::int64_t>(std::floor(low - 1e-3));
        const auto end = static_cast<std::int64_t>(std::ceil(high + 1e-3)) + 1;
        sites.begin[i] = std::clamp(begin, sites.begin[i], sites.end[i]);
        sites.end[i] = std::clamp(end, sites.begin[i], sites.end[i]);
    }
    return sites;
}

Region PermutationWarp::reads() const noexcept {
    Region box = sites();
    for (int i = 0; i < 3; ++i) {
        // Points are moved by the halo at most, and lie between two samples.
        const std::int64_t n = plan_.object.extent[i];
        box.begin[i] = std::clamp<std::int64_t>(box.begin[i] - plan_.halo[i] - 2, 0, n - 1);
        box.end[i] = std::clamp<std::int64_t>(box.end[i] + plan_.halo[i] + 2, 1, n);
    }
    return box;
}

PermutationWarp::Row PermutationWarp::row_at(std::int64_t y, std::int64_t z,
                                             Columns sites) const noexcept {
    Row row{.y = y, .z = z, .sites = sites};
    row.start = permuted<double>(plan_.chain, {0, double(y), double(z)});
    for (int i = 0; i < 3; ++i) row.step[i] = plan_.chain.from[i] == 0 ? plan_.chain.sign[i] : 0;
    const std::array<double, 3> first = sheared(plan_.chain, {0, double(y), double(z)});
    for (int i = 0; i < 3; ++i) {
        const double slack = plan_.reach[i] + 1e-3;
        row.sites = columns_between(first[i], plan_.along_x[i], double(plan_.box.begin[i]) - slack,
                                    double(plan_.box.end[i] - 1) + slack, row.sites);
    }
    return row;
}

void PermutationWarp::operator()(const Region& sites, float* screen) const noexcept {
    // Rows are prepared before any vector code runs: alternating between them row by row, where a
    // processor pays for each change between vector widths, took more than half of the time.
    std::array<Row, 64> rows;
    std::size_t count = 0;
    for (std::int64_t z = sites.begin[2]; z < sites.end[2]; ++z)
        for (std::int64_t y = sites.begin[1]; y < sites.end[1]; ++y) {
            rows[count] = row_at(y, z, {sites.begin[0], sites.end[0]});
            if (rows[count].sites.end > rows[count].sites.begin) ++count;
            if (count < rows.size()) continue;
            permute_simd(plan_, rows, screen);
            count = 0;
        }
    if (count > 0) permute_simd(plan_, {rows.data(), count}, screen);
}

Extent preferred_sites(const Extent& object) noexcept {
    if (object.z == 1) return {256, 64, 1};
    return {128, 16, 16};
}

}  // namespace edgewise::kernels
