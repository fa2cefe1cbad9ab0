#pragma once

#include <string_view>

#include "graph/job.hpp"
#include "graph/mode.hpp"

namespace edgewise {

// Jobs and modes by what they are, for code that knows none by name.

/// The first job whose paths end in a kind of data ("screen/picture"). @throws std::logic_error
Job job_to(std::string_view target);
/// Whether views place its result: it has a screen.
bool has_screen(Job job) noexcept;
/// Whether its result is a surface of triangles.
bool makes_surface(Job job) noexcept;
/// Whether its result is samples or pictures, which charts and audits compare with the reference's.
bool is_charted(Job job) noexcept;

/// The first mode whose samples go through such a loop.
Mode mode_by(Combine loop);

}  // namespace edgewise
