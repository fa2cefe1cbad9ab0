#include "transitions/project/preintegrated_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>

#include "graph/picture_facts.hpp"
#include "transitions/kernels/transfer_integrals.hpp"
#include "transitions/project/picture.hpp"

namespace edgewise {
namespace {

constexpr std::array<double, 2> kSteps = {1, 2};

/// The transfer function between two values, by the integrals that the edge reads.
class Between {
 public:
    explicit Between(const Request& want)
        : optics_(optics_of(want, {})), integrals_(kernels::transfer_integrals_of(optics_)) {}

    /// Mean colour, and in [3] mean optical depth per t.
    std::array<double, 4> means(double a, double b) const {
        std::array<double, 4> means{};
        if (std::abs(b - a) < 2 * static_cast<double>(integrals_.width)) {
            const std::array<double, 4> middle = kernels::optics_at(optics_, (a + b) / 2);
            std::copy(middle.begin() + 1, middle.end(), means.begin());
            means[3] = middle[0];
            return means;
        }
        const std::array<double, 4> to_a = reached(a), to_b = reached(b);
        const double depth = to_b[0] - to_a[0];
        for (std::size_t c = 0; c < 3; ++c)
            means[c] = depth != 0 ? (to_b[c + 1] - to_a[c + 1]) / depth : 0;
        means[3] = std::max(0.0, depth / (b - a));
        return means;
    }

 private:
    std::array<double, 4> reached(double value) const {
        const double at = (value - static_cast<double>(integrals_.first)) *
                          static_cast<double>(integrals_.per_number);
        const auto cell =
            static_cast<std::size_t>(std::clamp(at, 0.0, kernels::TransferIntegrals::kCells - 1.0));
        const double share = at - static_cast<double>(cell);
        std::array<double, 4> sums;
        for (std::size_t c = 0; c < 4; ++c) {
            const double low = integrals_.knots[cell][c], high = integrals_.knots[cell + 1][c];
            sums[c] = low + share * (high - low);
        }
        return sums;
    }

    kernels::Optics optics_;
    kernels::TransferIntegrals integrals_;
};

class PiecesRay final : public RayModel {
 public:
    PiecesRay(const Request& want, const std::vector<const Filter*>& by, const Between& between)
        : want_(want), by_(by), between_(between) {
        made_.resize(by.size() * kSteps.size());
    }
    void take(double step, RayPiece& piece) override {
        const auto s = static_cast<std::size_t>(std::find(kSteps.begin(), kSteps.end(), step) -
                                                kSteps.begin());
        for (std::size_t i = 0; i < by_.size(); ++i) {
            Made& made = made_[i * kSteps.size() + s];
            piece.each_in_order(*by_[i],
                                [&](double t, double value) { made.take(t, value, between_); });
        }
    }
    void finish(const RayAnswer& answer, RaySquares& squares) override {
        for (std::size_t i = 0; i < made_.size(); ++i)
            squares.add(i, answer.square(answer.written(made_[i].stretch(want_))));
    }

 private:
    struct Made {
        double t = 0, value = std::nan("");
        std::array<double, 3> light{};
        double left = 1;

        void take(double next_t, double next, const Between& between) {
            if (std::isfinite(value) && std::isfinite(next) && next_t > t) {
                const std::array<double, 4> mean = between.means(value, next);
                const double kept = std::exp(-mean[3] * (next_t - t));
                for (std::size_t c = 0; c < 3; ++c) light[c] += left * (1 - kept) * mean[c];
                left *= kept;
            }
            t = next_t;
            value = next;
        }
        /// As the mode keeps it.
        Stretch stretch(const Request& want) const {
            Stretch made = Stretch::empty(want.mode);
            std::copy(light.begin(), light.end(), made.state.begin());
            made.state[3] = left;
            return made;
        }
    };

    const Request& want_;
    const std::vector<const Filter*>& by_;
    const Between& between_;
    std::vector<Made> made_;  // by filter, then by step
};

class PreintegratedModel final : public Model {
 public:
    explicit PreintegratedModel(const ModelSetting& setting)
        : want_(setting.want), between_(setting.want) {
        for (const Filter* filter : setting.filters)
            if (filter->taps > 1) by_.push_back(filter);
        for (const Filter* filter : by_)
            for (const double step : kSteps)
                facts_.push_back({.name = integrated_fact(*filter, step),
                                  .like = step == 2 ? RayLook::kFoh2 : RayLook::kFoh1});
    }
    std::vector<double> steps() const override { return {kSteps.begin(), kSteps.end()}; }
    std::unique_ptr<RayModel> follow(const RaySpan&, const OutputSample&) const override {
        return std::make_unique<PiecesRay>(want_, by_, between_);
    }

 private:
    const Request& want_;
    Between between_;
    std::vector<const Filter*> by_;
};

}  // namespace

FactName integrated_fact(const Filter& filter, double step) {
    return kPictureError("integrated", filter.name, step);
}

std::shared_ptr<const Model> preintegrated_model(const ModelSetting& setting) {
    const Request& want = setting.want;
    if (!want.job->of_rays() || !want.mode->takes_transfer || want.shading.on() || want.cue ||
        want.transfer.needs_gradients())
        return nullptr;
    return std::make_shared<PreintegratedModel>(setting);
}

}  // namespace edgewise
