#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "graph/parameters.hpp"

namespace edgewise {

/// A reconstruction filter: how a value between samples is made of those around it, along each axis
/// by itself. One file a filter and one line in filters.cpp; kernels, previews, error models and
/// the command read this and know no filter by name, but kernels that were written for one.
struct Filter {
    std::string name = {};  // as parameters have it: "foh"
    std::string help = {};  // what it is: "linear interpolation"
    /// Samples along each axis. At a place x these are floor(x) - taps / 2 + 1 and those after it;
    /// of a filter of one tap the nearest, ties upwards.
    int taps = 1;
    bool coefficients = false;  // reads coefficients of the cubic B-spline in place of samples
    bool positive = true;       // no weight is negative: no value leaves the range of those read
    int order = 1;              // polynomials of lower degree come out exactly
    double noise_gain = 1;      // root of the mean over x of the sum of squared weights, one axis
    double operations = 0;      // additions and products of the weights of one place, one axis
    /// RMS error over the range of the samples, where it was not measured: the median over scanned
    /// volumes turned by 5 to 45 degrees is of this size.
    double guess = 0.002;
    /// Weights of the taps at x = floor(x) + f, 0 <= f < 1; they add up to 1.
    void (*weights)(double f, double* weights) = nullptr;
    /// Of the whole filter, the coefficients' making included: transform at a frequency [cycles a
    /// sample].
    double (*response)(double frequency) = nullptr;

    /// Products and sums for one sample of a volume of so many axes: its weights and the taps'
    /// separable sum.
    double operations_of(int axes) const noexcept;
};

/// All there are, in the order in which they are listed.
const std::vector<Filter>& filters();
/// @throws RequestError for a name that none has
const Filter& filter_named(std::string_view name);
/// The parameter "filter" of an edge that reads by any of them. @param tried  unasked
Domain any_filter(const std::vector<std::string>& tried);

}  // namespace edgewise
