#include "transitions/reference/statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory_resource>
#include <random>
#include <span>
#include <tbb/parallel_for.h>
#include <vector>

#include "transitions/reference/stored.hpp"

namespace edgewise {
namespace {

constexpr std::int64_t kChunks = 16;  // fixed, so that sums do not depend on threads

/// Stored values first ... last - 1 of a chunk.
struct Chunk {
    std::int64_t first, last;
};
Chunk chunk_of(std::int64_t values, std::int64_t chunk) {
    return {values * chunk / kChunks, values * (chunk + 1) / kChunks};
}

/// Numbers before the value map, as far as one chunk goes.
struct Tally {
    double low = std::numeric_limits<double>::infinity(), high = -low, sum = 0;
    std::int64_t finite = 0, differing = 0;
};

struct Found {
    std::array<Tally, kChunks> chunks;
    double commonest = 0;
};

/// Counts the stored values of a chunk. Neighbours are often equal, and a counter that was just
/// written is slow to read again: eight equal bytes are counted at once, others in turn in tables
/// of their own.
void count(const std::uint8_t* stored, Chunk range, std::uint32_t* counts) {
    constexpr int kTables = 4, kLevels = 256;
    std::array<std::uint32_t, kTables * kLevels> tables{};
    std::int64_t i = range.first;
    for (; i + 8 <= range.last; i += 8) {
        std::uint64_t eight;
        std::memcpy(&eight, stored + i, 8);
        if (eight == (eight & 255) * 0x0101010101010101u) {
            tables[eight & 255] += 8;
            continue;
        }
        for (int k = 0; k < 8; ++k)
            ++tables[static_cast<std::size_t>(k % kTables * kLevels) + (eight >> 8 * k & 255)];
    }
    for (; i < range.last; ++i) ++tables[stored[i]];
    for (int level = 0; level < kLevels; ++level)
        for (int table = 0; table < kTables; ++table)
            counts[level] += tables[static_cast<std::size_t>(table * kLevels + level)];
}

/// The same of 16 bits, four values at once.
void count(const std::uint16_t* stored, Chunk range, std::uint32_t* counts) {
    std::int64_t i = range.first;
    for (; i + 4 <= range.last; i += 4) {
        std::uint64_t four;
        std::memcpy(&four, stored + i, 8);
        if (four == (four & 65535) * 0x0001000100010001u) {
            counts[four & 65535] += 4;
            continue;
        }
        for (int k = 0; k < 4; ++k) ++counts[four >> 16 * k & 65535];
    }
    for (; i < range.last; ++i) ++counts[stored[i]];
}

template <class T>
Found by_histogram(const T* stored, std::int64_t values, std::pmr::memory_resource* memory) {
    // Counted by their bits; of signed types the negative ones are the upper half.
    using Bits = std::make_unsigned_t<T>;
    constexpr int kLevels = 1 << 8 * sizeof(T);
    constexpr int kLeast = std::numeric_limits<T>::min();
    std::pmr::vector<std::uint32_t> counts(kLevels * kChunks, 0u, memory);
    tbb::parallel_for(std::int64_t{0}, kChunks, [&](std::int64_t chunk) {
        count(reinterpret_cast<const Bits*>(stored), chunk_of(values, chunk),
              counts.data() + chunk * kLevels);
    });
    Found found;
    std::uint64_t most = 0;
    for (int level = 0; level < kLevels; ++level) {
        std::uint64_t total = 0;
        for (std::int64_t chunk = 0; chunk < kChunks; ++chunk) {
            const auto bits = static_cast<Bits>(level + kLeast);
            const std::uint32_t times = counts[static_cast<std::size_t>(chunk * kLevels + bits)];
            if (times == 0) continue;
            Tally& tally = found.chunks[static_cast<std::size_t>(chunk)];
            const double value = level + kLeast;
            tally.low = std::min(tally.low, value);
            tally.high = std::max(tally.high, value);
            tally.sum += value * times;
            tally.finite += times;
            total += times;
        }
        if (total > most) {
            most = total;
            found.commonest = level + kLeast;
        }
    }
    found.chunks[0].differing = values - static_cast<std::int64_t>(most);
    return found;
}

template <class T>
double drawn_commonest(const T* stored, std::int64_t values) {
    std::mt19937_64 bits(4096);
    std::vector<double> drawn;
    for (int i = 0; i < 4096; ++i) {
        const double at = static_cast<double>(bits() >> 11) * 0x1p-53;
        const double value =
            as_double(stored[static_cast<std::int64_t>(at * static_cast<double>(values))]);
        if (std::isfinite(value)) drawn.push_back(value);
    }
    std::sort(drawn.begin(), drawn.end());
    std::ptrdiff_t most = 7;
    double commonest = std::numeric_limits<double>::quiet_NaN();
    for (auto run = drawn.begin(); run != drawn.end();) {
        const auto next = std::upper_bound(run, drawn.end(), *run);
        if (next - run > most) {
            most = next - run;
            commonest = *run;
        }
        run = next;
    }
    return commonest;
}

/// Sixteen lanes keep the order of additions fixed and fit any vector.
template <class T>
Tally scan(const T* stored, Chunk range, double commonest) {
    constexpr int kLanes = 16;
    using Real = std::conditional_t<std::is_same_v<T, StoredHalf>, float, T>;
    using Limits = std::numeric_limits<Real>;
    const auto common = static_cast<Real>(commonest);
    std::array<Real, kLanes> low, high;
    std::array<double, kLanes> sum{};
    std::array<std::int64_t, kLanes> finite{}, differing{};
    low.fill(Limits::max());
    high.fill(Limits::lowest());
    const auto step = [&](std::int64_t i, int lane) {
        const auto value = static_cast<Real>(stored[i]);
        const bool good = value >= Limits::lowest() && value <= Limits::max();
        low[lane] = good && value < low[lane] ? value : low[lane];
        high[lane] = good && value > high[lane] ? value : high[lane];
        sum[lane] += good ? static_cast<double>(value) : 0.0;
        finite[lane] += good;
        differing[lane] += value != common;
    };
    std::int64_t i = range.first;
    for (; i + kLanes <= range.last; i += kLanes)
        for (int lane = 0; lane < kLanes; ++lane) step(i + lane, lane);
    for (int lane = 0; i < range.last; ++i, ++lane) step(i, lane);
    Tally tally;
    for (int lane = 0; lane < kLanes; ++lane) {
        tally.sum += sum[lane];
        tally.finite += finite[lane];
        tally.differing += differing[lane];
    }
    if (tally.finite > 0) {
        tally.low = static_cast<double>(*std::min_element(low.begin(), low.end()));
        tally.high = static_cast<double>(*std::max_element(high.begin(), high.end()));
    }
    return tally;
}

template <class T>
Found by_scan(const T* stored, std::int64_t values) {
    Found found;
    found.commonest = drawn_commonest(stored, values);
    const auto pass = [&] {
        tbb::parallel_for(std::int64_t{0}, kChunks, [&](std::int64_t chunk) {
            found.chunks[static_cast<std::size_t>(chunk)] =
                scan(stored, chunk_of(values, chunk), found.commonest);
        });
    };
    pass();
    if (std::isnan(found.commonest)) {  // no value is common: the least counts as empty
        double least = std::numeric_limits<double>::infinity();
        for (const Tally& tally : found.chunks) least = std::min(least, tally.low);
        found.commonest = std::isfinite(least) ? least : 0;
        pass();
    }
    return found;
}

/// The box of samples that differ, from the faces inwards: what lies inside is not looked at.
template <class T>
Region occupied_box(const T* stored, const Extent& n, int channels, double commonest) {
    const std::int64_t row = n.x * channels;
    const auto differs = [&](std::int64_t i) { return as_double(stored[i]) != commonest; };
    const auto row_differs = [&](std::int64_t y, std::int64_t z) {
        const std::int64_t first = row * (y + n.y * z);
        int any = 0;
        for (std::int64_t x = 0; x < row; ++x) any |= differs(first + x);
        return any != 0;
    };
    const auto plane_differs = [&](std::int64_t z) {
        for (std::int64_t y = 0; y < n.y; ++y)
            if (row_differs(y, z)) return true;
        return false;
    };
    Region box = Region::all(n);
    auto& begin = box.begin;
    auto& end = box.end;
    while (begin[2] < end[2] && !plane_differs(begin[2])) ++begin[2];
    if (begin[2] == end[2]) return {};
    while (!plane_differs(end[2] - 1)) --end[2];
    const auto layer_differs = [&](std::int64_t y) {
        for (std::int64_t z = begin[2]; z < end[2]; ++z)
            if (row_differs(y, z)) return true;
        return false;
    };
    while (!layer_differs(begin[1])) ++begin[1];
    while (!layer_differs(end[1] - 1)) --end[1];
    std::int64_t first = row, last = -1;  // values within a row
    for (std::int64_t z = begin[2]; z < end[2]; ++z)
        for (std::int64_t y = begin[1]; y < end[1]; ++y) {
            const std::int64_t start = row * (y + n.y * z);
            for (std::int64_t x = 0; x < first; ++x)
                if (differs(start + x)) first = x;
            for (std::int64_t x = row - 1; x > last; --x)
                if (differs(start + x)) last = x;
        }
    begin[0] = first / channels;
    end[0] = last / channels + 1;
    return box;
}

template <class T>
std::int64_t first_with(const T* stored, std::int64_t values, const Found& found, double wanted,
                        double Tally::*extreme) {
    for (std::int64_t chunk = 0; chunk < kChunks; ++chunk) {
        if (found.chunks[static_cast<std::size_t>(chunk)].*extreme != wanted) continue;
        const Chunk range = chunk_of(values, chunk);
        for (std::int64_t i = range.first; i < range.last; ++i)
            if (as_double(stored[i]) == wanted) return i;
    }
    return 0;
}

}  // namespace

Statistics statistics_of(const Data& data, std::pmr::memory_resource* memory) {
    const Extent& n = data.what.extent;
    const int channels = data.what.channels;
    const std::int64_t values = n.samples() * channels;
    Statistics statistics;
    with_stored_type(data.what.type, [&](auto zero) {
        using T = decltype(zero);
        const T* stored = data.as<T>();
        Found found;
        if constexpr (std::is_integral_v<T> && sizeof(T) <= 2)
            found = by_histogram(stored, values, memory);
        else
            found = by_scan(stored, values);
        Tally all;
        for (const Tally& chunk : found.chunks) {
            all.low = std::min(all.low, chunk.low);
            all.high = std::max(all.high, chunk.high);
            all.sum += chunk.sum;
            all.finite += chunk.finite;
            all.differing += chunk.differing;
        }
        const ValueMap& map = data.what.values;
        statistics.commonest = map(found.commonest);
        statistics.non_finite = values - all.finite;
        statistics.occupied = occupied_box(stored, n, channels, found.commonest);
        statistics.occupied_fraction =
            static_cast<double>(all.differing) / static_cast<double>(values);
        if (all.finite == 0) return;
        statistics.low = map(all.low);
        statistics.high = map(all.high);
        statistics.mean = map(all.sum / static_cast<double>(all.finite));
        statistics.lowest = first_with(stored, values, found, all.low, &Tally::low) / channels;
        statistics.highest = first_with(stored, values, found, all.high, &Tally::high) / channels;
        if (map.slope < 0) {
            std::swap(statistics.low, statistics.high);
            std::swap(statistics.lowest, statistics.highest);
        }
    });
    return statistics;
}

}  // namespace edgewise
