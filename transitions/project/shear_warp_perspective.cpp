#include "transitions/project/shear_warp_perspective.hpp"

#include "transitions/project/shear_perspective_picture.hpp"

namespace edgewise {
namespace {

Work work(const Offer& offer, const Ask& ask, int view) {
    return perspective_work(offer, ask, view);
}

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    perspective_picture(offer, ask, in, out, region, context, nullptr);
}

}  // namespace

Transition shear_warp_perspective() {
    Transition edge;
    edge.name = "project.shear_warp_perspective";
    edge.source = "Lacroute and Levoy 1994; Schulze, Niemeier and Lang 2001";
    edge.joins = {{"object/scalar", "screen/picture"}};
    edge.parameters = perspective_parameters();
    edge.on_demand = true;  // its error is measured by runs
    edge.offer = perspective_offer;
    edge.work = work;
    edge.parts = perspective_parts;
    edge.run = run;
    return edge;
}

}  // namespace edgewise
