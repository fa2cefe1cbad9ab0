#include "transitions/kernels/ray_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace edgewise::kernels {
namespace {

/// Numbers beyond those of f32 become its largest.
float narrowed(double number) {
    constexpr double kLargest = std::numeric_limits<float>::max();
    if (std::isnan(number)) return 0;
    return static_cast<float>(std::clamp(number, -kLargest, kLargest));
}

RayTable::Axis axis_of(std::span<const double> places) {
    RayTable::Axis axis;
    for (const double place : places) axis.knots.push_back(narrowed(place));
    if (places.size() == 1) axis.knots.push_back(axis.knots[0]);
    axis.count = static_cast<int>(axis.knots.size());
    while (2 * axis.first_step < axis.count) axis.first_step *= 2;
    axis.knots.resize(2 * static_cast<std::size_t>(axis.first_step),
                      std::numeric_limits<float>::infinity());
    return axis;
}

}  // namespace

float RayTable::largest(float low, float high) const noexcept {
    if (low > high) return 0;  // nothing finite
    // Interpolated samples may round beyond those that they are made of.
    constexpr float kRounding = 1e-6f;
    const float beyond = low == high ? 0 : kRounding * std::max(std::abs(low), std::abs(high));
    const auto begin = values.knots.begin(), end = begin + values.count;
    const auto at = [&](float value) {
        value = std::clamp(value, values.low(), values.high());
        const auto above = std::upper_bound(begin, end - 1, value);
        const auto i = static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, above - begin - 1));
        const float a = values.knots[i], b = values.knots[i + 1];
        return most[i] + (value >= b ? 1 : (value - a) / (b - a)) * (most[i + 1] - most[i]);
    };
    float largest = std::max(at(low - beyond), at(high + beyond));
    const auto last = std::upper_bound(begin, end, high + beyond);
    for (auto knot = std::lower_bound(begin, end, low - beyond); knot < last; ++knot)
        largest = std::max(largest, most[static_cast<std::size_t>(knot - begin)]);
    return largest;
}

double RayTable::bytes() const noexcept {
    const auto floats = values.knots.size() + gradients.knots.size() + cells.size() + most.size();
    return static_cast<double>(floats * sizeof(float));
}

double bytes_of_ray_table(const TransferTable& table) noexcept {
    const auto columns = static_cast<double>(table.values.size() + 1),
               rows = static_cast<double>(table.gradients.size() + 1);
    return 4 * (4 * columns * rows + 3 * columns + 2 * rows);
}

RayTable ray_table_of(const TransferTable& table, const Vec3& per_length, const ValueMap& values) {
    // Of a negative slope the values descend with the stored numbers.
    const std::size_t columns = table.values.size(), rows = table.gradients.size();
    const auto column_of = [&](std::size_t i) { return values.slope < 0 ? columns - 1 - i : i; };
    SmallVector<double> stored;
    for (std::size_t i = 0; i < columns; ++i)
        stored.push_back((table.values[column_of(i)] - values.offset) / values.slope);
    RayTable made;
    made.values = axis_of(stored);
    made.gradients = axis_of(table.gradients);
    const auto across = static_cast<std::size_t>(made.values.count),
               down = static_cast<std::size_t>(made.gradients.count);
    made.cells.reserve(4 * across * down);
    made.most.assign(across, 0);
    for (std::size_t row = 0; row < down; ++row)
        for (std::size_t i = 0; i < across; ++i) {
            const std::size_t from =
                std::min(row, rows - 1) * columns + column_of(std::min(i, columns - 1));
            for (const double part : table.color[from])
                made.cells.push_back(static_cast<float>(part));
            // So little that a part of it may round to 0 is 0.
            constexpr double kNothing = 1e-36;
            const double opacity = table.opacity[from];
            made.cells.push_back(static_cast<float>(opacity > kNothing ? opacity : 0));
            made.most[i] = std::max(made.most[i], made.cells.back());
        }
    for (int axis = 0; axis < 3; ++axis)
        made.per_length[static_cast<std::size_t>(axis)] =
            static_cast<float>(values.slope * per_length[axis]);
    return made;
}

}  // namespace edgewise::kernels
