#include "graph/transition.hpp"

#include <fmt/format.h>

namespace edgewise {

Error exact(const Offer&, const Ask&) { return {}; }

std::string fact_of_runs(const Transition& edge, const Parameters& with) {
    return "run/" + edge.name + with.text();
}

std::string gain_of_runs(const std::string& fact_of_runs) { return "gain/" + fact_of_runs; }

std::string Transition::views_refused(const Request& want) const {
    if (any_transform || attaches) return {};
    const std::optional<int> view = want.deformed();
    if (!view) return {};
    return fmt::format("the view '{}' is no matrix, and it takes no other",
                       want.views.at(*view).name());
}

Error Transition::error_of(const Offer& made, const Ask& ask) const {
    if (error) return error(made, ask);
    const std::string fact = fact_of_runs(*this, made.with);
    const std::optional<double> measured = ask.scene.fact(fact);
    if (!measured) return Error::unknown();
    const double gain = ask.scene.fact(gain_of_runs(fact)).value_or(1);
    return {.gain = gain, .noise_gain = gain, .bias = *measured};
}

}  // namespace edgewise
