// Shear-warp in perspective: slices are added to an intermediate image on which they shrink.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "transitions/kernels/scalar_load.hpp"
#include "transitions/kernels/shear_perspective.hpp"
#include "transitions/kernels/shear_perspective_runs.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/shear_perspective_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/open_blocks-inl.hpp"
#include "transitions/kernels/pixel_rules-inl.hpp"
#include "transitions/kernels/sample_rows-inl.hpp"

#ifndef EDGEWISE_SHEAR_PERSPECTIVE_ROOM
#define EDGEWISE_SHEAR_PERSPECTIVE_ROOM
namespace edgewise::kernels {

/// How the room of a tile is divided. Behind a plane and a row stands what vectors read beyond.
struct PerspectiveRoom {
    static constexpr std::ptrdiff_t kPitch = kPerspectiveWidth,
                                    kPlane = kPitch * kPerspectiveHeight + 16, kBeyond = 64;
    float *low, *high, *steps, *lengths, *states, *row;

    PerspectiveRoom(float* room, std::int64_t samples)
        : low(room),
          high(low + kPlane),
          steps(high + kPlane),
          lengths(steps + kPlane),
          row(lengths + kPlane) {
        states = row + (samples + kBeyond + 15) / 16 * 16;
    }
};

}  // namespace edgewise::kernels
#endif

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

/// A tile while slices go by.
class PerspectiveSlab {
    static constexpr std::ptrdiff_t kPitch = PerspectiveRoom::kPitch,
                                    kPlane = PerspectiveRoom::kPlane;

    struct Part {
        std::int64_t begin = 0, end = 0;
    };

 public:
    PerspectiveSlab(const PerspectiveSlices& of, std::int64_t i, std::int64_t j, std::int64_t width,
                    std::int64_t height, const PerspectiveRoom& room)
        : of_(of), width_(width), height_(height), room_(room) {
        columns_ = (width + static_cast<std::int64_t>(kLanes) - 1) /
                   static_cast<std::int64_t>(kLanes) * static_cast<std::int64_t>(kLanes);
        for (std::int64_t c = 0; c < columns_; ++c) {
            at_[c] = of.across[0].at(static_cast<double>(i + c));
            slope_[c] = (at_[c] - of.across[0].eye) / of.distance;
            column_low_[c] = 1e9f, column_high_[c] = -1;
        }
        for (std::int64_t row = 0; row < height; ++row) find_row(row, static_cast<double>(j + row));
    }

    template <class Rule>
    void run() {
        const Rule rule(of_.with);
        const bool sums = of_.with.rule == Combine::sum || of_.with.rule == Combine::mean;
        constexpr std::int64_t kTogether = 8;  // slices between looks at what is opaque
        const Part slices = slices_met();
        for (std::int64_t k = slices.begin; k < slices.end; ++k) {
            if (const Part columns = columns_of(k); columns.begin < columns.end) {
                find_columns(k, columns);
                for (std::int64_t row = 0; row < height_; ++row)
                    if (in_row(row, k))
                        add_row(rule, k, row, lines_of(k, row), columns, columns.end);
            }
            if (sums && (k + 1) % kBlockPlanes == 0) close();
            if (of_.with.rule == Combine::over && (k + 1) % kTogether == 0) end_rows(k + 1);
        }
    }

    /// The same for visible cells. @param first  slice of the runs that is the lowest here
    template <class Rule>
    void run(const VisibleRuns& runs, std::int64_t first) {
        const Rule rule(of_.with);
        std::array<OpenBlocks, kPerspectiveHeight> open;
        open.fill(OpenBlocks(width_));
        const Part slices = slices_met();
        for (std::int64_t k = slices.begin; k < slices.end; ++k) {
            const std::int64_t slice = first + stored(k);
            if (runs.slices[static_cast<std::size_t>(slice)].runs == 0) continue;
            Part columns;  // found where a row has runs
            for (std::int64_t row = 0; row < height_; ++row) {
                if (!in_row(row, k) || !open[row].any()) continue;
                const Lines lines = lines_of(k, row);
                const std::span<const VisibleRuns::Run> seen = runs.row(lines.upper, slice);
                if (seen.empty()) continue;
                if (columns.begin == columns.end) {
                    columns = columns_of(k);
                    if (columns.begin >= columns.end) break;
                    find_columns(k, columns);
                }
                add_seen(rule, k, row, lines, columns, seen, open[row]);
            }
            if (kEnds<Rule> && std::none_of(open.begin(), open.begin() + height_,
                                            [](const OpenBlocks& row) { return row.any(); }))
                return;
        }
    }

