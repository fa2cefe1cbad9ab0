#pragma once

#include <functional>
#include <map>
#include <string>

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
};

/// How one pass of a filter is worked out. An edge is made of it by filtering_edge().
struct FilterAlgorithm {
    std::string name = {};    // "filter.backward"
    std::string source = {};  // where algorithm and counts come from
    std::map<std::string, Domain> parameters = {};
    bool on_demand = false;
    /// Why it cannot serve, or "".
    std::function<std::string(const PassAsk&)> refused = {};
    /// Operations a sample.
    std::function<double(const PassAsk&)> operations = {};
    /// Bytes that a thread needs; absent: those of three tiles.
    std::function<double(const PassAsk&)> scratch = {};
    /// What it adds to rounding, which filtering_edge() knows; absent: nothing.
    std::function<Error(const PassAsk&)> error = {};
    std::function<void(const PassRun&, Type)> run = {};
};

/// An edge that works off the passes of a filter by an algorithm.
///
/// Edge    object/scalar -> object/filtered
/// Shape   as the input; extremes of flat kernels keep its type, all else is f32, or f64 where f32
///         would not give the sums of integers exactly
/// Needs   samples as they were read, in memory, row by row
/// Error   rounding: none of integers whose sums are exact, else 2^-24 (f64: 2^-53) of the sum of
///         the magnitudes of the weights times the largest value, by the root of the number of
///         places
Transition filtering_edge(const FilterAlgorithm& algorithm);

}  // namespace edgewise
