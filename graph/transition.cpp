#include "graph/transition.hpp"

#include <fmt/format.h>

namespace edgewise {

Error exact(const Offer&, const Ask&) { return {}; }

std::string fact_of_runs(const Transition& edge, const Parameters& with) {
    return "run/" + edge.name + with.text();
}

std::string Transition::views_refused(const Request& want) const {
    if (any_transform || attaches) return {};
    const std::optional<int> view = want.deformed();
    if (!view) return {};
    return fmt::format("the view '{}' is no matrix, and it takes no other",
                       want.views.at(*view).name());
}

Error Transition::error_of(const Offer& made, const Ask& ask) const {
    if (error) return error(made, ask);
    const std::optional<double> measured = ask.scene.fact(fact_of_runs(*this, made.with));
    return measured ? Error{.bias = *measured} : Error::unknown();
}

}  // namespace edgewise
