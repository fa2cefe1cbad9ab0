#include "cli/request/quantities.hpp"

#include <cmath>
#include <fmt/format.h>

namespace edgewise::cli {

std::string seconds_text(double seconds) {
    if (seconds < 1e-3) return fmt::format("{:.1f} us", seconds * 1e6);
    if (seconds < 1) return fmt::format("{:.2f} ms", seconds * 1e3);
    return fmt::format("{:.3f} s", seconds);
}

std::string bytes_text(double bytes) { return fmt::format("{:.1f} MiB", bytes / 0x1p20); }

std::string error_text(const Predicted& predicted) {
    if (!predicted.known) return "unknown";
    const double decibels = -20 * std::log10(predicted.error);
    if (!std::isfinite(decibels)) return fmt::format("{:.3g}", predicted.error);
    return fmt::format("{:.3g} ({:.1f} dB)", predicted.error, decibels);
}

}  // namespace edgewise::cli
