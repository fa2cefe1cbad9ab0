#include "charts/axes.hpp"

namespace edgewise::charts {
namespace {

using Value = std::optional<double>;

LogAxis axis_of(const Table& table, Value Values::*of, double Peer::*of_peer, const Value& budget,
                std::string (*text)(double)) {
    std::vector<double> values;
    const auto take = [&](const Value& value) {
        if (value) values.push_back(*value);
    };
    for (const Point& point : table.points) {
        take(point.predicted.*of);
        take(point.measured.*of);
    }
    for (const Peer& peer : table.peers) values.push_back(peer.*of_peer);
    take(budget);
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
