#pragma once

#include <memory>
#include <optional>
#include <string>

#include "graph/transition.hpp"
#include "transitions/kernels/sorted_mip.hpp"

namespace edgewise {

/// Lays a list of all bricks beside the samples, in descending order of bounds, once for all views
/// of a largest or least sample: what project.sorted_mip projects first is what hides the rest.
/// Edge    object/scalar -> object/sorted, object/coefficients -> object/sorted-coefficients: the
/// same
///         samples with a facet, by a name that no other edge reads
/// Shape   bricks of 8^3 samples; 8 bytes each
/// Needs   parallel rays, a mode whose kernels take the largest sample, and data of which rays need
///         less than a third of their samples (measure_casting)
/// Work    every sample is compared twice, those on faces of bricks once more; bricks are sorted
/// Error   none
/// Source  Mroz, Hauser, Groeller, "Interactive high-quality maximum intensity projection",
///         Computer Graphics Forum 19(3), 2000
Transition sorted_bricks();

/// What the facet holds.
struct BricksBeside {
    Array room;
    kernels::SortedBricks sorted;  // of `room`
};

/// The facet of a request: "largest-first", or "least-first" where stored numbers fall as values
/// rise, or as the mode's do.
std::string sorted_facet_of(const Request& want, const ValueMap& values);
/// Both of them, and what samples beside them are called.
inline constexpr const char* kSortedFacets[] = {"largest-first", "least-first"};
inline constexpr const char* kSortedSamples = "sorted";
inline constexpr const char* kSortedCoefficients = "sorted-coefficients";
/// What rays need of their samples whatever comes first, told from what the caster takes; absent:
/// it was not counted.
std::optional<double> share_needed(const Scene& scene);
/// Why a request has no use for it; empty: it has.
std::string no_sorting(const Representation& from, const Ask& ask);
/// The bricks of data that have them.
std::shared_ptr<const BricksBeside> sorted_bricks_of(const Data& data, const std::string& facet);

}  // namespace edgewise
