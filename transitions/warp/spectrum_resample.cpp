#include "transitions/warp/spectrum_resample.hpp"

#include "transitions/warp/phase_lines.hpp"

namespace edgewise {

Transition spectrum_resample() {
    Transition edge = phase_axes_edge({}, "Yaroslavsky 1997", true);
    edge.name = "warp.spectrum_resample";
    return edge;
}

}  // namespace edgewise
