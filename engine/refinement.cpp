#include "engine/refinement.hpp"

#include <algorithm>
#include <utility>

namespace edgewise {

FrontBound front_bound_of(const Data& picture) {
    const std::int64_t pixels = picture.what.samples();
    const float* opacity = picture.as<float>() + 3;
    FrontBound bound;
    for (std::int64_t i = 0; i < pixels; ++i) {
        const double through = std::clamp(1.0 - opacity[4 * i], 0.0, 1.0);
        bound.most = std::max(bound.most, through);
        bound.mean += through;
    }
    if (pixels > 0) bound.mean /= static_cast<double>(pixels);
    return bound;
}

Refinement::Refinement(bool writes, std::optional<double> stop_after)
    : writes_(writes), stop_after_(stop_after), taker_(std::make_shared<FrontWatch>()) {}

FrontWatch Refinement::watch() const {
    return [taker = taker_](const FrontPicture& front) { return !*taker || (*taker)(front); };
}

void Refinement::give_to(FrontWatch taker) { *taker_ = std::move(taker); }

}  // namespace edgewise
