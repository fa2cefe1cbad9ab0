#pragma once

#include <memory>
#include <string>

#include "graph/transition.hpp"
#include "transitions/kernels/gradient.hpp"

namespace edgewise {

/// Works out the gradient at every sample and lays it beside the samples, as a facet
/// "gradient-central", "gradient-sobel" or "gradient-fourth" ([W93] EQ 57, FIGURE 57): what many
/// lit views of many samples need is made once.
Transition gradient_facet();

/// The facet of a scheme.
const std::string& gradient_facet_of(kernels::Differences by);
/// That of a representation, which has one.
kernels::Differences differences_of(const Representation& what);
/// The gradients of data that have them.
std::shared_ptr<const kernels::Gradients> gradients_of(const Data& data);

}  // namespace edgewise
