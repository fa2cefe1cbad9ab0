#include "transitions/project/trapezoid_cast.hpp"

#include "transitions/kernels/ray_cast_quadratures.hpp"
#include "transitions/project/cast_by.hpp"
#include "transitions/project/ray_cast.hpp"

namespace edgewise {
namespace {

Work work_trapezoid(const Offer& offer, const Ask& ask, int view) {
    constexpr double kPiece = 80;  // a logarithm and an exponential of 30, and two means
    Work work = ray_cast().work(offer, ask, view);
    work.operations += kPiece * samples_taken(offer, ask, view);
    work.variant = "trapezoid";
    return work;
}

void run_trapezoid(const Offer& offer, const Ask& ask, const Data& in, Data& out,
                   const Region& region, Context& context) {
    cast_by({.tile = kernels::ray_cast_trapezoid}, offer, ask, in, out, region, context);
}

}  // namespace

Transition trapezoid_cast() {
    Transition edge = preintegrated_cast();
    edge.name = "project.trapezoid_cast";
    edge.trials = {};
    edge.factors.clear();
    edge.source = "Etiene and others 2014; Wittenbrink 1993, EQ 62 and 63";
    edge.on_demand = true;  // its error is measured by runs
    edge.parameters["step"] =
        number(0.01, 4, {1, 0.5}, "distance of samples, in the smallest spacing");
    edge.work = work_trapezoid;
    edge.error = {};
    edge.model = {};
    edge.run = run_trapezoid;
    return edge;
}

}  // namespace edgewise
