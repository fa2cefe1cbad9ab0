#include "planner/priced_graph.hpp"

#include <utility>

#include "planner/alike.hpp"

namespace edgewise {

PricedGraph::PricedGraph(const Catalogue& catalogue, const Ask& ask, std::vector<Source> sources,
                         const Profile& profile, const PlanOptions& options)
    : sources_(std::move(sources)),
      spanned_(expand(catalogue, ask, sources_, options.demands)),
      other_threads_(ask.want.threads != profile.processors),
      choice_{spanned_, sources_, {}, options.pinned},
      real_{spanned_, sources_, {}, options.pinned} {
    choice_.costs = price(spanned_, catalogue, ask, profile, profile.processors, options);
    if (const auto& like = ask.want.budget.like)
        choice_.alike = alike_of(choice_, catalogue, ask, *like);
    real_.alike = choice_.alike;
    real_.costs = other_threads_
                      ? price(spanned_, catalogue, ask, profile, ask.want.threads, options)
                      : choice_.costs;
}

}  // namespace edgewise
