#pragma once

#include <optional>
#include <string>
#include <vector>

namespace edgewise::charts {

/// What one way of doing something takes, predicted or measured; absent where it is not known.
struct Values {
    std::optional<double> seconds, error, bytes;  // error: NRMSE
};

/// A mark of a chart: one path.
struct Point {
    std::string path;    // its steps
    std::string family;  // what it has in common with others: one colour and shape
    Values predicted, measured;
    bool front = false;            // measured: see mark_front
    bool predicted_front = false;  // of seconds, bytes and error as predicted
    bool chosen = false;           // by the planner
    std::optional<double> at;      // the swept value, in a sweep
};

/// Another program, as somebody measured it.
struct Peer {
    std::string name;
    double seconds = 0, error = 0;
};

/// All that a chart shows.
struct Table {
    std::string title;
    std::vector<Point> points;
    std::vector<Peer> peers;
    std::optional<double> seconds_budget, error_budget;
    std::string swept;  // the option whose values the points were measured at, or ""
};

}  // namespace edgewise::charts
