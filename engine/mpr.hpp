#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/reached.hpp"

namespace edgewise {

/// The three planes of a volume through one place, in one picture: what front, left and bottom show
/// (coronal, sagittal, axial) where the file is anatomical, else along y, x and z. Above are the
/// first two, below the first is the third, so that what lies in one column or row has one x or z.
/// All have square pixels of one size, through one window.
struct Planes {
    /// @param request   of render; its size is one number, of the longest side of the volume;
    ///                  absent: one pixel a sample, but at least 512 on the longer side
    /// @param place     sample of the input
    /// @param listener  outlives it
    Planes(Query request, const std::array<double, 3>& place, Engine means, Listener& listener);

    const Query query;
    const std::array<double, 3> place;
    const Engine engine;
    Listener& messages;
    bool explained = false;  // whoever asked is shown the plans: what they cost is worked out
    std::vector<Reached> requests;  // their plans and measurements
    Extent extent;                  // of the picture, without a legend
    double write_seconds = 0;
    std::vector<std::string> files;  // written
};

/// @param planned  told of each plane when it is planned, and its samples are still there
/// @throws RequestError, InputError, NoPlan, Cancelled, RunError, std::bad_alloc
void perform(Planes& planes, const std::function<void(Planned&)>& planned = {});

}  // namespace edgewise
