#include "transitions/project/ray_cast_model.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <map>
#include <memory>
#include <utility>

#include "graph/range.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/project/arriving.hpp"
#include "transitions/project/picture.hpp"

namespace edgewise {
namespace {

using Filters = std::vector<const Filter*>;

/// Noise of samples between which a spline runs passes as that of linear interpolation does.
constexpr std::array<PreviewHold, 2> kNoisy = {kZoh, kFoh};
constexpr std::size_t kNoisyStep = 2;  // of kCastSteps

/// A cast steps over a stretch between two crossings of the level that is shorter than a step, now
/// and then; and such stretches are rarer than the rays that a preview draws. Where rays graze a
/// smooth body, the density of chords is proportional to their length (of a ball of radius R it is
/// l / (2 R^2), up to the diameter). So of chords shorter than `reach` a share of step^2 / (3
/// reach^2) is stepped over: the integral of (1 - l / step) 2 l / reach^2 from 0 to step. Every ray
/// with such a chord stands for that share of a ray that sees what is behind. Walls have no chords
/// shorter than they are thick: they are overrated.
class SteppedOver {
 public:
    explicit SteppedOver(Mode mode) : behind_(Stretch::empty(mode)) {}

    /// Cells of the finest step.
    void take(RayPiece& piece, const Filter& filter, const Request& want) {
        const std::span<const double> held = piece.held(filter);
        std::array<double, Places::kMost> beyond;  // NaN before the second crossing
        for (std::size_t i = 0; i < held.size(); ++i) {
            const double t = piece.cells().middle[i], above = held[i] - want.level();
            const bool crosses =
                std::isfinite(last_) && std::isfinite(above) && (last_ >= 0) != (above >= 0);
            if (crosses && std::isnan(second_))
                (std::isnan(first_) ? first_ : second_) =
                    last_t_ + (t - last_t_) * last_ / (last_ - above);
            last_ = above;
            last_t_ = t;
            beyond[i] = std::isnan(second_) ? kNone : held[i];
        }
        constexpr double kDerivativeStep = 1.0 / 32;
        piece.add_read(
            {beyond.data(), held.size()}, Vec3::Constant(filter.taps <= 2 ? 1 : kDerivativeStep),
            [&](const Places& at, double* values) { piece.block().read(filter, at, values); },
            behind_, want);
    }
    /// Expected square of what a step leaves out.
    double square(const RayAnswer& answer, double step) const {
        constexpr double kReach = 4;  // [t]
        const double reach = kReach * std::max(1.0, step);
        if (!(second_ - first_ < reach)) return 0;
        return step * step / (3 * reach * reach) * answer.square(behind_);
    }

 private:
    static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    Stretch behind_;
    double last_t_ = kNone, last_ = kNone;   // place, and value less the level
    double first_ = kNone, second_ = kNone;  // crossings [t]
};

class CastRay final : public RayModel {
 public:
    CastRay(const Request& want, const Filters& by, double noise, ArrivingAt arriving)
        : want_(want), by_(by), noise_(noise), arriving_(std::move(arriving)), cast_(by.size()) {
        for (auto& steps : cast_) steps.fill(Stretch::empty(want.mode));
        if (want.mode->first_hit) over_.assign(by.size(), SteppedOver(want.mode));
        noisy_.fill(Stretch::empty(want.mode));
        clean_.fill(Stretch::empty(want.mode));
    }
    void take(double step, RayPiece& piece) override {
        const auto s = static_cast<std::size_t>(
            std::find(kCastSteps.begin(), kCastSteps.end(), step) - kCastSteps.begin());
        for (std::size_t i = 0; i < by_.size(); ++i)
            piece.add_held(*by_[i], cast_[i][s], want_, arriving_);
        if (s == 0)
            for (std::size_t i = 0; i < over_.size(); ++i) over_[i].take(piece, *by_[i], want_);
        if (s == kNoisyStep && noise_ > 0) add_noisy(piece);
    }
    void finish(const RayAnswer& answer, RaySquares& squares) override {
        std::size_t fact = 0;
        for (std::size_t i = 0; i < cast_.size(); ++i)
            for (std::size_t s = 0; s < kCastSteps.size(); ++s)
                squares.add(fact++,
                            answer.square(cast_[i][s]) +
                                (over_.empty() ? 0 : over_[i].square(answer, kCastSteps[s])));
        if (noise_ > 0)
            for (const PreviewHold hold : kNoisy)
                squares.add(fact++, answer.between(answer.written(noisy_[hold]),
                                                   answer.written(clean_[hold])) /
                                        (noise_ * noise_));
        if (want_.mode->left) squares.add(fact, answer.transparency() < kTerminated ? 1 : 0);
    }

