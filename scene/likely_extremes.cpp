#include "scene/likely_extremes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <tbb/parallel_for.h>

namespace edgewise {
namespace {

using Looked = DrawnPixels::Looked;

constexpr std::size_t kStarts = 8, kFound = 4;  // of either end
constexpr int kClimb = 32;                      // steps of a climb at most

/// Whether one pixel's estimate is more extreme than another's.
using Before = bool (*)(const Looked&, const Looked&);
bool is_lower(const Looked& a, const Looked& b) { return a.look.low < b.look.low; }
bool is_higher(const Looked& a, const Looked& b) { return a.look.high > b.look.high; }

/// Moves to a neighbour with a more extreme value, until there is none.
Looked climb(Looked from, const Request& want, const ReferenceField& field,
             const ViewGeometry& geometry, Before before) {
    constexpr std::array<std::array<int, 2>, 8> around = {
        {{-1, -1}, {0, -1}, {1, -1}, {-1, 0}, {1, 0}, {-1, 1}, {0, 1}, {1, 1}}};
    for (int step = 0; step < kClimb; ++step) {
        const OutputSample at = from.at;
        for (const auto& [dx, dy] : around) {
            const OutputSample next{at.view, at.x + dx, at.y + dy, 0};
            if (next.x < 0 || next.y < 0 || next.x >= want.screen.x || next.y >= want.screen.y)
                continue;
            const std::optional<RaySpan> ray = geometry.ray(next);
            if (!ray) continue;
            const Looked there{next, look_at(*ray, want, field)};
            if (there.look.seen() && before(there, from)) from = there;
        }
        if (from.at.x == at.x && from.at.y == at.y) break;
    }
    return from;
}

/// Extremes of one kind, the most extreme first, no two of them neighbours.
void add_ends(const Request& want, const ReferenceField& field, const ViewGeometry& geometry,
              std::vector<Looked> looked, Before before, std::vector<OutputSample>& found) {
    const std::size_t starts = std::min(kStarts, looked.size());
    const auto end = looked.begin() + static_cast<std::ptrdiff_t>(starts);
    std::partial_sort(looked.begin(), end, looked.end(), before);
    tbb::parallel_for(std::size_t{0}, starts, [&](std::size_t i) {
        looked[i] = climb(looked[i], want, field, geometry, before);
    });
    std::stable_sort(looked.begin(), end, before);
    const std::size_t first = found.size();
    for (std::size_t i = 0; i < starts && found.size() < first + kFound; ++i) {
        const OutputSample& at = looked[i].at;
        const auto is_near = [&](const OutputSample& other) {
            return other.view == at.view && std::abs(other.x - at.x) < 2 &&
                   std::abs(other.y - at.y) < 2;
        };
        if (std::none_of(found.begin(), found.end(), is_near)) found.push_back(at);
    }
}

}  // namespace

std::vector<OutputSample> likely_extremes(const Request& want, const ReferenceField& field,
                                          const ViewGeometry& geometry,
                                          const Statistics& statistics,
                                          std::span<const Looked> looked) {
    std::vector<Looked> seen;
    for (const Looked& one : looked)
        if (one.look.seen()) seen.push_back(one);
    std::vector<OutputSample> found;
    for (const Before before : {is_higher, is_lower})
        add_ends(want, field, geometry, seen, before, found);
    if (want.mode->extreme <= 0 || want.eye) return found;

    const Extent& n = field.extent();
    const std::int64_t place = statistics.highest;
    const Vec3 p(static_cast<double>(place % n.x), static_cast<double>(place / n.x % n.y),
                 static_cast<double>(place / (n.x * n.y)));
    for (int i = 0; i < std::min(2, want.frames); ++i) {
        const int view = i * want.frames / 2;
        const Vec3 screen = (want.views.at(view).matrix() * p.homogeneous()).head<3>();
        const double x = std::floor(screen.x()), y = std::floor(screen.y());
        if (x >= 0 && y >= 0 && x < static_cast<double>(want.screen.x) &&
            y < static_cast<double>(want.screen.y))
            found.push_back({view, static_cast<std::int64_t>(x), static_cast<std::int64_t>(y), 0});
    }
    return found;
}

}  // namespace edgewise
