#include "transitions/kernels/visible_runs.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "transitions/kernels/pmr_block.hpp"
#include "transitions/kernels/scalar_load.hpp"

namespace edgewise::kernels {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// How far a ramp has gone at a value, as look_up() works it out.
float part_at(const OpticsRamp& ramp, float value) {
    return std::min(std::max((value - ramp.start) * ramp.inverse_width, 0.0f), 1.0f);
}

/// A value from which on ramps are at their ends, by a few roundings the least; infinite: none was
/// found.
float behind(std::span<const OpticsRamp> ramps) {
    constexpr int kTries = 64;
    const OpticsRamp& last = ramps.back();
    // Differences from where a ramp starts round as the larger of both numbers does.
    float largest = 0;
    for (const OpticsRamp& ramp : ramps) largest = std::max(largest, std::abs(ramp.start));
    const float step = 0x1p-24f * largest;
    float value = last.start + 1 / last.inverse_width;
    for (int i = 0; i < kTries;
         ++i, value = std::max(value + step, std::nextafter(value, kInfinity)))
        if (std::all_of(ramps.begin(), ramps.end(),
                        [value](const OpticsRamp& ramp) { return part_at(ramp, value) == 1; }))
            return value;
    return kInfinity;
}

/// The rows of a slice as the cells' kernel reads them: types without vector loads through f32.
class RowPairs {
 public:
    RowPairs(const Grid& volume, std::int64_t z, std::pmr::memory_resource* memory)
        : volume_(volume), z_(z), loads_(!in_lanes(volume.type)), loaded_(memory) {
        if (loads_) loaded_.resize(2 * pitch());
    }
    Type type() const { return loads_ ? Type::f32 : volume_.type; }
    /// Of line y and the one below it.
    std::pair<const void*, const void*> at(std::int64_t y) {
        const std::int64_t below = std::min(y + 1, volume_.extent.y - 1);
        return {row(y, 0), row(below, 1)};
    }

 private:
    std::size_t pitch() const {
        return static_cast<std::size_t>(volume_.extent.x) + kSlack / sizeof(float);
    }
    const void* row(std::int64_t y, std::size_t place) {
        const std::int64_t start = z_ * volume_.slice_step() + y * volume_.row_step();
        if (!loads_)
            return volume_.tail.of(volume_.as<std::byte>() +
                                   start * static_cast<std::int64_t>(bytes_of(volume_.type)));
        const ScalarLoad load = scalar_load(volume_.type);
        float* to = loaded_.data() + place * pitch();
        for (std::int64_t x = 0; x < volume_.extent.x; ++x)
            to[x] = load(volume_.samples, start + x);
        return to;
    }

    const Grid& volume_;
    std::int64_t z_;
    bool loads_;
    std::pmr::vector<float> loaded_;
};

/// Bits of cells, as runs.
class RunsOfRow {
 public:
    RunsOfRow(std::int64_t n, std::pmr::memory_resource* memory)
        : n_(n), scratch_(visible_cells_scratch(n), memory), bits_(words(n), memory) {
        std::memset(scratch_.data(), 0, visible_cells_scratch(n));
    }

    /// Calls use(run) for each run of a row.
    template <class Use>
    void each(RowPairs& rows, std::int64_t y, std::span<const UnseenSpan> unseen, Use&& use) {
        const auto [upper, lower] = rows.at(y);
        visible_cells(rows.type(), upper, lower, n_, unseen, scratch_.data(), bits_.data());
        std::int64_t begin = 0, end = -1;  // of the run that is open; none
        for (std::size_t word = 0; word < words(n_); ++word) {
            const auto first = static_cast<std::int64_t>(64 * word);
            for (std::uint64_t left = bits_[word]; left != 0;) {
                const int from = std::countr_zero(left), count = std::countr_one(left >> from);
                const std::int64_t at = first + from;
                if (end < 0 || at - end > VisibleRuns::kGap) {
                    if (end >= 0) use(run_of(begin, end));
                    begin = at;
                }
                end = at + count;
                left = from + count < 64 ? left >> (from + count) << (from + count) : 0;
            }
        }
        if (end >= 0) use(run_of(begin, end));
    }

