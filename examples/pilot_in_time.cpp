// Lets a pilot choose: it runs the paths that may be fastest, for at most two seconds in all. What
// it measured is kept, so that the same request needs no second pilot.
#include <cstdio>
#include <string>

#include "engine/session.hpp"
#include "planner/profile.hpp"
#include "transitions/catalogue.hpp"

int main() {
    using namespace edgewise;
    RequestSpec spec;
    spec.job = Job::warp;
    spec.input = "phantom:gaussians:64";
    spec.geometry.steps = {{GeometryStep::Kind::rotate, {10, 20, 30}}};
    spec.max_error = 0.01;
    spec.planner = Planner::pilot;
    spec.planning_time = 2;  // [s]
    spec.verify = 2048;      // samples of the result that are compared with the reference

    Listener listener;
    Session session(spec, catalogue(), default_profile(), listener);
    session.runs = true;
    take_request(session);
    make_plan(session);
    perform(session);

    const Predicted& predicted = session.answer->plan->predicted;
    const Measured& measured = *session.measured;
    for (const std::string& step : measured.steps) std::printf("%s\n", step.c_str());
    std::printf("chosen in %.2g s; it takes %.2g s (expected %.2g), error %.2g (expected %.2g)\n",
                session.answer->seconds, measured.seconds[0], predicted.seconds,
                measured.error->nrmse, predicted.error);
    return measured.error->nrmse <= 0.01 ? 0 : 1;
}
