#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "graph/data.hpp"

namespace edgewise {

/// How many numbers f32 rounds, of 32-bit integers and f64; 0 of other types.
std::int64_t rounded_by_f32(const Data& data);

/// Turns stored numbers of 32-bit integers or f64 into f32, which must hold them; the map to values
/// stays. 32-bit ones are changed where they lie.
/// @throws std::bad_alloc
void to_f32(Data& data, std::pmr::memory_resource* memory);

/// Values in ascending order, of which results hold places.
using LabelTable = std::vector<double>;

/// Labels only have to stay apart, so those that f32 cannot hold are replaced by their places in a
/// table, which it can: edges that make no new value then carry any integer bit for bit, and the
/// table is put back when results are written. Places are in the order of values.
/// @param labels   of 32-bit integers or f64; becomes f32 with the identity as map to values
/// @param outside  joins the table: the value beyond the input
/// @throws RequestError more than 2^24 different labels
std::shared_ptr<const LabelTable> code_labels(Data& labels, double outside,
                                              std::pmr::memory_resource* memory);
/// Of a value that is in it.
double place_in(const LabelTable& table, double value);

/// Whether integers look like labels, where nobody says what they are: at most 32 different values
/// in 16 times as many samples, or at most 4096 where, away from the commonest value, 7 of 10
/// neighbours along x are equal. Not where more than 4 values mostly change by 1 between
/// neighbours, as a dim picture does. Photographs, CT and MR have neighbours that differ; a fine
/// mosaic of many labels may be missed. Of large data some rows are looked at. One channel only.
bool looks_like_labels(const Data& data, double commonest);

}  // namespace edgewise
