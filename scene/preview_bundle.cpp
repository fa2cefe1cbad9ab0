#include "scene/preview_bundle.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "reference/ray_cells.hpp"

namespace edgewise {
namespace {

constexpr double kBlockSide = 20;  // samples that a stretch of a bundle covers on its longest axis

}  // namespace

RaySetting::RaySetting(const Request& want_, const ReferenceField& field_,
                       std::vector<std::shared_ptr<const Model>> models_)
    : want(want_), field(field_), models(std::move(models_)), arriving(want_, field_) {
    for (std::size_t m = 0; m < models.size(); ++m) {
        first.push_back(facts.size());
        facts.insert(facts.end(), models[m]->facts().begin(), models[m]->facts().end());
        for (const double step : models[m]->steps()) {
            const auto found = std::find(steps.begin(), steps.end(), step);
            const auto at = static_cast<std::size_t>(found - steps.begin());
            if (found == steps.end()) {
                steps.push_back(step);
                takers.emplace_back();
            }
            takers[at].push_back(m);
        }
    }
}

bool is_short(const RaySpan& ray, const Request& want) {
    return ShortRays::class_of(ray, want) < ShortRays::kClasses;
}

Bundle bundle_at(const RaySetting& setting, const ViewGeometry& geometry,
                 const OutputSample& corner, int side, bool whole) {
    const Request& want = setting.want;
    Bundle bundle;
    bundle.points.resize(setting.facts.size());
    for (int i = 0; i < side * side; ++i) {
        const std::int64_t x = corner.x + i % side, y = corner.y + i / side;
        if (x < 0 || y < 0 || x >= want.screen.x || y >= want.screen.y) continue;
        const std::optional<RaySpan> ray =
            geometry.ray(corner.view, static_cast<double>(x), static_cast<double>(y));
        if (!ray || (!whole && is_short(*ray, want))) continue;
        Traced traced{
            .ray = *ray,
            .at = {corner.view, x, y, 0},
            .frame = needs_frame(want) ? std::optional(geometry.frame({corner.view, x, y, 0}))
                                       : std::nullopt,
            .arriving = {},
            .reference = Stretch::empty(want.mode),
            .models = {},
            .next = {static_cast<std::int64_t>(std::floor((ray->low - ray->front) / ray->step))},
            .low = ray->low,
            .high = ray->high,
            .squares = {}};
        if (setting.arriving.any())
            traced.arriving = [along = std::make_shared<ArrivingAlong>(setting.arriving, *ray,
                                                                       corner.view)](double t) {
                return along->at(t);
            };
        for (const double step : setting.steps)
            traced.next.push_back(
                static_cast<std::int64_t>(std::floor((ray->low - front_of(want)) / step)));
        for (const auto& model : setting.models) {
            traced.models.push_back(model->follow(*ray, traced.at));
            if (!traced.models.back()) continue;
            traced.low = std::min(traced.low, traced.models.back()->begin());
            traced.high = std::max(traced.high, traced.models.back()->end());
        }
        traced.squares.resize(setting.facts.size());
        if (setting.want.mode->threshold) traced.fourths.resize(setting.facts.size());
        bundle.rays.push_back(std::move(traced));
    }
    return bundle;
}

namespace {

/// One stretch of one ray.
void trace(Traced& traced, const PreviewBlock& block, double end, const RaySetting& setting) {
    RayPiece piece(block, traced.ray, traced.frame ? &*traced.frame : nullptr);
    piece.set_arriving(traced.arriving);
    while (piece.take(end, traced.ray.front, traced.ray.step, traced.next[0])) {
        piece.add_reference(traced.reference, setting.want);
        for (const auto& model : traced.models)
            if (model) model->take_reference(piece);
    }
    for (const auto& model : traced.models)
        if (model) model->trace(block, end);
    for (std::size_t s = 0; s < setting.steps.size(); ++s)
        while (piece.take(end, front_of(setting.want), setting.steps[s], traced.next[s + 1]))
            for (const std::size_t taker : setting.takers[s])
                if (traced.models[taker]) traced.models[taker]->take(setting.steps[s], piece);
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

void trace_all(Bundle& bundle, const RaySetting& setting, const PreviewBlock* whole,
               std::pmr::memory_resource* memory) {
    constexpr double kEnd = std::numeric_limits<double>::infinity();
    if (whole) {
        for (Traced& traced : bundle.rays) trace(traced, *whole, kEnd, setting);
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
        for (Traced& traced : bundle.rays) trace(traced, block, end, setting);
    }
}

/// Takes what one model has measured on one ray.
class Squares final : public RaySquares {
 public:
    Squares(Traced& traced, Bundle& bundle, std::size_t first)
        : traced_(traced), bundle_(bundle), first_(first) {}
    void add(std::size_t fact, double square, double fourth) override {
        traced_.squares[first_ + fact] = square;
        if (fourth > 0) traced_.fourths[first_ + fact] = fourth;
    }
    void add_points(std::size_t fact, double squares, double points) override {
        Bundle::Points& sums = bundle_.points[first_ + fact];
        sums.squares += squares;
        sums.points += points;
    }

 private:
    Traced& traced_;
    Bundle& bundle_;
    std::size_t first_;
};

void finish(Bundle& bundle, const RaySetting& setting) {
    Traced* one = nullptr;  // that stands for its neighbours
    for (Traced& traced : bundle.rays) {
        const RayAnswer answer(traced.reference, setting.want, setting.nearby);
        bool alone = true;
        if (!is_short(traced.ray, setting.want)) {
            alone = !one;
            if (one)
                ++one->stands_for;
            else
                one = &traced;
        }
        for (std::size_t m = 0; m < traced.models.size(); ++m) {
            if (!traced.models[m]) continue;
            if (setting.models[m]->stands_for_neighbours() && !alone) continue;
            Squares squares(traced, bundle, setting.first[m]);
            traced.models[m]->finish(answer, squares);
        }
        traced.models.clear();
    }
}

}  // namespace

void measure(Bundle& bundle, const RaySetting& setting, const PreviewBlock* whole,
             std::pmr::memory_resource* memory) {
    trace_all(bundle, setting, whole, memory);
    finish(bundle, setting);
}

}  // namespace edgewise
