#pragma once

#include <memory>

#include "scene/model.hpp"

namespace edgewise {

/// Pictures cast with each filter and step: facts kPictureError(FILTER, STEP); of composites
/// kEnded; kNoiseGain(FILTER).
std::shared_ptr<const Model> ray_cast_model(const ModelSetting& setting);

}  // namespace edgewise
