#include "transitions/warp/backward_model.hpp"

#include <cmath>
#include <fmt/format.h>

namespace edgewise {
namespace {

constexpr std::array<PreviewHold, 3> kHolds = {kZoh, kFoh, kSpline};

class Held final : public WarpModel {
 public:
    explicit Held(PreviewHold hold) : hold_(hold) {}
    void make(const PreviewBlock& block, const Places& places, std::span<const std::uint64_t>,
              double* values) const override {
        block.hold(hold_, places, values);
    }

 private:
    PreviewHold hold_;
};

class HeldAlongRay final : public RayModel {
 public:
    explicit HeldAlongRay(const ReferenceField& field) : field_(field) {}
    void take(double, RayPiece& piece) override {
        std::array<std::span<const double>, kHolds.size()> held;
        for (const PreviewHold hold : kHolds) held[hold] = piece.held(hold);
        for_each_present(piece, field_, [&](std::size_t i, double expected) {
            const double length = piece.cells().length[i];
            for (const PreviewHold hold : kHolds) {
                const double d = held[hold][i] - expected;
                if (std::isfinite(d)) squares_[hold] += d * d * length;
            }
            points_ += length;
        });
    }
    void finish(const RayAnswer&, RaySquares& squares) override {
        for (const PreviewHold hold : kHolds) squares.add_points(hold, squares_[hold], points_);
    }

 private:
    const ReferenceField& field_;
    std::array<double, kHolds.size()> squares_{};
    double points_ = 0;
};

class BackwardModel final : public Model {
 public:
    explicit BackwardModel(const ModelSetting& setting) : setting_(setting) {
        for (const PreviewHold hold : kHolds)
            facts_.push_back({.name = fmt::format("field/{}", kPreviewHolds[hold]),
                              .like_point = hold == kZoh ? 0u : 1u,
                              .of_points = true});
    }
    void at(const PointMade& point, std::span<double> squares) const override {
        std::vector<double> got(point.expected.size());
        for (const PreviewHold hold : kHolds) {
            // Every filter copies what lies on a sample.
            point.block.hold(point.exact ? kZoh : hold, point.p, got.data());
            squares[hold] = point.square(got);
        }
    }
    std::vector<std::pair<std::string, const WarpModel*>> makes() const override {
        std::vector<std::pair<std::string, const WarpModel*>> all;
        for (const Held& held : held_)
            all.emplace_back(kPreviewHolds[static_cast<std::size_t>(&held - held_.data())], &held);
        return all;
    }
    std::vector<double> steps() const override { return {kFieldStep}; }
    std::unique_ptr<RayModel> follow(const RaySpan&, const OutputSample&) const override {
        return std::make_unique<HeldAlongRay>(setting_.field);
    }

 private:
    const ModelSetting& setting_;
    std::array<Held, kHolds.size()> held_ = {Held(kZoh), Held(kFoh), Held(kSpline)};
};

}  // namespace

std::shared_ptr<const Model> backward_model(const ModelSetting& setting) {
    return std::make_shared<BackwardModel>(setting);
}

}  // namespace edgewise
