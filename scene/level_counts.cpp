#include "scene/level_counts.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

#include "reference/stored.hpp"

namespace edgewise {
namespace {

// Neighbours are often equal, and a counter that was just written is slow to read again: eight
// bytes that are the same count at once.

/// Other bytes are counted in turn in tables of their own, which the stack has room for.
void add_levels(const std::uint8_t* stored, std::int64_t n, std::uint32_t* counts) {
    constexpr std::size_t kTables = 4, kLevels = 256;
    std::array<std::uint32_t, kTables * kLevels> tables{};
    std::int64_t i = 0;
    for (; i + 8 <= n; i += 8) {
        std::uint64_t eight;
        std::memcpy(&eight, stored + i, 8);
        if (eight == (eight & 255) * 0x0101010101010101u) {
            tables[eight & 255] += 8;
            continue;
        }
        for (std::size_t k = 0; k < 8; ++k)
            ++tables[k % kTables * kLevels + (eight >> 8 * k & 255)];
    }
    for (; i < n; ++i) ++tables[stored[i]];
    for (std::size_t k = 0; k < tables.size(); ++k) counts[k % kLevels] += tables[k];
}

void add_levels(const std::uint16_t* stored, std::int64_t n, std::uint32_t* counts) {
    std::int64_t i = 0;
    for (; i + 4 <= n; i += 4) {
        std::uint64_t four;
        std::memcpy(&four, stored + i, 8);
        if (four == (four & 65535) * 0x0001000100010001u) {
            counts[four & 65535] += 4;
            continue;
        }
        for (int k = 0; k < 4; ++k) ++counts[four >> 16 * k & 65535];
    }
    for (; i < n; ++i) ++counts[stored[i]];
}

}  // namespace

LevelCounts::LevelCounts(Type type, std::pmr::memory_resource* memory)
    : type_(type),
      levels_(std::size_t{1} << 8 * bytes_of(type)),
      memory_(memory),
      sum_(memory),
      parts_([this] {
          return Part{std::pmr::vector<std::uint32_t>(memory_), 0};
      }) {}

void LevelCounts::count(const Stretched& values) {
    constexpr std::int64_t kAtOnce = std::int64_t{1} << 30;  // far from what counters hold
    if (values.last - values.first > kAtOnce) {
        for (Stretched part = values; part.first < values.last; part.first = part.last) {
            part.last = std::min(values.last, part.first + kAtOnce);
            count(part);
        }
        return;
    }
    Part& part = parts_.local();
    const std::int64_t n = values.last - values.first;
    if (part.counted + n > std::numeric_limits<std::uint32_t>::max()) add(part);
    if (part.counts.empty()) part.counts.resize(levels_);
    part.counted += n;
    if (bytes_of(type_) == 1)
        add_levels(static_cast<const std::uint8_t*>(values.stored) + values.first, n,
                   part.counts.data());
    else
        add_levels(static_cast<const std::uint16_t*>(values.stored) + values.first, n,
                   part.counts.data());
}

void LevelCounts::add(Part& part) {
    const std::lock_guard<std::mutex> lock(summing_);
    sum_.resize(levels_);
    for (std::size_t i = 0; i < part.counts.size(); ++i) sum_[i & (levels_ - 1)] += part.counts[i];
    std::ranges::fill(part.counts, 0u);
    part.counted = 0;
}

LevelCounts::Level LevelCounts::commonest(std::int64_t least, std::int64_t greatest) const {
    Level most{0, 0};
    for (std::int64_t level = least; level <= greatest; ++level) {
        // Of signed types the negative numbers are the upper half.
        const auto place = static_cast<std::size_t>(level) & (levels_ - 1);
        std::int64_t times = sum_.empty() ? 0 : sum_[place];
        for (const Part& part : parts_)
            if (!part.counts.empty()) times += part.counts[place];
        if (times > most.times) most = {static_cast<double>(level), times};
    }
    return most;
}

}  // namespace edgewise
