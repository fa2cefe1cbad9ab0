#include "transitions/project/ray_cast_model.hpp"

#include <algorithm>
#include <fmt/format.h>

#include "graph/range.hpp"
#include "transitions/project/picture.hpp"

namespace edgewise {
namespace {

constexpr std::array<PreviewHold, 3> kHolds = {kZoh, kFoh, kSpline};
constexpr std::array<PreviewHold, 2> kNoisy = {kZoh, kFoh};
constexpr std::size_t kNoisyStep = 2;  // of kCastSteps

/// Where facts stand.
constexpr std::size_t place_of(PreviewHold hold, std::size_t step) {
    return static_cast<std::size_t>(hold) * kCastSteps.size() + step;
}
constexpr std::size_t kCasts = kHolds.size() * kCastSteps.size();

class CastRay final : public RayModel {
 public:
    CastRay(const Request& want, double noise) : want_(want), noise_(noise) {
        for (auto& steps : cast_) steps.fill(Stretch::empty(want.mode));
        noisy_.fill(Stretch::empty(want.mode));
    }
    void take(double step, RayPiece& piece) override {
        const auto s = static_cast<std::size_t>(
            std::find(kCastSteps.begin(), kCastSteps.end(), step) - kCastSteps.begin());
        for (const PreviewHold hold : kHolds) piece.add(piece.held(hold), cast_[hold][s], want_);
        if (s == kNoisyStep && noise_ > 0) add_noisy(piece);
    }
    void finish(const RayAnswer& answer, RaySquares& squares) override {
        for (const PreviewHold hold : kHolds)
            for (std::size_t s = 0; s < kCastSteps.size(); ++s)
                squares.add(place_of(hold, s), answer.square(cast_[hold][s]));
        std::size_t fact = kCasts;
        if (noise_ > 0)
            for (const PreviewHold hold : kNoisy)
                squares.add(fact++, answer.between(answer.written(noisy_[hold]),
                                                   answer.written(cast_[hold][kNoisyStep])) /
                                        (noise_ * noise_));
        if (want_.mode == Mode::composite)
            squares.add(fact, answer.transparency() < kTerminated ? 1 : 0);
    }

 private:
    void add_noisy(RayPiece& piece) {
        std::array<double, Places::kMost> noisy;
        for (const PreviewHold hold : kNoisy) {
            const std::span<const double> held = piece.held(hold);
            for (std::size_t i = 0; i < piece.count(); ++i)
                noisy[i] = held[i] + noise_ * piece.block().noise(hold, piece.places()[i]);
            piece.add({noisy.data(), piece.count()}, noisy_[hold], want_);
        }
    }

    const Request& want_;
    double noise_;  // RMS of the samples' [value]
    std::array<std::array<Stretch, kCastSteps.size()>, kHolds.size()> cast_;
    std::array<Stretch, kNoisy.size()> noisy_;
};

class RayCastModel final : public Model {
 public:
    /// About the rounding to 8 bits: gains of a maximum depend on how large noise is.
    explicit RayCastModel(const ModelSetting& setting)
        : want_(setting.want),
          noise_(1e-3 * range_between(setting.statistics.low, setting.statistics.high)) {
        for (const PreviewHold hold : kHolds)
            for (const double step : kCastSteps) {
                const bool coarse = step == 2;
                facts_.push_back({.name = fmt::format("picture/{}/{}", kPreviewHolds[hold], step),
                                  .like = hold == kZoh
                                              ? (coarse ? RayLook::kZoh2 : RayLook::kZoh1)
                                              : (coarse ? RayLook::kFoh2 : RayLook::kFoh1)});
            }
        if (noise_ > 0)
            for (const PreviewHold hold : kNoisy)
                facts_.push_back(
                    {.name = fmt::format("gain/noise/{}", kPreviewHolds[hold]), .promised = false});
        if (want_.mode == Mode::composite) facts_.push_back({.name = "picture/ended"});
    }
    std::vector<double> steps() const override { return {kCastSteps.begin(), kCastSteps.end()}; }
    std::unique_ptr<RayModel> follow(const RaySpan&, const OutputSample&) const override {
        return std::make_unique<CastRay>(want_, noise_);
    }

 private:
    const Request& want_;
    double noise_;
};

}  // namespace

std::shared_ptr<const Model> ray_cast_model(const ModelSetting& setting) {
    if (setting.want.job != Job::render) return nullptr;
    return std::make_shared<RayCastModel>(setting);
}

}  // namespace edgewise
