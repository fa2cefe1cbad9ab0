#include "transitions/reference/preview_bundle.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "transitions/reference/ray_cells.hpp"

namespace edgewise {
namespace {

constexpr double kFine = 1.0 / Reference::kStepsPerUnit;
constexpr double kBlockSide = 20;  // samples that a stretch of a bundle covers on its longest axis

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
                      .look = {},
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

using Values = std::array<double, Places::kMost>;

/// One stretch of one ray.
class Tracer {
 public:
    Tracer(Traced& traced, const PreviewBlock& block, double end, const Setting& setting,
           Bundle& bundle)
        : traced_(traced), block_(block), end_(end), setting_(setting), bundle_(bundle) {}

    void trace() {
        const Request& want = setting_.want;
        trace_reference();
        if (traced_.screen) traced_.screen->trace(block_, end_, want);
        if (traced_.sheared) traced_.sheared->trace(block_, end_, want);
        for (std::size_t s = 0; s < kPreviewSteps.size(); ++s)
            while (take(front_of(want), kPreviewSteps[s], traced_.next[s + 1])) cast(s);
    }

 private:
    bool take(double front, double step, std::int64_t& next) {
        cells_.take(end_, front, step, traced_.ray, next);
        places_.count = 0;
        for (std::size_t i = 0; i < cells_.count; ++i)
            places_.add(traced_.ray.origin + cells_.middle[i] * traced_.ray.direction);
        return cells_.count > 0;
    }
    void add(Stretch& to, const Values& values) const {
        to.add({values.data(), cells_.count}, cells_.length.data(), setting_.want);
    }

    void trace_reference() {
        while (take(0, kFine, traced_.next[0])) {
            block_.reference(places_, held_[0].data());
            add(traced_.reference, held_[0]);
        }
    }

    void cast(std::size_t s) {
        for (PreviewHold hold : {kZoh, kFoh, kSpline}) {
            block_.hold(hold, places_, held_[hold].data());
            add(traced_.cast[hold][s], held_[hold]);
        }
        if (kPreviewSteps[s] == 1) add_noisy();
        if (kPreviewSteps[s] == 0.5) compare_fields();
    }

    void add_noisy() {
        Values noisy;
        for (PreviewHold hold : {kZoh, kFoh}) {
            for (std::size_t i = 0; i < cells_.count; ++i)
                noisy[i] = held_[hold][i] + setting_.noise * block_.noise(hold, places_[i]);
            add(traced_.noisy[hold], noisy);
        }
    }

    /// Squared errors of samples themselves, and of what a pass of shears makes of some.
    void compare_fields() {
        Values expected;
        const Field kind = setting_.field.kind();
        if (kind == Field::spline)
            expected = held_[kSpline];
        else
            block_.reference(places_, expected.data());
        Places moved;
        for (std::size_t i = 0; i < cells_.count; ++i)
            moved.add(block_.assigned_to(places_[i], seed(i)));
        block_.hold(kZoh, moved, held_[3].data());
        for (std::size_t i = 0; i < cells_.count; ++i) {
            if (kind != Field::formula && !std::isfinite(held_[kZoh][i])) continue;  // absent
            for (std::size_t method = 0; method < held_.size(); ++method) {
                const double d = held_[method][i] - expected[i];
                if (std::isfinite(d)) bundle_.field[method] += d * d * cells_.length[i];
            }
            bundle_.points += cells_.length[i];
            if (setting_.lines.empty() || (cells_.index[i] & 3) != 0) continue;
            const std::array<double, 2> wrong = block_.sheared(
                places_[i], setting_.lines[seed(i) % setting_.lines.size()], hashed(seed(i)));
            for (std::size_t k = 0; k < wrong.size(); ++k)
                if (std::isfinite(wrong[k])) bundle_.sheared[k] += wrong[k] * wrong[k];
            ++bundle_.sheared_points;
        }
    }

    std::uint64_t seed(std::size_t i) const {
        return static_cast<std::uint64_t>(std::abs(1e3 * (cells_.middle[i] + places_[i].sum())));
    }

    Traced& traced_;
    const PreviewBlock& block_;
    double end_;
    const Setting& setting_;
    Bundle& bundle_;
    RayCells cells_;
    Places places_;
    std::array<Values, 4> held_;  // zoh, foh, bspline3, me
};

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
        for (Traced& traced : bundle.rays) Tracer(traced, *whole, kEnd, setting, bundle).trace();
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
        for (Traced& traced : bundle.rays) Tracer(traced, block, end, setting, bundle).trace();
    }
}

}  // namespace edgewise
