#include "charts/front.hpp"

#include <algorithm>

namespace edgewise::charts {
namespace {

bool known(const Values& values) { return values.seconds && values.error; }

/// `<=` in both and `<` in one: with `<=` alone equals would take each other away.
bool dominates(const Values& a, const Values& b) {
    return *a.seconds <= *b.seconds && *a.error <= *b.error &&
           (*a.seconds < *b.seconds || *a.error < *b.error);
}

}  // namespace

void mark_front(std::vector<Point>& points) {
    for (Point& point : points)
        point.front = known(point.measured) &&
                      std::none_of(points.begin(), points.end(), [&](const Point& other) {
                          return other.at == point.at && known(other.measured) &&
                                 dominates(other.measured, point.measured);
                      });
}

std::vector<std::size_t> front_of(const std::vector<Point>& points) {
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < points.size(); ++i)
        if (points[i].front) places.push_back(i);
    std::stable_sort(places.begin(), places.end(), [&](std::size_t a, std::size_t b) {
        return *points[a].measured.seconds < *points[b].measured.seconds;
    });
    return places;
}

}  // namespace edgewise::charts
