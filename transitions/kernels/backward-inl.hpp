// Vector code of the backward warp, compiled once a target (Highway's foreach_target).
// No pragma once: the guard toggles, so that every target sees the text once.
#if defined(EDGEWISE_BACKWARD_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef EDGEWISE_BACKWARD_INL
#undef EDGEWISE_BACKWARD_INL
#else
#define EDGEWISE_BACKWARD_INL
#endif

#include <array>
#include <cstdint>
#include <type_traits>

#include "hwy/highway.h"
#include "transitions/kernels/backward_rows.hpp"
#include "transitions/kernels/gathers-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using namespace gathers::HWY_NAMESPACE;  // NOLINT: the other half of this file

/// a + f (b - a) (EQ 14). Where f is 0 the sample itself: not 0 * NaN, and -0 keeps its sign.
/// Border cells also have f = 1, where this formula would be off by a rounding.
template <class T, bool kBorder>
HWY_INLINE VF linear(VF a, VF b, VF f) {
    const Floats d;
    VF blend = hn::MulAdd(f, hn::Sub(b, a), a);
    if constexpr (!std::is_same_v<T, float>) return blend;
    if constexpr (kBorder) blend = hn::IfThenElse(hn::Eq(f, hn::Set(d, 1.0f)), b, blend);
    return hn::IfThenElse(hn::Eq(f, hn::Zero(d)), a, blend);
}

/// Weights of the cubic B-spline for the taps at cell-1 .. cell+2.
struct CubicWeights {
    VF w[4];
};

HWY_INLINE CubicWeights cubic_weights(VF f) {
    const Floats d;
    const VF sixth = hn::Set(d, 1.0f / 6), half = hn::Set(d, 0.5f), centre = hn::Set(d, 2.0f / 3);
    const VF one = hn::Set(d, 1.0f), two = hn::Set(d, 2.0f);
    const VF g = hn::Sub(one, f), ff = hn::Mul(f, f), gg = hn::Mul(g, g);
    CubicWeights weights;
    weights.w[0] = hn::Mul(hn::Mul(gg, g), sixth);
    weights.w[1] = hn::NegMulAdd(hn::Mul(ff, half), hn::Sub(two, f), centre);
    weights.w[2] = hn::NegMulAdd(hn::Mul(gg, half), hn::Add(one, f), centre);
    weights.w[3] = hn::Mul(hn::Mul(ff, f), sixth);
    return weights;
}

/// Positions of a vector of columns: cells counted from the block's origin, and fractions in [0,
/// 1).
template <int kAxes>
struct Places {
    VI cell[kAxes];
    VF fraction[kAxes];
};

/// Rows that are prepared together, so that the f64 arithmetic of row starts fills vectors too:
/// sixteen rows of up to eight blocks of one slice.
struct Batch {
    static constexpr int kRows = 16, kBlocks = 8;
    alignas(64) std::int64_t offset[kBlocks][kRows];  // bytes from sample 0 to the origin's cell
    alignas(64) std::int32_t cell[3][kBlocks][kRows];
    alignas(64) std::int32_t fraction[3][kBlocks][kRows];  // of the origin, in units of 2^-23
    alignas(64) double start[3][kRows];                    // position of column 0
    alignas(64) double seen[2][kRows], inner[2][kRows];    // first and last column, not rounded
};

/// Intersects the columns of each row with low <= start + x * step <= high.
HWY_INLINE void cut_columns(const double* start, double inverse, Range range,
                            double (&columns)[2][Batch::kRows]) {
    constexpr double kNone = 1e300;
    for (int r = 0; r < Batch::kRows; ++r) {
        const double one = (range.low - start[r]) * inverse;
        const double other = (range.high - start[r]) * inverse;
        const bool never = inverse == 0 && (start[r] < range.low || start[r] > range.high);
        const double first = inverse == 0 ? (never ? kNone : -kNone) : std::min(one, other);
        const double last = inverse == 0 ? (never ? -kNone : kNone) : std::max(one, other);
        columns[0][r] = std::max(columns[0][r], first);
        columns[1][r] = std::min(columns[1][r], last);
    }
}

