#pragma once

#include "graph/request.hpp"
#include "request/geometry.hpp"
#include "request/query.hpp"

namespace edgewise {

/// Puts what rays see of the input into a request whose views and input are known. A clip that
/// keeps all of the input is none.
/// @throws RequestError numbers that are not finite, a plane without a direction, a ball without a
///         radius, a slab without a thickness, a clip that keeps nothing in any view
void take_clip(Request& want, const ClipSpec& spec, const InputGrid& grid,
               const Geometry& geometry);

}  // namespace edgewise
