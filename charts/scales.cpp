#include "charts/scales.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace edgewise::charts {
namespace {

constexpr double kRoom = 1.35;        // factor beyond the outermost values
constexpr double kZeroBelow = 4;      // factor that 0 is drawn below the least other value
constexpr double kManyDecades = 3.2;  // beyond: only powers of ten

std::vector<double> tick_values(double low, double high) {
    const double decades = std::log10(high / low);
    // About seven powers of ten are as many as can be read.
    const int stride = std::max(1, static_cast<int>(std::ceil(decades / 7)));
    std::vector<double> values;
    for (int power = static_cast<int>(std::floor(std::log10(low))); std::pow(10, power) <= high;
         ++power)
        for (const double digit : {1., 2., 5.}) {
            if (digit > 1 && decades > kManyDecades) continue;
            if (stride > 1 && ((power % stride) + stride) % stride != 0) continue;
            const double at = digit * std::pow(10, power);
            if (at >= low && at <= high) values.push_back(at);
        }
    return values;
}

}  // namespace

double LogAxis::place(double value) const noexcept {
    if (value <= 0) return zero.value_or(low);
    return std::clamp(value, low, high);
}

LogAxis log_axis(std::span<const double> values, std::string (*text)(double)) {
    double least = std::numeric_limits<double>::infinity(), most = 0;
    bool has_zero = false;
    for (const double value : values) {
        if (!std::isfinite(value) || value < 0) continue;
        has_zero = has_zero || value == 0;
        if (value == 0) continue;
        least = std::min(least, value);
        most = std::max(most, value);
    }
    LogAxis axis;
    if (most == 0) least = most = 1;
    axis.low = least / kRoom;
    axis.high = most * kRoom;
    for (const double at : tick_values(axis.low, axis.high)) axis.ticks.push_back({at, text(at)});
    if (!has_zero) return axis;
    axis.zero = least / kZeroBelow;
    axis.low = *axis.zero / kRoom;
    axis.ticks.insert(axis.ticks.begin(), {*axis.zero, "0"});
    return axis;
}

std::string seconds_text(double seconds) {
    if (seconds == 0) return "0 s";
    struct Unit {
        double size;
        const char* name;
    };
    constexpr Unit kUnits[] = {{1, "s"}, {1e-3, "ms"}, {1e-6, "µs"}};
    // 0.9995 ms would be written as "1e+03 µs".
    for (const Unit& unit : kUnits)
        if (seconds >= 0.9995 * unit.size)
            return fmt::format("{:.3g} {}", seconds / unit.size, unit.name);
    return fmt::format("{:.3g} ns", seconds * 1e9);
}

std::string plain_text(double value) { return fmt::format("{:.3g}", value); }

}  // namespace edgewise::charts
