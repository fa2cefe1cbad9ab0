#include "transitions/composite/back_to_front.hpp"

namespace edgewise {

Transition back_to_front_over() {
    Transition edge = over_edge(Compositing::back_to_front);
    edge.name = "composite.back_to_front";
    edge.source = "Wittenbrink 1993, Appendix B, EQ 66, TABLE 36 and 37";
    return edge;
}

}  // namespace edgewise
