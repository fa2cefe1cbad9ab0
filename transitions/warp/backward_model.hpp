#pragma once

#include <memory>

#include "scene/model.hpp"

namespace edgewise {

/// Samples read by each filter where they lie: facts kFieldError(FILTER), at points and along rays.
std::shared_ptr<const Model> backward_model(const ModelSetting& setting);

/// Walks over the samples of the field that a ray takes at a step of kFieldStep: calls
/// each(i, expected) for those that are present, i a place of the piece.
inline constexpr double kFieldStep = 0.5;
template <class Each>
void for_each_present(RayPiece& piece, const ReferenceField& field, Each&& each) {
    const std::span<const double> expected =
        field.kind() == Field::spline ? piece.held(kSpline) : piece.reference();
    const std::span<const double> nearest = piece.held(kZoh);
    for (std::size_t i = 0; i < piece.count(); ++i)
        if (field.kind() == Field::formula || std::isfinite(nearest[i])) each(i, expected[i]);
}

}  // namespace edgewise
