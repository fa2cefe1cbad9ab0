#pragma once

#include <memory>

#include "scene/model.hpp"

namespace edgewise {

/// Samples that an assignment sends (filter=me): fact kFieldError("me"). With other filters it errs
/// as reading by them does.
std::shared_ptr<const Model> permutation_model(const ModelSetting& setting);

}  // namespace edgewise
