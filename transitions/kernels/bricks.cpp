#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "transitions/kernels/brick_rows.hpp"
#include "transitions/kernels/largest_opacity.hpp"
#include "transitions/kernels/ray_cast.hpp"
#include "transitions/kernels/ray_table.hpp"
#include "transitions/kernels/scalar_load.hpp"

namespace edgewise::kernels {
namespace {

constexpr std::int64_t kSide = kBrickSide;
static_assert(kSide == 1 << Bricks::kShift);
constexpr std::size_t kRows = kSide * kSide;  // of samples in a line of bricks
constexpr float kInfinity = std::numeric_limits<float>::infinity();

using Levels = StoredSpan;

/// The values that are made of samples in a span.
Levels widened(const Levels& span, const Overshoot& by) {
    if (span.low > span.high) return {};
    if (by.range == 0) return span;
    const double low = span.low, high = span.high;
    const double margin =
        by.range * (high - low) + by.magnitude * std::max(std::abs(low), std::abs(high));
    constexpr double kMost = std::numeric_limits<float>::max();
    return {static_cast<float>(std::max(low - margin, -kMost)),
            static_cast<float>(std::min(high + margin, kMost))};
}

/// The same of one brick after the other: most are like the one before where data are empty.
class LargestOpacity {
 public:
    explicit LargestOpacity(const LevelsOf& of) : of_(of) {}
    float operator()(const Levels& span) {
        if (span != last_) {
            last_ = span;
            largest_ = of_.table ? of_.table->largest(span.low, span.high)
                                 : largest_opacity(*of_.optics, span);
        }
        return largest_;
    }

 private:
    const LevelsOf& of_;
    Levels last_;  // nothing finite
    float largest_ = 0;
};

/// The rows of samples that a line of bricks is made of.
class RowsOfBricks {
 public:
    RowsOfBricks(const Grid& volume, std::pmr::memory_resource* memory)
        : volume_(volume), loads_(!in_lanes(volume.type)), loaded_(memory) {
        if (loads_) loaded_.resize(kRows * pitch());
    }
    Type type() const { return loads_ ? Type::f32 : volume_.type; }

    /// Of line j of layer k. @return how many
    int find(std::int64_t j, std::int64_t k, std::array<const void*, kRows>& rows) {
        const Extent& n = volume_.extent;
        int count = 0;
        for (std::int64_t z = k * kSide; z < std::min((k + 1) * kSide, n.z); ++z)
            for (std::int64_t y = j * kSide; y < std::min((j + 1) * kSide, n.y); ++y, ++count)
                rows[count] = row((z * n.y + y) * n.x, count);
        return count;
    }

 private:
    std::size_t pitch() const {
        return static_cast<std::size_t>(volume_.extent.x) + kSlack / sizeof(float);
    }
    const void* row(std::int64_t start, int place) {
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
    bool loads_;
    std::pmr::vector<float> loaded_;  // rows of other types, through f32
};

/// The largest of each level and its neighbours, along x.
void spread_row(const std::pmr::vector<float>& from, float* to) {
    const std::size_t last = from.size() - 1;
    to[0] = std::max(from[0], from[std::min<std::size_t>(1, last)]);
    for (std::size_t i = 1; i < last; ++i)
        to[i] = std::max(from[i], std::max(from[i - 1], from[i + 1]));
    if (last > 0) to[last] = std::max(from[last - 1], from[last]);
}

/// The same across `count` runs of `length` levels that lie `stride` apart.
void spread_across(float* levels, std::int64_t count, std::int64_t stride, std::int64_t length,
                   std::pmr::memory_resource* memory) {
    std::pmr::vector<float> before(levels, levels + length, memory), old(before.size(), memory);
    for (std::int64_t i = 0; i < count; ++i, levels += stride) {
        const float* after = i + 1 < count ? levels + stride : levels;
        for (std::int64_t r = 0; r < length; ++r) {
            old[r] = levels[r];
            levels[r] = std::max(std::max(before[r], old[r]), after[r]);
        }
        before.swap(old);
    }
}

Extent bricks_in(const Extent& volume) {
    Extent bricks;
    for (int axis = 0; axis < 3; ++axis) bricks[axis] = (volume[axis] + kSide - 1) / kSide;
    return bricks;
}

}  // namespace

Bricks::Bricks(const Extent& volume, std::pmr::memory_resource* memory)
    : extent(bricks_in(volume)),
      level(static_cast<std::size_t>(extent.samples()), memory),
      least(memory) {}

void brick_layers(const Grid& volume, const LevelsOf& of, std::int64_t begin, std::int64_t end,
                  Bricks& bricks) {
    std::pmr::memory_resource* memory = bricks.level.get_allocator().resource();
    const Extent& n = bricks.extent;
    RowsOfBricks rows(volume, memory);
    std::array<const void*, kRows> row;
    std::pmr::vector<float> level(static_cast<std::size_t>(n.x), memory);
    std::pmr::vector<float> low(level.size() + kSlack / sizeof(float), memory), high(low, memory);
    const bool ranges = of.ranges(), falls = volume.values.slope < 0;
    for (std::int64_t k = begin; k < end; ++k) {
        const std::int64_t first = k * n.y * n.x;
        for (std::int64_t j = 0; j < n.y; ++j) {
            const int count = rows.find(j, k, row);
            brick_rows(rows.type(), row.data(), count, volume.extent.x, {low.data(), high.data()});
            const auto spread = [&](bool negated, std::pmr::vector<float>& to) {
                for (std::size_t i = 0; i < level.size(); ++i) {
                    const float largest = negated ? -low[i] : high[i];
                    level[i] = low[i] > high[i] ? -kInfinity : largest;
                }
                spread_row(level, to.data() + first + j * n.x);
            };
            spread(!ranges && falls, bricks.level);
            if (ranges) spread(true, bricks.least);
        }
        spread_across(bricks.level.data() + first, n.y, n.x, n.x, memory);
        if (ranges) spread_across(bricks.least.data() + first, n.y, n.x, n.x, memory);
    }
}

void join_layers(const Grid& volume, const LevelsOf& of, std::int64_t begin, std::int64_t end,
                 Bricks& bricks) {
    std::pmr::memory_resource* memory = bricks.level.get_allocator().resource();
    const Extent& n = bricks.extent;
    const std::int64_t length = (end - begin) * n.x;
    const auto join = [&](std::pmr::vector<float>& levels) {
        spread_across(levels.data() + begin * n.x, n.z, n.x * n.y, length, memory);
    };
    join(bricks.level);
    if (!of.ranges()) return;
    join(bricks.least);
    std::optional<LargestOpacity> opacity;
    if (of.optics || of.table) opacity.emplace(of);
    const bool falls = volume.values.slope < 0;
    for (std::int64_t k = 0; k < n.z; ++k)
        for (std::int64_t i = (k * n.y + begin) * n.x, last = i + length; i < last; ++i) {
            float& level = bricks.level[static_cast<std::size_t>(i)];
            const Levels span =
                widened({-bricks.least[static_cast<std::size_t>(i)], level}, of.overshoot);
            level = opacity ? (*opacity)(span) : falls ? -span.low : span.high;
        }
}

}  // namespace edgewise::kernels
