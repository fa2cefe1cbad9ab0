#include "edgewise/edgewise.hpp"

#include <utility>

#include "engine/facts/memory_facts.hpp"
#include "measure/machine.hpp"
#include "request/input.hpp"

namespace edgewise {
namespace {

const Catalogue& all_edges() {
    static const Catalogue edges = catalogue();
    return edges;
}

}  // namespace

Query query_of(Job job, const std::vector<Given>& given) {
    return query_of(job, given, all_edges());
}

void set(Query& query, std::string_view name, const SettingValue& value) {
    set(query, name, value, all_edges());
}

Engine default_engine(const std::string& folder) {
    Catalogue edges = catalogue();
    Profile machine = profile_in(folder, edges);
    return {std::move(edges), std::move(machine), std::make_shared<MemoryFacts>()};
}

Prepared prepare(const Engine& engine, Query query, const Volume& volume, Listener& messages) {
    query.input = volume.input().name;
    query.selection = volume.input().selection;
    return prepare(
        engine, std::move(query),
        Opening{.given = volume.data(), .described = std::make_shared<const Input>(volume.input())},
        {.errors = ErrorsWanted::for_choice, .front = false}, messages);
}

Prepared prepare(const Engine& engine, Query query, const Volume& volume) {
    Listener messages;
    return prepare(engine, std::move(query), volume, messages);
}

}  // namespace edgewise
