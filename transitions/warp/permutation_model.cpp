#include "transitions/warp/permutation_model.hpp"

#include <cmath>

#include "graph/picture_facts.hpp"
#include "transitions/warp/backward_model.hpp"

namespace edgewise {
namespace {

/// By the rule of an assignment of samples to places: the nearest sample of a place that `alike`
/// moves by one rounding more, so that two have an effect on each axis.
Vec3 assigned_to(const Vec3& p, int axes, std::uint64_t alike) {
    Vec3 moved = p;
    for (int axis = 0; axis < axes; ++axis)
        moved[axis] += hashed(3 * alike + static_cast<std::uint64_t>(axis)) - 0.5;
    return moved;
}

class Assigned final : public WarpModel {
 public:
    explicit Assigned(int axes) : axes_(axes) {}
    void make(const PreviewBlock& block, const Places& places, std::span<const std::uint64_t> alike,
              double* values) const override {
        Places moved;
        for (std::size_t i = 0; i < places.count; ++i)
            moved.add(assigned_to(places[i], axes_, alike[i]));
        block.hold(kZoh, moved, values);
    }
    bool takes_samples() const override { return true; }

 private:
    int axes_;
};

class AssignedAlongRay final : public RayModel {
 public:
    AssignedAlongRay(const ReferenceField& field, const Assigned& assigned)
        : field_(field), assigned_(assigned) {}
    void take(double, RayPiece& piece) override {
        std::array<std::uint64_t, Places::kMost> seeds;
        for (std::size_t i = 0; i < piece.count(); ++i)
            seeds[i] = static_cast<std::uint64_t>(
                std::abs(1e3 * (piece.cells().middle[i] + piece.places()[i].sum())));
        std::array<double, Places::kMost> got;
        assigned_.make(piece.block(), piece.places(), seeds, got.data());
        for_each_present(piece, field_, [&](std::size_t i, double expected) {
            const double d = got[i] - expected, length = piece.cells().length[i];
            if (std::isfinite(d)) squares_ += d * d * length;
            points_ += length;
        });
    }
    void finish(const RayAnswer&, RaySquares& squares) override {
        squares.add_points(0, squares_, points_);
    }

 private:
    const ReferenceField& field_;
    const Assigned& assigned_;
    double squares_ = 0, points_ = 0;
};

class PermutationModel final : public Model {
 public:
    explicit PermutationModel(const ModelSetting& setting)
        : setting_(setting), assigned_(setting.field.axes()) {
        facts_.push_back({.name = kFieldError("me"), .like_point = 0, .of_points = true});
    }
    void at(const PointMade& point, std::span<double> squares) const override {
        std::vector<double> got(point.expected.size());
        const auto alike = static_cast<std::uint64_t>(1e3 * point.place.sum());
        point.block.hold(kZoh, assigned_to(point.p, setting_.field.axes(), alike), got.data());
        squares[0] = point.square(got);
    }
    std::vector<std::pair<std::string, const WarpModel*>> makes() const override {
        return {{"me", &assigned_}};
    }
    std::vector<double> steps() const override { return {kFieldStep}; }
    std::unique_ptr<RayModel> follow(const RaySpan&, const OutputSample&) const override {
        return std::make_unique<AssignedAlongRay>(setting_.field, assigned_);
    }

 private:
    const ModelSetting& setting_;
    Assigned assigned_;
};

}  // namespace

std::shared_ptr<const Model> permutation_model(const ModelSetting& setting) {
    return std::make_shared<PermutationModel>(setting);
}

}  // namespace edgewise
