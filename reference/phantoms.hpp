#pragma once

#include <memory_resource>
#include <string>
#include <vector>

#include "graph/data.hpp"

namespace edgewise {

/// An analytic image or volume whose exact value is known at every point, also between samples.
/// phantom_named() makes it.
struct Phantom {
    std::string name;
    std::int64_t side = 1;  // samples along each axis
    int axes = 3;
    double (*formula)(const Vec3& index, double side) = nullptr;

    /// The value at a position in index space (sample centres at integers), 0..1. Of a 2D phantom z
    /// is ignored.
    double at(const Vec3& index) const { return formula(index, static_cast<double>(side)); }
};

/// The names that phantom_named knows, volumes first.
std::vector<std::string> phantom_names();

/// Volumes: `sphere` and `cube` ([W93] 4.6, lengths in proportion to the side), `marschner-lobb`
/// (Marschner, Lobb, Visualization 1994: f 6, alpha 0.25), `shepp-logan` (ten ellipsoids, Toft's
/// contrast), `gaussians`, `noise` (cosines of at most 0.2 cycles a sample). Images: `zone-plate`
/// (0.4 cycles a sample at the middle of an edge), `checker` (8 x 8 fields).
/// @throws RequestError for a name that is not there, or a side below 1
Phantom phantom_named(const std::string& name, std::int64_t side);

/// The samples of a phantom: f32, side^axes.
/// @throws RequestError as phantom_named; std::bad_alloc where memory does not reach
Data make_phantom(const std::string& name, std::int64_t side, std::pmr::memory_resource* memory);

}  // namespace edgewise
