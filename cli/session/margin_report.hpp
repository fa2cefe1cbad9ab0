#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "planner/margin.hpp"

namespace edgewise {
struct Planned;
}

namespace edgewise::cli {

/// Margin and rivals as lines of an explanation; "" where nothing was weighed.
std::string margin_text(const Planned& planned);

/// {"steps": [{"step", "factor", "instead", "spread", "inside"}], "toss_up", "late"}
nlohmann::ordered_json margin_json(const Margin& margin);
/// [{"steps", "predicted", "loses": {"seconds", "bytes", "error"}, "breaks", "differs", "faster",
/// "chance", "toss_up"}]
nlohmann::ordered_json rivals_json(const Margin& margin);

}  // namespace edgewise::cli
