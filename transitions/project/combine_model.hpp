#pragma once

#include <memory>

#include "scene/model.hpp"

namespace edgewise {

/// Pictures combined of the samples that warps make: facts "picture/screen/WARP". From these follow
///  - "picture/combined": what combining adds to samples without error;
///  - "combined/WARP": the error of its samples as far as a picture shows it;
///  - "gain/blur": error of a picture over that of its samples ("combined/...").
std::shared_ptr<const Model> combine_model(const ModelSetting& setting);

}  // namespace edgewise
