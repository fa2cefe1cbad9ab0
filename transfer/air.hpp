#pragma once

#include <optional>
#include <span>

#include "graph/data.hpp"
#include "io/store.hpp"

namespace edgewise {

/// The least value of a CT in Hounsfield units that is no padding: air, as it was measured.
///
/// Padding is what the file calls so, and below -1024 a value that no other comes near: scanners
/// fill what lies outside their field of view with -2000 or -3024, and not all files say so.
/// @param padding  samples that the file calls no measurements; ascending
/// @return nothing where nothing was measured
std::optional<double> air_of(const Data& data, std::span<const store::PaddingRuns::Run> padding);

}  // namespace edgewise
