#include "transitions/project/ray_cast_model.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "graph/label_surface.hpp"
#include "graph/picture_facts.hpp"
#include "graph/range.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/project/arriving.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/store/precision.hpp"

namespace edgewise {
namespace {

using Filters = std::vector<const Filter*>;

/// What a preview casts by: filters, and places in kCastSteps.
struct CastBy {
    Filters filters;
    std::vector<std::size_t> steps;

    /// All by which an error is wanted.
    static CastBy wanted_of(const ModelSetting& setting) {
        const auto wants = [&](const Filter& filter, std::size_t step) {
            return setting.wants(kPictureError(filter.name, kCastSteps[step]));
        };
        CastBy by;
        for (const Filter* filter : setting.filters)
            for (std::size_t step = 0; step < kCastSteps.size(); ++step)
                if (wants(*filter, step)) {
                    by.filters.push_back(filter);
                    break;
                }
        for (std::size_t step = 0; step < kCastSteps.size(); ++step)
            if (std::ranges::any_of(by.filters,
                                    [&](const Filter* filter) { return wants(*filter, step); }))
                by.steps.push_back(step);
        return by;
    }
};

/// Noise of samples between which a spline runs passes as that of linear interpolation does.
constexpr std::array<PreviewHold, 2> kNoisy = {kZoh, kFoh};
constexpr std::size_t kNoisyStep = 2;  // of kCastSteps

/// Root mean squares of rounding errors in f32 of the values that a cast reads.
struct CastRounding {
    double value = 0;           // of the sum [value]
    Vec3 place = Vec3::Zero();  // of the place, by axis [sample]

    /// A number is off by up to 2^-24 of itself, evenly: 2^-24 / sqrt(3). Along each axis a place
    /// is the sum of a start and of a product, three roundings of about half the extent. A sum of
    /// products over three axes keeps about four roundings of the largest value: those of the last
    /// axis, and of its terms. Weights of two integer samples have 14 bits, off by up to half a
    /// last place: 2^-14 / sqrt(12), as if the place were.
    static CastRounding of(const Filter& filter, const Request& want, Type type) {
        constexpr double kOne = 0x1p-24 / 1.7320508075688772, kSums = 2;
        CastRounding rounding;
        rounding.value = kSums * kOne * want.magnitude;
        const bool short_weights = filter.taps == 2 && is_integer(type) && bytes_of(type) <= 2;
        for (int axis = 0; axis < 3; ++axis)
            rounding.place[axis] = std::hypot(std::sqrt(3.0) * kOne * double(want.input[axis]) / 2,
                                              short_weights ? 0x1p-14 / std::sqrt(12.0) : 0);
        return rounding;
    }
};

/// Where a ray first meets a surface: from the place where the field passes the level to where it
/// passes it again. A pixel jumps where a cast does not reach the level there, or the reference
/// hardly does: at silhouettes, at thin walls, where a step leaves out a short stretch.
class FirstCrossing {
 public:
    explicit FirstCrossing(Mode mode) : behind_(Stretch::empty(mode)) {}

