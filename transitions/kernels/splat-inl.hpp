// Voxels that are splatted: which of a row, and to which pixels. Compiled once a target (Highway's
// foreach_target). No pragma once: the guard toggles, so that every target sees the text once.
#if defined(EDGEWISE_SPLAT_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef EDGEWISE_SPLAT_INL
#undef EDGEWISE_SPLAT_INL
#else
#define EDGEWISE_SPLAT_INL
#endif

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "hwy/highway.h"
#include "transitions/kernels/gathers-inl.hpp"
#include "transitions/kernels/scalar_load.hpp"
#include "transitions/kernels/splat.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {  // other kernels have names of their own in this namespace

using namespace gathers::HWY_NAMESPACE;  // NOLINT: the vectors and gathers
using Words = hn::RebindToUnsigned<Floats>;
using VW = hn::Vec<Words>;

constexpr int kMost = static_cast<int>(hn::MaxLanes(Floats()));
constexpr int kNarrow = 4;  // pixels: footprints of voxels no larger than a pixel, turned anyhow

/// Samples of a row along x, as f32.
template <class T>
struct TypedRow {
    const T* first;

    HWY_INLINE VF at(std::int64_t x, std::int64_t) const {
        if constexpr (std::is_same_v<T, float>) {
            return hn::LoadU(Floats(), first + x);
        } else {
            const hn::Rebind<T, Ints> narrow;
            return hn::ConvertTo(Floats(), hn::PromoteTo(Ints(), hn::LoadU(narrow, first + x)));
        }
    }
};

/// The same of a type that vectors do not load.
struct LoadedSamples {
    const void* samples;
    ScalarLoad load;
    std::int64_t first;

    HWY_INLINE VF at(std::int64_t x, std::int64_t n) const {
        HWY_ALIGN float values[kMost] = {};
        for (std::int64_t lane = 0; lane < std::min<std::int64_t>(n, kMost); ++lane)
            values[lane] = load(samples, first + x + lane);
        return hn::Load(Floats(), values);
    }
};

/// Lists the samples of a row from `begin` to `end` that are not empty.
template <class Row>
std::int64_t splatted(const Row& row, float empty, std::int64_t begin, std::int64_t end,
                      Splatted* list) {
    const Floats d;
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
    const VF nothing = hn::Set(d, empty), finite = hn::Set(d, 3.4028235e38f);
    std::int64_t count = 0;
    for (std::int64_t x = begin; x < end; x += lanes) {
        const VF sample = row.at(x, end - x);
        auto mine = hn::And(hn::Ne(sample, nothing), hn::Le(hn::Abs(sample), finite));
        if (end - x < lanes) mine = hn::And(mine, hn::FirstN(d, static_cast<std::size_t>(end - x)));
        if (hn::AllFalse(d, mine)) continue;
        HWY_ALIGN float values[kMost];
        hn::Store(hn::IfThenElseZero(mine, hn::Sub(sample, nothing)), d, values);
        for (std::int64_t lane = 0; lane < std::min(lanes, end - x); ++lane) {
            list[count] = {static_cast<std::int32_t>(x + lane), values[lane]};
            count += values[lane] != 0;
        }
    }
    return count;
}

/// Which voxels of a row have footprints that may meet the sums, and perhaps some more: what is cut
/// here is cut again, by the pixels that a footprint has.
class Meeting {
 public:
    Meeting(const Splat& splat, const SplatSums& sums) : splat_(splat) {
        for (std::size_t i = 0; i < 2; ++i) {
            low_[i] = double(sums.begin[i]) - splat.reach[i] - 1;
            high_[i] = double(sums.end[i]) + splat.reach[i];
            // Steps below move a row of 2^20 voxels by less than a pixel.
            const double step = splat.screen[i].voxel[0];
            inverse_[i] = std::abs(step) < 1e-6 ? 0 : 1 / step;
        }
    }
    HWY_INLINE SplatSpan of(SplatSpan span, std::int64_t y, std::int64_t z) const {
        double from = span.begin, to = span.end;
        for (std::size_t i = 0; i < 2; ++i) {
            const double start = splat_.screen[i].of(0, double(y), double(z));
            const double low = low_[i] - start, high = high_[i] - start;
            if (inverse_[i] == 0) {
                if (low > 1 || high < -1) return {};
                continue;
            }
            const double one = low * inverse_[i], other = high * inverse_[i];
            from = std::max(from, std::floor(std::min(one, other)));
            to = std::min(to, std::ceil(std::max(one, other)) + 1);
        }
        if (!(from < to)) return {};
        return {static_cast<std::int32_t>(from), static_cast<std::int32_t>(to)};
    }

 private:
    const Splat& splat_;
    std::array<double, 2> low_, high_, inverse_;
};

/// The pixels that a footprint may have.
struct Patch {
    double left, top;  // its first pixel