/// Row starts, and which columns see the input: numbers that do not depend on the region.
template <int kAxes>
HWY_INLINE void start_rows(const BackwardPlan& plan, std::int64_t y, std::int64_t z, Span columns,
                           bool cut, Batch& batch) {
    for (int r = 0; r < Batch::kRows; ++r) {
        batch.seen[0][r] = batch.inner[0][r] = double(columns.begin);
        batch.seen[1][r] = batch.inner[1][r] = double(columns.end - 1);
    }
    for (int a = 0; a < kAxes; ++a) {
        const double* m = &plan.map[4 * a];
        for (int r = 0; r < Batch::kRows; ++r)
            batch.start[a][r] = m[1] * double(y + r) + m[2] * double(z) + m[3];
        if (!cut) continue;
        const std::int64_t n = plan.extent[a];
        cut_columns(batch.start[a], plan.inverse[a], seen_range(n), batch.seen);
        cut_columns(batch.start[a], plan.inverse[a], inner_range(n, plan.hold), batch.inner);
    }
}

/// Origins of the blocks from column x (a multiple of kBlock) on.
template <Hold kHold, int kAxes>
HWY_INLINE void place_blocks(const BackwardPlan& plan, std::int64_t x, int blocks, Batch& batch) {
    constexpr std::int64_t kHalf = kHold == Hold::zoh ? std::int64_t{1} << 39 : 0;
    constexpr double kFarthest = 1 << 22;  // keeps blocks that see nothing convertible
    for (int b = 0; b < blocks; ++b) {
        const std::int64_t column = x + b * kBlock, chunk = column & ~std::int64_t{kChunk - 1};
        for (int a = 0; a < kAxes; ++a) {
            const double along = double(chunk) * plan.map[4 * a];
            // 2^16 rounds to the 23 bits that lanes keep.
            const std::int64_t rest =
                (column - chunk) / kBlock * plan.step16[a] + kHalf + (std::int64_t{1} << 16);
            for (int r = 0; r < Batch::kRows; ++r) {
                const double place =
                    std::min(std::max(batch.start[a][r] + along, -kFarthest), kFarthest);
                const std::int64_t fixed = (std::int64_t(place * kFixedOne) + rest) >> 17;
                const std::int64_t cell = fixed >> 23;
                batch.cell[a][b][r] = std::int32_t(cell);
                batch.fraction[a][b][r] = std::int32_t(fixed & 0x7fffff);
                const std::int64_t before = a == 0 ? 0 : batch.offset[b][r];
                batch.offset[b][r] = before + cell * plan.stride[a];
            }
        }
    }
}

template <int kAxes>
HWY_INLINE Places<kAxes> places_at(const BackwardPlan& plan, const Batch& batch, int b, int r,
                                   int lane) {
    const Ints di;
    const Floats d;
    const VI mask = hn::Set(di, 0x7fffff), exponent = hn::Set(di, 0x3f800000);
    Places<kAxes> places;
    for (int a = 0; a < kAxes; ++a) {
        const VI t =
            hn::Add(hn::Set(di, batch.fraction[a][b][r]), hn::Load(di, plan.lane[a].data() + lane));
        places.cell[a] = hn::ShiftRight<23>(t);
        // The 23 bits become the fraction of a float in [1, 2): no rounding, no conversion.
        const VI bits = hn::Or(hn::And(t, mask), exponent);
        places.fraction[a] = hn::Sub(hn::BitCast(d, bits), hn::Set(d, 1.0f));
    }
    return places;
}

/// Byte offsets of the cells from `base`.
template <class T, int kAxes, bool kNeighbours>
HWY_INLINE VI offsets_of(const BackwardPlan& plan, const Places<kAxes>& at) {
    const Ints di;
    VI offset = hn::Mul(at.cell[1], hn::Set(di, std::int32_t(plan.stride[1])));
    if constexpr (kAxes == 3)
        offset = hn::Add(offset, hn::Mul(at.cell[2], hn::Set(di, std::int32_t(plan.stride[2]))));
    if constexpr (!kNeighbours)
        return hn::Add(offset, hn::Mul(at.cell[0], hn::Set(di, std::int32_t(plan.stride[0]))));
    return hn::Add(offset, hn::ShiftLeft<sizeof(T) / 2>(at.cell[0]));
}

