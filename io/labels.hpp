#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "graph/data.hpp"
#include "io/store.hpp"

namespace edgewise {

/// How many numbers f32 rounds, of 32-bit integers and f64; 0 of other types.
std::int64_t rounded_by_f32(const Data& data);

/// Turns stored numbers of 32-bit integers or f64 into f32, which must hold them; the map to values
/// stays. 32-bit ones are changed where they lie.
/// @throws std::bad_alloc
void to_f32(Data& data, std::pmr::memory_resource* memory);

/// Labels in ascending order, of which results hold places.
struct LabelTable {
    std::vector<double> values;  // of 64-bit integers as f64 rounds them
    /// Of 64-bit integers: as they are, in two's complement where they have a sign; else empty.
    std::vector<std::uint64_t> bits = {};
    bool with_sign = false;

    /// As text: all digits of an integer.
    std::string text(std::size_t place) const;
    /// The integer that a label is, where it is one of 64 bits with a sign.
    std::optional<std::int64_t> integer(std::size_t place) const;
};

/// Labels only have to stay apart, so those that f32 cannot hold are replaced by their places in a
/// table, which it can: edges that make no new value then carry any integer bit for bit, and the
/// table is put back when results are written. Places are in the order of values.
/// @param labels    of 32-bit integers or f64; becomes f32 with the identity as map to values
/// @param outside   joins the table: the value beyond the input
/// @param integers  f64 stands for these 64-bit integers, bit by bit
/// @throws RequestError more than 2^24 different labels; 64-bit integers cannot say `outside`
std::shared_ptr<const LabelTable> code_labels(Data& labels, double outside,
                                              std::pmr::memory_resource* memory,
                                              store::Wide integers = store::Wide::no);
/// Of a value that is in it, a whole number where it is of 64-bit integers.
double place_in(const LabelTable& table, double value);

/// Whether integers look like labels, where nobody says what they are: at most 32 different values
/// in 16 times as many samples, or at most 4096 where, away from the commonest value, 7 of 10
/// neighbours along x are equal. Not where more than 4 values mostly change by 1 between
/// neighbours, as a dim picture does. Photographs, CT and MR have neighbours that differ; a fine
/// mosaic of many labels may be missed. Of large data some rows are looked at. One channel only.
bool looks_like_labels(const Data& data, double commonest);

}  // namespace edgewise