    HWY_INLINE Patch(const Splat& splat, double x, double y, double z)
        : left(std::ceil(splat.screen[0].of(x, y, z) - splat.reach[0])),
          top(std::ceil(splat.screen[1].of(x, y, z) - splat.reach[1])) {}
    HWY_INLINE bool meets(const Splat& splat, const SplatSums& sums) const {
        return left < double(sums.end[0]) && left + splat.patch[0] > double(sums.begin[0]) &&
               top < double(sums.end[1]) && top + splat.patch[1] > double(sums.begin[1]);
    }
};

/// Calls use(list, count, y, z) for the samples of rows that may meet the sums.
template <class Use>
void each_row(const Splat& splat, std::int64_t begin, std::int64_t end, const SplatSums& sums,
              Splatted* list, const Use& use) {
    const Grid& volume = splat.volume;
    const Meeting meeting(splat, sums);
    const auto by = [&](const auto& row_at) {
        for (std::int64_t z = begin; z < end; ++z)
            for (std::int64_t y = 0; y < volume.extent.y; ++y) {
                const SplatSpan span = splat.spans[z * volume.extent.y + y];
                if (span.begin >= span.end) continue;
                const SplatSpan meets = meeting.of(span, y, z);
                if (meets.begin >= meets.end) continue;
                const std::int64_t count =
                    splatted(row_at(z * volume.slice_step() + y * volume.row_step()), splat.empty,
                             meets.begin, meets.end, list);
                if (count > 0) use(list, count, y, z);
            }
    };
    const auto typed = [&](auto sample) {
        using T = decltype(sample);
        by([&](std::int64_t first) { return TypedRow<T>{volume.row_from<T>(first)}; });
    };
    switch (volume.type) {
        case Type::u8:
            return typed(std::uint8_t{});
        case Type::i8:
            return typed(std::int8_t{});
        case Type::u16:
            return typed(std::uint16_t{});
        case Type::i16:
            return typed(std::int16_t{});
        case Type::f32:
            return typed(float{});
        default: {
            const ScalarLoad load = scalar_load(volume.type);
            by([&](std::int64_t first) { return LoadedSamples{volume.samples, load, first}; });
        }
    }
}

/// The table of a voxel.
HWY_INLINE const float* table_of(const Splat& splat, std::int64_t x, std::int64_t y,
                                 std::int64_t z) {
    const Extent& n = splat.volume.extent;
    return splat.footprints->of({face_of(x, n.x), face_of(y, n.y), face_of(z, n.z)});
}

/// How vectors lie over the pixels of a footprint: one row of it each, or several rows that are no
/// longer than kNarrow.
template <bool kShort>
struct Vectors {
    static constexpr int kColumns = kShort ? kNarrow : kMost;
    static constexpr int kRows = kMost / kColumns;

    /// A place at a vector's pixels, from the one at its first.
    static VW lanes_of(const FixedPlace& place) {
        HWY_ALIGN std::uint32_t at[kMost];
        for (int lane = 0; lane < kMost; ++lane)
            at[lane] = place.right(lane % kColumns) + place.down(lane / kColumns);
        return hn::Load(Words(), at);
    }
    static HWY_INLINE void add(VF products, float* pixels, std::ptrdiff_t pitch) {
        const Floats d;
        if constexpr (kRows == 1) {
            hn::StoreU(hn::Add(hn::LoadU(d, pixels), products), d, pixels);
        } else {
            HWY_ALIGN float of[kMost];
            hn::Store(products, d, of);
            const hn::CappedTag<float, kNarrow> four;
            for (int row = 0; row < kRows; ++row) {
                float* to = pixels + row * pitch;
                hn::StoreU(hn::Add(hn::LoadU(four, to), hn::Load(four, of + row * kColumns)), four,
                           to);
            }
        }
    }
};

/// Where vectors of pixels lie in the tables of footprints.
template <bool kShort, int kCellBits>
class Lookup {
 public:
    explicit Lookup(const Splat& splat)
        : across_{Vectors<kShort>::lanes_of(splat.across[0]),
                  Vectors<kShort>::lanes_of(splat.across[1])},
          columns_(hn::Set(Words(), static_cast<std::uint32_t>(splat.footprints->columns()))),
          rows_(hn::Set(Words(), static_cast<std::uint32_t>(splat.footprints->rows()))),
          pitch_(hn::Set(Words(), static_cast<std::uint32_t>(splat.footprints->pitch()))) {}

    /// The entry of each pixel. Places beside the table take that behind its last row or column:
    /// those before it are large numbers without sign.
    HWY_INLINE VW places(std::uint32_t a, std::uint32_t b) const {
        const Words d;
        constexpr int kShift = kPlaceBits - kCellBits;
        const VW column =
            hn::Min(hn::ShiftRight<kShift>(hn::Add(hn::Set(d, a), across_[0])), columns_);
        const VW row = hn::Min(hn::ShiftRight<kShift>(hn::Add(hn::Set(d, b), across_[1])), rows_);
        return hn::Add(hn::Mul(row, pitch_), column);
    }

 private:
    std::array<VW, 2> across_;
    VW columns_, rows_, pitch_;
};

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
