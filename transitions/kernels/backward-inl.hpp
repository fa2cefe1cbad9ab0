// Rows and blocks of the backward warp in vectors, compiled once a target (Highway's
// foreach_target). No pragma once: the guard toggles, so that every target sees the text once.
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
#include "transitions/kernels/backward_holds-inl.hpp"
#include "transitions/kernels/backward_rows.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using namespace gathers::HWY_NAMESPACE;  // NOLINT: the vectors and gathers

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
        cut_columns(batch.start[a], plan.inverse[a], inner_range(n, plan), batch.inner);
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

/// Sixteen columns, all of them seen and away from borders, to sixteen floats.
template <class Read, Hold kHold, int kAxes, bool kNeighbours>
HWY_INLINE void inner_block(const BackwardPlan& plan, const Batch& batch, int b, int r, int channel,
                            float* out) {
    const Floats d;
    const std::uint8_t* base =
        plan.input.as<std::uint8_t>() + batch.offset[b][r] + channel * Read::kBytes;
    for (int lane = 0; lane < kBlock; lane += int(hn::Lanes(d))) {
        const auto at = places_at<kAxes>(plan, batch, b, r, lane);
        const VF value = inner_value<Read, kHold, kAxes, kNeighbours>(plan, base, at);
        if constexpr (kAxes == 3)
            prefetch<Read, 2, 1>({base}, plan.ahead,
                                 offsets_of<Read, kAxes, kNeighbours>(plan, at));
        hn::StoreU(mapped_value(plan, value), d, out + lane);
    }
}

/// Sixteen columns of which some see the input; what the others get is of no use.
template <class Read, Hold kHold, int kAxes, bool kNeighbours>
HWY_INLINE void border_block(const BackwardPlan& plan, const Batch& batch, int b, int r,
                             int channel, float* out) {
    const Floats d;
    const Ints di;
    const std::uint8_t* base = plan.input.as<std::uint8_t>() + channel * Read::kBytes;
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
        const VF value = border_value<Read, kHold, kAxes, kNeighbours>(plan, base, corner, at);
        hn::StoreU(mapped_value(plan, value), d, out + lane);
    }
}

