#pragma once

#include <string>
#include <vector>

#include "graph/request.hpp"

namespace edgewise {

/// Views that turn about one axis, which lies along the screen's y.
struct Turntable {
    std::string refused = {};         // why they are none
    std::vector<double> angles = {};  // of each different view from the first [turns, 0 to 1]
    double axis = 0;                  // x of the axis on the screen [pixel]; twice it is whole
    double radius = 0;                // of the input's box about the axis [steps along screen z]
    double finest = 0;                // least distance of samples along their axes [the same]
    Mat4 first = Mat4::Identity();    // input index -> screen of the first view
    Vec3 middle = Vec3::Zero();       // of the input, on the screen of the first view
    std::array<double, 2> pixel{1, 1};

    /// Parallel views of one volume, by matrices.
    explicit Turntable(const Request& want);

    /// The map of a view that is so many turns from the first.
    Mat4 view_at(double turns) const;
    /// The least even number of equal parts of a turn whose ends are all angles; 0: more than most.
    std::int64_t parts(std::int64_t most) const;
    /// As many parts of a turn as sampling needs: spectra of a volume of this radius vary with the
    /// angle, at f cycles a step, by up to 2 pi f radius waves a turn.
    /// @param cutoff   highest frequency [cycles a sample]
    /// @param padding  more than that, for a window
    std::int64_t needed(double cutoff, double padding) const;
};

}  // namespace edgewise
