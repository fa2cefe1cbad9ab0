#pragma once

#include "cli/request/geometry.hpp"
#include "cli/request/input.hpp"
#include "cli/request/make_request.hpp"
#include "cli/request/outputs.hpp"
#include "cli/request/tail.hpp"

namespace edgewise::cli {

/// What is written of a request: its tail, and the description that goes into the file.
struct Written {
    Tail tail;
    store::Header header;
    std::vector<std::string> warnings;
};

/// @param low,high  of the input's values
/// @throws RequestError where the format can hold neither values nor a view of this
Written written_of(const Wish& wish, const Geometry& geometry, const Input& input,
                   const Outputs& outputs, double low, double high);

}  // namespace edgewise::cli
