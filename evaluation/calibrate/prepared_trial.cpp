#include "evaluation/calibrate/prepared_trial.hpp"

namespace edgewise {
namespace {

Looked looked_at(const Trial& trial, Phantoms& phantoms, const Catalogue& edges,
                 Listener& messages) {
    const Opened opened = open(
        ask(Engine(edges, default_profile(edges)), spec_of(trial), {.given = phantoms.of(trial)}),
        messages);
    return look(opened, read(opened, messages), {.errors = ErrorsWanted::never}, messages);
}

}  // namespace

PreparedTrial::PreparedTrial(const Trial& trial, Phantoms& phantoms, const Catalogue& edges,
                             Listener& listener)
    : told(listener), looked(looked_at(trial, phantoms, edges, told)) {}

std::vector<Plan> PreparedTrial::paths(const Profile& profile) const {
    const PlanOptions options;
    const PricedGraph graph(looked.engine.edges(), looked.ask(), {{looked.stored}}, profile,
                            options);
    return all_paths(graph.real(), looked.engine.edges(), looked.ask(), options, 1000);
}

Outcome PreparedTrial::run(const Plan& plan, int threads) const {
    RunOptions how;
    how.threads = threads;
    how.arenas = &looked.engine.arenas();
    how.memory = looked.memory.get();
    how.stop = &told.stop();
    return edgewise::run(
        plan, looked.ask(), looked.input.data, [](int, const std::shared_ptr<const Data>&) {}, how);
}

}  // namespace edgewise
