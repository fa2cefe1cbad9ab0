#include "graph/spread.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

namespace edgewise {
namespace {

// Ranks side by side that share a port of the network: 4 x 4 on the MasPar (16 to a router port).
constexpr double kPortSide = 4;

/// Prime factors, the greatest first.
std::vector<int> factors_of(int n) {
    std::vector<int> factors;
    for (int p = 2; p * p <= n; ++p)
        for (; n % p == 0; n /= p) factors.push_back(p);
    if (n > 1) factors.push_back(n);
    std::reverse(factors.begin(), factors.end());
    return factors;
}

double meeting(const Mat4& map, const Cut& cut, Layout layout, int axes) {
    if (axes == 2 || layout != Layout::columns) return 1;
    const double squeezed = std::abs(map.topLeftCorner<2, 2>().determinant());
    const double most = std::max(1.0, std::sqrt(double(cut[0]) * cut[1]) / kPortSide);
    return std::clamp(1 / std::max(squeezed, 1e-9), 1.0, most);
}

}  // namespace

Cut cut_of(Layout layout, const Extent& extent, int axes, int ranks) {
    Cut cut{1, 1, 1};
    if (layout != Layout::columns && layout != Layout::diced) return cut;
    const int cuttable = axes == 3 && layout == Layout::diced ? 3 : 2;
    for (const int factor : factors_of(ranks)) {
        int longest = 0;
        for (int axis = 1; axis < cuttable; ++axis)
            if (static_cast<double>(extent[axis]) / cut[axis] >
                static_cast<double>(extent[longest]) / cut[longest])
                longest = axis;
        cut[longest] *= factor;
    }
    return cut;
}

Moves moves_of(const Mat4& map, const Extent& from, const Extent& to, int axes, Layout layout,
               int ranks) {
    const int side = axes == 2 ? 24 : 8, depth = axes == 2 ? 1 : side;
    int seen = 0;
    for (int k = 0; k < depth; ++k)
        for (int j = 0; j < side; ++j)
            for (int i = 0; i < side; ++i) {
                const auto place = [](int step, int steps, std::int64_t n) {
                    return (step + 0.5) / steps * static_cast<double>(n) - 0.5;
                };
                const Eigen::Vector4d p(place(i, side, from.x), place(j, side, from.y),
                                        place(k, depth, from.z), 1);
                const Eigen::Vector4d q = map * p;
                bool inside = q[3] > 0;
                for (int axis = 0; axis < axes; ++axis)
                    inside = inside && q[axis] / q[3] >= -0.5 &&
                             q[axis] / q[3] <= static_cast<double>(to[axis]) - 0.5;
                seen += inside;
            }
    return {.seen = double(seen) / (side * side * depth),
            .meet = meeting(map, cut_of(layout, from, axes, ranks), layout, axes)};
}

double halo_samples(const Extent& extent, const Cut& cut, int halo) {
    double inner = 1, outer = 1;
    for (int axis = 0; axis < 3; ++axis) {
        const double side = std::ceil(static_cast<double>(extent[axis]) / cut[axis]);
        inner *= side;
        outer *= side + (cut[axis] > 1 ? 2 * halo : 0);
    }
    return outer - inner;
}

}  // namespace edgewise
