#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>

#include "graph/request.hpp"

namespace edgewise::cli {

/// --max-error: an NRMSE ("0.01") or a PSNR ("40dB"). @return NRMSE; @throws RequestError
double error_budget(const std::string& text);

/// --max-time: "50us", "50ms", "2s", "1min", "1h", a number is seconds. @throws RequestError
double time_budget(const std::string& text);

/// --max-memory: "512MiB", "2GB", a number is bytes. @throws RequestError
double memory_budget(const std::string& text);

/// One end of a window: a value, or a share of the samples.
struct WindowEnd {
    double at = 0;
    bool percentile = false;  // then `at` is in percent
};
struct Window {
    WindowEnd low, high;

    bool values() const noexcept { return !low.percentile && !high.percentile; }
};

/// --window LO,HI: "0,255", "1%,99.5%". @throws RequestError
Window window_of(const std::string& text);

/// --background R,G,B, each 0..1. @throws RequestError
std::array<double, 3> background_of(const std::string& text);

/// --transfer FILE.json. @param unit length of its opacities where the file names none
/// @throws RequestError naming the file and the field
Transfer load_transfer(const std::string& file, double unit);

/// A grey ramp: opacity 0 to 0.05 per `unit` of length between two values.
Transfer grey_ramp(double low, double high, double unit);

/// --verify=N: a number of samples, or all (0). @throws RequestError
std::size_t verify_count(const std::string& text);

}  // namespace edgewise::cli
