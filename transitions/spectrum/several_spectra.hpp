#pragma once

#include <array>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "graph/transition.hpp"
#include "transitions/kernels/spectrum.hpp"

namespace edgewise {

/// Several spectra of one volume for one window, one behind the other along z: "object/CONTENT+
/// degreeN+window...". How many there are hangs on the degree. Each is as spectrum.forward has it.
struct SeveralSpectra {
    std::string_view content;
    int most_degree = 1;
    int (*count)(int degree) = nullptr;

    /// Of all degrees and windows. They are many, so a few windows are enough.
    std::vector<std::string> kinds() const;
    /// degree, width and padding. @param degree  what its number says
    std::map<std::string, Domain> parameters(const std::string& degree) const;
    /// @param ask  with a request that a spectrum alone could serve
    Offer offer(const Representation& from, const Ask& ask, const Parameters& with) const;
    /// Of all of them; what they are made of comes on top.
    Work work(const Offer& offer, const Ask& ask, int view) const;

    int degree_of(const Representation& spectra) const;
    /// The extent of one of them.
    Extent one_of(const Representation& spectra) const;
    /// What one of them is stored as.
    static kernels::SpectrumShape shape_of(const Offer& offer);
    /// What a run leaves beside the samples.
    static void name_facets(const Offer& offer, Data& out);
};

/// What one of several spectra counts for in a view: value x (its field) + derivative . (the
/// gradient of its field by voxel).
struct SliceWeight {
    double value = 0;
    std::array<double, 3> derivative{0, 0, 0};

    bool counts() const noexcept { return value != 0 || derivative != std::array<double, 3>{}; }
};

/// The slice of a view through several spectra, each by its weight: an edge that lacks its name and
/// its source.
///
/// Edge    of each of their kinds -> slice/CONTENT, one a view
/// Shape   [py, px / 2 + 1] c64, as spectrum.slice
/// Work    that of spectrum.slice and two operations a sample, for each spectrum that counts; one
///         that counts for nothing is not read
/// Error   that of spectrum.slice
/// @param content  of the slice
/// @param refused  why a request's pictures are no such sums; empty: they are
/// @param weights  one for each spectrum
Transition slice_of_several(
    const SeveralSpectra& spectra, const std::string& content,
    std::function<std::string(const Ask&)> refused,
    std::function<std::vector<SliceWeight>(const Representation& spectra, const Request&, int view)>
        weights);

}  // namespace edgewise
