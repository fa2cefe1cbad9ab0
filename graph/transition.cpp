#include "graph/transition.hpp"

#include <fmt/format.h>

namespace edgewise {
namespace {

constexpr FactFamily kRun{"run"}, kGain{"gain"}, kResult{"result"};

}  // namespace

Error exact(const Offer&, const Ask&) { return {}; }

FactName fact_of_runs(const Transition& edge, const Parameters& with) {
    return fact_of_runs(edge.name, with);
}

FactName fact_of_runs(const std::string& edge, const Parameters& with) {
    return kRun(edge + with.text());
}

FactName fact_of_runs(const std::string& edge, const Parameters& with, Type made) {
    return kRun(fmt::format("{}{} of {}", edge, with.text(), name_of(made)));
}

FactName gain_of_runs(const FactName& fact_of_runs) { return kGain(fact_of_runs.text()); }

bool is_of_results(std::string_view fact) {
    return kRun.has(fact) || kResult.has(fact) || fact == kWritten.name;
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
    const FactName fact = fact_of_runs(*this, made.with);
    const std::optional<double> measured = ask.scene.fact(fact);
    if (!measured) return Error::unknown();
    const double gain = ask.scene.fact(gain_of_runs(fact)).value_or(1);
    return {.gain = gain, .noise_gain = gain, .bias = *measured};
}

const Joins& Catalogue::joins() const {
    std::call_once(joins_->once, [&] { joins_->joins.emplace(*this); });
    return *joins_->joins;
}

}  // namespace edgewise
