#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <memory_resource>
#include <span>

#include "surface/mesh.hpp"

namespace edgewise::surface {

using Quad = std::array<std::uint32_t, 4>;

/// By how much the thickness of a flat part may change, as a share of it.
inline constexpr float kThickness = 0.04F;

/// A corner of voxels that surfaces run through. Its neighbours are those at the next corners along
/// the axes, backwards and forwards along x, then y, then z, that it is drawn to.
struct NetPoint {
    static constexpr std::uint32_t kNone = 0xffffffff;

    std::array<std::uint32_t, 6> neighbours;  // kNone: it is not drawn that way
    std::uint8_t free = 0;                    // axes along which it may move, bit by bit
    /// Neighbours that count twice, bit by bit: beyond the scan's end the surface is taken to go on
    /// as if it were mirrored there.
    std::uint8_t twice = 0;
    /// Where a label lies flat at it, it and the point straight across that label, downwards and
    /// upwards along one axis; kNone: no such point is near.
    std::array<std::uint32_t, 2> across{kNone, kNone};
    std::array<std::uint8_t, 2> thickness{};  // to there [samples]
    std::uint8_t axis = 0;                    // from one to the other

    /// The thickest part of a label that is looked through.
    static constexpr int kThick = 12;
};

/// A face of a voxel between two groups of samples.
struct NetWall {
    Quad points;  // counter-clockwise, seen from `above`
    std::uint32_t below = 0, above = 0;
    std::uint8_t axis = 0;  // from `below` to `above`
    bool thin = false;      // of a part of a label that is one sample thick
};

/// Smooths walls by moving points: at first half way between voxels, in the end smooth, and each
/// within a share of its cell, the box half a sample around where it began.
///
/// A step draws each point half way to the mean of its neighbours. That takes volume from what is
/// bent outwards. So each step measures what every wall has swept since the beginning, takes the
/// mean over walls around it between the same two groups, over fewer where a part is thin, and
/// moves walls back by that: the steps between voxels go, volumes stay, in all parts of a surface.
/// Where walls of more groups meet, a point goes to where it moves each of them by its own
/// distance, as well as it can. What rounding takes from the edges of a thin part must not swell
/// its sides: where two points lie across it, it keeps its thickness to kThickness.
///
/// @param share   0 to 1, of half a sample along each axis
/// @param moved   by how much, in samples
void smooth_net(std::span<const NetPoint> points, std::span<const NetWall> walls, float share,
                std::span<Eigen::Vector3f> moved, std::pmr::memory_resource* memory,
                const std::function<void()>& poll);

/// Bytes that it takes beside its arguments.
double smoothing_scratch(double points, double walls) noexcept;

}  // namespace edgewise::surface
