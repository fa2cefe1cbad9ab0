#pragma once

#include <map>
#include <string>

#include "graph/transform_graph.hpp"
#include "graph/transition.hpp"
#include "reference/answer.hpp"
#include "scene/statistics.hpp"

namespace edgewise {

/// Errors measured on a few output samples (graph/scene.hpp lists the facts), and the reference's
/// range over these and over a few chosen because they are likely to be its ends.
struct Preview {
    std::map<std::string, double> facts, likely;
    std::int64_t draws = 0;    // clusters
    bool exhausted = false;    // no more is drawn, whatever is asked for
    double low = 0, high = 0;  // of the reference; low > high: no output sample sees the input
};

/// Operations that the usual draws of a request take, by and large: what looking costs.
double preview_operations(const Request& want) noexcept;

/// Of warps: points.
/// @param times  so many times the usual draws, within what there is
Preview preview_points(const Catalogue& catalogue, const Demands& asked, const Request& want,
                       const ReferenceField& field, const Statistics& statistics,
                       std::pmr::memory_resource* memory, int times = 1);

/// Of pictures: rays.
Preview preview_rays(const Catalogue& catalogue, const Demands& asked, const Request& want,
                     const ReferenceField& field, const Statistics& statistics,
                     std::pmr::memory_resource* memory, int times = 1);

}  // namespace edgewise
