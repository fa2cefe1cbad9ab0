#include "transitions/project/shear_warp_perspective_runs.hpp"

#include "transitions/project/casting.hpp"
#include "transitions/project/shear_perspective_picture.hpp"
#include "transitions/shade/runs.hpp"

namespace edgewise {
namespace {

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (unseen_of(ask.want, from.values).empty())
        return Offer::no("no value is transparent, so that runs would hold all samples");
    return perspective_offer(from, ask, with);
}

Work work(const Offer& offer, const Ask& ask, int view) {
    return perspective_work(offer, ask, view, share_in_runs(ask));
}

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    const auto runs = runs_of_axes(in);
    perspective_picture(offer, ask, in, out, region, context, runs.get());
}

}  // namespace

Transition shear_warp_perspective_runs() {
    Transition edge;
    edge.name = "project.shear_warp_perspective_runs";
    edge.source = "Lacroute and Levoy 1994";
    edge.joins = {{"object/sliced_runs", "screen/picture"}};
    edge.parameters = perspective_parameters();
    // Its error is measured by runs. Unasked, that would nearly double the planning of every
    // composite from an eye, for a picture that is seldom as good as linear.
    edge.on_demand = true;
    edge.offer = offer;
    edge.work = work;
    edge.shared_counts = {measure_casting};
    edge.parts = perspective_parts;
    edge.run = run;
    return edge;
}

}  // namespace edgewise
