#pragma once

#include <memory>

#include "scene/model.hpp"

namespace edgewise {

/// Pictures cast with each filter and step: facts "picture/FILTER/STEP"; of composites
/// "picture/ended", the share of rays that end early; "gain/noise/FILTER", the error of a picture
/// over independent noise of its samples.
std::shared_ptr<const Model> ray_cast_model(const ModelSetting& setting);

}  // namespace edgewise