/// Bilinear or trilinear value of cells whose upper neighbours exist (or have the fraction 0).
template <class T, int kAxes, bool kNeighbours, bool kBorder>
HWY_INLINE VF linear_value(const BackwardPlan& plan, const std::uint8_t* base, VI offset,
                           const Places<kAxes>& at) {
    const auto line = [&](const std::uint8_t* row) HWY_ATTR {
        if constexpr (kNeighbours) {
            const Pair taps = gather_pair<T>(row, offset);
            return linear<T, kBorder>(taps.first, taps.second, at.fraction[0]);
        } else {
            const VF first = gather_one<T>(row, offset);
            const VF second = gather_one<T>(row + plan.next[0], offset);
            return linear<T, kBorder>(first, second, at.fraction[0]);
        }
    };
    const auto plane = [&](const std::uint8_t* slice) HWY_ATTR {
        const VF low = line(slice), high = line(slice + plan.next[1]);
        return linear<T, kBorder>(low, high, at.fraction[1]);
    };
    if constexpr (kAxes == 2) {
        return plane(base);
    } else {
        const VF low = plane(base), high = plane(base + plan.next[2]);
        return linear<T, kBorder>(low, high, at.fraction[2]);
    }
}

/// Cubic B-spline value where all taps exist.
template <int kAxes, bool kNeighbours>
HWY_INLINE VF cubic_value(const BackwardPlan& plan, const std::uint8_t* base, VI offset,
                          const Places<kAxes>& at) {
    const CubicWeights wx = cubic_weights(at.fraction[0]), wy = cubic_weights(at.fraction[1]);
    const auto pair = [&](const std::uint8_t* row) HWY_ATTR {
        if constexpr (kNeighbours) return gather_pair<float>(row, offset);
        return Pair{gather_one<float>(row, offset),
                    gather_one<float>(row + plan.stride[0], offset)};
    };
    const auto plane = [&](const std::uint8_t* slice) HWY_ATTR {
        VF sum = hn::Zero(Floats());
        for (int j = 0; j < 4; ++j) {
            const std::uint8_t* row = slice + (j - 1) * plan.stride[1];
            const Pair left = pair(row - plan.stride[0]), right = pair(row + plan.stride[0]);
            VF line = hn::Mul(wx.w[0], left.first);
            line = hn::MulAdd(wx.w[1], left.second, line);
            line = hn::MulAdd(wx.w[2], right.first, line);
            line = hn::MulAdd(wx.w[3], right.second, line);
            sum = hn::MulAdd(wy.w[j], line, sum);
        }
        return sum;
    };
    if constexpr (kAxes == 2) {
        return plane(base);
    } else {
        const CubicWeights wz = cubic_weights(at.fraction[2]);
        VF sum = hn::Zero(Floats());
        for (int k = 0; k < 4; ++k)
            sum = hn::MulAdd(wz.w[k], plane(base + (k - 1) * plan.stride[2]), sum);
        return sum;
    }
}

/// Reconstruction where all taps exist. `base` points at the origin's sample.
template <class T, Hold kHold, int kAxes, bool kNeighbours>
HWY_INLINE VF inner_value(const BackwardPlan& plan, const std::uint8_t* base,
                          const Places<kAxes>& at) {
    const VI offset = offsets_of<T, kAxes, kNeighbours>(plan, at);
    if constexpr (kHold == Hold::zoh) {
        return gather_one<T>(base, offset);
    } else if constexpr (kHold == Hold::foh) {
        return linear_value<T, kAxes, kNeighbours, false>(plan, base, offset, at);
    } else {
        return cubic_value<kAxes, kNeighbours>(plan, base, offset, at);
    }
}

