#include "transitions/project/preintegrated_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>

#include "transitions/project/picture.hpp"

namespace edgewise {
namespace {

constexpr std::array<double, 2> kSteps = {1, 2};

/// Means of optical depth and of colour, by depth, between two values: integrals of the transfer
/// function, piece by piece between its points.
std::array<double, 4> mean_between(const Transfer& transfer, double a, double b) {
    constexpr int kParts = 8;  // of a piece
    constexpr double kMostDepth = 100;
    std::array<double, 4> sum{};
    const double low = std::min(a, b), high = std::max(a, b);
    const auto add = [&](double from, double to) {
        for (int i = 0; i < kParts; ++i) {
            const double at = from + (i + 0.5) / kParts * (to - from);
            const std::array<double, 4> optics = transfer.at(at);
            const double share = low < high ? (to - from) / (high - low) / kParts : 1.0 / kParts;
            const double depth =
                share * std::min(kMostDepth, -std::log1p(-std::min(1.0, optics[3])));
            sum[3] += depth;
            for (std::size_t c = 0; c < 3; ++c) sum[c] += depth * optics[c];
        }
    };
    double from = low;
    for (const Transfer::Point& point : transfer.points) {
        if (!(point.value > from && point.value < high)) continue;
        add(from, point.value);
        from = point.value;
    }
    add(from, high);
    for (std::size_t c = 0; c < 3; ++c) sum[c] = sum[3] > 0 ? sum[c] / sum[3] : 0;
    return sum;
}

class PiecesRay final : public RayModel {
 public:
    PiecesRay(const Request& want, const std::vector<const Filter*>& by) : want_(want), by_(by) {
        made_.resize(by.size() * kSteps.size());
    }
    void take(double step, RayPiece& piece) override {
        const auto s = static_cast<std::size_t>(std::find(kSteps.begin(), kSteps.end(), step) -
                                                kSteps.begin());
        for (std::size_t i = 0; i < by_.size(); ++i) {
            Made& made = made_[i * kSteps.size() + s];
            piece.each_in_order(*by_[i],
                                [&](double t, double value) { made.take(t, value, want_); });
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

        void take(double next_t, double next, const Request& want) {
            if (std::isfinite(value) && std::isfinite(next) && next_t > t) {
                const std::array<double, 4> mean = mean_between(want.transfer, value, next);
                const double kept =
                    std::exp(-mean[3] * (next_t - t) * want.unit / want.transfer.unit);
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
    std::vector<Made> made_;  // by filter, then by step
};

class PreintegratedModel final : public Model {
 public:
    explicit PreintegratedModel(const ModelSetting& setting) : want_(setting.want) {
        for (const Filter* filter : setting.filters)
            if (filter->taps > 1) by_.push_back(filter);
        for (const Filter* filter : by_)
            for (const double step : kSteps)
                facts_.push_back({.name = integrated_fact(*filter, step),
                                  .like = step == 2 ? RayLook::kFoh2 : RayLook::kFoh1});
    }
    std::vector<double> steps() const override { return {kSteps.begin(), kSteps.end()}; }
    std::unique_ptr<RayModel> follow(const RaySpan&, const OutputSample&) const override {
        return std::make_unique<PiecesRay>(want_, by_);
    }

 private:
    const Request& want_;
    std::vector<const Filter*> by_;
};

}  // namespace

std::string integrated_fact(const Filter& filter, double step) {
    return fmt::format("picture/integrated/{}/{}", filter.name, step);
}

std::shared_ptr<const Model> preintegrated_model(const ModelSetting& setting) {
    const Request& want = setting.want;
    if (!want.job->of_rays() || !want.mode->takes_transfer || want.shading.on() || want.cue ||
        !want.transfer.edges.empty())
        return nullptr;
    return std::make_shared<PreintegratedModel>(setting);
}

}  // namespace edgewise
