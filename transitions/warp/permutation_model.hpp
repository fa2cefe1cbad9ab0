#pragma once

#include <memory>

#include "scene/model.hpp"

namespace edgewise {

/// Samples that an assignment sends (filter=me): fact "field/me". What it sends by other filters is
/// as good as what is read by them.
std::shared_ptr<const Model> permutation_model(const ModelSetting& setting);

}  // namespace edgewise
