#include "charts/axes.hpp"

#include <algorithm>
#include <limits>

namespace edgewise::charts {
namespace {

using Value = std::optional<double>;

/// A budget far from everything would leave the lines of a sweep a small part of their panel.
bool is_near(const Value& budget, const std::vector<double>& values) {
    constexpr double kNear = 4;  // factor
    if (!budget) return false;
    double least = std::numeric_limits<double>::infinity(), most = 0;
    for (const double value : values)
        if (value > 0) {
            least = std::min(least, value);
            most = std::max(most, value);
        }
    return most == 0 || (*budget >= least / kNear && *budget <= most * kNear);
}

LogAxis axis_of(const Table& table, Value Values::*of, double Peer::*of_peer, const Value& budget,
                std::string (*text)(double)) {
    std::vector<double> values;
    const auto take = [&](const Value& value) {
        if (value) values.push_back(*value);
    };
    for (const Point& point : table.points) {
        if (table.swept.empty()) take(point.predicted.*of);
        take(point.measured.*of);
    }
    for (const Peer& peer : table.peers) values.push_back(peer.*of_peer);
    if (table.swept.empty() || is_near(budget, values)) take(budget);
    return log_axis(values, text);
}

}  // namespace

LogAxis seconds_axis(const Table& table) {
    return axis_of(table, &Values::seconds, &Peer::seconds, table.seconds_budget, seconds_text);
}

LogAxis error_axis(const Table& table) {
    return axis_of(table, &Values::error, &Peer::error, table.error_budget, plain_text);
}

}  // namespace edgewise::charts
