#pragma once

#include <cmath>
#include <limits>
#include <memory>
#include <set>
#include <string>

#include "scene/model.hpp"

namespace edgewise {

/// The part of a ray whose samples are combined [z of the screen], rounded inwards: a warp writes
/// its outside value where its own arithmetic finds a sample outside.
struct CombinedSpan {
    float low, high;
};
inline CombinedSpan combined_span(double low, double high) noexcept {
    constexpr double kInwards = 1e-6;
    constexpr float kFar = std::numeric_limits<float>::infinity();
    return {std::nextafter(static_cast<float>(low + kInwards), kFar),
            std::nextafter(static_cast<float>(high - kInwards), -kFar)};
}

/// The error of a picture that is combined of the samples of a warp.
inline constexpr FactFamily kScreenError{"picture/screen"};
/// What combining adds to samples without error.
inline constexpr Fact kCombiningError{"picture/combined"};

/// Pictures combined of the samples that warps make: facts kScreenError(WARP), from which
/// kCombiningError, kCombinedError(WARP) and kBlurGain follow.
std::shared_ptr<const Model> combine_model(const ModelSetting& setting);
/// Adds what these follow from, see Transition::derives.
void add_combined_from(std::set<std::string>& wanted);

}  // namespace edgewise
