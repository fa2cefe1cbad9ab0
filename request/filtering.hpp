#pragma once

#include <array>

#include "graph/data.hpp"
#include "graph/filtering.hpp"
#include "request/query.hpp"

namespace edgewise {

/// What kernels are made for.
struct FilterGrid {
    int axes = 3;
    std::array<double, 3> spacing{1, 1, 1};
    bool has_unit = false;  // spacings are in millimetres; else in samples
};

/// What a spec asks for, with its kernel. Of a file this is the samples as they are: weights of a
/// sum; of morphology heights, or, where they are 0 and one other value, the places of a flat
/// kernel that are not 0. NaN is a hole.
/// @throws RequestError sizes that make no sense, lengths without a unit, kernels of more than 2^22
///                      places
/// @throws InputError   of the file
Filtering filtering_of(const FilterSpec& spec, const FilterGrid& grid);

/// What a binary operation calls inside: the value of all samples that are not 0 where they share
/// one, else 1. NaN is outside.
double mask_value(const Data& data);

}  // namespace edgewise