 private:
    /// The lines of a slice that a row of the image lies between.
    struct Lines {
        std::int64_t upper = 0;
        double down = 0;  // weight of the next one
    };

    /// Slices that rays of the tile meet.
    Part slices_met() const {
        Part slices{of_.volume.extent.z, 0};
        for (std::int64_t row = 0; row < height_; ++row) {
            if (row_low_[row] > row_high_[row]) continue;
            slices.begin =
                std::min(slices.begin, static_cast<std::int64_t>(std::ceil(row_low_[row])));
            slices.end =
                std::max(slices.end, static_cast<std::int64_t>(std::floor(row_high_[row])) + 1);
        }
        return {std::max<std::int64_t>(slices.begin, 0), std::min(slices.end, of_.volume.extent.z)};
    }
    /// Where slice k lies in memory.
    std::int64_t stored(std::int64_t k) const {
        return of_.backwards ? of_.volume.extent.z - 1 - k : k;
    }
    bool in_row(std::int64_t row, std::int64_t k) const {
        const auto z = static_cast<float>(k);
        return z >= row_low_[row] && z <= row_high_[row];
    }

    void find_row(std::int64_t row, double pixel) {
        float *low = room_.low + row * kPitch, *high = room_.high + row * kPitch;
        float *steps = room_.steps + row * kPitch, *lengths = room_.lengths + row * kPitch;
        row_at_[row] = of_.across[1].at(pixel);
        row_slope_[row] = (row_at_[row] - of_.across[1].eye) / of_.distance;
        row_low_[row] = 1e9f, row_high_[row] = -1;
        for (std::int64_t c = 0; c < columns_; ++c) {
            low[c] = 1, high[c] = 0, steps[c] = 1, lengths[c] = 0;
            if (c >= width_) continue;
            SliceRay ray = slice_ray(of_, at_[c], row_at_[row]);
            if (!ray.hits()) continue;
            lengths[c] = static_cast<float>(ray.length());
            steps[c] = static_cast<float>(ray.step);
            if (std::ceil(ray.low) > ray.high) end_in_slice(ray);
            low[c] = static_cast<float>(ray.low), high[c] = static_cast<float>(ray.high);
            row_low_[row] = std::min(row_low_[row], low[c]);
            row_high_[row] = std::max(row_high_[row], high[c]);
            column_low_[c] = std::min(column_low_[c], low[c]);
            column_high_[c] = std::max(column_high_[c], high[c]);
        }
    }
    /// Moves a span that lies between two slices to end in the nearest one.
    void end_in_slice(SliceRay& ray) const {
        const double before = std::floor(ray.low), after = before + 1, length = ray.high - ray.low;
        const auto last = static_cast<double>(of_.volume.extent.z - 1);
        if (after > last || (before >= 0 && ray.low - before <= after - ray.high))
            ray.low = before, ray.high = before + length;
        else
            ray.low = after - length, ray.high = after;
    }

