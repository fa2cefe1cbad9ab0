#include "graph/transfer_table.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <iterator>
#include <memory>
#include <utility>

namespace edgewise {
namespace {

using Color = std::array<double, 3>;

constexpr double kMost = 1e300;  // differences of such numbers are still finite

/// The place before which a number lies, and how far behind it: of one place that place alone.
struct Between {
    std::size_t low = 0, high = 0;
    double share = 0;
};

Between between(const std::vector<double>& places, double at) {
    const auto above = std::upper_bound(places.begin(), places.end(), at);
    if (above == places.begin()) return {};
    const auto high = static_cast<std::size_t>(above - places.begin());
    if (above == places.end()) return {high - 1, high - 1, 0};
    const double low = places[high - 1];
    return {high - 1, high, (at - low) / (places[high] - low)};
}

double mixed(double a, double b, double share) { return a + share * (b - a); }

std::string no_axis(const char* name, const std::vector<double>& places, double least) {
    if (places.empty() || places.size() > TransferTable::kMostPlaces)
        return fmt::format("{} has {} numbers; expected 1 to {}", name, places.size(),
                           TransferTable::kMostPlaces);
    for (std::size_t i = 0; i < places.size(); ++i) {
        if (!(places[i] >= least && places[i] <= kMost))
            return fmt::format("{}[{}] is {}; expected a number from {} to {}", name, i, places[i],
                               least, kMost);
        if (i > 0 && !(places[i] > places[i - 1]))
            return fmt::format("{}[{}] is {}, not more than {} before it; they must ascend", name,
                               i, places[i], places[i - 1]);
    }
    return {};
}

/// Values at which a table or the colours of points have a corner; sorted.
std::vector<double> joined_values(const TransferTable& table,
                                  const std::vector<Transfer::Point>& points) {
    std::vector<double> places;
    for (const Transfer::Point& point : points) places.push_back(point.value);
    // Twice where colours jump: so often as they are in one of both.
    std::vector<double> values;
    std::set_union(table.values.begin(), table.values.end(), places.begin(), places.end(),
                   std::back_inserter(values));
    const auto away = [](double from, double sign) {
        return from + sign * std::max(1.0, std::abs(from));
    };
    if (values.size() > 1 && values[0] == values[1])
        values.insert(values.begin(), away(values[0], -1));
    if (values.size() > 1 && values.back() == values[values.size() - 2])
        values.push_back(away(values.back(), 1));
    return values;
}

/// The colour that points have at a value, seen from below or above where they jump.
Color color_at(const std::vector<Transfer::Point>& points, double value, bool from_below) {
    if (points.empty()) return {1, 1, 1};
    const auto last_before = [&](auto before) {
        return std::partition_point(points.begin(), points.end(), before);
    };
    const auto above =
        from_below ? last_before([&](const Transfer::Point& p) { return p.value < value; })
                   : last_before([&](const Transfer::Point& p) { return p.value <= value; });
    if (above == points.begin()) return points.front().color;
    if (above == points.end()) return points.back().color;
    const Transfer::Point &low = *(above - 1), &high = *above;
    const double share = (value - low.value) / (high.value - low.value);
    Color color;
    for (std::size_t c = 0; c < 3; ++c) color[c] = mixed(low.color[c], high.color[c], share);
    return color;
}

/// The same function, with a colour in each cell.
TransferTable colored(const TransferTable& table, const std::vector<Transfer::Point>& points) {
    TransferTable all = table;
    if (!table.color.empty()) return all;
    all.values = joined_values(table, points);
    const std::size_t columns = all.values.size(), rows = table.gradients.size();
    all.opacity.clear();
    for (std::size_t row = 0; row < rows; ++row)
        for (std::size_t i = 0; i < columns; ++i) {
            const Between at = between(table.values, all.values[i]);
            const double* line = table.opacity.data() + row * table.values.size();
            all.opacity.push_back(mixed(line[at.low], line[at.high], at.share));
            const bool from_below = i + 1 < columns && all.values[i] == all.values[i + 1];
            all.color.push_back(color_at(points, all.values[i], from_below));
        }
    return all;
}

double steepest_of(const TransferTable& table) {
    const std::size_t columns = table.values.size();
    double steepest = 0;
    for (std::size_t i = 0; i < table.opacity.size(); ++i) {
        const std::size_t column = i % columns;
        if (column == 0) continue;
        const double width = table.values[column] - table.values[column - 1];
        if (width > 0)
            steepest =
                std::max(steepest, std::abs(table.opacity[i] - table.opacity[i - 1]) / width);
    }
    return steepest;
}

/// The largest opacity of each value, and the colour that it has there.
std::vector<Transfer::Point> largest_of(const TransferTable& table) {
    const std::size_t columns = table.values.size();
    std::vector<Transfer::Point> largest;
    for (std::size_t column = 0; column < columns; ++column) {
        std::size_t most = column;
        for (std::size_t i = column; i < table.opacity.size(); i += columns)
            if (table.opacity[i] > table.opacity[most]) most = i;
        largest.push_back({table.values[column], table.opacity[most], table.color[most]});
    }
    return largest;
}

/// No less than points have, with few points: steps, which leave what is transparent alone. Each
/// point costs time wherever opacities are asked by value.
std::vector<Transfer::Point> few_of(const std::vector<Transfer::Point>& points) {
    constexpr std::size_t kFew = 32;
    if (points.size() <= kFew + 1) return points;
    const std::size_t longest = (points.size() + kFew - 2) / kFew;  // intervals of one step
    const auto most = [&](std::size_t i) {
        return std::max(points[i].opacity, points[i + 1].opacity);
    };
    std::vector<Transfer::Point> few{points.front()};  // below it, it alone
    std::size_t pieces = 0;
    for (std::size_t begin = 0, end = 0; begin + 1 < points.size(); begin = end, ++pieces) {
        double opacity = most(begin);
        for (end = begin + 1; end + 1 < points.size() && end - begin < longest; ++end) {
            if (pieces < kFew && (most(end) > 0) != (most(begin) > 0)) break;
            opacity = std::max(opacity, most(end));
        }
        // An end that is transparent stays so.
        const auto end_at = [&](std::size_t at, std::size_t within) {
            if (points[at].opacity > 0 || opacity == 0) within = at;
            few.push_back({points[within].value, opacity, points[within].color});
        };
        if (points[begin].opacity == 0) few.push_back(points[begin]);
        end_at(begin, begin + 1);
        end_at(end, end - 1);
        if (points[end].opacity == 0) few.push_back(points[end]);
    }
    few.push_back(points.back());
    return few;
}

}  // namespace

std::array<double, 4> TransferTable::at(double value, double gradient) const noexcept {
    const Between across = between(values, value), down = between(gradients, gradient);
    const auto cell = [&](std::size_t row, std::size_t column) {
        const std::size_t i = row * values.size() + column;
        return std::array{color[i][0], color[i][1], color[i][2], opacity[i]};
    };
    const auto low = cell(down.low, across.low), low_next = cell(down.low, across.high);
    const auto high = cell(down.high, across.low), high_next = cell(down.high, across.high);
    std::array<double, 4> found{};
    for (std::size_t c = 0; c < 4; ++c)
        found[c] = mixed(mixed(low[c], low_next[c], across.share),
                         mixed(high[c], high_next[c], across.share), down.share);
    return found;
}

std::string no_table(const TransferTable& table, std::size_t points) {
    if (std::string reason = no_axis("values", table.values, -kMost); !reason.empty())
        return reason;
    if (std::string reason = no_axis("gradients", table.gradients, 0); !reason.empty())
        return reason;
    const std::size_t cells = table.values.size() * table.gradients.size();
    const std::size_t more = table.color.empty() ? points * table.gradients.size() : 0;
    if (cells + more > TransferTable::kMostCells)
        return fmt::format("{} values{} by {} gradients; expected at most {} cells",
                           table.values.size(),
                           more > 0 ? fmt::format(" and {} points", points) : "",
                           table.gradients.size(), TransferTable::kMostCells);
    if (table.opacity.size() != cells)
        return fmt::format("{} opacities; expected {}, one of each value and gradient",
                           table.opacity.size(), cells);
    if (!table.color.empty() && table.color.size() != cells)
        return fmt::format("{} colours; expected {}, one of each value and gradient",
                           table.color.size(), cells);
    const auto is_share = [](double part) { return part >= 0 && part <= 1; };
    if (!std::all_of(table.opacity.begin(), table.opacity.end(), is_share))
        return "expected opacities from 0 to 1";
    for (const Color& color : table.color)
        if (!std::all_of(color.begin(), color.end(), is_share))
            return "expected colours from 0 to 1";
    return {};
}

Transfer completed(Transfer transfer) {
    if (!transfer.table) return transfer;
    auto table = std::make_shared<TransferTable>(colored(*transfer.table, transfer.points));
    table->steepest = steepest_of(*table);
    transfer.points = few_of(largest_of(*table));
    transfer.table = std::move(table);
    return transfer;
}

void rescale(Transfer& transfer, double shift, double scale) {
    for (Transfer::Point& point : transfer.points) point.value = shift + scale * point.value;
    for (Transfer::Edge& edge : transfer.edges) edge.magnitude *= scale;
    if (!transfer.table) return;
    auto table = std::make_shared<TransferTable>(*transfer.table);
    for (double& value : table->values) value = shift + scale * value;
    for (double& gradient : table->gradients) gradient *= scale;
    transfer.table = std::move(table);
}

}  // namespace edgewise
