#include "edgewise/edgewise.hpp"

#include <utility>

#include "engine/measure/machine.hpp"
#include "engine/reached.hpp"

namespace edgewise {

Engine default_engine() { return {catalogue(), chosen_profile({})}; }

Prepared prepare(const Engine& engine, Query query, const Volume& volume, Listener& messages) {
    query.input = volume.input().name;
    query.selection = volume.input().selection;
    const Opening as{.runs = true,
                     .keeps_samples = true,
                     .guest = true,
                     .given = volume.data(),
                     .described = std::make_shared<const Input>(volume.input())};
    Reached reached(ask(engine, std::move(query), as));
    reached.prepare({.errors = ErrorsWanted::for_choice, .front = false}, messages);
    return Prepared(std::move(reached.plan()));
}

Prepared prepare(const Engine& engine, Query query, const Volume& volume) {
    Listener messages;
    return prepare(engine, std::move(query), volume, messages);
}

}  // namespace edgewise
