#pragma once

#include "reference/field.hpp"
#include "reference/view_geometry.hpp"

namespace edgewise {

/// The gradient of a label's coverage at p, but for its length: see graph/label_surface.hpp.
Vec3 coverage_gradient(const ReferenceField& field, double label, const Vec3& p);

/// How the first label of a ray is lit.
/// @param t      where on the ray its first point is
/// @param label  there
Lit label_light(const ReferenceField& field, double label, const RaySpan& ray, double t,
                const LitFrame& frame, const Request& want);

}  // namespace edgewise
