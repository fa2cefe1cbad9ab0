#include "transitions/composite/attenuated_sum.hpp"

namespace edgewise {

Transition attenuated_sum() {
    Transition edge = over_edge(Compositing::sum);
    edge.name = "composite.attenuated_sum";
    edge.source = "Wittenbrink 1993, Appendix B, EQ 91, TABLE 36 and 37";
    return edge;
}

}  // namespace edgewise
