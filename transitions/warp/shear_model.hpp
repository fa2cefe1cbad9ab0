#pragma once

#include <memory>

#include "scene/model.hpp"

namespace edgewise {

/// The error of one pass of shears, by filter.
inline constexpr FactFamily kShearedError{"sheared"};

/// What one pass of shears along slanted lines gets wrong: facts kShearedError(FILTER).
/// Null where no view has such passes.
std::shared_ptr<const Model> shear_model(const ModelSetting& setting);

}  // namespace edgewise
