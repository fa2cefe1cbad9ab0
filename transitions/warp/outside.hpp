#pragma once

#include "graph/request.hpp"
#include "graph/scene.hpp"
#include "graph/transition.hpp"

namespace edgewise {

/// What a warp writes where its input has no samples.
///
/// Rays of a picture end at the faces of the whole volume, so what they still read beyond the
/// samples of a vertex has been cropped away: it was the commonest value.
inline double outside_of(const Ask& ask) {
    return ask.want.job->of_rays() ? ask.scene.commonest : ask.want.outside;
}

}  // namespace edgewise