    /// Columns with rays that meet slice k, out to whole vectors.
    Part columns_of(std::int64_t k) const {
        const auto z = static_cast<float>(k);
        const auto meets = [&](std::int64_t c) {
            return z >= column_low_[c] && z <= column_high_[c];
        };
        Part part{0, width_};
        while (part.begin < part.end && !meets(part.begin)) ++part.begin;
        while (part.end > part.begin && !meets(part.end - 1)) --part.end;
        if (part.begin == part.end) return part;
        constexpr auto kWide = static_cast<std::int64_t>(kLanes);
        return {part.begin / kWide * kWide, (part.end + kWide - 1) / kWide * kWide};
    }
    /// Where they are in it: the sample to the left, the next one, and its weight.
    void find_columns(std::int64_t k, const Part& part) {
        const auto last = static_cast<double>(of_.volume.extent.x - 1);
        const auto slice = static_cast<double>(k);
        const bool nearest = of_.hold == Hold::zoh;
        for (std::int64_t c = part.begin; c < part.end; ++c) {
            const double x = std::clamp(at_[c] + slice * slope_[c], 0.0, last);
            const double left = std::floor(nearest ? x + 0.5 : x);
            right_[c] = nearest ? 0 : static_cast<float>(x - left);
            left_[c] = static_cast<std::int32_t>(left);
            next_[c] = left_[c] + (right_[c] > 0 ? 1 : 0);
        }
        // What vectors read that begin anywhere in it.
        for (std::int64_t c = part.end; c < part.end + static_cast<std::int64_t>(kLanes); ++c)
            left_[c] = next_[c] = left_[part.end - 1], right_[c] = 0;
    }
    /// The first column of a part that sees a cell of slice k, or what is behind it.
    std::int64_t column_of(std::int64_t cell, std::int64_t k, const Part& part) const {
        if (cell <= 0) return part.begin;
        if (cell >= of_.volume.extent.x) return part.end;
        const auto slice = static_cast<double>(k);
        const double begin = at_[part.begin] + slice * slope_[part.begin];
        const double apart = of_.across[0].pitch * (1 + slice / of_.distance);
        const double face = static_cast<double>(cell) - (of_.hold == Hold::zoh ? 0.5 : 0);
        const double guess = std::ceil((face - begin) / apart);
        const auto columns = static_cast<double>(part.end - part.begin);
        std::int64_t c = part.begin + static_cast<std::int64_t>(std::clamp(guess, 0.0, columns));
        // Places were rounded.
        while (c > part.begin && left_[c - 1] >= cell) --c;
        while (c < part.end && left_[c] < cell) ++c;
        return c;
    }

    /// Samples that a row of the image sees between two rows of a slice.
    template <class Row>
    void read(const Row& upper, const Row& lower, double down, const Part& part) {
        const DF d;
        const VF weight = hn::Set(d, static_cast<float>(down));
        for (std::int64_t x = part.begin; x < part.end; x += kLanes) {
            VF value = upper.at(x, part.end - x);
            if (down > 0) value = between(value, lower.at(x, part.end - x), weight);
            hn::StoreU(value, d, room_.row + x);
        }
    }
    Lines lines_of(std::int64_t k, std::int64_t row) const {
        const double y = std::clamp(row_at_[row] + static_cast<double>(k) * row_slope_[row], 0.0,
                                    static_cast<double>(of_.volume.extent.y - 1));
        const double upper = std::floor(of_.hold == Hold::zoh ? y + 0.5 : y);
        return {static_cast<std::int64_t>(upper), of_.hold == Hold::zoh ? 0 : y - upper};
    }
    void read_lines(std::int64_t k, const Lines& lines, const Part& part) {
        const Grid& volume = of_.volume;
        const double down = lines.down;
        const std::int64_t first =
            stored(k) * volume.slice_step() + lines.upper * volume.row_step();
        const std::int64_t second = first + (down > 0 ? volume.row_step() : 0);
        const auto lanes = [&]<class T>() {
            read(Row<T>{volume.template row_from<T>(first)},
                 Row<T>{volume.template row_from<T>(second)}, down, part);
        };
        switch (volume.type) {
            case Type::u8:
                return lanes.template operator()<std::uint8_t>();
            case Type::i8:
                return lanes.template operator()<std::int8_t>();
            case Type::u16:
                return lanes.template operator()<std::uint16_t>();
            case Type::i16:
                return lanes.template operator()<std::int16_t>();
            case Type::f32:
                return lanes.template operator()<float>();
            default: {
                const ScalarLoad load = scalar_load(volume.type);
                read(LoadedRow{volume.samples, load, first},
                     LoadedRow{volume.samples, load, second}, down, part);
            }
        }
    }