/// Whole-sample mirror for taps at most three samples outside; axes of 1 and 2 samples included.
HWY_INLINE VI mirror_lanes(VI index, VI low, VI high) {
    index = hn::Add(low, hn::Abs(hn::Sub(index, low)));
    index = hn::Sub(high, hn::Abs(hn::Sub(high, index)));
    index = hn::Add(low, hn::Abs(hn::Sub(index, low)));
    return hn::Min(hn::Max(index, low), high);
}

/// The four mirrored taps of one axis near a border: byte offsets from `base`, and weights.
struct MirroredTaps {
    VI offset[4];
    CubicWeights weights;

    HWY_INLINE MirroredTaps(VI cell, VF fraction, VI low, VI high, VI stride)
        : weights(cubic_weights(fraction)) {
        for (int i = 0; i < 4; ++i) {
            const VI index = hn::Add(cell, hn::Set(Ints(), i - 1));
            offset[i] = hn::Mul(mirror_lanes(index, low, high), stride);
        }
    }

    template <class Value>
    HWY_INLINE VF join(const Value& value) const {
        VF sum = hn::Mul(weights.w[0], value(offset[0]));
        for (int i = 1; i < 4; ++i) sum = hn::MulAdd(weights.w[i], value(offset[i]), sum);
        return sum;
    }
};

/// Clamps cells to low..high; the fraction becomes 0 below and `beyond` above.
HWY_INLINE void clamp_place(VI& cell, VF& fraction, VI low, VI high, VF beyond) {
    const Floats d;
    fraction = hn::IfThenZeroElse(hn::RebindMask(d, hn::Lt(cell, low)), fraction);
    fraction = hn::IfThenElse(hn::RebindMask(d, hn::Gt(cell, high)), beyond, fraction);
    cell = hn::Min(hn::Max(cell, low), high);
}

/// Reconstruction with the border rule. `corner` is the cell of `base`; cells count from there.
template <class T, Hold kHold, int kAxes, bool kNeighbours>
HWY_INLINE VF border_value(const BackwardPlan& plan, const std::uint8_t* base,
                           const std::array<std::int64_t, 3>& corner, Places<kAxes> at) {
    const Ints di;
    const VF one = hn::Set(Floats(), 1.0f);
    VI low[kAxes], high[kAxes];
    for (int a = 0; a < kAxes; ++a) {
        low[a] = hn::Set(di, std::int32_t(-corner[a]));
        high[a] = hn::Set(di, std::int32_t(plan.extent[a] - 1 - corner[a]));
    }
    if constexpr (kHold == Hold::zoh) {
        for (int a = 0; a < kAxes; ++a) at.cell[a] = hn::Min(hn::Max(at.cell[a], low[a]), high[a]);
        return gather_one<T>(base, offsets_of<T, kAxes, kNeighbours>(plan, at));
    } else if constexpr (kHold == Hold::foh) {
        // The last centre is the far end of the last cell, so that both taps exist.
        for (int a = 0; a < kAxes; ++a) {
            const bool thin = plan.extent[a] == 1;
            if (thin) at.fraction[a] = hn::Zero(Floats());
            clamp_place(at.cell[a], at.fraction[a], low[a],
                        thin ? high[a] : hn::Sub(high[a], hn::Set(di, 1)),
                        thin ? hn::Zero(Floats()) : one);
        }
        const VI offset = offsets_of<T, kAxes, kNeighbours>(plan, at);
        return linear_value<T, kAxes, kNeighbours, true>(plan, base, offset, at);
    } else {
        for (int a = 0; a < kAxes; ++a)
            clamp_place(at.cell[a], at.fraction[a], low[a], hn::Sub(high[a], hn::Set(di, 1)), one);
        const auto taps = [&](int a) HWY_ATTR {
            return MirroredTaps(at.cell[a], at.fraction[a], low[a], high[a],
                                hn::Set(di, std::int32_t(plan.stride[a])));
        };
        const MirroredTaps x = taps(0), y = taps(1);
        const auto plane = [&](VI slice) HWY_ATTR {
            return y.join([&](VI row) HWY_ATTR {
                const VI line = hn::Add(slice, row);
                return x.join([&](VI column)
                                  HWY_ATTR { return gather_one<T>(base, hn::Add(line, column)); });
            });
        };
        if constexpr (kAxes == 2) {
            return plane(hn::Zero(di));
        } else {
            return taps(2).join(plane);
        }
    }
}

