#pragma once

#include <memory>
#include <string>

#include "scene/model.hpp"

namespace edgewise {

/// Error of a cast through a level of detail, steps in the input's smallest spacing.
FactName level_fact(int level, const Filter& filter, double step);

/// How casts through levels 1 and 2, and through those that are asked for, are measured without
/// making them: the cells that a ray needs are averaged when it meets them. Nothing where the
/// budget asks for what linear interpolation gives, which means of samples do not, unless the edge
/// is asked for by name.
std::shared_ptr<const Model> level_model(const ModelSetting& setting);

}  // namespace edgewise
