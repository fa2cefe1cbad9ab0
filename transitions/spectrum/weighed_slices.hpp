#pragma once

#include <array>
#include <string>
#include <vector>

#include "graph/transition.hpp"

namespace edgewise {

/// What one of several spectra of a volume counts for in a view: value x (its field) + derivative .
/// (the gradient of its field by voxel).
struct SliceWeight {
    double value = 0;
    std::array<double, 3> derivative{0, 0, 0};

    bool counts() const noexcept { return value != 0 || derivative != std::array<double, 3>{}; }
};

/// A slice of several spectra that lie one behind the other along z, of a content.
Offer weighed_offer(const std::string& content, const Representation& from, const Ask& ask,
                    const Parameters& with);
/// That of spectrum.slice and two operations a sample, for each spectrum that counts.
/// @param one  extent of one of the spectra
Work weighed_work(const Extent& one, const std::vector<SliceWeight>& weights, const Offer& offer,
                  const Ask& ask, int view);
/// Adds up the slices of spectra, each by its weight; one that counts for nothing is not read.
void weighed_slices(const Extent& one, const std::vector<SliceWeight>& weights, const Offer& offer,
                    const Ask& ask, const Data& in, Data& out, const Region& region,
                    Context& context);

}  // namespace edgewise
