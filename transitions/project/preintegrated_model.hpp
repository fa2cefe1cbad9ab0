#pragma once

#include <memory>

#include "scene/model.hpp"

namespace edgewise {

/// What project.preintegrated_cast would make of a pixel.
std::shared_ptr<const Model> preintegrated_model(const ModelSetting& setting);

/// The name of its error's fact.
FactName integrated_fact(const Filter& filter, double step);

}  // namespace edgewise