    /// The cells of the reference.
    void take(RayPiece& piece, const Request& want) {
        const std::span<const double> values = piece.reference();
        for (std::size_t i = 0; i < values.size(); ++i) {
            const double t = piece.cells().middle[i], beyond = beyond_level(values[i], want);
            if (!std::isfinite(beyond)) continue;
            if (beyond < 0) {
                if (first_ < kNever) second_ = std::min(second_, t);
            } else if (second_ == kNever) {
                if (first_ == kNever) about_ = piece.light_about_hit(std::min(last_t_, t), t, want);
                first_ = std::min(first_, t);
            }
            last_t_ = t;
            if (second_ == kNever) farthest_ = std::max(farthest_, beyond);
        }
        if (second_ < kNever) piece.add_reference(behind_, want, second_);
    }
    bool is_met() const { return first_ < kNever; }
    bool holds(double t, double margin) const {
        return t >= first_ - margin && t <= second_ + margin;
    }
    double farthest() const { return farthest_; }
    /// The mean square change of the light by rounding: the place moves, far where a
    /// ray grazes the surface, and the gradient turns, far where it is short.
    double rounded(const CastRounding& by) const {
        if (!is_met()) return 0;
        constexpr double kMost = 1;  // [t]
        const double off = value_off(by);
        const double moved =
            about_.slope > 0 ? std::min(kMost, off / about_.slope + by.place.maxCoeff()) : kMost;
        return std::min(
            1.0, std::pow(about_.along * moved, 2) + about_.by_gradient.squaredNorm() * off * off);
    }
    /// The root mean square of the values' rounding errors there.
    double value_off(const CastRounding& by) const {
        double square = by.value * by.value;
        for (int axis = 0; axis < 3; ++axis)
            square += std::pow(about_.gradient[axis] * by.place[axis], 2);
        return std::sqrt(square);
    }
    /// Behind it, as the reference has it.
    const Stretch& behind() const { return behind_; }
    /// How far a value lies on the other side of the level than where the ray began.
    double beyond_level(double value, const Request& want) {
        if (side_ == 0 && std::isfinite(value)) side_ = value >= want.level() ? -1 : 1;
        return side_ * (value - want.level());
    }

 private:
    static constexpr double kNever = std::numeric_limits<double>::infinity();
    Stretch behind_;
    double side_ = 0;
    double first_ = kNever, second_ = kNever;  // [t]
    double farthest_ = -kNever;                // between them
    double last_t_ = kNever;                   // [t]
    LightAbout about_;                         // of the first
};

/// What a cast makes of a crossing.
struct Crossed {
    double at = std::numeric_limits<double>::infinity();  // where it first passes the level [t]
    double farthest = -std::numeric_limits<double>::infinity();  // about the reference's crossing

    void take(std::span<const double> values, const RayPiece& piece, double margin,
              FirstCrossing& crossing, const Request& want) {
        for (std::size_t i = 0; i < values.size(); ++i) {
            const double t = piece.cells().middle[i];
            const double beyond = crossing.beyond_level(values[i], want);
            if (!std::isfinite(beyond)) continue;
            if (beyond >= 0) at = std::min(at, t);
            if (crossing.holds(t, margin)) farthest = std::max(farthest, beyond);
        }
    }
};

/// What a cast without interpolation may make of a ray of which samples lie halfway between
/// neighbours, as they do at views turned by quarters: rounding in f32 decides which one each axis
/// gives. So all are cast.
class Halfway {
 public:
    /// Before `so_far` is given the piece.
    void take(RayPiece& piece, const Filter& filter, const Stretch& so_far, const Request& want,
              const ArrivingAt& arriving) {
        if (casts_.empty()) {
            if (!is_halfway(piece.places(), want.input)) return;
            casts_.assign(kShifts, so_far);
        }
        for (std::size_t shift = 0; shift < kShifts; ++shift) {
            Vec3 by;
            for (int axis = 0; axis < 3; ++axis)
                by[axis] = ((shift >> axis & 1) != 0 ? 1 : -1) * rounding_of(want.input, axis);
            const auto read = [&](const Places& at, double* values) {
                Places moved;
                for (std::size_t i = 0; i < at.count; ++i) moved.add(at[i] + by);
                piece.block().read(filter, moved, values);
            };
            std::array<double, Places::kMost> values;
            read(piece.places(), values.data());
            piece.add_read({values.data(), piece.count()}, Vec3::Constant(1), read, casts_[shift],
                           want, arriving);
        }
    }
    /// Of the cast that errs most; at least `square`.
    double square(double square, const RayAnswer& answer) const {
        for (const Stretch& cast : casts_) square = std::max(square, answer.square(cast));
        return square;
    }

