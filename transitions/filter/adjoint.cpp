#include "transitions/filter/adjoint.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tbb/parallel_for.h>

#include "graph/with_type.hpp"
#include "transitions/kernels/scalar_load.hpp"

namespace edgewise {
namespace {

using Voxel = std::array<std::int64_t, 3>;

struct Height {
    Voxel at;
    double height;
};

SmallVector<Height> heights_of(const Neighbourhood& of) {
    SmallVector<Height> heights;
    std::size_t i = 0;
    for (std::int64_t z = of.low[2]; z <= of.high[2]; ++z)
        for (std::int64_t y = of.low[1]; y <= of.high[1]; ++y)
            for (std::int64_t x = of.low[0]; x <= of.high[0]; ++x, ++i)
                if (of.counts(of.weights[i])) heights.push_back({{x, y, z}, of.weights[i]});
    return heights;
}

/// The height at a place, NaN where there is none.
double height_at(const Neighbourhood& of, const Voxel& at) {
    for (std::size_t k = 0; k < 3; ++k)
        if (at[k] < of.low[k] || at[k] > of.high[k])
            return std::numeric_limits<double>::quiet_NaN();
    const Extent n = of.extent();
    return of.weights[static_cast<std::size_t>(
        at[0] - of.low[0] + n.x * (at[1] - of.low[1] + n.y * (at[2] - of.low[2])))];
}

bool is_own_mirror_image(const Neighbourhood& of, const SmallVector<Height>& heights) {
    return std::all_of(heights.begin(), heights.end(), [&](const Height& one) {
        for (std::size_t k = 0; k < 3; ++k) {
            Voxel at = one.at;
            at[k] = -at[k];
            if (!(height_at(of, at) == one.height)) return false;
        }
        return true;
    });
}

bool reaches_the_middle(const Neighbourhood& of, const SmallVector<Height>& heights) {
    return of.flat() && std::all_of(heights.begin(), heights.end(), [&](const Height& one) {
               for (std::size_t k = 0; k < 3; ++k) {
                   Voxel at = one.at;
                   if (at[k] == 0) continue;
                   at[k] -= at[k] > 0 ? 1 : -1;
                   if (std::isnan(height_at(of, at))) return false;
               }
               return true;
           });
}

/// Where a sample of an axis of n stands, itself and behind the borders, as far as the kernel
/// reaches.
SmallVector<std::int64_t> stands_at(Border border, std::int64_t at, std::int64_t n,
                                    std::int64_t low, std::int64_t high) {
    SmallVector<std::int64_t> places;
    for (std::int64_t place = std::min<std::int64_t>(low, 0);
         place < n + std::max<std::int64_t>(high, 0); ++place)
        if (bordered(border, place, n) == at) places.push_back(place);
    return places;
}

struct Frame {
    std::array<std::int64_t, 3> begin{}, end{};  // where results need no correction at the border

    Frame(const Neighbourhood& of, const Extent& n) {
        for (int axis = 0; axis < 3; ++axis) {
            const auto k = static_cast<std::size_t>(axis);
            // Sample r stands at -r too, and the first result reads as far as that.
            const std::int64_t reach =
                n[axis] > 1 && of.extent()[axis] > 1 ? std::max(of.high[k], -of.low[k]) + 1 : 0;
            begin[k] = std::min(reach, n[axis]);
            end[k] = std::max(begin[k], n[axis] - reach);
        }
    }
    bool inside(std::size_t k, std::int64_t at) const { return at >= begin[k] && at < end[k]; }
};

/// Numbers as they are stored, or values.
class Numbers {
 public:
    Numbers(const Data& data, bool stored) : data_(data) {
        if (!stored) map_ = data.what.values;
    }
    double operator[](std::int64_t i) const {
        if (data_.what.type == Type::f16)
            return map_(double(kernels::float_of_half(data_.as<std::uint16_t>()[i])));
        return with_type(data_.what.type, [&](auto type) {
            return map_(static_cast<double>(data_.as<decltype(type)>()[i]));
        });
    }

 private:
    const Data& data_;
    ValueMap map_;
};

}  // namespace

bool needs_adjoint(const Neighbourhood& second) {
    if (second.border != Border::mirror && second.border != Border::clamp) return false;
    const SmallVector<Height> heights = heights_of(second);
    return second.border == Border::mirror ? !is_own_mirror_image(second, heights)
                                           : !reaches_the_middle(second, heights);
}

double adjoined_samples(const Neighbourhood& second, const Extent& n) {
    const Frame frame(second, n);
    double middle = 1;
    for (std::size_t k = 0; k < 3; ++k) middle *= double(frame.end[k] - frame.begin[k]);
    return double(n.samples()) - middle;
}

void adjoin(const Neighbourhood& second, const Data& input, const Data& in, Data& out,
            const Context& context) {
    const Extent n = in.what.extent;
    const int channels = in.what.channels;
    const Frame frame(second, n);
    const SmallVector<Height> heights = heights_of(second);
    const bool least = second.rule == Neighbourhood::Rule::least;
    const Numbers numbers(in, out.what.values == in.what.values);
    const Numbers before(input, input.what.values == in.what.values);
    std::array<SmallVector<SmallVector<std::int64_t>>, 3> stands;
    for (int axis = 0; axis < 3; ++axis) {
        const auto k = static_cast<std::size_t>(axis);
        // q' = p - k of this pass, whose places are those of the first, turned.
        for (std::int64_t at = 0; at < n[axis]; ++at)
            stands[k].push_back(
                stands_at(second.border, at, n[axis], -second.high[k], -second.low[k]));
    }
    const auto extreme = [&](const Voxel& at, int channel) {
        double so_far = least ? std::numeric_limits<double>::infinity()
                              : -std::numeric_limits<double>::infinity();
        bool read = false;
        const auto of = [&](std::size_t k) -> const SmallVector<std::int64_t>& {
            return stands[k][static_cast<std::size_t>(at[k])];
        };
        for (const std::int64_t z : of(2))
            for (const std::int64_t y : of(1))
                for (const std::int64_t x : of(0))
                    for (const Height& one : heights) {
                        const std::int64_t px = x + one.at[0], py = y + one.at[1],
                                           pz = z + one.at[2];
                        if (px < 0 || py < 0 || pz < 0 || px >= n.x || py >= n.y || pz >= n.z)
                            continue;
                        const double number =
                            numbers[(px + n.x * (py + n.y * pz)) * channels + channel];
                        const double moved = least ? number - one.height : number + one.height;
                        if (std::isnan(moved)) return moved;
                        read = true;
                        so_far = least ? std::min(so_far, moved) : std::max(so_far, moved);
                    }
        return read ? so_far : before[(at[0] + n.x * (at[1] + n.y * at[2])) * channels + channel];
    };
    with_type(out.what.type, [&](auto type) {
        using T = decltype(type);
        tbb::parallel_for(std::int64_t{0}, n.y * n.z, [&](std::int64_t row) {
            if (context.stopped()) return;
            const std::int64_t y = row % n.y, z = row / n.y;
            const bool inner = frame.inside(1, y) && frame.inside(2, z);
            T* to = out.as<T>() + row * n.x * channels;
            for (std::int64_t x = 0; x < n.x; ++x) {
                if (inner && x == frame.begin[0]) x = frame.end[0];
                if (x >= n.x) break;
                for (int channel = 0; channel < channels; ++channel)
                    to[x * channels + channel] = static_cast<T>(extreme({x, y, z}, channel));
            }
        });
    });
    context.poll();
}

}  // namespace edgewise