    /// Pixels of a row that runs let be seen, and that are not opaque.
    template <class Rule>
    HWY_INLINE void add_seen(const Rule& rule, std::int64_t k, std::int64_t row, const Lines& lines,
                             const Part& columns, std::span<const VisibleRuns::Run> seen,
                             OpenBlocks& open) {
        for (const VisibleRuns::Run& run : seen) {
            const std::int64_t from = column_of(run.begin, k, columns);
            if (from >= columns.end) return;
            const std::int64_t to = column_of(run.end, k, columns);
            open.each(from, to, [&](std::int64_t begin, std::int64_t end) HWY_ATTR {
                add_row(rule, k, row, lines, {begin, end}, columns.end);
                if constexpr (kEnds<Rule>)
                    open.close(begin, end, room_.states + row * kPitch + 3 * kPlane);
            });
        }
    }

    /// @param known  columns whose places are known
    template <class Rule>
    void add_row(const Rule& rule, std::int64_t k, std::int64_t row, const Lines& lines,
                 const Part& columns, std::int64_t known) {
        const DF d;
        const DI whole;
        constexpr auto kWide = static_cast<std::int64_t>(kLanes);
        // Samples of whole vectors.
        const std::int64_t vectors = (columns.end - columns.begin + kWide - 1) / kWide;
        const std::int64_t last = std::min(columns.begin + vectors * kWide, known) - 1;
        read_lines(k, lines, {left_[columns.begin], next_[last] + 1});
        const float* low = room_.low + row * kPitch;
        const float* high = room_.high + row * kPitch;
        const float* steps = room_.steps + row * kPitch;
        float* state = room_.states + row * kPitch;
        const auto z = static_cast<float>(k);
        const VF here = hn::Set(d, z), before = hn::Set(d, z - 1), after = hn::Set(d, z + 1);
        const bool nearest = of_.hold == Hold::zoh;
        for (std::int64_t c = columns.begin; c < columns.end; c += kLanes) {
            const VF a = hn::LoadU(d, low + c), b = hn::LoadU(d, high + c);
            MF none = hn::Or(hn::Lt(here, a), hn::Gt(here, b));
            if (columns.end - c < kWide) none = hn::Or(none, beyond(columns.end - c));
            if (hn::AllTrue(d, none)) continue;
            // Where the neighbouring slice does not count, its share is this one's.
            const VF begin = hn::IfThenElse(hn::Lt(before, a), a, hn::Set(d, z - 0.5f));
            const VF end = hn::IfThenElse(hn::Gt(after, b), b, hn::Set(d, z + 0.5f));
            VF value = hn::GatherIndex(d, room_.row, hn::LoadU(whole, left_ + c));
            if (!nearest)
                value = between(value, hn::GatherIndex(d, room_.row, hn::LoadU(whole, next_ + c)),
                                hn::LoadU(d, right_ + c));
            rule.add(value, hn::Mul(hn::Sub(end, begin), hn::LoadU(d, steps + c)), false, none,
                     state + c, kPlane);
        }
    }

    void close() {
        for (std::int64_t row = 0; row < height_; ++row)
            close_block(room_.states + row * kPitch, kPlane, width_);
    }
    /// Leaves out rows of which nothing behind slices before k is seen.
    void end_rows(std::int64_t k) {
        const DF d;
        for (std::int64_t row = 0; row < height_; ++row) {
            if (row_low_[row] > row_high_[row]) continue;
            const float* left = room_.states + row * kPitch + 3 * kPlane;
            const float* high = room_.high + row * kPitch;
            const VF next = hn::Set(d, static_cast<float>(k));
            bool seen = false;
            for (std::int64_t c = 0; c < columns_ && !seen; c += kLanes)
                seen = !hn::AllFalse(d, hn::And(hn::Gt(hn::LoadU(d, left + c), hn::Zero(d)),
                                                hn::Ge(hn::LoadU(d, high + c), next)));
            if (!seen) row_high_[row] = -1;
        }
    }

