#pragma once

#include "graph/data.hpp"

namespace edgewise {

/// What one pass over the samples tells. Values are mapped; all channels count alike.
struct Statistics {
    double low = 0, high = 0, mean = 0;    // over finite values; 0 where there is none
    std::int64_t lowest = 0, highest = 0;  // the first sample that has them
    double commonest = 0;                  // of ties the smallest
    std::int64_t non_finite = 0;           // values
    Region occupied;                       // box of the samples that differ from the commonest
    double occupied_fraction = 0;          // of all values
};

/// All of it exactly, but that of types of more than 16 bits the commonest value is that of 4096
/// values drawn at random, where at least 8 of these agree, else the least: a float volume without
/// a background has no commonest value that would matter.
Statistics statistics_of(const Data& data, std::pmr::memory_resource* memory);

}  // namespace edgewise
