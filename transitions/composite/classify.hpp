#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Gives each sample in screen space its light and its transparency, and combines nothing.
/// Edge    screen/scalar -> screen/classified
/// Shape   [nz, ny, nx] in; [nz, ny, nx, 4] f32 out: red, green, blue times opacity, transparency
/// Needs   what project.combine needs, no light, and a mode that composites
/// Work    a sample: that of project.combine, whose loop it is, and EQ 83 and 88; 16 bytes written
/// Error   none of its own: gains of pictures are measured from samples to pixels, and so belong to
///         the edge that composites
/// Source  [W93] Appendix B, EQ 83 and 88; EQ 53 for the length of a cell
Transition classify();

/// What it leads to.
Representation screen_classified(const Representation& from, const Request& want);

}  // namespace edgewise