    const PerspectiveSlices& of_;
    std::int64_t width_, height_, columns_;
    PerspectiveRoom room_;
    double at_[kPerspectiveWidth], slope_[kPerspectiveWidth];
    float column_low_[kPerspectiveWidth], column_high_[kPerspectiveWidth];
    static constexpr std::int64_t kPlaces = kPerspectiveWidth + static_cast<std::int64_t>(kLanes);
    HWY_ALIGN std::int32_t left_[kPlaces], next_[kPlaces];
    HWY_ALIGN float right_[kPlaces];
    double row_at_[kPerspectiveHeight], row_slope_[kPerspectiveHeight];
    float row_low_[kPerspectiveHeight], row_high_[kPerspectiveHeight];
};

/// with_rule() calls it for a rule.
struct PerspectiveRun {
    PerspectiveSlab& slab;

    template <class Rule>
    void run() const {
        slab.run<Rule>();
    }
};

struct PerspectiveRunOfSeen {
    PerspectiveSlab& slab;
    const VisibleRuns& runs;
    std::int64_t first;

    template <class Rule>
    void run() const {
        slab.run<Rule>(runs, first);
    }
};

void perspective_slices_on(const PerspectiveSlices& of, std::int64_t i, std::int64_t j,
                           std::int64_t width, std::int64_t height, float* room) {
    PerspectiveSlab slab(of, i, j, width, height, PerspectiveRoom(room, of.volume.extent.x));
    with_rule<false>(of.with, PerspectiveRun{slab});
}

void perspective_runs_on(const PerspectiveSlices& of, const VisibleRuns& runs, std::int64_t first,
                         std::int64_t i, std::int64_t j, std::int64_t width, std::int64_t height,
                         float* room) {
    PerspectiveSlab slab(of, i, j, width, height, PerspectiveRoom(room, of.volume.extent.x));
    with_seen_rule<false>(of.with, PerspectiveRunOfSeen{slab, runs, first});
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(perspective_slices_on);
HWY_EXPORT(perspective_runs_on);

std::size_t perspective_room(const PerspectiveSlices& of) noexcept {
    const int planes = 4 + PixelStates::planes(of.with.rule, of.with.other);
    return static_cast<std::size_t>(planes * PerspectiveRoom::kPlane + of.volume.extent.x +
                                    PerspectiveRoom::kBeyond + 16);
}

/// A tile before the first slice.
static PerspectiveTile cleared_tile(const PerspectiveSlices& of, std::int64_t width,
                                    std::int64_t height, float* room) {
    const PerspectiveRoom parts(room, of.volume.extent.x);
    const PerspectiveTile tile{{parts.states, PerspectiveRoom::kPitch, PerspectiveRoom::kPlane},
                               parts.lengths};
    // Vectors reach beyond the last column.
    clear_states(of.with, tile.states, PixelStates::pitch_of(width), height);
    return tile;
}

PerspectiveTile perspective_slices(const PerspectiveSlices& of, std::int64_t i, std::int64_t j,
                                   std::int64_t width, std::int64_t height, float* room) {
    const PerspectiveTile tile = cleared_tile(of, width, height, room);
    HWY_DYNAMIC_DISPATCH(perspective_slices_on)(of, i, j, width, height, room);
    return tile;
}

PerspectiveTile perspective_runs(const PerspectiveSlices& of, const VisibleRuns& runs,
                                 std::int64_t first, std::int64_t i, std::int64_t j,
                                 std::int64_t width, std::int64_t height, float* room) {
    const PerspectiveTile tile = cleared_tile(of, width, height, room);
    HWY_DYNAMIC_DISPATCH(perspective_runs_on)(of, runs, first, i, j, width, height, room);
    return tile;
}

}  // namespace edgewise::kernels
#endif
