#include "cli/session/typed_session.hpp"

#include <fmt/format.h>

#include "engine/measure/machine.hpp"
#include "engine/request/quantities.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise::cli {
namespace {

/// --progressive and --stop-after; null: neither. @throws RequestError
std::shared_ptr<Refinement> refinement_of(const JobOptions& options, const RequestSpec& spec) {
    if (!options.progressive && !options.stop_after) return nullptr;
    const char* option = options.progressive ? "--progressive" : "--stop-after";
    if (spec.mode->combine != Combine::over)
        throw RequestError(
            fmt::format("{}: pictures from the front are of --mode composite, not of {}", option,
                        spec.mode->name));
    std::optional<double> limit;
    if (options.stop_after) limit = time_budget(*options.stop_after, "--stop-after");
    return std::make_shared<Refinement>(options.progressive, limit);
}

Session session_of(const JobOptions& options, Messages& messages) {
    configure(messages, options);
    Catalogue edges = catalogue();
    RequestSpec spec = spec_of(options, edges);
    const std::shared_ptr<Refinement> refinement = refinement_of(options, spec);
    if (refinement) edges = watched(std::move(edges), refinement->watch());
    Session session(std::move(spec), std::move(edges), chosen_profile(options.machine), messages);
    session.refinement = refinement;
    return session;
}

}  // namespace

TypedSession::TypedSession(const JobOptions& options)
    : options_(options),
      startup_seconds_(process_seconds()),
      session_(session_of(options, messages_)) {
    session_.explained = options.explain;
    session_.shows = options.report.has_value();
}

void configure(Messages& messages, const JobOptions& options) {
    messages.configure(options.log.value_or("warning"), options.progress.value_or("auto"),
                       options.quiet);
}

}  // namespace edgewise::cli
