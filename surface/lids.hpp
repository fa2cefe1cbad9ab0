#pragma once

#include <memory_resource>

#include "graph/data.hpp"
#include "graph/fingerprint.hpp"

namespace edgewise::surface {

/// What a mesh asks for beside its isovalue.
struct MeshSetting {
    bool lids = false;  // an isosurface is closed at the volume's faces
};

template <Either<MeshSetting> T, class F>
void visit_fields(T& setting, F&& f) {
    auto& [lids] = setting;
    f("lids", lids);
}

/// Samples within a frame of one sample that lies below every isovalue. A surface of them is closed
/// by flat lids in the outermost samples' planes, as good as the numbers' rounding: the frame is so
/// far below that it is reached at once. Sample (0, 0, 0) becomes (1, 1, 1).
/// @throws std::bad_alloc
Data with_frame(const Data& samples, std::pmr::memory_resource* memory);

/// Bytes of these.
double frame_bytes(const Representation& samples) noexcept;

}  // namespace edgewise::surface
