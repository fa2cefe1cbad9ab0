#pragma once

#include "engine/request/geometry.hpp"
#include "engine/request/input.hpp"
#include "engine/request/make_request.hpp"
#include "engine/request/outputs.hpp"
#include "engine/request/tail.hpp"

namespace edgewise {

/// What is written of a request: its tail, and the description that goes into the file.
struct Written {
    Tail tail;
    store::Header header;
    std::vector<std::string> warnings;
};

/// @param low,high  of the input's values
/// @throws RequestError where the format can hold neither values nor a view of this
Written written_of(const Request& want, const RequestSpec& spec, const Geometry& geometry,
                   const Input& input, const Outputs& outputs, double low, double high);

}  // namespace edgewise
