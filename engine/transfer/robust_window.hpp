#pragma once

#include <optional>
#include <vector>

#include "graph/data.hpp"
#include "scene/statistics.hpp"

namespace edgewise {

/// Two values between which a volume has what there is to see.
struct ValueWindow {
    double low = 0, high = 1;
};

/// Some of the finite values of a volume, the same ones each time: all where these are few, else
/// one from each of 2^18 stretches of equal length; of sparse volumes 2^21.
/// @param region  that they are of
std::vector<float> drawn_values(const Data& data, const Region& region, double occupied_fraction);

/// From where the background ends to the percentile 99.5 of what is above it, so that neither noise
/// around a body nor a few very bright samples count.
///
/// Background is the commonest value where more than half of the samples have it. Else it is what
/// lies up to the foot of the largest peak of the histogram (the triangle method of Zack, Rogers
/// and Latt 1977), where that is in the lower half. Without samples: the range.
ValueWindow robust_window(const Data& data, const Statistics& statistics);

/// What to add to values to have Hounsfield units: 0 where a volume has air at about -1000 and
/// water at about 0; -1024 where both lie so much higher, as scanners store them; else nothing.
std::optional<double> hounsfield_shift(const Data& data, const Statistics& statistics);

}  // namespace edgewise
