#pragma once

#include <array>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "graph/fact.hpp"
#include "graph/transform_graph.hpp"
#include "graph/transition.hpp"
#include "reference/answer.hpp"
#include "reference/jumps.hpp"
#include "reference/preview_block.hpp"
#include "reference/ray_cells.hpp"
#include "reference/ray_look.hpp"
#include "scene/statistics.hpp"

namespace edgewise {

// How an edge's errors are worked out without running it: a model makes, in f64 and from the field
// itself, what the edge would make of a few output samples that are drawn. A preview compares that
// with the reference. An edge's model lies in its folder (<edge>_model.cpp) and is the only place
// that knows its algorithm twice; what is drawn, and how errors are told from it, is the preview's.

/// Values of one output sample: one, or red, green, blue and opacity.
using PixelValues = std::array<double, 4>;

/// Errors by the name of their fact (Scene::facts): upper estimates, and what draws say themselves.
struct FactMaps {
    std::map<std::string, double> upper, likely;
};

/// What a model measures.
struct ModelFact {
    FactName name;
    /// The look whose squares go best with these (kCasts: none does); of warps 0 for what goes with
    /// nearest samples, 1 with linear ones.
    RayLook::Cast like = RayLook::kCasts;
    std::size_t like_point = 1;
    /// Of pictures: squares of samples along rays, weighed by length; else one a ray.
    bool of_points = false;
};

/// One output sample of a warp.
struct PointMade {
    const PreviewBlock& block;
    Vec3 place;                        // in the input [input index]
    Vec3 p;                            // the same, whole numbers exactly so
    bool exact = false;                // p is a sample
    bool labels = false;               // errors count values that differ
    std::span<const double> expected;  // by channel

    /// Mean square of the difference over channels; of labels 1 where any differs.
    double square(std::span<const double> got) const noexcept;
};

/// How the light of the reference changes about a hit, and the field.
struct LightAbout {
    Vec3 gradient = Vec3::Zero();     // of the field [value / sample]
    double slope = 0;                 // of the field, along the ray [value / t]
    double along = 0;                 // of the light, as the gradient turns along the ray [1 / t]
    Vec3 by_gradient = Vec3::Zero();  // of the light, by component [sample / value]
};

/// Cells of a ray, one after another, with the field at their middles. What several models read is
/// worked out once.
class RayPiece {
 public:
    /// @param frame  of the ray, where anything depends on it, else null
    RayPiece(const PreviewBlock& block, const RaySpan& ray, const LitFrame* frame = nullptr)
        : block_(block),
          ray_(ray),
          frame_(frame),
          values_(1 + filters().size()),
          known_(values_.size()) {}

    /// How much light arrives, where that is not all of it.
    void set_arriving(ArrivingAt arriving) { arriving_ = std::move(arriving); }

    /// The next cells whose middles lie before `end`. @return false: none
    bool take(double end, double front, double step, std::int64_t& next);
    std::size_t count() const noexcept { return cells_.count; }
    const RayCells& cells() const noexcept { return cells_; }
    const Places& places() const noexcept { return places_; }
    const PreviewBlock& block() const noexcept { return block_; }
    std::span<const double> held(PreviewHold hold) { return held(filter_of(hold)); }
    /// Values of the field at the cells' middles, as one of filters() reads it.
    std::span<const double> held(const Filter& filter);
    /// The same as the reference has it: NaN where it is absent.
    std::span<const double> reference();
    /// Adds values at the cells' middles to a stretch of the ray.
    void add(std::span<const double> values, Stretch& to, const Request& want) const {
        to.add(values, cells_.length.data(), want);
    }
    /// Adds what a filter reads, lit where the request asks for it: by the differences of
    /// neighbouring samples of filters of zero and first order, else by the filter's derivative.
    /// @param arriving  as the model has it; empty: as the reference has it
    void add_held(const Filter& filter, Stretch& to, const Request& want,
                  const ArrivingAt& arriving = {});
    using Read = std::function<void(const Places&, double*)>;
    /// Adds values of another field than the samples', which `read` knows at any place, lit where
    /// the request asks for it.
    /// @param values  at the cells' middles
    /// @param steps   along the axes, of the differences that make a gradient [sample]
    /// @param arriving  as in add_held
    void add_read(std::span<const double> values, const Vec3& steps, const Read& read, Stretch& to,
                  const Request& want, const ArrivingAt& arriving = {});
    /// Where the reference passes the request's level between two places of the ray.
    LightAbout light_about_hit(double before, double behind, const Request& want) const;
    /// Calls each(t, value) with what a filter reads where the ray enters, at the cells' middles,
    /// and where it leaves.
    void each_in_order(const Filter& filter, const std::function<void(double, double)>& each);
    /// Adds the reference, likewise.
    /// @param after  only what lies behind [t]
    void add_reference(Stretch& to, const Request& want,
                       double after = -std::numeric_limits<double>::infinity());