 private:
    static std::size_t words(std::int64_t n) { return static_cast<std::size_t>((n + 63) / 64); }
    static VisibleRuns::Run run_of(std::int64_t begin, std::int64_t end) {
        return {static_cast<std::uint16_t>(begin), static_cast<std::uint16_t>(end)};
    }

    std::int64_t n_;
    Block<std::byte> scratch_;
    Block<std::uint64_t> bits_;
};

/// Of a row of n cells, each run but the last with the gap behind it.
std::int64_t most_runs(std::int64_t n) {
    return (n + VisibleRuns::kGap + 1) / (VisibleRuns::kGap + 2);
}

}  // namespace

std::vector<UnseenSpan> unseen_of(const Optics& optics) {
    const std::span<const OpticsRamp> ramps = optics.ramps;
    // Opacity is constant before the first ramp (piece 0), on ramps that do not rise (piece i is
    // ramp i - 1) and behind the last. Sums are those of the kernels: what they leave of an opacity
    // that rises and falls again is seen.
    const std::size_t pieces = ramps.size() + 2;
    std::vector<bool> empty(pieces);
    float opacity = optics.opacity;
    empty[0] = opacity <= 0;
    for (std::size_t i = 0; i < ramps.size(); ++i) {
        opacity += ramps[i].opacity;
        empty[i + 1] = ramps[i].opacity == 0 && opacity <= 0;
    }
    empty[pieces - 1] = opacity <= 0;

    std::vector<UnseenSpan> spans;
    for (std::size_t first = 0; first < pieces; ++first) {
        if (!empty[first]) continue;
        std::size_t last = first;
        while (last + 1 < pieces && empty[last + 1]) ++last;
        // Ramps before have to be at their ends, to the last bit; those behind begin at `high`.
        const float low = first < 2 ? -kInfinity : behind(ramps.first(first - 1));
        const float high = last + 1 == pieces ? kInfinity : ramps[last].start;
        if (low <= high && low < kInfinity) spans.push_back({low, high});
        first = last;
    }
    return spans;
}

double VisibleRuns::bytes(const Extent& volume) noexcept {
    const auto rows = static_cast<double>(volume.y), slices = static_cast<double>(volume.z);
    const double runs = rows * static_cast<double>(most_runs(volume.x));
    return slices *
           (sizeof(std::uint32_t) * (rows + 1) + sizeof(Run) * runs + sizeof(Slice) + kArraySlack);
}

VisibleRuns::Slice visible_slice(const Grid& volume, std::span<const UnseenSpan> unseen,
                                 std::int64_t z, std::pmr::memory_resource* memory) {
    using Run = VisibleRuns::Run;
    const Extent& n = volume.extent;
    RowPairs rows(volume, z, memory);
    RunsOfRow row(n.x, memory);
    Block<std::uint32_t> places(static_cast<std::size_t>(n.y + 1), memory);
    Block<Run> runs(static_cast<std::size_t>(n.y * most_runs(n.x)), memory);
    VisibleRuns::Slice slice;
    std::uint32_t count = 0;
    for (std::int64_t y = 0; y < n.y; ++y) {
        places[static_cast<std::size_t>(y)] = count;
        row.each(rows, y, unseen, [&](const Run& run) {
            runs[count++] = run;
            slice.cells += run.end - run.begin;
        });
        if (count == places[static_cast<std::size_t>(y)]) continue;
        if (slice.last == 0) slice.first = y;
        slice.last = y + 1;
    }
    places[static_cast<std::size_t>(n.y)] = count;
    slice.runs = count;
    const std::size_t heads = sizeof(std::uint32_t) * static_cast<std::size_t>(n.y + 1);
    slice.numbers = Array(heads + sizeof(Run) * count, memory);
    auto* to = static_cast<std::byte*>(slice.numbers.data());
    std::memcpy(to, places.data(), heads);
    std::memcpy(to + heads, runs.data(), sizeof(Run) * count);
    return slice;
}

void count_row(const Grid& volume, std::span<const UnseenSpan> unseen, std::int64_t y,
               std::int64_t z, std::int64_t& runs, std::int64_t& cells,
               std::pmr::memory_resource* memory) {
    RowPairs rows(volume, z, memory);
    RunsOfRow(volume.extent.x, memory).each(rows, y, unseen, [&](const VisibleRuns::Run& run) {
        ++runs;
        cells += run.end - run.begin;
    });
}

}  // namespace edgewise::kernels
