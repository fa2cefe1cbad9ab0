#include "graph/transition.hpp"

namespace edgewise {

Error exact(const Offer&, const Ask&) { return {}; }

std::string fact_of_runs(const Transition& edge, const Parameters& with) {
    return "run/" + edge.name + with.text();
}

Error Transition::error_of(const Offer& made, const Ask& ask) const {
    if (error) return error(made, ask);
    const std::optional<double> measured = ask.scene.fact(fact_of_runs(*this, made.with));
    return measured ? Error{.bias = *measured} : Error::unknown();
}

}  // namespace edgewise
