#include "transitions/reference/preview_bundle.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace edgewise {
namespace {

constexpr double kFine = 1.0 / Reference::kStepsPerUnit;
constexpr double kBlockSide = 20;  // samples that a stretch of a bundle covers on its longest axis

/// Where the first cell of cast rays begins: in front of the first layer of the screen, or in the
/// eye, as in project.ray_cast.
double front_of(const Request& want) { return want.eye ? 0 : -0.5; }

}  // namespace

bool is_short(const RaySpan& ray, const Request& want) {
    return ShortRays::class_of(ray, want) < ShortRays::kClasses;
}

Bundle bundle_at(const Request& want, const ViewGeometry& geometry, const OutputSample& corner,
                 int side, bool whole) {
    Bundle bundle;
    for (int i = 0; i < side * side; ++i) {
        const std::int64_t x = corner.x + i % side, y = corner.y + i / side;
        if (x < 0 || y < 0 || x >= want.screen.x || y >= want.screen.y) continue;
        const std::optional<RaySpan> ray =
            geometry.ray(corner.view, static_cast<double>(x), static_cast<double>(y));
        if (!ray || (!whole && is_short(*ray, want))) continue;
        const Stretch empty = Stretch::empty(want.mode);
        Traced traced{.ray = *ray,
                      .at = {corner.view, x, y, 0},
                      .reference = empty,
                      .noisy = {empty, empty},
                      .cast = {},
                      .screen = {},
                      .sheared = {},
                      .spectrum = {},
                      .low = ray->low,
                      .high = ray->high};
        if (!want.eye) {
            traced.screen.emplace(*ray, want.mode);
            traced.sheared.emplace(*ray, want.input, want.mode);
            traced.low = std::min(traced.low, traced.sheared->begin());
            traced.high = std::max(traced.high, traced.sheared->end());
        }
        for (auto& steps : traced.cast) steps.fill(empty);
        traced.next[0] = static_cast<std::int64_t>(std::floor(ray->low / kFine));
        for (std::size_t s = 0; s < kPreviewSteps.size(); ++s)
            traced.next[s + 1] = static_cast<std::int64_t>(
                std::floor((ray->low - front_of(want)) / kPreviewSteps[s]));
        bundle.rays.push_back(traced);
    }
    return bundle;
}

namespace {

/// Calls each(t, length) for the cells of one step whose middles lie before `end`.
template <class Each>
void cells_before(double end, double front, double step, const RaySpan& ray, std::int64_t& next,
                  Each&& each) {
    for (;; ++next) {
        const double begin = front + static_cast<double>(next) * step;
        const double low = std::max(ray.low, begin), high = std::min(ray.high, begin + step);
        if (0.5 * (low + high) >= end || begin >= ray.high) return;
        if (low < high) each(0.5 * (low + high), high - low);
    }
}

void trace(Traced& traced, const PreviewBlock& block, double end, const Setting& setting,
           Bundle& bundle) {
    const Request& want = setting.want;
    const RaySpan& ray = traced.ray;
    double expected = 0;
    const auto place = [&](double t) { return Vec3(ray.origin + t * ray.direction); };
    const auto add = [&](Stretch& to, double seen, double length) {
        if (std::isfinite(seen)) to.add(seen, length, want);
    };
    cells_before(end, 0, kFine, ray, traced.next[0], [&](double t, double length) {
        const Vec3 p = place(t);
        if (block.reference(p, &expected)) add(traced.reference, expected, length);
    });
    if (traced.screen) traced.screen->trace(block, end, want);
    if (traced.sheared) traced.sheared->trace(block, end, want);
    for (std::size_t s = 0; s < kPreviewSteps.size(); ++s)
        cells_before(
            end, front_of(want), kPreviewSteps[s], ray, traced.next[s + 1],
            [&](double t, double length) {
                const Vec3 p = place(t);
                std::array<double, 4> held{};
                for (PreviewHold hold : {kZoh, kFoh, kSpline}) {
                    block.hold(hold, p, &held[hold]);
                    add(traced.cast[hold][s], held[hold], length);
                }
                if (kPreviewSteps[s] == 1)
                    for (PreviewHold hold : {kZoh, kFoh})
                        add(traced.noisy[hold], held[hold] + setting.noise * block.noise(hold, p),
                            length);
                if (kPreviewSteps[s] != 0.5 || !block.reference(p, &expected)) return;
                block.assigned(p, static_cast<std::uint64_t>(std::abs(1e3 * (t + p.sum()))),
                               &held[3]);
                for (std::size_t method = 0; method < 4; ++method) {
                    const double d = held[method] - expected;
                    if (std::isfinite(d)) bundle.field[method] += d * d * length;
                }
                bundle.points += length;
                if (want.eye || (traced.next[s + 1] & 3) != 0) return;
                const std::array<double, 2> wrong =
                    block.sheared(p, static_cast<std::uint64_t>(std::abs(1e3 * (t + p.sum()))));
                for (std::size_t i = 0; i < wrong.size(); ++i)
                    if (std::isfinite(wrong[i])) bundle.sheared[i] += wrong[i] * wrong[i];
                ++bundle.sheared_points;
            });
}

/// The box of cells that the rays of a bundle cross between begin and end; none: empty.
Region cells_between(const Bundle& bundle, double begin, double end, const ReferenceField& field) {
    Region cells{{field.extent().x, field.extent().y, field.extent().z}, {0, 0, 0}};
    for (const Traced& traced : bundle.rays)
        for (double t : {std::max(begin, traced.low), std::min(end, traced.high)}) {
            if (t < traced.low || t > traced.high) continue;
            const Vec3 p = field.clamped(traced.ray.origin + t * traced.ray.direction);
            for (int axis = 0; axis < 3; ++axis) {
                const auto cell = static_cast<std::int64_t>(std::floor(p[axis]));
                cells.begin[axis] = std::min(cells.begin[axis], cell);
                cells.end[axis] = std::max(cells.end[axis], cell + 1);
            }
        }
    return cells;
}

}  // namespace

void measure(Bundle& bundle, const Setting& setting, const PreviewBlock* whole,
             std::pmr::memory_resource* memory) {
    constexpr double kEnd = std::numeric_limits<double>::infinity();
    if (whole) {
        for (Traced& traced : bundle.rays) trace(traced, *whole, kEnd, setting, bundle);
        return;
    }
    double low = kEnd, high = -low, speed = 0;
    for (const Traced& traced : bundle.rays) {
        low = std::min(low, traced.low);
        high = std::max(high, traced.high);
        speed = std::max(speed, traced.ray.direction.cwiseAbs().maxCoeff());
    }
    const double piece = kBlockSide / speed;
    for (double begin = low; begin < high; begin += piece) {
        const double end = begin + piece >= high ? kEnd : begin + piece;
        const Region cells = cells_between(bundle, begin, std::min(end, high), setting.field);
        if (cells.empty()) continue;
        const PreviewBlock block(setting.field, cells, memory);
        for (Traced& traced : bundle.rays) trace(traced, block, end, setting, bundle);
    }
}

}  // namespace edgewise
