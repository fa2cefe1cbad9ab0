#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "planner/machines.hpp"
#include "planner/planner.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise::thesis {

/// An image or a cube turned about its centre, EQ 37; the output has the input's size.
/// @param turn  "2d", or the axes of a volume that all turn by that angle: "x", "xyz"
inline Request turned(Job job, int side, const std::string& turn, double degrees) {
    const bool image = turn == "2d";
    Request want;
    want.job = job;
    want.axes = image ? 2 : 3;
    want.input = {side, side, image ? 1 : side};
    want.screen = want.input;
    const Vec3 centre(0.5 * (side - 1), 0.5 * (side - 1), image ? 0 : 0.5 * (side - 1));
    const double angle = degrees * std::numbers::pi / 180;
    Eigen::Affine3d map = Eigen::Affine3d::Identity();
    map.translate(centre);
    for (int axis = 2; axis >= 0; --axis)
        if (image ? axis == 2 : turn.find("xyz"[axis]) != std::string::npos)
            map.rotate(Eigen::AngleAxisd(angle, Vec3::Unit(axis)));
    map.translate(-centre);
    want.views = Placement(map.matrix());
    return want;
}

/// Bytes, on disk where there are ranks: each reads its share.
inline Source samples_of(const Request& want) {
    Representation what;
    what.axes = want.axes;
    what.extent = want.input;
    what.type = Type::u8;
    what.place = want.ranks > 1 ? Place::disk : Place::memory;
    return {what};
}

inline Answer planned(const Request& want, const Scene& scene, const Profile& profile,
                      const std::vector<std::string>& via = {}) {
    static const Catalogue edges = catalogue();
    PlanOptions options;
    for (const std::string& text : via) options.demands.via.push_back(demand_of(text, edges));
    return plan(edges, {want, scene}, {samples_of(want)}, profile, options);
}

}  // namespace edgewise::thesis
