#include "transitions/warp/backward_model.hpp"

#include <cmath>
#include <deque>
#include <fmt/format.h>

#include "graph/picture_facts.hpp"

namespace edgewise {
namespace {

using Filters = std::vector<const Filter*>;

class Held final : public WarpModel {
 public:
    explicit Held(const Filter& filter) : filter_(filter) {}
    void make(const PreviewBlock& block, const Places& places, std::span<const std::uint64_t>,
              double* values) const override {
        block.read(filter_, places, values);
    }
    bool takes_samples() const override { return filter_.taps == 1; }

 private:
    const Filter& filter_;
};

class HeldAlongRay final : public RayModel {
 public:
    HeldAlongRay(const Filters& by, const ReferenceField& field)
        : by_(by), field_(field), squares_(by.size()), held_(by.size()) {}
    void take(double, RayPiece& piece) override {
        for (std::size_t i = 0; i < by_.size(); ++i) held_[i] = piece.held(*by_[i]);
        for_each_present(piece, field_, [&](std::size_t at, double expected) {
            const double length = piece.cells().length[at];
            for (std::size_t i = 0; i < by_.size(); ++i) {
                const double d = held_[i][at] - expected;
                if (std::isfinite(d)) squares_[i] += d * d * length;
            }
            points_ += length;
        });
    }
    void finish(const RayAnswer&, RaySquares& squares) override {
        for (std::size_t i = 0; i < by_.size(); ++i) squares.add_points(i, squares_[i], points_);
    }

 private:
    const Filters& by_;
    const ReferenceField& field_;
    std::vector<double> squares_;
    std::vector<std::span<const double>> held_;
    double points_ = 0;
};

class BackwardModel final : public Model {
 public:
    explicit BackwardModel(const ModelSetting& setting) : setting_(setting) {
        for (const Filter* filter : setting.filters) {
            held_.emplace_back(*filter);
            facts_.push_back({.name = kFieldError(filter->name),
                              .like_point = filter->taps == 1 ? 0u : 1u,
                              .of_points = true});
        }
    }
    void at(const PointMade& point, std::span<double> squares) const override {
        std::vector<double> got(point.expected.size());
        Places place;
        place.add(point.p);
        for (std::size_t i = 0; i < held_.size(); ++i) {
            for (std::size_t c = 0; c < got.size(); ++c) {
                // Every filter copies what lies on a sample.
                const Filter& by = point.exact ? filter_of(kZoh) : *setting_.filters[i];
                point.block.read(by, place, &got[c], static_cast<int>(c));
            }
            squares[i] = point.square(got);
        }
    }
    std::vector<std::pair<std::string, const WarpModel*>> makes() const override {
        std::vector<std::pair<std::string, const WarpModel*>> all;
        for (std::size_t i = 0; i < held_.size(); ++i)
            all.emplace_back(setting_.filters[i]->name, &held_[i]);
        return all;
    }
    std::vector<double> steps() const override { return {kFieldStep}; }
    std::unique_ptr<RayModel> follow(const RaySpan&, const OutputSample&) const override {
        return std::make_unique<HeldAlongRay>(setting_.filters, setting_.field);
    }

 private:
    const ModelSetting& setting_;
    std::deque<Held> held_;  // others point to them
};

}  // namespace

std::shared_ptr<const Model> backward_model(const ModelSetting& setting) {
    return std::make_shared<BackwardModel>(setting);
}

}  // namespace edgewise
