#include "engine/calibrate/prepared_trial.hpp"

namespace edgewise {

PreparedTrial::PreparedTrial(const Trial& trial, Phantoms& phantoms, const Catalogue& edges,
                             Listener& listener)
    : told(listener), session(spec_of(trial), edges, default_profile(), told) {
    session.errors = ErrorsWanted::never;
    session.given = phantoms.of(trial);
    take_request(session);
}

std::vector<Plan> PreparedTrial::paths(const Profile& profile) const {
    const PricedGraph graph(session.edges, session.ask(), {{session.input->data->what}}, profile,
                            session.plan_options);
    return all_paths(graph.real(), session.edges, session.ask(), session.plan_options, 1000);
}

Outcome PreparedTrial::run(const Plan& plan, int threads) const {
    RunOptions how;
    how.threads = threads;
    how.memory = session.memory.get();
    how.stop = &session.messages.stop();
    return edgewise::run(
        plan, session.ask(), session.input->data, [](int, const std::shared_ptr<const Data>&) {},
        how);
}

}  // namespace edgewise
