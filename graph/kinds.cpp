#include "graph/kinds.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <stdexcept>

namespace edgewise {

Job job_to(std::string_view target) {
    const auto found =
        std::find_if(jobs().begin(), jobs().end(), [&](Job job) { return job->target == target; });
    if (found == jobs().end()) throw std::logic_error(fmt::format("no job leads to {}", target));
    return *found;
}

bool has_screen(Job job) noexcept { return job->values != JobTraits::Values::other; }

bool makes_surface(Job job) noexcept { return job->target == "object/mesh"; }

bool is_charted(Job job) noexcept { return job->samples || job->of_rays(); }

Mode mode_by(Combine loop) {
    return *std::find_if(modes().begin(), modes().end(),
                         [&](Mode mode) { return mode->combine == loop; });
}

}  // namespace edgewise
