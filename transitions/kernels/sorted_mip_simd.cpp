// The largest sample along rays, brick after brick in descending order of bounds.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <new>
#include <type_traits>

#include "transitions/kernels/sorted_mip.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/sorted_mip_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/ray_cast-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

/// A tile and what it may see.
struct SortedTile {
    const RayCast& cast;
    const SortedBricks& bricks;
    const ShownBricks& shown;
    std::span<const std::int32_t> order;
    std::int64_t x, y, width, height;
    float* out;
    std::ptrdiff_t row_floats;
    std::byte* room;
};

constexpr int kColumns = kSortedTile / kWidth, kRows = kSortedTile / kHeight;
constexpr int kPackets = kColumns * kRows;

/// The packets of a tile, and what they have seen so far. Those whose rays meet nothing are not
/// made.
struct Packets {
    HWY_ALIGN float best[kPackets][kLanes];  // as MaxSum has it
    HWY_ALIGN float least[kPackets];         // of a packet's rays; none: +inf
    bool any[kPackets] = {};                 // whether rays of a packet meet the volume
    struct alignas(Packet) Room {
        std::byte bytes[sizeof(Packet)];
    } rooms[kPackets];

    Packet& rays(int packet) { return *std::launder(reinterpret_cast<Packet*>(&rooms[packet])); }
    const Packet& rays(int packet) const {
        return *std::launder(reinterpret_cast<const Packet*>(&rooms[packet]));
    }

    Packets(const SortedTile& tile, const ParallelRays& shared);
    /// What all rays have seen.
    float least_of_all() const {
        const DF d;
        VF lanes = hn::Load(d, least);
        for (std::size_t i = kLanes; i < kPackets; i += kLanes)
            lanes = hn::Min(lanes, hn::Load(d, least + i));
        return hn::GetLane(hn::MinOfLanes(d, lanes));
    }
};
static_assert(kPackets % kLanes == 0);

Packets::Packets(const SortedTile& tile, const ParallelRays& shared) {
    const float floor = tile.bricks.floor;
    std::fill_n(&best[0][0], kPackets * kLanes, floor);
    std::fill_n(least, kPackets, std::numeric_limits<float>::infinity());
    const auto left = static_cast<double>(tile.x), top = static_cast<double>(tile.y);
    const Shadow shadow(tile.cast, shared, left, top, static_cast<double>(tile.width),
                        static_cast<double>(tile.height));
    for (int row = 0; row * kHeight < tile.height; ++row) {
        const int rows = std::min(kHeight, static_cast<int>(tile.height) - row * kHeight);
        const double above = top + row * kHeight;
        const Shadow::Columns seen = shadow.columns(above, above + rows - 1);
        for (int column = 0; column * kWidth < tile.width; ++column) {
            const int columns = std::min(kWidth, static_cast<int>(tile.width) - column * kWidth);
            const double before = left + column * kWidth;
            if (before + columns - 1 < seen.first || before > seen.last) continue;
            const int packet = row * kColumns + column;
            auto* const made = new (&rooms[packet]) Packet;
            any[packet] = made->prepare(tile.cast, shared, before, above, columns, rows);
            if (any[packet]) least[packet] = floor;
        }
    }
}

/// Cells of a packet that some of its rays have in a brick [cell].
struct CellsIn {
    double enters, leaves;

    /// Those that are sampled in the middle.
    int first() const { return whole(std::ceil(enters - 0.5)); }
    int last() const { return whole(std::floor(leaves - 0.5)); }
    /// Cells at the ends of rays may be sampled half a cell from there.
    int first_part() const { return whole(std::ceil(enters - 1)); }
    int last_part() const { return whole(std::floor(leaves)); }

 private:
    static int whole(double cell) { return static_cast<int>(std::clamp(cell, -1e9, 1e9)); }
};

