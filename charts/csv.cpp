#include "charts/csv.hpp"

#include <fmt/format.h>

namespace edgewise::charts {
namespace {

std::string quoted(const std::string& text) {
    if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
    std::string safe = "\"";
    for (const char c : text) {
        if (c == '"') safe += '"';
        safe += c;
    }
    return safe + '"';
}

/// The shortest text that reads back as the same number.
std::string number(const std::optional<double>& value) {
    return value ? fmt::format("{}", *value) : "";
}

}  // namespace

std::string to_csv(const Table& table) {
    std::string csv =
        "plan,predicted_seconds,measured_seconds,predicted_error,measured_error,predicted_bytes,"
        "measured_bytes,front";
    csv += table.swept.empty() ? "\n" : "," + quoted(table.swept) + "\n";
    for (const Point& point : table.points) {
        const Values &a = point.predicted, &b = point.measured;
        csv += fmt::format("{},{},{},{},{},{},{},{}", quoted(point.path), number(a.seconds),
                           number(b.seconds), number(a.error), number(b.error), number(a.bytes),
                           number(b.bytes), point.front ? 1 : 0);
        csv += table.swept.empty() ? "\n" : "," + number(point.at) + "\n";
    }
    return csv;
}

}  // namespace edgewise::charts