 private:
    void add_seen(std::span<const double> values, const Vec3& steps, const Read& read, Stretch& to,
                  const Request& want, const ArrivingAt& arriving) const;
    void add_lit(std::span<const double> values, const Vec3& steps, const Read& read, Stretch& to,
                 const Request& want, const ArrivingAt& arriving) const;
    template <class ValueAt, class Each>
    void in_order(std::span<const double> values, ValueAt&& value_at, Each&& each) const;
    double value_at(const Vec3& p, const Read& read) const;
    void follow(std::span<const double> values, const Vec3& steps, const Read& read, Stretch& to,
                const Request& want) const;
    Vec3 gradient_at(double t, const Vec3& steps, const Read& read, const Request& want) const;
    int inwards_at(const Vec3& p, int axis, double step, const Request& want) const;
    double slope_at_face(const Vec3& p, int axis, double step, double here, const Read& read) const;
    /// As the reference reads places, and the steps of its gradients.
    void read_reference(const Places& at, double* values, const Request& want) const;
    static Vec3 reference_steps(const Request& want);
    using Values = std::array<double, Places::kMost>;
    const PreviewBlock& block_;
    const RaySpan& ray_;
    const LitFrame* frame_;
    ArrivingAt arriving_;
    RayCells cells_;
    Places places_;
    std::vector<Values> values_;  // the reference's, then by place in filters()
    std::vector<char> known_;
};

/// The reference of one pixel, as it is written, and how far other answers are from it.
///
/// Of modes with a threshold squares are those of jumps, times the share of levels nearby at which
/// there would be one (reference/jumps.hpp).
class RayAnswer {
 public:
    RayAnswer(const Stretch& reference, const Request& want, const Nearby& nearby = {});

    const PixelValues& expected() const noexcept { return expected_; }
    /// Of the reference: what is left to see behind it.
    double transparency() const noexcept { return transparency_; }
    PixelValues written(const Stretch& got) const noexcept;
    /// Mean square over the channels that are written.
    double square(const Stretch& got) const noexcept { return between(got, reference_); }
    double between(const Stretch& a, const Stretch& b) const noexcept;
    /// See RaySquares::add. @param square  of this answer and another stretch
    double fourth(double square) const noexcept;
    double square(const PixelValues& got) const noexcept { return between(got, expected_); }
    double between(const PixelValues& a, const PixelValues& b) const noexcept;
    const Stretch& reference() const noexcept { return reference_; }
    const Nearby& nearby() const noexcept { return nearby_; }