/// The columns of block b that lie in `seen` but not all of which are inner, channels interleaved.
template <class Read, Hold kHold, int kAxes, bool kNeighbours>
HWY_NOINLINE void part_block(const BackwardPlan& plan, const Batch& batch, int b, int r, Span seen,
                             bool inner, float* out) {
    const int channels = kNeighbours ? 1 : plan.input.channels;
    alignas(64) float values[kBlock];
    for (int c = 0; c < channels; ++c) {
        if (inner)
            inner_block<Read, kHold, kAxes, kNeighbours>(plan, batch, b, r, c, values);
        else
            border_block<Read, kHold, kAxes, kNeighbours>(plan, batch, b, r, c, values);
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
template <class Read, Hold kHold, int kAxes, bool kNeighbours>
HWY_INLINE void warp_row(const BackwardPlan& plan, const Batch& batch, int r, std::int64_t x,
                         Span columns, float* row) {
    const Span seen = whole_columns(batch.seen[0][r], batch.seen[1][r], columns);
    const Span inner = whole_columns(batch.inner[0][r], batch.inner[1][r], columns);
    fill_columns(plan, row, columns.begin, seen.begin);
    fill_columns(plan, row, seen.end, columns.end);
    if (seen.begin == seen.end) return;  // even within a block: there may be none
    for (int b = int((seen.begin - x) / kBlock); x + b * kBlock < seen.end; ++b) {
        const std::int64_t column = x + b * kBlock;
        const bool whole = inner.holds(column, column + kBlock);
        if (kNeighbours && whole) {
            inner_block<Read, kHold, kAxes, kNeighbours>(plan, batch, b, r, 0, row + column);
            continue;
        }
        const Span part{std::max(seen.begin - column, std::int64_t{0}),
                        std::min<std::int64_t>(seen.end - column, kBlock)};
        part_block<Read, kHold, kAxes, kNeighbours>(plan, batch, b, r, part, whole,
                                                    row + column * plan.input.channels);
    }
}

/// Columns of which some row sees the input.
HWY_INLINE Span seen_columns(const Batch& batch, Span within) {
    double first = 1e300, last = -1e300;
    for (int r = 0; r < Batch::kRows; ++r) {
        const bool sees = batch.seen[0][r] <= batch.seen[1][r];
        first = sees ? std::min(first, batch.seen[0][r]) : first;
        last = sees ? std::max(last, batch.seen[1][r]) : last;
    }
    return whole_columns(first, last, within);
}

template <class Read, Hold kHold, int kAxes, bool kNeighbours>
void warp_batch(const BackwardPlan& plan, const WarpOutput& output, std::int64_t z, Span rows,
                Span columns, std::ptrdiff_t ahead, bool cut) {
    Batch batch;
    start_rows<kAxes>(plan, rows.begin, z, columns, cut, batch);
    const Span seen = seen_columns(batch, columns);
    const std::int64_t x = seen.begin & ~std::int64_t{kBlock - 1};
    const int blocks = int((seen.end - x + kBlock - 1) / kBlock);
    place_blocks<kHold, kAxes>(plan, x, blocks, batch);
    for (std::int64_t y = rows.begin; y < rows.end; ++y) {
        float* const row = row_of(plan, output, y, z);
        if (ahead > 0) prefetch_columns(plan, row + ahead, columns);
        warp_row<Read, kHold, kAxes, kNeighbours>(plan, batch, int(y - rows.begin), x, columns,
                                                  row);
    }
}

/// The end of the run of `size` (a power of two, counted from 0) that holds `from`, within `end`.
HWY_INLINE std::int64_t end_of_run(std::int64_t from, std::int64_t size, std::int64_t end) {
    return std::min((from & ~(size - 1)) + size, end);
}

template <class Read, Hold kHold, int kAxes, bool kNeighbours>
void warp_region(const BackwardPlan& plan, const WarpOutput& output, const Region& region) {
    constexpr std::int64_t kColumns = Batch::kBlocks * kBlock;
    const Sight sight = sight_of(plan, region);
    const Extent held = output.held.extent();
    const std::int64_t slice = held.x * held.y * plan.input.channels;
    const bool far = held.z * slice * std::int64_t(sizeof(float)) > kNearOutput;
    for (std::int64_t z = region.begin[2]; z < region.end[2]; ++z) {
        const std::ptrdiff_t ahead = far && z + 1 < region.end[2] ? slice : 0;
        for (std::int64_t y = region.begin[1]; y < region.end[1]; y += Batch::kRows) {
            const Span rows{y, std::min(y + Batch::kRows, region.end[1])};
            if (sight == Sight::outside) {
                for (std::int64_t r = y; r < rows.end; ++r) {
                    float* const row = row_of(plan, output, r, z);
                    if (ahead > 0)
                        prefetch_columns(plan, row + ahead, {region.begin[0], region.end[0]});
                    fill_columns(plan, row, region.begin[0], region.end[0]);
                }
                continue;
            }
            for (std::int64_t x = region.begin[0], end = x; x < region.end[0]; x = end) {
                end = end_of_run(x, kColumns, region.end[0]);
                warp_batch<Read, kHold, kAxes, kNeighbours>(plan, output, z, rows, {x, end}, ahead,
                                                            sight == Sight::mixed);
            }
        }
    }
}

template <class Read, int kAxes, bool kNeighbours>
void warp_typed(const BackwardPlan& plan, const WarpOutput& output, const Region& region) {
    if (plan.hold == Hold::zoh)
        return warp_region<Read, Hold::zoh, kAxes, kNeighbours>(plan, output, region);
    if (plan.hold == Hold::foh)
        return warp_region<Read, Hold::foh, kAxes, kNeighbours>(plan, output, region);
    if constexpr (Read::kFloats)
        warp_region<Read, Hold::bspline3, kAxes, kNeighbours>(plan, output, region);
}

}  // namespace HWY_NAMESPACE
}  // namespace edgewise::kernels
HWY_AFTER_NAMESPACE();

#endif
