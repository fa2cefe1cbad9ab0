#pragma once

#include <map>
#include <string>
#include <vector>

#include "graph/transform_graph.hpp"
#include "graph/transition.hpp"
#include "reference/answer.hpp"
#include "scene/model.hpp"
#include "scene/statistics.hpp"

namespace edgewise {

/// Errors measured on a few output samples (graph/scene.hpp lists the facts), and the reference's
/// range over these and over a few chosen because they are likely to be its ends.
struct Preview {
    std::map<std::string, double> facts, likely;
    std::int64_t draws = 0;    // clusters
    bool exhausted = false;    // no more is drawn, whatever is asked for
    double low = 0, high = 0;  // of the reference; low > high: no output sample sees the input
    /// The likely facts without each of the groups of draws (PreviewOf::groups).
    std::vector<std::map<std::string, double>> without;
};

/// Operations that the usual draws of a request take, by and large: what looking costs.
double preview_operations(const Request& want) noexcept;

/// Of warps: points. Draws are not grouped.
Preview preview_points(const Catalogue& catalogue, const PreviewOf& of, const Request& want,
                       const ReferenceField& field, const Statistics& statistics,
                       std::pmr::memory_resource* memory);

/// Of pictures: rays.
Preview preview_rays(const Catalogue& catalogue, const PreviewOf& of, const Request& want,
                     const ReferenceField& field, const Statistics& statistics,
                     std::pmr::memory_resource* memory);

}  // namespace edgewise
