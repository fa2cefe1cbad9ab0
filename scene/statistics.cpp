#include "scene/statistics.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <memory_resource>
#include <optional>
#include <random>
#include <span>
#include <tbb/parallel_for.h>
#include <vector>

#include "reference/stored.hpp"
#include "scene/level_counts.hpp"
#include "scene/tally.hpp"

namespace edgewise {
namespace {

constexpr std::int64_t kChunks = 16;  // fixed, so that sums do not depend on threads
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// All stored values, before the value map.
struct Values {
    Type type;
    const void* stored;
    std::int64_t count, planes;
    RowGrid grid;

    explicit Values(const Data& data)
        : type(data.what.type),
          stored(data.samples.data()),
          count(data.what.samples() * data.what.channels),
          planes(data.what.extent.z),
          grid{data.what.extent.x * data.what.channels, data.what.extent.y} {}

    /// Their number alone says where chunks begin.
    Stretched chunk(std::int64_t i) const {
        return {type, stored, count * i / kChunks, count * (i + 1) / kChunks};
    }
    /// Replaces places by the values there.
    void look_up(std::span<double> places) const {
        with_stored_type(type, [&](auto zero) {
            const auto* from = static_cast<const decltype(zero)*>(stored);
            for (double& place : places) place = as_double(from[static_cast<std::int64_t>(place)]);
        });
    }
    /// A box that nothing lies in.
    Region nothing() const { return {{grid.row, grid.rows, planes}, {0, 0, 0}}; }
};

/// Part of a chunk: small enough to stay in the first cache while it is looked at again, and a
/// multiple of kLanes.
std::int64_t tile_of(Type type) { return (1 << 14) / static_cast<std::int64_t>(bytes_of(type)); }

/// A number that may be the commonest. Of few bits that is proved where no range of other numbers
/// has more values than it: ranges end at each of the bounds, and go on to the next one.
struct Guess {
    double common = 0;
    std::vector<double> bounds;  // at most kMostBounds, ascending

