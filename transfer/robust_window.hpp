#pragma once

#include <optional>

#include "graph/data.hpp"
#include "scene/statistics.hpp"
#include "transfer/drawn.hpp"

namespace edgewise {

/// Two values between which a volume has what there is to see.
struct ValueWindow {
    double low = 0, high = 1;

    /// The value at a share of it.
    double at(double share) const noexcept { return low + share * (high - low); }
};

/// What a few drawn samples of a volume tell; drawn once, in about a millisecond.
struct Glance {
    Drawn everywhere;  // over all of the volume
    Drawn inside;      // over the box of what is not background
    ValueWindow window = {};
    std::optional<double> hounsfield = {};  // see hounsfield_shift()
};
Glance glance_at(const Data& data, const Statistics& statistics);

/// From where the background ends to the percentile 99.5 of what is above it, so that neither noise
/// around a body nor a few very bright samples count.
///
/// Background is the commonest value where more than half of the samples have it. Else it is what
/// lies up to the foot of the largest peak of the histogram (the triangle method of Zack, Rogers
/// and Latt 1977), where that is in the lower half. Without samples: the range.
ValueWindow robust_window(const Drawn& inside, const Statistics& statistics);

/// What to add to values to have Hounsfield units: 0 where a volume has air at about -1000 and
/// water at about 0; -1024 where both lie so much higher, as scanners store them; else nothing.
///
/// Both are peaks: of values that spread over all between, as phases, velocities and seismic traces
/// do, nothing is said.
std::optional<double> hounsfield_shift(const Drawn& everywhere, const Statistics& statistics);

}  // namespace edgewise