/// Where the rays of a tile's packets meet a brick. Along each axis a ray enters at a cell that is
/// an affine function of its pixel.
class Crossing {
 public:
    Crossing(const SortedTile& tile, const ParallelRays& shared) : shared_(shared) {
        const Rays::Field& origin = tile.cast.rays.origin;
        corner_ = origin.at(static_cast<double>(tile.x), static_cast<double>(tile.y));
        for (std::size_t a = 0; a < 3; ++a) {
            const double right = (kWidth - 1) * origin.x[a], down = (kHeight - 1) * origin.y[a];
            across_[a] = kWidth * origin.x[a];
            down_[a] = kHeight * origin.y[a];
            least_[a] = std::min(right, 0.0) + std::min(down, 0.0);
            most_[a] = std::max(right, 0.0) + std::max(down, 0.0);
        }
    }
    void take(const BrickBox& box) {
        for (std::size_t a = 0; a < 3; ++a) {
            low_[a] = box.low[a] - corner_[a] - most_[a];
            high_[a] = box.high[a] - corner_[a] - least_[a];
        }
    }
    HWY_INLINE CellsIn of(int column, int row) const {
        CellsIn in{-1e9, 1e9};
        for (std::size_t a = 0; a < 3; ++a) {
            const double at = column * across_[a] + row * down_[a];
            const double low = low_[a] - at, high = high_[a] - at, inverse = shared_.inverse[a];
            if (inverse == 0) {
                if (low > 0 || high < 0) return {1e9, -1e9};
                continue;
            }
            const double one = low * inverse, other = high * inverse;
            in.enters = std::max(in.enters, std::min(one, other));
            in.leaves = std::min(in.leaves, std::max(one, other));
        }
        return in;
    }

 private:
    const ParallelRays& shared_;
    std::array<double, 3> corner_, across_{}, down_{}, least_{}, most_{}, low_{}, high_{};
};

/// Samples the cells of a packet in a brick. @return how many whole ones
template <class Sum, class Sampler>
HWY_NOINLINE int sample(const Packet& packet, const Sampler& sampler, const CellsIn& in, Sum& sum) {
    const Lanes lanes(packet);
    const int begin = std::max(in.first(), packet.inner_begin),
              end = std::min(in.last() + 1, packet.inner_end);
    if (begin < end) walk_all(lanes, sampler, sum, begin, end);
    const int first = std::max(in.first_part(), packet.begin),
              last = std::min(in.last_part() + 1, packet.end);
    const int before = std::min(last, packet.inner_begin),
              behind = std::max(first, packet.inner_end);
    if (first < before) walk_partial(packet, lanes, sampler, sum, first, before);
    if (behind < last) walk_partial(packet, lanes, sampler, sum, behind, last);
    return std::max(0, end - begin);
}

/// Packets of a tile along one axis, of `side` pixels each, that lie within a distance of a pixel;
/// none: first > last.
struct PacketsAround {
    int first, last;

    PacketsAround(float pixel, float distance, int side, int count) {
        const float least = std::ceil(pixel - distance), most = std::floor(pixel + distance);
        const auto width = static_cast<float>(side), top = static_cast<float>(count - 1);
        first = static_cast<int>(std::min(std::floor(std::max(0.0f, least) / width), top + 1));
        last = static_cast<int>(std::clamp(std::floor(most / width), -1.0f, top));
    }
};

template <class Sum, class Sampler>
std::int64_t project(const SortedTile& tile, const Sampler& sampler, Packets& packets,
                     const ParallelRays& shared) {
    constexpr int kLooks = 16;  // bricks between looks at whether all rays have seen as much
    const RayCast& cast = tile.cast;
    const VF sign = hn::Set(DF(), cast.volume.values.slope < 0 ? -0.0f : 0.0f);
    const auto left = static_cast<float>(tile.x), top = static_cast<float>(tile.y);
    Crossing crossing(tile, shared);
    std::int64_t taken = 0;
    int looks = 0;
    for (const std::int32_t next : tile.order) {
        const SortedBrick& brick = tile.bricks.bricks[static_cast<std::size_t>(next)];
        if (looks++ % kLooks == 0 && !(brick.bound > packets.least_of_all())) break;
        const auto& middle = tile.shown.middles[static_cast<std::size_t>(next)];
        const PacketsAround columns(middle[0] - left, tile.shown.half_width, kWidth, kColumns);
        const PacketsAround rows(middle[1] - top, tile.shown.half_height, kHeight, kRows);
        bool found = false;
        for (int row = rows.first; row <= rows.last; ++row)
            for (int column = columns.first; column <= columns.last; ++column) {
                const int at = row * kColumns + column;
                if (!(brick.bound > packets.least[at])) continue;
                if (!found) crossing.take({tile.bricks, brick.place});
                found = true;
                const CellsIn in = crossing.of(column, row);
                if (in.first_part() > in.last_part()) continue;
                Sum sum(cast);
                sum.add(hn::Xor(hn::Load(DF(), packets.best[at]), sign), 0);
                const int cells = sample(packets.rays(at), sampler, in, sum);
                const typename Sum::Lanewise seen(sum);
                const VF best = hn::Load(DF(), seen.best);
                hn::Store(best, DF(), packets.best[at]);
                packets.least[at] = hn::GetLane(hn::MinOfLanes(DF(), best));
                taken += cells * static_cast<int>(kLanes);
            }
    }
    return taken;
}

