#include "cli/request/options.hpp"

#include <cmath>
#include <fmt/format.h>
#include <utility>

#include "cli/request/numbers.hpp"
#include "graph/errors.hpp"
#include "graph/range.hpp"

namespace edgewise::cli {
namespace {

struct Unit {
    const char* name;
    double factor;
};

constexpr Unit kTimes[] = {{"us", 1e-6}, {"ms", 1e-3}, {"s", 1}, {"min", 60}, {"h", 3600}, {"", 1}};
constexpr Unit kSizes[] = {{"", 1},
                           {"B", 1},
                           {"kB", 1e3},
                           {"KB", 1e3},
                           {"MB", 1e6},
                           {"GB", 1e9},
                           {"TB", 1e12},
                           {"KiB", 1024},
                           {"MiB", 1024.0 * 1024},
                           {"GiB", 1024.0 * 1024 * 1024},
                           {"TiB", 1024.0 * 1024 * 1024 * 1024}};

/// A number with one of the units behind it.
template <std::size_t N>
double with_unit(const char* option, const std::string& text, const Unit (&units)[N],
                 const char* expected) {
    // The unit is what follows the last character that a number may end with.
    const std::size_t digits = text.find_last_of("0123456789.") + 1;
    for (const Unit& unit : units) {
        if (text.compare(digits, std::string::npos, unit.name) != 0 || digits == 0) continue;
        const double value = number_of(option, text.substr(0, digits)) * unit.factor;
        if (value < 0) throw RequestError(fmt::format("{}: {} is negative", option, text));
        return value;
    }
    throw RequestError(fmt::format("{}: '{}' given; expected {}", option, text, expected));
}

WindowEnd window_end(const std::string& text) {
    if (text.empty() || text.back() != '%') return {number_of("--window", text), false};
    const double at = number_of("--window", text.substr(0, text.size() - 1));
    if (at < 0 || at > 100)
        throw RequestError(fmt::format("--window: {} is not from 0% to 100%", text));
    return {at, true};
}

}  // namespace

double error_budget(const std::string& text) {
    if (text.size() > 2 && text.ends_with("dB"))
        return std::pow(10.0, -number_of("--max-error", text.substr(0, text.size() - 2)) / 20);
    const double error = number_of("--max-error", text);
    if (error < 0)
        throw RequestError(fmt::format(
            "--max-error: {} is negative; expected an NRMSE as 0.01 or a PSNR as 40dB", text));
    return error;
}

double time_budget(const std::string& text) {
    return with_unit("--max-time", text, kTimes, "a time as 50ms, 2s or 1min");
}

double memory_budget(const std::string& text) {
    return with_unit("--max-memory", text, kSizes, "a size as 512MiB, 2GB or a number of bytes");
}

Window window_of(const std::string& text) {
    const auto words = split(text, ',');
    if (words.size() != 2)
        throw RequestError(fmt::format(
            "--window: '{}' given; expected LO,HI in values or percentiles, as 1%,99.5%", text));
    const Window window{window_end(words[0]), window_end(words[1])};
    if (window.low.percentile == window.high.percentile && !(window.low.at < window.high.at))
        throw RequestError(fmt::format("--window: {}: LO is not less than HI", text));
    return window;
}

std::array<double, 3> background_of(const std::string& text) {
    const std::vector<double> c = numbers_of("--background", text);
    if (c.size() != 3)
        throw RequestError(
            fmt::format("--background: '{}' given; expected R,G,B, each from 0 to 1", text));
    for (const double part : c)
        if (part < 0 || part > 1)
            throw RequestError(fmt::format("--background: {} is not from 0 to 1", part));
    return {c[0], c[1], c[2]};
}

Transfer grey_ramp(double low, double high, double unit) {
    constexpr double kMostOpacity = 0.05;
    // A step would tell a constant from its own rounding.
    if (!(low < high)) high = low + range_between(low, low);
    return {{{low, 0, {0, 0, 0}}, {high, kMostOpacity, {1, 1, 1}}}, unit};
}

std::size_t verify_count(const std::string& text) {
    if (text == "all") return 0;
    return static_cast<std::size_t>(whole_of("--verify", text, 1, 1'000'000'000));
}

}  // namespace edgewise::cli
