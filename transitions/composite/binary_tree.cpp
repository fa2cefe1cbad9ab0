#include "transitions/composite/binary_tree.hpp"

namespace edgewise {

Transition binary_tree_over() {
    Transition edge = over_edge(Compositing::tree_from_back);
    edge.name = "composite.binary_tree";
    edge.source = "Wittenbrink 1993, Appendix B, 2.4, TABLE 36 and 37";
    return edge;
}

}  // namespace edgewise
