#include "charts/places.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

namespace edgewise::charts {
namespace {

/// Below and left of a mark of a falling front is where nothing is; then clockwise about it.
constexpr std::array kTurns = {3, 4, 2, 5, 1, 6, 0, 7};            // eighths, from the right
constexpr std::array kDistances = {13.0, 19.0, 27.0, 37.0, 50.0};  // [pixel]
constexpr double kForDistance = 0.004, kForTurn = 0.003;           // a pixel, a turn

double shared(const Obstacle& a, const Obstacle& b) {
    const double wide = std::min(a.right, b.right) - std::max(a.left, b.left);
    const double high = std::min(a.bottom, b.bottom) - std::max(a.top, b.top);
    return wide > 0 && high > 0 ? wide * high : 0;
}

Obstacle box_at(Spot middle, double width, double height) {
    return {middle.x - width / 2, middle.y - height / 2, middle.x + width / 2,
            middle.y + height / 2};
}

bool holds(const Room& room, const Obstacle& box) {
    return box.left >= room.left && box.right <= room.right && box.top >= room.top &&
           box.bottom <= room.bottom;
}

/// What a place costs: the share of the text that something else covers, and how far it is.
double cost_of(const Obstacle& box, const Room& room, double distance, std::size_t turn) {
    double cost = kForDistance * distance + kForTurn * static_cast<double>(turn);
    const double area = (box.right - box.left) * (box.bottom - box.top);
    for (const Obstacle& obstacle : room.obstacles)
        cost += obstacle.weight * shared(box, obstacle) / area;
    return cost;
}

Spot place_beside(Spot anchor, double width, double height, const Room& room) {
    Spot best = {std::clamp(anchor.x, room.left + width / 2, room.right - width / 2),
                 std::clamp(anchor.y, room.top + height / 2, room.bottom - height / 2)};
    double least = std::numeric_limits<double>::infinity();
    for (const double distance : kDistances)
        for (std::size_t turn = 0; turn < kTurns.size(); ++turn) {
            const double angle = kTurns[turn] * std::numbers::pi / 4;
            // A wide text is farther out on its sides.
            const Spot spot = {anchor.x + std::cos(angle) * (distance + (width - height) / 2),
                               anchor.y + std::sin(angle) * distance};
            const Obstacle box = box_at(spot, width, height);
            const double cost = cost_of(box, room, distance, turn);
            if (cost >= least || !holds(room, box)) continue;
            least = cost;
            best = spot;
        }
    return best;
}

}  // namespace

std::vector<Spot> places_beside(std::span<const Spot> anchors, std::span<const double> widths,
                                double height, Room room) {
    std::vector<Spot> places;
    for (std::size_t i = 0; i < anchors.size(); ++i) {
        places.push_back(place_beside(anchors[i], widths[i], height, room));
        room.obstacles.push_back(box_at(places.back(), widths[i], height));
    }
    return places;
}

std::vector<double> spread(std::span<const double> values, double apart, double low, double high) {
    std::vector<std::size_t> order(values.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
    // Values that are too close form a block about their common middle, which may take in the next.
    struct Block {
        double sum;  // of the positions of the block's first, by each of its values
        double count;
        double first() const { return sum / count; }
    };
    std::vector<Block> blocks;
    for (const std::size_t i : order) {
        blocks.push_back({values[i], 1});
        while (blocks.size() > 1) {
            Block& before = blocks[blocks.size() - 2];
            const Block& last = blocks.back();
            if (before.first() + apart * before.count <= last.first()) break;
            before.sum += last.sum - apart * before.count * last.count;
            before.count += last.count;
            blocks.pop_back();
        }
    }
    std::vector<double> places(values.size());
    std::size_t next = 0;
    for (const Block& block : blocks)
        for (double k = 0; k < block.count; ++k) places[order[next++]] = block.first() + apart * k;
    // What is beyond an end pushes the others; the lower end is the last to give way.
    double most = high;
    for (std::size_t n = order.size(); n-- > 0; most -= apart)
        places[order[n]] = std::min(places[order[n]], most);
    double least = low;
    for (std::size_t n = 0; n < order.size(); ++n, least += apart)
        places[order[n]] = std::max(places[order[n]], least);
    return places;
}

}  // namespace edgewise::charts
