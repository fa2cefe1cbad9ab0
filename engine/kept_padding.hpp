#pragma once

#include <string>

#include "graph/request.hpp"
#include "request/input.hpp"
#include "request/tail.hpp"

namespace edgewise {

/// Padding of the input (DICOM) is padding in the result of a filter too, which worked on the value
/// that stands for nothing in its place. Where results are no values of the input's kind
/// (derivatives, differences, masks) it is 0 there; so it is in a view.
/// @param written  as `finished` has made them; of other jobs nothing changes
/// @return what to say, or ""
std::string keep_padding(const Request& want, const Input& input, const Tail& tail, Array& written);

}  // namespace edgewise
