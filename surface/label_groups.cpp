#include "surface/label_groups.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numeric>
#include <tbb/combinable.h>
#include <tbb/parallel_for.h>
#include <type_traits>
#include <unordered_set>

#include "graph/with_type.hpp"

namespace edgewise::surface {
namespace {

/// Whether every stored number has a place in a short table.
template <class T>
constexpr bool kIsShort = std::is_integral_v<T> && sizeof(T) <= 2;

template <class T>
bool is_number(T stored) noexcept {
    if constexpr (std::is_floating_point_v<T>) return std::isfinite(stored);
    return true;
}

template <class T>
std::size_t place_of(T stored) noexcept {
    return static_cast<std::size_t>(static_cast<std::int64_t>(stored) -
                                    std::numeric_limits<T>::lowest());
}

/// Calls body(row) for the rows of all slices, side by side.
template <class T, class Body>
void for_each_row(const Data& labels, const std::function<void()>& poll, Body body) {
    const Extent n = labels.what.extent;
    tbb::parallel_for(std::int64_t{0}, n.z, [&](std::int64_t z) {
        if (poll) poll();
        for (std::int64_t y = 0; y < n.y; ++y) body(labels.at<T>(0, y, z), y, z);
    });
}

/// All stored numbers that occur, ascending.
template <class T>
std::vector<T> stored_in(const Data& labels, const std::function<void()>& poll) {
    const std::int64_t length = labels.what.extent.x;
    std::vector<T> all;
    if constexpr (kIsShort<T>) {
        std::vector<std::uint8_t> seen(std::size_t{1} << 8 * sizeof(T));
        for_each_row<T>(labels, poll, [&](const T* row, std::int64_t, std::int64_t) {
            for (std::int64_t x = 0; x < length; ++x)
                std::atomic_ref(seen[place_of(row[x])]).store(1, std::memory_order_relaxed);
        });
        for (std::size_t i = 0; i < seen.size(); ++i)
            if (seen[i])
                all.push_back(static_cast<T>(static_cast<std::int64_t>(i) +
                                             std::numeric_limits<T>::lowest()));
        return all;
    }
    tbb::combinable<std::unordered_set<T>> found;
    for_each_row<T>(labels, poll, [&](const T* row, std::int64_t, std::int64_t) {
        std::unordered_set<T>& mine = found.local();
        for (std::int64_t x = 0; x < length; ++x)
            if (is_number(row[x]) && (x == 0 || row[x] != row[x - 1])) mine.insert(row[x]);
    });
    found.combine_each([&](const std::unordered_set<T>& some) {
        all.insert(all.end(), some.begin(), some.end());
    });
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
}

Representation framed(Representation what, std::size_t groups) {
    for (int axis = 0; axis < 3; ++axis) what.extent[axis] += 2;
    what.type = groups <= 0xff ? Type::u8 : groups <= 0xffff ? Type::u16 : Type::u32;
    what.values = {};
    return what;
}

/// @param group  of each number in `stored`
template <class T, class G>
void fill(const Data& labels, const std::vector<T>& stored, const std::vector<std::uint32_t>& group,
          Data& out, const std::function<void()>& poll) {
    const Extent n = labels.what.extent;
    std::vector<G> table;
    if constexpr (kIsShort<T>) {
        table.resize(std::size_t{1} << 8 * sizeof(T));
        for (std::size_t i = 0; i < stored.size(); ++i)
            table[place_of(stored[i])] = static_cast<G>(group[i]);
    }
    const Extent wide = out.what.extent;
    for (std::int64_t z = 0; z < wide.z; z += wide.z - 1)
        std::fill_n(out.at<G>(0, 0, z), wide.x * wide.y, G{0});
    for_each_row<T>(labels, poll, [&](const T* row, std::int64_t y, std::int64_t z) {
        G* const to = out.at<G>(1, y + 1, z + 1);
        to[-1] = to[n.x] = 0;
        if (y == 0) std::fill_n(out.at<G>(0, 0, z + 1), wide.x, G{0});
        if (y == n.y - 1) std::fill_n(out.at<G>(0, wide.y - 1, z + 1), wide.x, G{0});
        for (std::int64_t x = 0; x < n.x; ++x) {
            if constexpr (kIsShort<T>) {
                to[x] = table[place_of(row[x])];
            } else if (x > 0 && row[x] == row[x - 1]) {
                to[x] = to[x - 1];
            } else if (!is_number(row[x])) {
                to[x] = 0;
            } else {
                const auto at = std::lower_bound(stored.begin(), stored.end(), row[x]);
                to[x] = static_cast<G>(group[static_cast<std::size_t>(at - stored.begin())]);
            }
        }
    });
}

}  // namespace

LabelGroups groups_of(const Data& labels, double background, std::pmr::memory_resource* memory,
                      const std::function<void()>& poll) {
    LabelGroups result;
    with_type(labels.what.type, [&]<class T>(T) {
        const std::vector<T> stored = stored_in<T>(labels, poll);
        // By value, which may fall as stored numbers grow.
        const ValueMap& values = labels.what.values;
        std::vector<std::uint32_t> group(stored.size());
        for (std::size_t k = 0; k < stored.size(); ++k) {
            const std::size_t i = values.slope < 0 ? stored.size() - 1 - k : k;
            const double value = values(static_cast<double>(stored[i]));
            if (value == background) continue;
            result.labels.push_back(value);
            group[i] = static_cast<std::uint32_t>(result.labels.size());
        }
        result.samples = Data::make(framed(labels.what, result.labels.size()), memory);
        switch (result.samples.what.type) {
            case Type::u8:
                return fill<T, std::uint8_t>(labels, stored, group, result.samples, poll);
            case Type::u16:
                return fill<T, std::uint16_t>(labels, stored, group, result.samples, poll);
            default:
                return fill<T, std::uint32_t>(labels, stored, group, result.samples, poll);
        }
    });
    return result;
}

double group_bytes(const Representation& labels) noexcept {
    double samples = 1;
    for (int axis = 0; axis < 3; ++axis) samples *= static_cast<double>(labels.extent[axis] + 2);
    return samples * static_cast<double>(std::min<std::size_t>(4, bytes_of(labels.type)));
}

}  // namespace edgewise::surface
