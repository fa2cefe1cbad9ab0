#include "transfer/curves.hpp"

#include <algorithm>
#include <cmath>

namespace edgewise::transfer {
namespace {

using Values = std::array<double, 3>;

Values between(const Values& a, const Values& b, double share) noexcept {
    Values out{};
    for (std::size_t c = 0; c < 3; ++c) out[c] = a[c] + share * (b[c] - a[c]);
    return out;
}

/// How much of the way from one knot to the next is made, as VTK has it: the half that a place is
/// in is bent, then a cubic joins both halves smoothly.
double way_at(double share, double midpoint, double sharpness) noexcept {
    double s =
        share < midpoint ? 0.5 * share / midpoint : 0.5 + 0.5 * (share - midpoint) / (1 - midpoint);
    const double power = 1 + 10 * sharpness;
    s = s < 0.5 ? 0.5 * std::pow(2 * s, power) : 1 - 0.5 * std::pow(2 * (1 - s), power);
    const double slope = 1 - sharpness;
    return std::clamp(s * s * (3 - 2 * s) + slope * s * (1 - s) * (1 - 2 * s), 0.0, 1.0);
}

/// The same curve with straight lines between knots.
Curve straightened(const Curve& curve) {
    constexpr int kPieces = 12;  // of each half
    constexpr double kEdge = 1e-5, kLinear = 0.01, kStep = 0.99;
    Curve out;
    for (std::size_t i = 0; i < curve.size(); ++i) {
        const Knot& knot = curve[i];
        out.push_back({knot.at, knot.to});
        if (i + 1 == curve.size()) break;
        const Knot& next = curve[i + 1];
        const double midpoint = std::clamp(knot.midpoint, kEdge, 1 - kEdge);
        const auto place = [&](double share) { return knot.at + share * (next.at - knot.at); };
        if (knot.sharpness > kStep) {
            out.push_back({place(midpoint), knot.to});
            out.push_back({place(midpoint), next.to});
        } else if (knot.sharpness >= kLinear) {
            for (int piece = 1; piece < 2 * kPieces; ++piece) {
                const double half = double(piece) / kPieces;  // 1 at the midpoint
                const double share =
                    half < 1 ? half * midpoint : midpoint + (half - 1) * (1 - midpoint);
                out.push_back({place(share),
                               between(knot.to, next.to, way_at(share, midpoint, knot.sharpness))});
            }
        } else if (midpoint != 0.5) {
            out.push_back({place(midpoint), between(knot.to, next.to, 0.5)});
        }
    }
    return out;
}

/// Its values just before a place, and there.
std::array<Values, 2> sides(const Curve& curve, double at) {
    const auto value = [&](Curve::const_iterator next) {
        if (next == curve.begin()) return next->to;
        const Knot& low = *(next - 1);
        if (next == curve.end()) return low.to;
        const double width = next->at - low.at;
        return width > 0 ? between(low.to, next->to, (at - low.at) / width) : low.to;
    };
    const auto less = [](const Knot& knot, double v) { return knot.at < v; };
    const auto more = [](double v, const Knot& knot) { return v < knot.at; };
    return {value(std::lower_bound(curve.begin(), curve.end(), at, less)),
            value(std::upper_bound(curve.begin(), curve.end(), at, more))};
}

using Points = std::vector<Transfer::Point>;

bool is_clear(const Transfer::Point& point) noexcept { return point.opacity <= 0; }

/// Whether a point must stay: a step, or where what is seen begins or ends. Else the empty parts of
/// a volume would no longer be quite clear.
bool is_corner(const Points& points, std::size_t i) {
    if (i == 0 || i + 1 == points.size()) return true;
    const Transfer::Point &here = points[i], &before = points[i - 1], &after = points[i + 1];
    if (here.value == before.value || here.value == after.value) return true;
    return is_clear(here) && (!is_clear(before) || !is_clear(after));
}

/// What cannot be seen goes: all but the ends of stretches without opacity.
Points seen(const Points& points) {
    Points out;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const bool before = i == 0 || is_clear(points[i - 1]);
        const bool after = i + 1 == points.size() || is_clear(points[i + 1]);
        if (!is_clear(points[i]) || !before || !after) out.push_back(points[i]);
    }
    if (out.empty()) out.push_back(points.front());
    return out;
}

/// Lines through fewer points, none of which is farther off than a tolerance: from each point the
/// slopes are kept that pass all points since (a cone), until the next point is not among them.
Points simplified(const Points& points) {
    constexpr double kTolerance[] = {0.5 / 255, 0.5 / 255, 0.5 / 255, 1e-4};
    const auto values = [](const Transfer::Point& point) {
        return std::array<double, 4>{point.color[0], point.color[1], point.color[2], point.opacity};
    };
    Points out{points.front()};
    std::size_t from = 0;
    std::array<double, 4> low{}, high{};
    const auto restart = [&](std::size_t i) {
        from = i;
        low.fill(-HUGE_VAL), high.fill(HUGE_VAL);
    };
    restart(0);
    for (std::size_t i = 1; i < points.size(); ++i) {
        const auto passes = [&] {
            const double width = points[i].value - points[from].value;
            const auto a = values(points[from]), b = values(points[i]);
            for (std::size_t c = 0; c < 4; ++c) {
                const double slope = (b[c] - a[c]) / width;
                if (slope < low[c] || slope > high[c]) return false;
            }
            return true;
        };
        if (i > from + 1 && !passes()) {
            out.push_back(points[i - 1]);
            restart(i - 1);
        }
        if (is_corner(points, i)) {
            out.push_back(points[i]);
            restart(i);
            continue;
        }
        const double width = points[i].value - points[from].value;
        const auto a = values(points[from]), b = values(points[i]);
        for (std::size_t c = 0; c < 4; ++c) {
            low[c] = std::max(low[c], (b[c] - kTolerance[c] - a[c]) / width);
            high[c] = std::min(high[c], (b[c] + kTolerance[c] - a[c]) / width);
        }
    }
    return out;
}

}  // namespace

bool is_constant(const Curve& curve, double value) noexcept {
    return std::all_of(curve.begin(), curve.end(),
                       [&](const Knot& knot) { return knot.to[0] == value; });
}

std::vector<Transfer::Point> joined(const Curve& opacity, const Curve& color) {
    const Curve opaque = straightened(opacity), colored = straightened(color);
    std::vector<double> places;
    for (const Curve* curve : {&opaque, &colored})
        for (const Knot& knot : *curve) places.push_back(knot.at);
    std::sort(places.begin(), places.end());
    places.erase(std::unique(places.begin(), places.end()), places.end());
    Points points;
    for (const double at : places) {
        const auto alpha = sides(opaque, at), tint = sides(colored, at);
        points.push_back({at, alpha[0][0], tint[0]});
        if (alpha[0] != alpha[1] || tint[0] != tint[1])
            points.push_back({at, alpha[1][0], tint[1]});
    }
    return simplified(seen(points));
}

}  // namespace edgewise::transfer
