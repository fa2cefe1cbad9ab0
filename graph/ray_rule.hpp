#pragma once

#include <cstddef>

#include "graph/representation.hpp"

namespace edgewise {

/// How a mode adds up samples along rays in f32, for modes without kernels of their own. Many rays
/// go side by side: of each there are a few numbers, `plane` floats apart. Plain loops over rays,
/// which compilers turn into vectors.
struct RayRule {
    static constexpr int kMostPlanes = 4;

    /// What turns numbers of a ray into its result.
    struct Setting {
        ValueMap values = {};  // of stored numbers
        double length = 1;     // of a weight of 1 [file unit]
        double zero = 0, miss = 0;
        double level = 0;  // Request::level

        /// The stored number nearest to the level whose value reaches it; the values of others do
        /// where they are at least that, or, of a negative slope, at most.
        float stored_level() const noexcept;
    };

    int planes = 1;    // numbers of a ray, at most kMostPlanes
    int channels = 1;  // of its result
    void (*clear)(float* state, std::ptrdiff_t plane, int rays) = nullptr;
    /// Adds a stored number to each ray. A weight of 0, or a value that is not finite: none.
    /// @param weights  lengths, in cells
    void (*add)(const Setting& setting, const float* stored, const float* weights, float* state,
                std::ptrdiff_t plane, int rays) = nullptr;
    /// One ray: `from` lies behind `into`.
    void (*join)(float* into, std::ptrdiff_t plane, const float* from,
                 std::ptrdiff_t from_plane) = nullptr;
    void (*finish)(const Setting& setting, const float* state, std::ptrdiff_t plane,
                   float* out) = nullptr;
};

}  // namespace edgewise
