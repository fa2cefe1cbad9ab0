#pragma once

#include <string>

#include "graph/scene.hpp"
#include "io/store.hpp"
#include "scene/statistics.hpp"

namespace edgewise {

/// What `describe:WxH[xD]:TYPE[:key=value...]` says of an image or a volume that is not there. What
/// it does not say is guessed as scanned volumes are on the median.
struct Described {
    Extent extent;
    bool volume = true;
    Type type = Type::u8;
    std::array<double, 3> spacing{1, 1, 1};
    double occupied = 1;  // share of the samples that are not empty
    /// Above 1: power falls with frequency to minus this exponent. Up to 1: power is even up to
    /// this share of the Nyquist frequency, and none beyond.
    double spectrum = 3;
};

/// @throws RequestError naming the part that was not understood
Described described_by(const std::string& name);

store::Header header_of(const std::string& name, const Described& described);

/// Values from 0 to the type's greatest (floats: 1), empty where 0.
Statistics described_statistics(const Described& described, const store::Header& header);

/// The statistics as a scene, with the error of reconstruction by zoh, foh and bspline3 that
/// follows from the spectrum: the mean over all shifts of |1 - H|^2 of what is there and |H|^2 of
/// what repeats, H a hold's frequency response, along each axis. [value]
Scene described_scene(const Described& described, const store::Header& header);

}  // namespace edgewise