HWY_INLINE VF mapped_value(const BackwardPlan& plan, VF value) {
    if (!plan.mapped) return value;
    const Floats d;
    return hn::MulAdd(value, hn::Set(d, plan.slope), hn::Set(d, plan.offset));
}

/// Sixteen columns, all of them seen and away from borders, to sixteen floats.
template <class T, Hold kHold, int kAxes, bool kNeighbours>
HWY_INLINE void inner_block(const BackwardPlan& plan, const Batch& batch, int b, int r, int channel,
                            float* out) {
    const Floats d;
    const std::uint8_t* base =
        plan.input.as<std::uint8_t>() + batch.offset[b][r] + channel * int(sizeof(T));
    for (int lane = 0; lane < kBlock; lane += int(hn::Lanes(d))) {
        const auto at = places_at<kAxes>(plan, batch, b, r, lane);
        const VF value = inner_value<T, kHold, kAxes, kNeighbours>(plan, base, at);
        hn::StoreU(mapped_value(plan, value), d, out + lane);
    }
}

/// Sixteen columns of which some see the input; what the others get is of no use.
template <class T, Hold kHold, int kAxes, bool kNeighbours>
HWY_INLINE void border_block(const BackwardPlan& plan, const Batch& batch, int b, int r,
                             int channel, float* out) {
    const Floats d;
    const Ints di;
    const std::uint8_t* base = plan.input.as<std::uint8_t>() + channel * int(sizeof(T));
    // Lanes count from a sample that exists, so that their 32-bit offsets stay small.
    std::array<std::int64_t, 3> corner{}, shift{};
    for (int a = 0; a < kAxes; ++a) {
        const std::int64_t cell = batch.cell[a][b][r];
        corner[a] = std::min(std::max<std::int64_t>(cell, 0), plan.extent[a] - 1);
        shift[a] = cell - corner[a];
        base += corner[a] * plan.stride[a];
    }
    for (int lane = 0; lane < kBlock; lane += int(hn::Lanes(d))) {
        auto at = places_at<kAxes>(plan, batch, b, r, lane);
        for (int a = 0; a < kAxes; ++a)
            at.cell[a] = hn::Add(at.cell[a], hn::Set(di, std::int32_t(shift[a])));
        const VF value = border_value<T, kHold, kAxes, kNeighbours>(plan, base, corner, at);
        hn::StoreU(mapped_value(plan, value), d, out + lane);
    }
}

/// The columns of block b that lie in `seen` but not all of which are inner, channels interleaved.
template <class T, Hold kHold, int kAxes, bool kNeighbours>
HWY_NOINLINE void part_block(const BackwardPlan& plan, const Batch& batch, int b, int r, Span seen,
                             bool inner, float* out) {
    const int channels = kNeighbours ? 1 : plan.input.channels;
    alignas(64) float values[kBlock];
    for (int c = 0; c < channels; ++c) {
        if (inner)
            inner_block<T, kHold, kAxes, kNeighbours>(plan, batch, b, r, c, values);
        else
            border_block<T, kHold, kAxes, kNeighbours>(plan, batch, b, r, c, values);
        for (std::int64_t x = seen.begin; x < seen.end; ++x) out[x * channels + c] = values[x];
    }
}

/// First and last column, not rounded, as a span within `within`. Columns are not negative, so the
/// conversions round down; std::ceil would be a call where there is no SSE4.
HWY_INLINE Span whole_columns(double first, double last, Span within) {
    first = std::min(first, double(within.end));
    last = std::max(last, double(within.begin) - 1);
    Span span{std::int64_t(first), std::int64_t(last + 1)};
    span.begin += double(span.begin) < first;
    span.end = std::max(span.end, span.begin);
    return span;
}

