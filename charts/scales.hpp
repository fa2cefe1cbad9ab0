#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace edgewise::charts {

struct Tick {
    double at = 0;
    std::string text;
};

/// A logarithmic axis.
struct LogAxis {
    double low = 0.1, high = 10;
    /// Where 0 is drawn, which has no logarithm: below all other values.
    std::optional<double> zero;
    std::vector<Tick> ticks;

    /// Where a value is drawn; the edge of the axis for what lies beyond it.
    double place(double value) const noexcept;
};

/// An axis on which all values lie with some room around them; ticks at 1, 2 and 5 times powers of
/// ten, at powers alone where there are many.
/// @param values  0 or more; what is negative or not finite is left out
/// @param text    of a tick's value
LogAxis log_axis(std::span<const double> values, std::string (*text)(double));

/// "20 µs", "1.5 ms", "2 s"; three digits.
std::string seconds_text(double seconds);
/// "0.001", "1e-05"; three digits.
std::string plain_text(double value);

}  // namespace edgewise::charts