 private:
    void add_noisy(RayPiece& piece) {
        std::array<double, Places::kMost> noisy;
        for (const PreviewHold hold : kNoisy) {
            const std::span<const double> held = piece.held(hold);
            for (std::size_t i = 0; i < piece.count(); ++i)
                noisy[i] = held[i] + noise_ * piece.block().noise(hold, piece.places()[i]);
            piece.add({noisy.data(), piece.count()}, noisy_[hold], want_);
            piece.add(held, clean_[hold], want_);
        }
    }

    const Request& want_;
    const Filters& by_;
    double noise_;                                              // RMS of the samples' [value]
    ArrivingAt arriving_;                                       // empty: all light
    std::vector<std::array<Stretch, kCastSteps.size()>> cast_;  // by filter
    std::vector<SteppedOver> over_;  // by filter, of modes that end at a hit
    std::array<Stretch, kNoisy.size()> noisy_, clean_;
};

class RayCastModel final : public Model {
 public:
    /// About the rounding to 8 bits: gains of a maximum depend on how large noise is.
    explicit RayCastModel(const ModelSetting& setting)
        : want_(setting.want),
          by_(setting.filters),
          noise_(1e-3 * range_between(setting.statistics.low, setting.statistics.high)) {
        for (const Filter* filter : by_)
            for (const double step : kCastSteps) {
                const bool coarse = step == 2;
                facts_.push_back({.name = fmt::format("picture/{}/{}", filter->name, step),
                                  .like = filter->taps == 1
                                              ? (coarse ? RayLook::kZoh2 : RayLook::kZoh1)
                                              : (coarse ? RayLook::kFoh2 : RayLook::kFoh1)});
            }
        if (noise_ > 0)
            for (const PreviewHold hold : kNoisy)
                facts_.push_back({.name = fmt::format("gain/noise/{}", filter_of(hold).name),
                                  .promised = false});
        if (want_.mode->left) facts_.push_back({.name = "picture/ended"});
        const Data& samples = setting.field.samples();
        if (want_.shading.has_shade() && setting.field.kind() != Field::formula)
            for (int view = 0; view < want_.frames; ++view) {
                grids_.push_back(std::make_unique<ArrivingGrids>(kernels::grid_of(samples),
                                                                 samples.what, want_, view,
                                                                 std::pmr::get_default_resource()));
                grids_.back()->prepare(view > 0 ? grids_[0].get() : nullptr);
            }
    }
    std::vector<double> steps() const override { return {kCastSteps.begin(), kCastSteps.end()}; }
    std::unique_ptr<RayModel> follow(const RaySpan& ray, const OutputSample& at) const override {
        return std::make_unique<CastRay>(want_, by_, noise_, arriving_along(ray, at.view));
    }

 private:
    /// From the grids that the edge makes, at points half of a t apart.
    ArrivingAt arriving_along(const RaySpan& ray, int view) const {
        if (grids_.empty()) return {};
        const ArrivingGrids& grids = *grids_[static_cast<std::size_t>(view)];
        return [&grids, ray,
                knots = std::make_shared<std::map<std::int64_t, Arriving>>()](double t) {
            constexpr double kKnots = 0.5;
            const auto knot = [&](std::int64_t k) {
                const auto found = knots->find(k);
                if (found != knots->end()) return found->second;
                const double there = std::clamp(static_cast<double>(k) * kKnots, ray.low, ray.high);
                return (*knots)[k] = grids.at(ray.origin + there * ray.direction);
            };
            const double below = std::floor(t / kKnots), share = t / kKnots - below;
            const Arriving a = knot(static_cast<std::int64_t>(below)),
                           b = knot(static_cast<std::int64_t>(below) + 1);
            Arriving between;
            between.ambient = a.ambient + share * (b.ambient - a.ambient);
            for (std::size_t i = 0; i < between.lights.size(); ++i)
                between.lights[i] = a.lights[i] + share * (b.lights[i] - a.lights[i]);
            return between;
        };
    }

    const Request& want_;
    const Filters& by_;
    double noise_;
    std::vector<std::unique_ptr<ArrivingGrids>> grids_;  // one a view; none: all light arrives
};

}  // namespace

std::shared_ptr<const Model> ray_cast_model(const ModelSetting& setting) {
    if (!setting.want.job->of_rays()) return nullptr;
    return std::make_shared<RayCastModel>(setting);
}

}  // namespace edgewise
