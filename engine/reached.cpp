#include "engine/reached.hpp"

namespace edgewise {

void Reached::open_all(Listener& messages) { stage_ = open(*asked(), messages); }

void Reached::look_at(const Effort& effort, Listener& messages, const std::optional<InSeries>& in) {
    try {
        Input input = read(*opened(), messages);
        Looked looked = look(*opened(), std::move(input), effort, messages, in);
        stage_ = std::move(looked);
    } catch (const Infeasible& none) {
        way_out = none.way_out;
        throw;
    }
}

void Reached::price_all(const Effort& effort, Listener& messages) {
    Planned planned_now = price(std::get<Looked>(stage_), effort, messages);
    stage_ = std::move(planned_now);
    way_out = planned()->way_out;
}

void Reached::prepare(const Effort& effort, Listener& messages) {
    open_all(messages);
    look_at(effort, messages);
    price_all(effort, messages);
    expect_plan(*planned());
}

}  // namespace edgewise
