#include "io/labels.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <limits>
#include <type_traits>
#include <unordered_map>
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

/// Of 64-bit integers in the place of f64.
template <class T>
std::shared_ptr<const LabelTable> code_integers(Data& labels, double outside,
                                                std::pmr::memory_resource* memory) {
    constexpr double kBeyond = std::is_signed_v<T> ? 0x1p63 : 0x1p64,
                     kLeast = std::is_signed_v<T> ? -0x1p63 : 0;
    if (!(outside >= kLeast && outside < kBeyond) || outside != std::floor(outside))
        throw RequestError(
            message("@outside({}): labels that are 64-bit integers cannot say it", outside));
    const auto count = static_cast<std::size_t>(numbers_of(labels));
    const auto* number = labels.as<std::uint64_t>();
    std::unordered_set<std::uint64_t> found{static_cast<std::uint64_t>(static_cast<T>(outside))};
    for (std::size_t i = 0; i < count; ++i) {
        if (i > 0 && number[i] == number[i - 1]) continue;
        if (found.insert(number[i]).second && found.size() > kMostLabels)
            throw RequestError(fmt::format("labels: more than {} different values", kMostLabels));
    }
    LabelTable table;
    table.with_sign = std::is_signed_v<T>;
    table.bits.assign(found.begin(), found.end());
    std::sort(table.bits.begin(), table.bits.end(), [](std::uint64_t a, std::uint64_t b) {
        return static_cast<T>(a) < static_cast<T>(b);
    });
    for (const std::uint64_t bits : table.bits)
        table.values.push_back(static_cast<double>(static_cast<T>(bits)));
    std::unordered_map<std::uint64_t, float> places;
    for (std::size_t i = 0; i < table.bits.size(); ++i)
        places[table.bits[i]] = static_cast<float>(i);
    Array coded(count * sizeof(float), memory);
    auto* to = static_cast<float*>(coded.data());
    for (std::size_t i = 0; i < count; ++i)
        to[i] = i > 0 && number[i] == number[i - 1] ? to[i - 1] : places.at(number[i]);
    labels.samples = std::move(coded);
    labels.what.type = Type::f32;
    labels.what.values = {};
    return std::make_shared<const LabelTable>(std::move(table));
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
                                              std::pmr::memory_resource* memory,
                                              store::Wide integers) {
    if (integers != store::Wide::no)
        return integers == store::Wide::with_sign
                   ? code_integers<std::int64_t>(labels, outside, memory)
                   : code_integers<std::uint64_t>(labels, outside, memory);
    LabelTable table;
    with_wide_type(labels.what.type, [&]<class T>(T) {
        auto found = values_of<T>(labels);
        found.insert(outside);
        table.values.assign(found.begin(), found.end());
    });
    std::sort(table.values.begin(), table.values.end());
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
    if (!table.bits.empty()) {
        const auto place = [&](auto whole) {
            using T = decltype(whole);
            const auto at = std::lower_bound(
                table.bits.begin(), table.bits.end(), whole,
                [](std::uint64_t bits, T number) { return static_cast<T>(bits) < number; });
            return static_cast<double>(at - table.bits.begin());
        };
        return table.with_sign ? place(static_cast<std::int64_t>(value))
                               : place(static_cast<std::uint64_t>(value));
    }
    const auto at = std::lower_bound(table.values.begin(), table.values.end(), value);
    return static_cast<double>(at - table.values.begin());
}

std::string LabelTable::text(std::size_t place) const {
    if (bits.empty()) return fmt::format("{}", values[place]);
    return with_sign ? fmt::format("{}", static_cast<std::int64_t>(bits[place]))
                     : fmt::format("{}", bits[place]);
}

std::optional<std::int64_t> LabelTable::integer(std::size_t place) const {
    if (!bits.empty()) {
        const auto number = static_cast<std::int64_t>(bits[place]);
        return with_sign || number >= 0 ? std::optional(number) : std::nullopt;
    }
    const double value = values[place];
    if (value != std::floor(value) || !(std::abs(value) < 0x1p63)) return {};
    return static_cast<std::int64_t>(value);
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
