#pragma once

#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

#include "graph/data.hpp"
#include "transitions/kernels/grid.hpp"
#include "transitions/kernels/optics.hpp"

namespace edgewise::kernels {

/// Stored numbers that add nothing to a ray; both ends belong to them.
struct UnseenSpan {
    float low, high;
};

/// Where a transfer function has the opacity 0, exactly as the kernels read it; ascending.
std::vector<UnseenSpan> unseen_of(const Optics& optics);

/// Where something may be seen of a volume, as runs along rows. Cell (x, y) of a slice is what lies
/// between samples x and x + 1 of rows y and y + 1, the outermost ones continued. It is part of a
/// run unless each value that is interpolated in it adds nothing, whatever the place. So a run
/// holds its own samples too, of which zero-order holds read. Runs of a row lie more than kGap
/// cells apart: what lies between closer ones takes less than to begin again. [Lacroute, Levoy
/// 1994]
struct VisibleRuns {
    static constexpr std::int64_t kGap = 7;       // cells
    static constexpr std::int64_t kMost = 65535;  // cells of a row
    struct Run {
        std::uint16_t begin = 0, end = 0;  // cells [begin, end)
    };
    struct Slice {
        std::int64_t first = 0, last = 0;  // rows [first, last) hold all of its runs
        std::int64_t runs = 0, cells = 0;  // how many, in all rows
        Array numbers;  // places of the first run of each row and behind the last; then the runs
    };

    Extent extent;
    std::pmr::vector<Slice> slices;

    VisibleRuns(const Extent& volume, std::pmr::memory_resource* memory)
        : extent(volume), slices(static_cast<std::size_t>(volume.z), memory) {}

    std::span<const Run> row(std::int64_t y, std::int64_t z) const noexcept {
        const Slice& slice = slices[static_cast<std::size_t>(z)];
        const auto* first = static_cast<const std::uint32_t*>(slice.numbers.data());
        const auto* runs = reinterpret_cast<const Run*>(first + extent.y + 1);
        return {runs + first[y], runs + first[y + 1]};
    }
    /// At most, of a volume.
    static double bytes(const Extent& volume) noexcept;
};

/// The runs of slice z of a volume, of a real type.
/// @param unseen  at most kMostUnseen
VisibleRuns::Slice visible_slice(const Grid& volume, std::span<const UnseenSpan> unseen,
                                 std::int64_t z, std::pmr::memory_resource* memory);
inline constexpr std::size_t kMostUnseen = 32;

/// The same of single rows, for counts: adds to `runs` and `cells`.
void count_row(const Grid& volume, std::span<const UnseenSpan> unseen, std::int64_t y,
               std::int64_t z, std::int64_t& runs, std::int64_t& cells,
               std::pmr::memory_resource* memory);

/// Sets bit x % 64 of word x / 64 where cell x of a row may be seen.
/// @param type          u8, i8, u16, i16 or f32
/// @param upper, lower  rows of n samples, with kSlack readable bytes behind the last one
/// @param scratch       visible_cells_scratch(n) bytes, aligned to 64
/// @param bits          [ceil(n / 64)]
void visible_cells(Type type, const void* upper, const void* lower, std::int64_t n,
                   std::span<const UnseenSpan> unseen, void* scratch, std::uint64_t* bits);
inline constexpr std::size_t visible_cells_scratch(std::int64_t n) noexcept {
    return 2 * (static_cast<std::size_t>(n) * sizeof(float) + 4 * kSlack);
}

}  // namespace edgewise::kernels
