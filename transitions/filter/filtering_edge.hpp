#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "graph/transition.hpp"
#include "transitions/filter/neighbourhood.hpp"
#include "transitions/filter/padded.hpp"

namespace edgewise {

/// What an algorithm is asked about: one pass over samples of so many in a type.
struct PassAsk {
    const Neighbourhood& of;
    const Representation& from;
    const Scene& scene;
    const Parameters& with;
    Type type;  // in which it computes

    /// Operations in vectors that take as long as one on a single value: so many values of its type
    /// are in a vector of eight f32.
    double alone() const noexcept { return 32 / static_cast<double>(bytes_of(type)); }
    /// Operations in vectors that one call on a row takes before and after its vectors, for each of
    /// so many samples: some 40, one by one.
    double call(std::int64_t samples) const noexcept {
        return 40 * alone() / static_cast<double>(samples);
    }
    /// Whether tiles in the middle are read and written where they are, see TileReads.
    bool in_place() const noexcept {
        return type == from.type && from.channels == 1 && from.values.identity();
    }
};

/// How one pass of a filter is worked out. An edge is made of it by filtering_edge().
struct FilterAlgorithm {
    std::string name = {};    // "filter.backward"
    std::string source = {};  // where algorithm and counts come from
    std::map<std::string, Domain> parameters = {};
    bool on_demand = false;
    /// Why it cannot serve, or "".
    std::function<std::string(const PassAsk&)> refused = {};
    /// Operations a sample, on vectors of the type in which it computes.
    std::function<double(const PassAsk&)> operations = {};
    /// Cache lines a sample that passes over a whole tile bring, and the bytes of that tile.
    std::function<Lines(const PassAsk&)> lines = {};
    /// Whether it has tiles read and written in place.
    bool in_place = false;
    /// See Work::variant; absent: none.
    std::function<std::string_view(const PassAsk&)> variant = {};
    /// Bytes that a thread needs; absent: those of three tiles.
    std::function<double(const PassAsk&)> scratch = {};
    /// What it adds to rounding, which filtering_edge() knows; absent: nothing.
    std::function<Error(const PassAsk&)> error = {};
    std::function<void(const PassRun&, Type)> run = {};
    std::function<std::vector<Trial>()> trials = {};  // see Transition
    std::map<std::string, double> factors = {};       // likewise
};

/// An edge that works off the passes of a filter by an algorithm.
///
/// Edge    object/scalar -> object/filtered
/// Shape   as the input; extremes of flat kernels keep its type, all else is f32, or f64 where f32
///         would not give the sums of integers exactly
/// Needs   samples as they were read, in memory, row by row
/// Error   what running it gave, where that was measured (scene/measured_results.hpp). Else of
///         rounding: none of integers whose sums are exact and of flat extremes, else at most 2^-24
///         (f64: 2^-53) of the sum of the magnitudes of the weights times the largest value; where
///         results were drawn what a random walk comes to
Transition filtering_edge(const FilterAlgorithm& algorithm);

/// Small and large sums, extremes and medians of an image and of a volume (Transition::trials).
std::vector<Trial> sum_trials();
std::vector<Trial> extreme_trials();
std::vector<Trial> median_trials();
/// Those of sums and of extremes.
std::vector<Trial> sum_and_extreme_trials();

}  // namespace edgewise
