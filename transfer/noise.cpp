#include "transfer/noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "reference/preview_block.hpp"
#include "reference/stored.hpp"
#include "transfer/drawn.hpp"

namespace edgewise {
namespace {

constexpr int kPlaces = 192, kLength = 18;  // runs along x, each with the eight rows around it

/// One run and the rows around it, by place along x.
struct Column {
    double difference = 0;  // second, along y and z
    double least = 0;
};

/// @param stored  of the sample before the first of the run, one row and one slice before it
template <class T>
Column column_at(const T* stored, std::int64_t row, std::int64_t slice, const ValueMap& map) {
    constexpr std::array<double, 3> kSecond = {1, -2, 1};
    Column column{0, HUGE_VAL};
    for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t j = 0; j < 3; ++j) {
            const double value = map(as_double(
                stored[static_cast<std::int64_t>(j) * row + static_cast<std::int64_t>(k) * slice]));
            column.difference += kSecond[j] * kSecond[k] * value;
            column.least = std::isnan(value) ? NAN : std::min(column.least, value);
        }
    return column;
}

/// Adds the sizes of triple differences along one run.
template <class T>
void add_run(const T* first, std::int64_t count, const Representation& what, double least,
             std::vector<float>& sizes) {
    const std::int64_t step = what.channels, row = step * what.extent.x,
                       slice = row * what.extent.y;
    std::array<Column, kLength> columns;
    for (std::int64_t i = 0; i < count; ++i)
        columns[static_cast<std::size_t>(i)] = column_at(first + i * step, row, slice, what.values);
    for (std::size_t i = 2; i < static_cast<std::size_t>(count); ++i) {
        const Column &a = columns[i - 2], &b = columns[i - 1], &c = columns[i];
        const double size = std::abs(a.difference - 2 * b.difference + c.difference);
        if (a.least >= least && b.least >= least && c.least >= least && std::isfinite(size))
            sizes.push_back(static_cast<float>(size));
    }
}

}  // namespace

std::optional<double> noise_of(const Data& data, const Statistics& statistics, double least) {
    const Extent& n = data.what.extent;
    const Extent box = statistics.occupied.extent();
    if (!data.samples.data() || std::min({box.x, box.y, box.z}) < 3) return std::nullopt;
    const std::int64_t count = std::min<std::int64_t>(kLength, box.x);
    std::vector<float> sizes;
    sizes.reserve(static_cast<std::size_t>(kPlaces) * kLength);
    with_stored_type(data.what.type, [&](auto zero) {
        const auto* stored = data.as<decltype(zero)>();
        for (std::uint64_t place = 0; place < kPlaces; ++place) {
            const std::array<std::int64_t, 3> free{box.x - count + 1, box.y - 2, box.z - 2};
            std::array<std::int64_t, 3> at;
            for (std::size_t k = 0; k < 3; ++k)
                at[k] =
                    statistics.occupied.begin[k] +
                    static_cast<std::int64_t>(hashed(3 * place + k) * static_cast<double>(free[k]));
            add_run(stored + data.what.channels * (at[0] + n.x * (at[1] + n.y * at[2])), count,
                    data.what, least, sizes);
        }
    });
    constexpr std::size_t kLeast = 64;  // places: the median is off by a tenth
    if (sizes.size() < kLeast) return std::nullopt;
    // The median size of a normal variable is 0.6745 of its deviation, and three second differences
    // of independent noise have that of one sample times 6^(3/2), as 1 + 4 + 1 = 6.
    return quantile_of(sizes, 0.5) / (0.6745 * std::pow(6.0, 1.5));
}

bool turns_normals(double share) noexcept {
    // Skin rises by half of the window over two samples. Each component of a central difference has
    // 1/sqrt(2) of the noise, and the two across the gradient turn it, so by noise / gradient.
    constexpr double kGradient = 0.25, kDegrees = 5;
    return share > kGradient * kDegrees * std::numbers::pi / 180;
}

}  // namespace edgewise
