#pragma once

#include <string>

#include "graph/cost.hpp"
#include "graph/message.hpp"

namespace edgewise {

/// "12.3 us", "4.56 ms", "1.234 s".
std::string seconds_text(double seconds);
/// "12.3 MiB".
std::string bytes_text(double bytes);
/// "0.0123 (38.2 dB)", "unknown".
std::string error_text(const Predicted& predicted);

/// "0.01", "1%" or "40dB" (a PSNR) as an NRMSE. @throws RequestError
double error_budget(const std::string& text);
/// "50us", "50ms", "2s", "1min", "1h"; a number is seconds. @throws RequestError
double time_budget(const std::string& text, const Message& option = setting("max_time"));
/// "512MiB", "2GB"; a number is bytes. @throws RequestError
double memory_budget(const std::string& text);

}  // namespace edgewise
