// Lets a pilot choose: it runs the paths that may be fastest, for at most two seconds in all. What
// it measured is kept, so that the same request needs no second pilot.
#include <cstdio>

#include "engine/reached.hpp"
#include "planner/profile.hpp"
#include "transitions/catalogue.hpp"

int main() {
    using namespace edgewise;
    Query query;
    query.job = Job::warp;
    query.input = "phantom:gaussians:64";
    query.geometry.steps = {{GeometryStep::Kind::rotate, {10, 20, 30}}};
    query.max_error = 0.01;
    query.planner = Planner::pilot;
    query.planning_time = 2;  // [s]
    query.verify = 2048;      // samples of the result that are compared with the reference

    Listener messages;
    Reached request(ask(Engine(catalogue(), default_profile(catalogue())), query, {.runs = true}));
    request.prepare({}, messages);
    request.run_all({}, messages);

    const Answer& answer = request.planned()->answer;
    const Measured& measured = request.run->measured;
    for (const std::string& step : measured.steps) std::printf("%s\n", step.c_str());
    std::printf("chosen in %.2g s; it takes %.2g s (expected %.2g), error %.2g (expected %.2g)\n",
                answer.seconds, measured.seconds[0], answer.plan->predicted.seconds,
                measured.error->nrmse, answer.plan->predicted.error);
    return measured.error->nrmse <= 0.01 ? 0 : 1;
}