 private:
    const Request& want_;
    Stretch reference_;
    Nearby nearby_;
    int channels_;
    PixelValues expected_;
    double transparency_;
};

/// Where a model of a ray leaves what it measured.
class RaySquares {
 public:
    virtual ~RaySquares() = default;
    /// @param fact    place in Model::facts()
    /// @param fourth  of jumps: the square of what one adds, times its share
    virtual void add(std::size_t fact, double square, double fourth = 0) = 0;
    /// Of facts of points: sums over the ray.
    virtual void add_points(std::size_t fact, double squares, double points) = 0;
};

/// One ray as an edge sees it, traced piece by piece from near to far.
class RayModel {
 public:
    virtual ~RayModel() = default;
    /// Cells of a step that Model::steps() names.
    virtual void take(double /*step*/, RayPiece& /*piece*/) {}
    /// The reference's own cells, before all others of a stretch.
    virtual void take_reference(RayPiece& /*piece*/) {}
    /// Samples of its own with t < end.
    virtual void trace(const PreviewBlock& /*block*/, double /*end*/) {}
    /// How far samples of its own reach [t]; begin > end: not beyond the ray.
    virtual double begin() const { return std::numeric_limits<double>::infinity(); }
    virtual double end() const { return -std::numeric_limits<double>::infinity(); }
    /// After the last piece.
    virtual void finish(const RayAnswer& answer, RaySquares& squares) = 0;
};

/// Samples that a warp makes at places in the input: what models of edges behind it read.
class WarpModel {
 public:
    virtual ~WarpModel() = default;
    /// @param alike  by place: what moves samples moves those of one number alike
    virtual void make(const PreviewBlock& block, const Places& places,
                      std::span<const std::uint64_t> alike, double* values) const = 0;
    /// Whether they are samples of the input, one for each place: then its errors go with those of
    /// nearest ones.
    virtual bool takes_samples() const = 0;
};

/// What an edge says of a few of its output samples.
class Model {
 public:
    virtual ~Model() = default;
    const std::vector<ModelFact>& facts() const noexcept { return facts_; }

    // Of a warp.
    /// @param squares  by fact; 0 before
    virtual void at(const PointMade& /*point*/, std::span<double> /*squares*/) const {}
    /// The samples that its facts are about, by the last part of a fact's name; a warp whose errors
    /// have no samples of their own has none.
    virtual std::vector<std::pair<std::string, const WarpModel*>> makes() const { return {}; }

    // Of a picture.
    /// Steps of the cells that its rays take [t].
    virtual std::vector<double> steps() const { return {}; }
    /// Null: it has nothing to say of pictures.
    virtual std::unique_ptr<RayModel> follow(const RaySpan& /*ray*/,
                                             const OutputSample& /*at*/) const {
        return nullptr;
    }
    /// Neighbours are wrong alike: one ray stands for all of a bundle but the short ones, each of
    /// which is a case of its own.
    virtual bool stands_for_neighbours() const { return false; }

    /// Facts that follow from those that were measured, its own and others'.
    virtual void derive(FactMaps& /*facts*/) const {}

 protected:
    std::vector<ModelFact> facts_;
};

/// What models are made for. All must stay alive.
struct ModelSetting {
    const Request& want;
    const ReferenceField& field;
    const Statistics& statistics;
    /// Boxes of the input that paths keep of it, the whole first.
    std::vector<Region> boxes;
    /// Filters that edges try, or that are asked for.
    std::vector<const Filter*> filters;
    /// Those of warps, made before.
    std::vector<std::pair<std::string, const WarpModel*>> warps;
    /// What paths must go through.
    const Demands* asked = nullptr;
    /// The facts that are measured, with those that they are derived from; absent: all.
    std::optional<std::set<std::string>> wanted = {};

    bool wants(const FactName& fact) const { return !wanted || wanted->contains(fact.text()); }
};

/// What a preview measures, and on how many draws.
struct PreviewOf {
    /// Demands whose parameters are measured in addition to those that a planner tries.
    const Demands& asked;
    double times = 1;  // as many draws as usual
    /// These facts alone, and the references' range is not looked for; null: all.
    const std::set<std::string>* wanted = nullptr;
    /// All that the request spans from the input; null: it is spanned here.
    const TransformGraph* spanned = nullptr;
    /// The draws are put into so many groups, and the facts are told without each of them too.
    std::size_t groups = 0;
};

/// The models of the edges that measure any of the facts, warps' first.
/// @param input  the vertex that paths begin with
std::vector<std::shared_ptr<const Model>> models_of(const Catalogue& catalogue,
                                                    const Representation& input,
                                                    const PreviewOf& of, ModelSetting& setting);

}  // namespace edgewise