 private:
    static constexpr std::size_t kShifts = 8;
    /// Of a place in f32, from a sum of some terms of the extent's size [sample].
    static double rounding_of(const Extent& n, int axis) {
        return 0x1p-21 * static_cast<double>(n[axis]);
    }
    static bool is_halfway(const Places& places, const Extent& n) {
        for (std::size_t i = 0; i < places.count; ++i)
            for (int axis = 0; axis < 3; ++axis) {
                const double p = places[i][axis];
                if (std::abs(p - std::floor(p) - 0.5) <= rounding_of(n, axis)) return true;
            }
        return false;
    }
    std::vector<Stretch> casts_;  // by which way each axis is rounded; empty: none is halfway
};

/// A request with its level a little lower, and a little higher.
class LevelsBeside {
 public:
    explicit LevelsBeside(const Request& want)
        : by_(kRounding * want.magnitude), beside_{want, want} {
        *beside_[0].surface->isovalue -= by_;
        *beside_[1].surface->isovalue += by_;
    }
    double by() const { return by_; }
    const std::array<Request, 2>& requests() const { return beside_; }

 private:
    // Of values that were added up in f32: less than levels are lowered by for plateaus.
    static constexpr double kRounding = 0x1p-22;
    double by_;
    std::array<Request, 2> beside_;
};

/// What a cast may make of a ray of which samples lie at the level, but for rounding in f32.
class AtLevel {
 public:
    /// Before `so_far` is given the piece.
    void take(RayPiece& piece, const Filter& filter, const Stretch& so_far,
              const LevelsBeside& beside, double level) {
        if (casts_.empty()) {
            const std::span<const double> values = piece.held(filter);
            if (std::none_of(values.begin(), values.end(),
                             [&](double value) { return std::abs(value - level) <= beside.by(); }))
                return;
            casts_.assign(beside.requests().size(), so_far);
        }
        for (std::size_t i = 0; i < casts_.size(); ++i)
            piece.add_held(filter, casts_[i], beside.requests()[i]);
    }
    /// Of the cast that errs most; at least `square`.
    double square(double square, const RayAnswer& answer) const {
        for (const Stretch& cast : casts_) square = std::max(square, answer.square(cast));
        return square;
    }

 private:
    std::vector<Stretch> casts_;  // by which way values are rounded; empty: none is at the level
};

class CastRay final : public RayModel {
 public:
    /// @param type    of the samples
    /// @param beside  of modes that end at a hit of a level, else null
    CastRay(const Request& want, const CastBy& by, Type type, double noise, ArrivingAt arriving,
            const LevelsBeside* beside)
        : want_(want),
          by_(by.filters),
          steps_(by.steps),
          noise_(noise),
          arriving_(std::move(arriving)),
          beside_(beside),
          cast_(by_.size()) {
        for (auto& steps : cast_) steps.fill(Stretch::empty(want.mode));
        if (want.mode->first_hit) {
            crossing_.emplace(want.mode);
            crossed_.resize(by_.size());
            for (const Filter* filter : by_)
                rounding_.push_back(CastRounding::of(*filter, want, type));
        }
        if (beside) at_level_.resize(by_.size());
        if (!shows_labels(want)) halfway_.resize(by_.size());
        noisy_.fill(Stretch::empty(want.mode));
        clean_.fill(Stretch::empty(want.mode));
    }
    void take(double step, RayPiece& piece) override {
        const auto s = static_cast<std::size_t>(
            std::find(kCastSteps.begin(), kCastSteps.end(), step) - kCastSteps.begin());
        for (std::size_t i = 0; i < by_.size(); ++i) {
            if (!halfway_.empty() && by_[i]->taps == 1)
                halfway_[i][s].take(piece, *by_[i], cast_[i][s], want_, arriving_);
            if (beside_) at_level_[i][s].take(piece, *by_[i], cast_[i][s], *beside_, want_.level());
            piece.add_held(*by_[i], cast_[i][s], want_, arriving_);
        }
        for (std::size_t i = 0; i < crossed_.size(); ++i)
            crossed_[i][s].take(piece.held(*by_[i]), piece, margin_of(step), *crossing_, want_);
        if (s == kNoisyStep && noise_ > 0) add_noisy(piece);
    }
    void take_reference(RayPiece& piece) override {
        if (crossing_) crossing_->take(piece, want_);
    }
    void finish(const RayAnswer& answer, RaySquares& squares) override {
        std::size_t fact = 0;
        for (std::size_t i = 0; i < cast_.size(); ++i)
            for (const std::size_t s : steps_) add(fact++, i, s, answer, squares);
        if (noise_ > 0)
            for (const PreviewHold hold : kNoisy) add_gain(fact++, hold, answer, squares);
        if (want_.mode->left) squares.add(fact, answer.transparency() < kTerminated ? 1 : 0);
    }

