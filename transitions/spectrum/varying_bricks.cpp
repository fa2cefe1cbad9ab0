#include "transitions/spectrum/varying_bricks.hpp"

#include <algorithm>
#include <random>
#include <tbb/parallel_for.h>
#include <type_traits>

#include "graph/with_type.hpp"

namespace edgewise {
namespace {

using Lengths = VaryingBricks::Lengths;

constexpr int kLooked = 32;
constexpr std::size_t kBatch = 256;  // bricks looked at together, where 32 were not enough

std::int64_t product(const Lengths& n) { return n[0] * n[1] * n[2]; }

/// Bricks that tile the data; where they do not fit, they overlap.
struct Tiling {
    Lengths extent, brick, count;
    bool shifted = false;  // by half a brick along all axes, as far as the data reach

    explicit Tiling(const Extent& n) : extent{n.x, n.y, n.z} {
        const std::int64_t side = n.z == 1 ? VaryingBricks::kSideOfImages : VaryingBricks::kSide;
        for (std::size_t k = 0; k < 3; ++k) {
            brick[k] = std::min(extent[k], side);
            count[k] = (extent[k] + side - 1) / side;
        }
    }
    /// The first sample of brick i.
    Lengths origin(std::int64_t i) const {
        Lengths at;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::int64_t place = i % count[k], last = count[k] - 1;
            at[k] = last > 0 ? place * (extent[k] - brick[k]) / last : 0;
            if (shifted) at[k] = std::min(at[k] + brick[k] / 2, extent[k] - brick[k]);
            i /= count[k];
        }
        return at;
    }
    bool meets(const Region& box, std::int64_t i) const {
        const Lengths from = origin(i);
        bool any = true;
        for (std::size_t k = 0; k < 3; ++k)
            any &= from[k] < box.end[k] && from[k] + brick[k] > box.begin[k];
        return any;
    }
};

double drawn(std::mt19937_64& bits) { return static_cast<double>(bits() >> 11) * 0x1p-53; }

/// All bricks where these are few, else one from each of 32 stretches of the tiling. Neighbours are
/// far apart in this order (bits are reversed), so that those that are used lie all over the data.
std::vector<std::int64_t> first_looks(std::int64_t bricks) {
    std::vector<std::int64_t> order;
    std::mt19937_64 bits(kLooked);
    for (int i = 0; i < kLooked; ++i) {
        int stretch = 0;
        for (int bit = 1; bit < kLooked; bit *= 2) stretch = stretch * 2 + (i & bit ? 1 : 0);
        const double place = (stretch + drawn(bits)) / kLooked * static_cast<double>(bricks);
        if (bricks > kLooked)
            order.push_back(static_cast<std::int64_t>(place));
        else if (stretch < bricks)
            order.push_back(stretch);
    }
    return order;
}

/// All other bricks in which anything can vary, shuffled.
std::vector<std::int64_t> further_looks(const Tiling& tiling, const Region& occupied,
                                        const std::vector<std::int64_t>& looked) {
    const std::int64_t bricks = product(tiling.count);
    std::vector<std::int64_t> order;
    for (std::int64_t i = 0; i < bricks; ++i)
        if (tiling.meets(occupied, i) && std::find(looked.begin(), looked.end(), i) == looked.end())
            order.push_back(i);
    std::mt19937_64 bits(VaryingBricks::kMost);
    for (std::size_t i = order.size(); i > 1; --i)
        std::swap(order[i - 1],
                  order[static_cast<std::size_t>(drawn(bits) * static_cast<double>(i))]);
    return order;
}

/// Whether a row has a finite number other than `first`, which is the first finite one so far.
template <class T>
bool row_varies(const T* row, std::int64_t n, std::int64_t step, T& first, bool& any_finite) {
    const auto is_finite = [](T v) {
        if constexpr (std::is_integral_v<T>)
            return true;
        else
            return v - v == T(0);
    };
    std::int64_t x = 0;
    for (; !any_finite && x < n; ++x)
        if (is_finite(row[x * step])) {
            first = row[x * step];
            any_finite = true;
        }
    unsigned differs = 0;
    for (; x < n; ++x)
        differs |= static_cast<unsigned>((row[x * step] != first) & is_finite(row[x * step]));
    return differs != 0;
}

/// Whether a brick has two different finite values in one channel.
bool varies(const Data& data, const Lengths& from, const Lengths& brick) {
    const Representation& what = data.what;
    return with_type(what.type, [&]<class T>(T) {
        for (int channel = 0; channel < what.channels; ++channel) {
            T first{};
            bool any_finite = false;
            for (std::int64_t z = from[2]; z < from[2] + brick[2]; ++z)
                for (std::int64_t y = from[1]; y < from[1] + brick[1]; ++y) {
                    const std::int64_t at = (z * what.extent.y + y) * what.extent.x + from[0];
                    if (row_varies(data.as<T>() + at * what.channels + channel, brick[0],
                                   std::int64_t{what.channels}, first, any_finite))
                        return true;
                }
        }
        return false;
    });
}

class Search {
 public:
    Search(const Data& data, const Region& occupied) : data_(data), tiling_(data.what.extent) {
        found_.brick = tiling_.brick;
        const std::vector<std::int64_t> first = first_looks(product(tiling_.count));
        look(first, first.size());
        if (enough()) return;
        look(further_looks(tiling_, occupied, first), kBatch);
        if (!found_.first.empty() || occupied.empty()) return;
        // Data that change between bricks only: some that lie half-way between them have both.
        tiling_.shifted = true;
        look(further_looks(tiling_, Region::all(data.what.extent), {}), kBatch);
    }
    const VaryingBricks& found() const noexcept { return found_; }

 private:
    bool enough() const noexcept { return found_.first.size() == VaryingBricks::kMost; }

    void look(const std::vector<std::int64_t>& order, std::size_t batch) {
        for (std::size_t begin = 0; begin < order.size() && !enough(); begin += batch) {
            const std::size_t size = std::min(batch, order.size() - begin);
            std::vector<char> full(size);
            tbb::parallel_for(std::size_t{0}, size, [&](std::size_t i) {
                full[i] = varies(data_, tiling_.origin(order[begin + i]), tiling_.brick);
            });
            for (std::size_t i = 0; i < size && !enough(); ++i) {
                found_.samples += product(tiling_.brick) * data_.what.channels;
                if (full[i])
                    found_.first.push_back(tiling_.origin(order[begin + i]));
                else
                    ++found_.empty;
            }
        }
    }

    const Data& data_;
    Tiling tiling_;
    VaryingBricks found_;
};

}  // namespace

VaryingBricks varying_bricks(const Data& data, const Region& occupied) {
    return Search(data, occupied).found();
}

}  // namespace edgewise
