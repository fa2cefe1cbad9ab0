#include "transitions/warp/phase_shift.hpp"

#include "transitions/warp/phase_lines.hpp"

namespace edgewise {

Transition phase_shift() {
    Transition edge = phase_axes_edge({}, "shift theorem; Yaroslavsky 1997", false);
    edge.name = "warp.phase_shift";
    return edge;
}

}  // namespace edgewise