 private:
    /// Places that belong to a crossing, around it [t].
    static double margin_of(double step) { return std::max(1.0, step); }
    void add(std::size_t fact, std::size_t i, std::size_t s, const RayAnswer& answer,
             RaySquares& squares) const {
        double square = answer.square(cast_[i][s]);
        if (!halfway_.empty()) square = halfway_[i][s].square(square, answer);
        if (beside_) square = at_level_[i][s].square(square, answer);
        // Rounding is as random as jumps are: a few pixels that graze the surface decide. The
        // square of a normal deviate of variance v varies by 2 v^2.
        const double rounded = crossing_ ? crossing_->rounded(rounding_[i]) : 0;
        const double varies = 2 * rounded * rounded;
        square += rounded;
        if (!crossing_ || !(answer.nearby().within > 0)) {
            squares.add(fact, square, answer.fourth(square) + varies);
            return;
        }
        // Where the reference meets nothing, a cast may. That is as frequent as the reverse, where
        // what the pixel shows is known.
        const Crossed& crossed = crossed_[i][s];
        if (!crossing_->is_met()) return squares.add(fact, 0);
        // How far values go is known to two standard deviations.
        Nearby nearby = answer.nearby();
        nearby.rounding = 4 * crossing_->value_off(rounding_[i]);
        const double share = share_above(crossing_->farthest(), crossed.farthest, nearby);
        const double jump = answer.square(crossing_->behind());
        const bool jumps =
            !std::isfinite(crossed.at) || !crossing_->holds(crossed.at, margin_of(kCastSteps[s]));
        squares.add(fact, (jumps ? 0 : square) + share * jump, share * jump * jump + varies);
    }
    void add_noisy(RayPiece& piece) {
        for (const PreviewHold hold : kNoisy) {
            const RayPiece::Read read = [&](const Places& at, double* values) {
                piece.block().read(filter_of(hold), at, values);
                for (std::size_t i = 0; i < at.count; ++i)
                    values[i] += noise_ * piece.block().noise(hold, at[i]);
            };
            std::array<double, Places::kMost> values;
            read(piece.places(), values.data());
            const std::span<const double> noisy(values.data(), piece.count());
            if (!crossing_) {
                piece.add(noisy, noisy_[hold], want_);
                piece.add(piece.held(hold), clean_[hold], want_);
                continue;
            }
            // Normals turn with the samples.
            piece.add_read(noisy, Vec3::Ones(), read, noisy_[hold], want_);
            piece.add_held(filter_of(hold), clean_[hold], want_);
            const double margin = margin_of(kCastSteps[kNoisyStep]);
            crossed_noisy_[hold].take(noisy, piece, margin, *crossing_, want_);
            crossed_clean_[hold].take(piece.held(hold), piece, margin, *crossing_, want_);
        }
    }
    void add_gain(std::size_t fact, PreviewHold hold, const RayAnswer& answer,
                  RaySquares& squares) const {
        const double size = noise_ * noise_;
        const double square = answer.between(noisy_[hold], clean_[hold]);
        if (!crossing_ || !(answer.nearby().within > 0)) return squares.add(fact, square / size);
        if (!crossing_->is_met()) return squares.add(fact, 0);
        // Jumps are told by their density, as those of casts are.
        const Crossed &noisy = crossed_noisy_[hold], &clean = crossed_clean_[hold];
        const auto holds = [&](const Crossed& crossed) {
            return std::isfinite(crossed.at) &&
                   crossing_->holds(crossed.at, margin_of(kCastSteps[kNoisyStep]));
        };
        const double share = share_above(clean.farthest, noisy.farthest, answer.nearby());
        const double jump = share * answer.square(crossing_->behind());
        squares.add(fact, ((holds(noisy) && holds(clean) ? square : 0) + jump) / size);
    }

