#pragma once

#include <cstdint>
#include <functional>

#include "graph/data.hpp"

namespace edgewise {

/// A picture of what lies in front, while a picture is made ([W93] Appendix B, 2.3 and 2.5).
struct FrontPicture {
    int view;             // the first that this picture is of
    std::int64_t slices;  // of them it is made, from the front,
    std::int64_t depth;   // of so many
    const Data& picture;  // all of it, [ny, nx, 4] premultiplied; while the call lasts
};

/// Is called from front pictures to the last one, in the thread that runs the edge; views that run
/// side by side call at the same time.
/// @return whether to go on; else this picture is the edge's result
using FrontWatch = std::function<bool(const FrontPicture&)>;

}  // namespace edgewise
