#include "edgewise/edgewise.hpp"

#include <utility>

#include "engine/facts/memory_facts.hpp"
#include "graph/filtering.hpp"
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

namespace {

/// Whether all results of a filter are samples that it read.
bool only_chooses(const Filtering& filtering) {
    switch (filtering.op) {
        case FilterOp::median:
            return true;
        case FilterOp::dilate:
        case FilterOp::erode:
        case FilterOp::open:
        case FilterOp::close:
            return filtering.stencil.flat();
        default:
            return false;
    }
}

}  // namespace

Type result_type(const Prepared& plan) {
    const Representation made = plan.result();
    const Planned& planned = plan.planned();
    const auto* filtering = planned.want.setting.as<Filtering>();
    if (!filtering || is_binary(filtering->op))
        return made.values.identity() ? made.type : Type::f32;
    const Type read = planned.stored.type;
    if (only_chooses(*filtering))
        return planned.stored.values.identity() && read != Type::f16 ? read : Type::f32;
    const bool wide = bytes_of(read) >= 4 && read != Type::f32;
    return wide ? Type::f64 : Type::f32;
}

Prepared prepare(const Engine& engine, Query query, const Volume& volume, Listener& messages) {
    query.input = volume.input().name;
    query.selection = volume.input().selection;
    expect_limits(query, engine.edges());
    return prepare(engine, std::move(query),
                   Opening{.given = volume.data(),
                           .described = std::make_shared<const Input>(volume.input()),
                           .loaded = volume.read_input()},
                   {.errors = ErrorsWanted::for_choice, .front = false}, messages);
}

Prepared prepare(const Engine& engine, Query query, const Volume& volume) {
    Listener messages;
    return prepare(engine, std::move(query), volume, messages);
}

}  // namespace edgewise