/// One row of a batch whose blocks begin at column x.
template <class T, Hold kHold, int kAxes, bool kNeighbours>
HWY_INLINE void warp_row(const BackwardPlan& plan, const Batch& batch, int r, std::int64_t x,
                         Span columns, float* row) {
    const Span seen = whole_columns(batch.seen[0][r], batch.seen[1][r], columns);
    const Span inner = whole_columns(batch.inner[0][r], batch.inner[1][r], columns);
    fill_columns(plan, row, columns.begin, seen.begin);
    fill_columns(plan, row, seen.end, columns.end);
    for (int b = int((seen.begin - x) / kBlock); x + b * kBlock < seen.end; ++b) {
        const std::int64_t column = x + b * kBlock;
        const bool whole = inner.holds(column, column + kBlock);
        if (kNeighbours && whole) {
            inner_block<T, kHold, kAxes, kNeighbours>(plan, batch, b, r, 0, row + column);
            continue;
        }
        const Span part{std::max(seen.begin - column, std::int64_t{0}),
                        std::min<std::int64_t>(seen.end - column, kBlock)};
        part_block<T, kHold, kAxes, kNeighbours>(plan, batch, b, r, part, whole,
                                                 row + column * plan.input.channels);
    }
}

template <class T, Hold kHold, int kAxes, bool kNeighbours>
void warp_batch(const BackwardPlan& plan, const WarpOutput& output, std::int64_t z, Span rows,
                Span columns, bool cut) {
    Batch batch;
    const std::int64_t x = columns.begin & ~std::int64_t{kBlock - 1};
    const int blocks = int((columns.end - x + kBlock - 1) / kBlock);
    start_rows<kAxes>(plan, rows.begin, z, columns, cut, batch);
    place_blocks<kHold, kAxes>(plan, x, blocks, batch);
    for (std::int64_t y = rows.begin; y < rows.end; ++y)
        warp_row<T, kHold, kAxes, kNeighbours>(plan, batch, int(y - rows.begin), x, columns,
                                               row_of(plan, output, y, z));
}

/// The end of the run of `size` (a power of two, counted from 0) that holds `from`, within `end`.
HWY_INLINE std::int64_t end_of_run(std::int64_t from, std::int64_t size, std::int64_t end) {
    return std::min((from & ~(size - 1)) + size, end);
}

template <class T, Hold kHold, int kAxes, bool kNeighbours>
void warp_region(const BackwardPlan& plan, const WarpOutput& output, const Region& region) {
    constexpr std::int64_t kColumns = Batch::kBlocks * kBlock;
    const Sight sight = sight_of(plan, region);
    for (std::int64_t z = region.begin[2]; z < region.end[2]; ++z)
        for (std::int64_t y = region.begin[1]; y < region.end[1]; y += Batch::kRows) {
            const Span rows{y, std::min(y + Batch::kRows, region.end[1])};
            if (sight == Sight::outside) {
                for (std::int64_t row = y; row < rows.end; ++row)
                    fill_columns(plan, row_of(plan, output, row, z), region.begin[0],
                                 region.end[0]);
                continue;
            }
            for (std::int64_t x = region.begin[0], end = x; x < region.end[0]; x = end) {
                end = end_of_run(x, kColumns, region.end[0]);
                warp_batch<T, kHold, kAxes, kNeighbours>(plan, output, z, rows, {x, end},
                                                         sight == Sight::mixed);
            }
        }
}

template <class T, int kAxes, bool kNeighbours>
void warp_typed(const BackwardPlan& plan, const WarpOutput& output, const Region& region) {
    if (plan.hold == Hold::zoh)
        return warp_region<T, Hold::zoh, kAxes, kNeighbours>(plan, output, region);
    if (plan.hold == Hold::foh)
        return warp_region<T, Hold::foh, kAxes, kNeighbours>(plan, output, region);
    if constexpr (std::is_same_v<T, float>)
        warp_region<T, Hold::bspline3, kAxes, kNeighbours>(plan, output, region);
}

}  // namespace HWY_NAMESPACE
}  // namespace edgewise::kernels
HWY_AFTER_NAMESPACE();

#endif
