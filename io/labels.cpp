#include "io/labels.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <limits>
#include <unordered_set>

#include "graph/errors.hpp"
#include "graph/with_type.hpp"

namespace edgewise {
namespace {

constexpr std::size_t kMostLabels = 1 << 24;  // f32 holds every place up to it

std::int64_t numbers_of(const Data& data) { return data.what.samples() * data.what.channels; }

template <class T>
bool fits(T number) noexcept {
    const auto value = static_cast<double>(number);
    // A cast of more than the largest float is undefined in C++.
    if (std::abs(value) > std::numeric_limits<float>::max()) return !std::isfinite(value);
    return std::isnan(value) || static_cast<double>(static_cast<float>(number)) == value;
}

/// Calls body with the type of 32-bit integers or f64; not at all of another type.
template <class Body>
void with_wide_type(Type type, Body&& body) {
    if (type == Type::i32) body(std::int32_t{});
    if (type == Type::u32) body(std::uint32_t{});
    if (type == Type::f64) body(double{});
}

/// Replaces stored numbers by f32, in order, so that those of 32 bits may lie in the same place.
template <class Convert>
void replace_by_f32(Data& data, std::pmr::memory_resource* memory, Convert convert) {
    with_wide_type(data.what.type, [&]<class T>(T) {
        const auto count = static_cast<std::size_t>(numbers_of(data));
        Array own;
        if (sizeof(T) != sizeof(float)) own = Array(count * sizeof(float), memory);
        const auto* from = data.as<std::byte>();
        auto* to = static_cast<std::byte*>(own.data() ? own.data() : data.samples.data());
        for (std::size_t i = 0; i < count; ++i) {
            T number;
            std::memcpy(&number, from + i * sizeof(T), sizeof number);
            const float value = convert(number);
            std::memcpy(to + i * sizeof(float), &value, sizeof value);
        }
        if (own.data()) data.samples = std::move(own);
    });
    data.what.type = Type::f32;
}

/// All different values of labels. Neighbours are mostly equal.
template <class T>
std::unordered_set<double> values_of(const Data& labels) {
    std::unordered_set<double> found;
    const T* number = labels.as<T>();
    double last = NAN;
    for (std::int64_t i = 0; i < numbers_of(labels); ++i) {
        const double value = labels.what.values(static_cast<double>(number[i]));
        if (value == last || std::isnan(value)) continue;
        last = value;
        if (found.insert(value).second && found.size() >= kMostLabels)
            throw RequestError(fmt::format("labels: more than {} different values", kMostLabels));
    }
    return found;
}

}  // namespace

std::int64_t rounded_by_f32(const Data& data) {
    std::int64_t rounded = 0;
    with_wide_type(data.what.type, [&]<class T>(T) {
        const T* number = data.as<T>();
        rounded = std::count_if(number, number + numbers_of(data), [](T n) { return !fits(n); });
    });
    return rounded;
}

void to_f32(Data& data, std::pmr::memory_resource* memory) {
    replace_by_f32(data, memory, [](auto number) { return static_cast<float>(number); });
}

std::shared_ptr<const LabelTable> code_labels(Data& labels, double outside,
                                              std::pmr::memory_resource* memory) {
    LabelTable table;
    with_wide_type(labels.what.type, [&]<class T>(T) {
        auto found = values_of<T>(labels);
        found.insert(outside);
        table.assign(found.begin(), found.end());
    });
    std::sort(table.begin(), table.end());
    const ValueMap values = labels.what.values;
    double last = NAN;
    float place = 0;
    replace_by_f32(labels, memory, [&](auto number) {
        const double value = values(static_cast<double>(number));
        if (std::isnan(value)) return std::numeric_limits<float>::quiet_NaN();
        if (value != last) {
            last = value;
            place = static_cast<float>(place_in(table, value));
        }
        return place;
    });
    labels.what.values = {};
    return std::make_shared<const LabelTable>(std::move(table));
}

double place_in(const LabelTable& table, double value) {
    return static_cast<double>(std::lower_bound(table.begin(), table.end(), value) - table.begin());
}

bool looks_like_labels(const Data& data, double commonest) {
    if (!is_integer(data.what.type) || data.what.channels != 1) return false;
    constexpr std::size_t kMask = 4, kFew = 32, kMost = 4096;
    constexpr std::int64_t kSamplesEach = 16, kLookedAt = 1 << 22;
    constexpr double kEqual = 0.7, kSteps = 0.7;
    const Extent& n = data.what.extent;
    const std::int64_t rows = n.y * n.z;
    const std::int64_t apart = std::max<std::int64_t>(1, n.samples() / kLookedAt);
    return with_type(data.what.type, [&]<class T>(T) {
        std::unordered_set<double> found;
        std::int64_t pairs = 0, equal = 0, unlike = 0, steps = 0;
        double last = NAN;
        for (std::int64_t row = 0; row < rows; row += apart) {
            const T* number = data.as<T>() + row * n.x;
            for (std::int64_t x = 0; x < n.x; ++x) {
                const double value = data.what.values(static_cast<double>(number[x]));
                if (x > 0 && value != commonest) {
                    ++pairs;
                    equal += number[x] == number[x - 1];
                }
                if (x > 0 && number[x] != number[x - 1]) {
                    ++unlike;
                    steps += std::abs(double(number[x]) - double(number[x - 1])) == 1;
                }
                if (value == last) continue;
                last = value;
                if (found.insert(value).second && found.size() > kMost) return false;
            }
        }
        const auto different = static_cast<std::int64_t>(found.size());
        if (different < 2 || different * kSamplesEach > n.samples()) return false;
        const bool smooth = double(steps) >= kSteps * double(unlike) && unlike > 0;
        if (found.size() > kMask && smooth) return false;
        if (found.size() <= kFew) return true;
        return static_cast<double>(equal) >= kEqual * static_cast<double>(pairs);
    });
}

}  // namespace edgewise