    const Request& want_;
    const Filters& by_;
    const std::vector<std::size_t>& steps_;
    double noise_;         // RMS of the samples' [value]; 0: its gain is not measured
    ArrivingAt arriving_;  // empty: all light
    const LevelsBeside* beside_;
    std::vector<std::array<Stretch, kCastSteps.size()>> cast_;      // by filter
    std::vector<std::array<AtLevel, kCastSteps.size()>> at_level_;  // by filter
    std::vector<std::array<Halfway, kCastSteps.size()>> halfway_;   // by filter
    std::optional<FirstCrossing> crossing_;                         // of modes that end at a hit
    std::vector<std::array<Crossed, kCastSteps.size()>> crossed_;   // by filter
    std::vector<CastRounding> rounding_;                            // by filter
    std::array<Stretch, kNoisy.size()> noisy_, clean_;
    std::array<Crossed, kNoisy.size()> crossed_noisy_,
        crossed_clean_;  // of modes that end at a hit
};

class RayCastModel final : public Model {
 public:
    /// With noise as rounding to 8 bits makes it: gains of a maximum depend on how large it is.
    explicit RayCastModel(const ModelSetting& setting)
        : want_(setting.want),
          by_(CastBy::wanted_of(setting)),
          type_(setting.field.samples().what.type),
          noise_(kMeasuredNoise * range_between(setting.statistics.low, setting.statistics.high)) {
        if (std::ranges::none_of(kNoisy, [&](PreviewHold hold) {
                return setting.wants(kNoiseGain(filter_of(hold).name));
            }))
            noise_ = 0;
        for (const Filter* filter : by_.filters)
            for (const std::size_t place : by_.steps) {
                const double step = kCastSteps[place];
                const bool coarse = step == 2;
                facts_.push_back({.name = kPictureError(filter->name, step),
                                  .like = filter->taps == 1
                                              ? (coarse ? RayLook::kZoh2 : RayLook::kZoh1)
                                              : (coarse ? RayLook::kFoh2 : RayLook::kFoh1)});
            }
        if (noise_ > 0)
            for (const PreviewHold hold : kNoisy)
                facts_.push_back({.name = kNoiseGain(filter_of(hold).name)});
        if (want_.mode->left) facts_.push_back({.name = kEnded});
        if (want_.mode->first_hit && want_.surface && want_.surface->isovalue)
            beside_.emplace(want_);
        const Data& samples = setting.field.samples();
        if (want_.shading.has_shade() && setting.field.kind() != Field::formula)
            for (int view = 0; view < want_.frames; ++view) {
                grids_.push_back(std::make_unique<ArrivingGrids>(kernels::grid_of(samples),
                                                                 samples.what, want_, view,
                                                                 std::pmr::get_default_resource()));
                grids_.back()->prepare(view > 0 ? grids_[0].get() : nullptr);
            }
    }
    std::vector<double> steps() const override {
        std::vector<double> steps;
        for (std::size_t place = 0; place < kCastSteps.size(); ++place)
            if ((noise_ > 0 && place == kNoisyStep) ||
                std::ranges::find(by_.steps, place) != by_.steps.end())
                steps.push_back(kCastSteps[place]);
        return steps;
    }
    std::unique_ptr<RayModel> follow(const RaySpan& ray, const OutputSample& at) const override {
        return std::make_unique<CastRay>(want_, by_, type_, noise_, arriving_along(ray, at.view),
                                         beside_ ? &*beside_ : nullptr);
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
    const CastBy by_;
    Type type_;
    double noise_;
    std::optional<LevelsBeside> beside_;
    std::vector<std::unique_ptr<ArrivingGrids>> grids_;  // one a view; none: all light arrives
};

}  // namespace

std::shared_ptr<const Model> ray_cast_model(const ModelSetting& setting) {
    if (!setting.want.job->of_rays()) return nullptr;
    return std::make_shared<RayCastModel>(setting);
}

}  // namespace edgewise
