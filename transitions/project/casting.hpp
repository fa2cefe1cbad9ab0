#pragma once

#include <map>
#include <memory_resource>
#include <string>

#include "graph/data.hpp"
#include "graph/request.hpp"

namespace edgewise {

/// Counts, on packets of rays spread over pixels and views, what the ray caster takes of this data:
/// empty stretches and what lies behind an opaque wall it leaves out, and no formula knows how
/// much. Facts, in samples a pixel at a step of 1 with the nearest hold:
///  - "cast/all": inside the data;
///  - "cast/taken": taken without bricks;
///  - "cast/bricks": taken with bricks;
/// and of composite as shares, where a packet of rays needs one
///  - "cast/corrected": of "cast/all", samples whose opacity a step that is not its unit corrects;
///  - "cast/corrected/ends": the same of samples at the ends of rays, whatever the step.
/// Only of MIP and composite; other modes take all. A millisecond, and one pass over the data.
void measure_casting(const Data& input, const Request& want, std::map<std::string, double>& facts,
                     std::pmr::memory_resource* memory);

}  // namespace edgewise