template <class Sum>
void write(const SortedTile& tile, const Packets& packets) {
    for (int row = 0; row < tile.height; ++row)
        for (int first = 0; first < tile.width; first += kWidth) {
            const int at = row / kHeight * kColumns + first / kWidth;
            typename Sum::Lanewise seen{Sum(tile.cast)};
            std::copy_n(packets.best[at], kLanes, seen.best);
            for (int i = 0; i < std::min(kWidth, static_cast<int>(tile.width) - first); ++i) {
                const int lane = row % kHeight * kWidth + i;
                const bool hit = packets.any[at] && packets.rays(at).hit[lane];
                seen.write(tile.cast, lane, hit, 0, tile.out + row * tile.row_floats + first + i);
            }
        }
}

template <class Sum, class Read>
std::int64_t fill_tile(const SortedTile& tile) {
    static_assert(std::is_trivially_destructible_v<Packets>);
    const ParallelRays shared(tile.cast);
    Packets& packets = *new (tile.room) Packets(tile, shared);
    const Grid& volume = tile.cast.volume;
    const std::int64_t taken = [&] {
        switch (tile.cast.hold) {
            case Hold::zoh:
                return project<Sum>(tile, NearestSampler<Read>(volume), packets, shared);
            case Hold::bspline3:
                // Coefficients are f32; of other types they are merely allowed.
                if constexpr (Read::kFloats)
                    return project<Sum>(tile, SplineSampler<Read>(volume), packets, shared);
                else
                    return project<Sum>(tile, SplineSampler<Walked>(volume), packets, shared);
            default:
                return project<Sum>(tile, LinearSampler<Read>(volume), packets, shared);
        }
    }();
    write<Sum>(tile, packets);
    return taken;
}

std::int64_t sorted_tile(const SortedTile& tile) {
    const Grid& volume = tile.cast.volume;
    const double bytes =
        static_cast<double>(volume.extent.samples()) * static_cast<double>(bytes_of(volume.type));
    if (kPlainLoops || !(bytes < 2147483648.0) || !in_lanes(volume.type))
        return fill_tile<MaxSum<false>, Walked>(tile);
    std::int64_t taken = 0;
    if constexpr (!kPlainLoops)
        gathers::HWY_NAMESPACE::with_reads(volume.type, [&](auto reads) {
            using Reads = decltype(reads);
            constexpr bool kFinite = std::is_integral_v<typename Reads::Sample>;
            taken = fill_tile<MaxSum<kFinite>, Gathered<Reads>>(tile);
        });
    return taken;
}

std::int64_t sorted_mip_on(const RayCast& cast, const SortedBricks& bricks,
                           const ShownBricks& shown, std::span<const std::int32_t> order,
                           std::int64_t x, std::int64_t y, std::int64_t width, std::int64_t height,
                           float* out, std::ptrdiff_t row_floats, std::byte* room) {
    return sorted_tile({cast, bricks, shown, order, x, y, width, height, out, row_floats, room});
}

std::size_t sorted_room_on() { return sizeof(Packets); }

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(sorted_mip_on);
HWY_EXPORT(sorted_room_on);

std::size_t sorted_room() { return HWY_DYNAMIC_DISPATCH(sorted_room_on)(); }

std::int64_t sorted_mip(const RayCast& cast, const SortedBricks& bricks, const ShownBricks& shown,
                        std::span<const std::int32_t> order, std::int64_t x, std::int64_t y,
                        std::int64_t width, std::int64_t height, float* out,
                        std::ptrdiff_t row_floats, std::byte* room) {
    return HWY_DYNAMIC_DISPATCH(sorted_mip_on)(cast, bricks, shown, order, x, y, width, height, out,
                                               row_floats, room);
}

}  // namespace edgewise::kernels
#endif
