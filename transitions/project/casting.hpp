#pragma once

#include <map>
#include <memory_resource>
#include <string>

#include "graph/data.hpp"
#include "graph/request.hpp"

namespace edgewise {

/// Counts, on packets of rays spread over pixels and views, what the ray caster takes of this data:
/// empty stretches and what lies behind an opaque wall it leaves out, and no formula knows how
/// much: facts kCastAll to kCastCorrectedEnds. An edge that reads one of them names this among its
/// shared_counts. Only of MIP and composite; other modes take all. A millisecond, and one pass over
/// the data.
void measure_casting(const Data& input, const Request& want, std::map<std::string, double>& facts,
                     std::pmr::memory_resource* memory);

}  // namespace edgewise
