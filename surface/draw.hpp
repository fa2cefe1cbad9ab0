#pragma once

#include <functional>
#include <optional>

#include "graph/request.hpp"
#include "surface/mesh.hpp"

namespace edgewise::surface {

/// How a mesh is seen in one view.
struct Drawing {
    const Mesh* mesh = nullptr;  // its vertices and normals by input index
    const Request* want = nullptr;
    int view = 0;
    bool by_vertex = false;  // light is worked out at the vertices (Gouraud 1971), else at each
                             // pixel from the interpolated normal (Phong 1975)
};

/// Draws the nearest triangle of each pixel, lit as the request says, in its label's colour or
/// white: a z-buffer in tiles, each of which keeps depth and triangle and is lit when all are in
/// (Burns and Hunt, "The visibility buffer", JCGT 2013). What is clipped away is seen through. A
/// triangle covers the pixels whose centres lie in it or on its edges; of two at one depth the
/// first one is seen. The same bytes for any number of threads.
/// @param pixels  [height][width][4], f32: red, green and blue, premultiplied, and opacity
/// @param poll    called now and then; may throw
void draw(const Drawing& drawing, const Region& region, float* pixels, std::ptrdiff_t row,
          std::pmr::memory_resource* memory, const std::function<void()>& poll);

/// Bytes that it takes beside mesh and picture.
double drawing_scratch(double vertices, double triangles, const Extent& picture) noexcept;

}  // namespace edgewise::surface
