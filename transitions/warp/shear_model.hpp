#pragma once

#include <memory>

#include "scene/model.hpp"

namespace edgewise {

/// What one pass of shears along slanted lines gets wrong: facts "sheared/foh", "sheared/bspline3".
/// Null where no view has such passes.
std::shared_ptr<const Model> shear_model(const ModelSetting& setting);

}  // namespace edgewise
