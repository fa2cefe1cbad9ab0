#pragma once

#include <optional>

#include "io/store.hpp"
#include "request/geometry.hpp"
#include "request/outputs.hpp"
#include "request/query.hpp"

namespace edgewise {

/// The coarsest resolution of a file that is as fine as the result's samples.
/// @param header  of a resolution that is read
/// @param grid    of the result, of a picture's pixels or a warp's samples
/// @return its number, from 0, the finest; that of `header` where none is
int level_as_fine(const store::Header& header, const ScreenGrid& grid, Job job);

/// What a request takes of its file: selection_of(), with that resolution where it asks for it
/// (Query::level_by_result) and the file holds several.
/// @throws RequestError  not of a picture or a warp; options that count samples of the input, whose
///                       resolution nobody knows then
store::Selection chosen_selection(const Query& query, const std::optional<Outputs>& outputs);

}  // namespace edgewise