    bool holds(std::int64_t values, std::int64_t equal, std::span<const std::int64_t> below) const {
        for (std::size_t range = 0; range <= bounds.size(); ++range) {
            const std::int64_t begin = range == 0 ? 0 : below[range - 1];
            const std::int64_t end = range == bounds.size() ? values : below[range];
            const bool smaller = range == 0 || bounds[range - 1] < common;
            const bool larger = range == bounds.size() || bounds[range] > common;
            const std::int64_t others = end - begin - (smaller && larger ? equal : 0);
            // Of ties the smallest.
            if (smaller ? others >= equal : others > equal) return false;
        }
        return true;
    }
};
constexpr std::size_t kMostBounds = 12;

/// From a look at a few values, which decides what is worth counting, not what is found.
std::optional<Guess> likely(const Values& values) {
    constexpr int kLooks = 512;
    std::array<double, kLooks> seen;
    std::minstd_rand bits(1);
    const double stretch = static_cast<double>(values.count) / kLooks;
    for (int i = 0; i < kLooks; ++i) {
        const double within = static_cast<double>(bits()) / std::minstd_rand::max();
        seen[static_cast<std::size_t>(i)] =
            std::min((i + within) * stretch, static_cast<double>(values.count - 1));
    }
    values.look_up(seen);
    std::ranges::sort(seen);
    const auto end_of = [&](auto run) { return std::upper_bound(run, seen.end(), *run); };
    Guess guess;
    std::ptrdiff_t most = 0;
    for (auto run = seen.begin(); run != seen.end(); run = end_of(run))
        if (end_of(run) - run > most) most = end_of(run) - run, guess.common = *run;
    if (most > 0.55 * kLooks) return guess;
    // Ranges that hold clearly fewer.
    double in_range = 0;
    for (auto run = seen.begin(); run != seen.end(); run = end_of(run)) {
        if (*run == guess.common) continue;
        const auto times = static_cast<double>(end_of(run) - run);
        if (in_range > 0 && in_range + times > 0.6 * static_cast<double>(most)) {
            guess.bounds.push_back(*run);
            in_range = 0;
        }
        in_range += times;
    }
    if (guess.bounds.size() > kMostBounds) return {};
    return guess;
}

/// The commonest of 4096 values drawn at random; of ties the smallest.
std::optional<Guess> drawn_commonest(const Values& values) {
    struct Times {
        double value;
        int times;
    };
    constexpr std::size_t kSlots = 1 << 13;
    std::vector<Times> seen(kSlots, Times{0, 0});
    std::array<double, 4096> drawn;
    std::mt19937_64 bits(4096);
    for (double& place : drawn)
        place = static_cast<double>(bits() >> 11) * 0x1p-53 * static_cast<double>(values.count);
    values.look_up(drawn);
    Times most{0, 7};
    for (double value : drawn) {
        if (!std::isfinite(value)) continue;
        value += 0.0;  // -0 is 0
        std::size_t slot = std::bit_cast<std::uint64_t>(value) * 0x9e3779b97f4a7c15u >> 51;
        while (seen[slot].times > 0 && seen[slot].value != value) slot = (slot + 1) % kSlots;
        seen[slot].value = value;
        const int times = ++seen[slot].times;
        if (times > most.times || (times == most.times && times > 7 && value < most.value))
            most = seen[slot];
    }
    if (most.times <= 7) return {};
    return Guess{most.value, {}};
}

/// What is found in a chunk, or in all of them.
struct Found {
    double low = kInfinity, high = -kInfinity, sum = 0;
    std::int64_t lowest = 0, highest = 0;  // the tile where these come first; of all: the value
    std::int64_t finite = 0, equal = 0;    // equal to the commonest value, or else to the least
    Region box;                            // of the samples that differ from the commonest
    std::array<std::int64_t, kMostBounds> below{};  // the bounds
};

/// One chunk. The lowest value is counted where there is no commonest one.
Found look(const Values& values, const Stretched& chunk, const std::optional<Guess>& guess,
           LevelCounts* levels) {
    Found found;
    found.box = values.nothing();
    LaneSums sums{};
    Stretched tile = chunk;
    for (; tile.first < chunk.last; tile.first = tile.last) {
        tile.last = std::min(chunk.last, tile.first + tile_of(values.type));
        const Tally here = tally(tile, guess ? guess->common : 0, sums);
        if (levels) levels->count(tile);
        if (guess) {
            found.equal += here.equal;
            if (here.equal < tile.last - tile.first)
                widen(tile, values.grid, guess->common, found.box);
            count_below(tile, guess->bounds, found.below);
        }
        if (here.finite == 0) continue;
        found.finite += here.finite;
        if (!guess && !levels && here.low <= found.low) {
            LaneSums ignored{};
            if (here.low < found.low) found.equal = 0;
            found.equal += tally(tile, here.low, ignored).equal;
        }
        if (here.low < found.low) found.low = here.low, found.lowest = tile.first;
        if (here.high > found.high) found.high = here.high, found.highest = tile.first;
    }
    for (const double lane : sums) found.sum += lane;
    return found;
}

void unite(Region& box, const Region& with) {
    for (std::size_t k = 0; k < 3; ++k) {
        box.begin[k] = std::min(box.begin[k], with.begin[k]);
        box.end[k] = std::max(box.end[k], with.end[k]);
    }
}

Found look(const Values& values, const std::optional<Guess>& guess, LevelCounts* levels) {
    std::array<Found, kChunks> chunks;
    tbb::parallel_for(std::int64_t{0}, kChunks, [&](std::int64_t i) {
        chunks[static_cast<std::size_t>(i)] = look(values, values.chunk(i), guess, levels);
    });
    Found all;
    all.box = values.nothing();
    for (const Found& chunk : chunks) {
        all.sum += chunk.sum;
        all.finite += chunk.finite;
        if (!guess && chunk.low < all.low) all.equal = 0;
        if (guess || chunk.low <= all.low) all.equal += chunk.equal;
        if (chunk.low < all.low) all.low = chunk.low, all.lowest = chunk.lowest;
        if (chunk.high > all.high) all.high = chunk.high, all.highest = chunk.highest;
        unite(all.box, chunk.box);
        for (std::size_t k = 0; k < kMostBounds; ++k) all.below[k] += chunk.below[k];
    }
    if (all.finite == 0) return all;
    const auto first = [&](std::int64_t tile, double value) {
        return first_equal({values.type, values.stored, tile, values.count}, value);
    };
    all.lowest = first(all.lowest, all.low);
    all.highest = first(all.highest, all.high);
    return all;
}

/// Where values differ from a number. Little is read where that is nearly everywhere.
Region box_of(const Values& values, double common) {
    std::array<Region, kChunks> boxes;
    tbb::parallel_for(std::int64_t{0}, kChunks, [&](std::int64_t i) {
        Region& box = boxes[static_cast<std::size_t>(i)] = values.nothing();
        widen(values.chunk(i), values.grid, common, box);
    });
    Region all = values.nothing();
    for (const Region& box : boxes) unite(all, box);
    return all;
}

/// Completes what was found without a commonest value, or with one that may be wrong.
/// @return the commonest value
double complete(const Values& values, const std::optional<Guess>& guess, LevelCounts* levels,
                Found& found) {
    double common = found.finite > 0 ? found.low : 0;
    if (levels) {
        if (guess)
            tbb::parallel_for(std::int64_t{0}, kChunks,
                              [&](std::int64_t i) { levels->count(values.chunk(i)); });
        const LevelCounts::Level most = levels->commonest(static_cast<std::int64_t>(found.low),
                                                          static_cast<std::int64_t>(found.high));
        common = most.stored;
        found.equal = most.times;
    }
    found.box = box_of(values, common);
    return common;
}

/// In samples, of a box in values.
Region in_samples(const Region& box, int channels) {
    if (box.empty()) return {};
    Region samples = box;
    samples.begin[0] = box.begin[0] / channels;
    samples.end[0] = (box.end[0] - 1) / channels + 1;
    return samples;
}

}  // namespace

Statistics statistics_of(const Data& data, std::pmr::memory_resource* memory) {
    const Values values(data);
    const int channels = data.what.channels;
    std::optional<LevelCounts> levels;
    if (is_integer(values.type) && bytes_of(values.type) <= 2) levels.emplace(values.type, memory);
    // Of few bits each number is counted, unless one of them proves to be the commonest.
    const std::optional<Guess> guess = levels ? likely(values) : drawn_commonest(values);
    Found all = look(values, guess, levels && !guess ? &*levels : nullptr);
    double common = guess ? guess->common : 0;
    if (!guess || (levels && !guess->holds(values.count, all.equal, all.below)))
        common = complete(values, guess, levels ? &*levels : nullptr, all);

    const ValueMap& map = data.what.values;
    Statistics statistics;
    statistics.commonest = map(common);
    statistics.non_finite = values.count - all.finite;
    statistics.occupied = in_samples(all.box, channels);
    statistics.occupied_fraction =
        static_cast<double>(values.count - all.equal) / static_cast<double>(values.count);
    if (all.finite == 0) return statistics;
    statistics.low = map(all.low);
    statistics.high = map(all.high);
    statistics.mean = map(all.sum / static_cast<double>(all.finite));
    statistics.lowest = all.lowest / channels;
    statistics.highest = all.highest / channels;
    if (map.slope < 0) {
        std::swap(statistics.low, statistics.high);
        std::swap(statistics.lowest, statistics.highest);
    }
    return statistics;
}

}  // namespace edgewise
