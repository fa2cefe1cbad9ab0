#include "request/quantities.hpp"

#include <cmath>
#include <fmt/format.h>

#include "graph/errors.hpp"
#include "graph/words.hpp"
#include "request/numbers.hpp"

namespace edgewise {
namespace {

struct Unit {
    const char* name;
    double factor;
};

constexpr Unit kTimes[] = {{"us", 1e-6}, {"ms", 1e-3}, {"s", 1}, {"min", 60}, {"h", 3600}, {"", 1}};
constexpr Unit kSizes[] = {{"", 1},
                           {"B", 1},
                           {"kB", 1e3},
                           {"MB", 1e6},
                           {"GB", 1e9},
                           {"TB", 1e12},
                           {"KiB", 1024},
                           {"MiB", 1024.0 * 1024},
                           {"GiB", 1024.0 * 1024 * 1024},
                           {"TiB", 1024.0 * 1024 * 1024 * 1024}};

/// A number with one of the units behind it.
template <std::size_t N>
double with_unit(const Message& option, const std::string& text, const Unit (&units)[N],
                 const char* expected) {
    // The unit is what follows the last character that a number may end with.
    const std::size_t digits = text.find_last_of("0123456789.") + 1;
    for (const Unit& unit : units) {
        if (!same_word(text.substr(digits), unit.name) || digits == 0) continue;
        const double value = number_of(option, text.substr(0, digits)) * unit.factor;
        if (value < 0) throw RequestError(message("{}: {} is negative", option, text));
        return value;
    }
    throw RequestError(message("{}: '{}' given; expected {}", option, text, expected));
}

}  // namespace

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

double error_budget(const std::string& text) {
    if (text.size() > 2 && lower(text).ends_with("db"))
        return std::pow(10.0,
                        -number_of(setting("max_error"), text.substr(0, text.size() - 2)) / 20);
    const bool percent = text.size() > 1 && text.ends_with('%');
    const double error =
        number_of(setting("max_error"), percent ? text.substr(0, text.size() - 1) : text) /
        (percent ? 100 : 1);
    if (error < 0)
        throw RequestError(message(
            "@max_error: {} is negative; expected an NRMSE as 0.01 or 1%, or a PSNR as 40dB",
            text));
    return error;
}

double time_budget(const std::string& text, const Message& option) {
    return with_unit(option, text, kTimes, "a time as 50ms, 2s or 1min");
}

double memory_budget(const std::string& text) {
    return with_unit(setting("max_memory"), text, kSizes,
                     "a size as 512MiB, 2GB or a number of bytes");
}

}  // namespace edgewise
