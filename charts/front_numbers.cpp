#include "charts/front_numbers.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace edgewise::charts {
namespace {

constexpr double kDigit = 8, kHeight = 14;            // of a text [pixel]
constexpr double kRing = 12, kMark = 7, kHollow = 4;  // radii [pixel]
constexpr double kFar = 24;                           // [pixel]
constexpr double kLine = 0.5, kFaint = 0.4;           // weights of marks that texts may touch

Obstacle about(Spot spot, double radius, double weight = 1) {
    return {spot.x - radius, spot.y - radius, spot.x + radius, spot.y + radius, weight};
}

void add_marks(const Table& table, const Frame& frame, std::vector<Obstacle>& obstacles) {
    for (const Point& point : table.points) {
        const auto& [seconds, error, bytes] = point.predicted;
        if (seconds && error)
            obstacles.push_back(about(frame.spot(*seconds, *error), kHollow, kFaint));
        const Values& measured = point.measured;
        if (measured.seconds && measured.error)
            obstacles.push_back(about(frame.spot(*measured.seconds, *measured.error),
                                      point.chosen ? kRing : kMark));
    }
}

/// The steps of the front: along from a mark, then down to the next.
void add_steps(const Table& table, const std::vector<std::size_t>& front, const Frame& frame,
               std::vector<Obstacle>& obstacles) {
    Spot before{frame.left, frame.top};
    for (std::size_t i = 0; i <= front.size(); ++i) {
        Spot next{frame.right, before.y};
        if (i < front.size()) {
            const Values& values = table.points[front[i]].measured;
            next = frame.spot(*values.seconds, *values.error);
        }
        if (i > 0) obstacles.push_back({before.x, before.y - 1, next.x, before.y + 1, 4 * kLine});
        obstacles.push_back({next.x - 1, before.y, next.x + 1, next.y, 4 * kLine});
        before = next;
    }
}

void add_peers(const Table& table, const Frame& frame, std::vector<Obstacle>& obstacles) {
    for (const Peer& peer : table.peers) {
        const Spot spot = frame.spot(peer.seconds, peer.error);
        obstacles.push_back(about(spot, kMark));
        const double wide = kDigit * static_cast<double>(peer.name.size()) + kMark;
        const bool is_left = spot.x > (frame.left + frame.right) / 2;
        obstacles.push_back({spot.x - (is_left ? wide : 0), spot.y - 22,
                             spot.x + (is_left ? 0 : wide), spot.y - 3});
    }
}

void add_budgets(const Table& table, const Frame& frame, std::vector<Obstacle>& obstacles) {
    constexpr double kText = 110, kHigh = 22;  // [pixel]
    if (table.seconds_budget) {
        const double x = frame.spot(*table.seconds_budget, 1).x;
        obstacles.push_back({x - kHigh, frame.top, x, frame.top + kText});
        obstacles.push_back({x - 1, frame.top, x + 1, frame.bottom, 4 * kLine});
    }
    if (table.error_budget) {
        const double y = frame.spot(1, *table.error_budget).y;
        obstacles.push_back({frame.right - kText, y - kHigh, frame.right, y});
        obstacles.push_back({frame.left, y - 1, frame.right, y + 1, 4 * kLine});
    }
}

}  // namespace

Spot Frame::spot(double seconds_there, double error_there) const {
    const auto share = [](const LogAxis& axis, double value) {
        return std::log(axis.place(value) / axis.low) / std::log(axis.high / axis.low);
    };
    return {left + (right - left) * share(seconds, seconds_there),
            bottom - (bottom - top) * share(error, error_there)};
}

std::vector<FrontNumber> front_numbers(const Table& table, const std::vector<std::size_t>& front,
                                       std::size_t most, const Frame& frame) {
    Room room{frame.left + 3, frame.top + 2, frame.right, frame.bottom - 3, {}};
    add_marks(table, frame, room.obstacles);
    add_steps(table, front, frame, room.obstacles);
    add_peers(table, frame, room.obstacles);
    add_budgets(table, frame, room.obstacles);
    std::vector<Spot> anchors;
    std::vector<double> widths;
    for (std::size_t i = 0; i < std::min(front.size(), most); ++i) {
        const Values& values = table.points[front[i]].measured;
        anchors.push_back(frame.spot(*values.seconds, *values.error));
        widths.push_back(kDigit * static_cast<double>(std::to_string(i + 1).size()) + 2);
    }
    std::vector<FrontNumber> numbers;
    for (const Spot spot : places_beside(anchors, widths, kHeight, std::move(room))) {
        const Spot& anchor = anchors[numbers.size()];
        numbers.push_back({spot, std::hypot(spot.x - anchor.x, spot.y - anchor.y) > kFar});
    }
    return numbers;
}

}  // namespace edgewise::charts
