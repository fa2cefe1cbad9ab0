#include "cli/session/typed_request.hpp"

#include <fmt/format.h>

#include "cli/request/user_folders.hpp"
#include "measure/machine.hpp"
#include "request/quantities.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise::cli {
namespace {

/// --progressive and --stop-after; null: neither. @throws RequestError
std::shared_ptr<Refinement> refinement_of(const JobOptions& options, const Query& query) {
    if (!options.progressive && !options.stop_after) return nullptr;
    const char* option = options.progressive ? "--progressive" : "--stop-after";
    if (query.mode->combine != Combine::over)
        throw RequestError(
            fmt::format("{}: pictures from the front are of --mode composite, not of {}", option,
                        query.mode->name));
    std::optional<double> limit;
    if (options.stop_after) limit = time_budget(*options.stop_after, "--stop-after");
    return std::make_shared<Refinement>(options.progressive, limit);
}

Engine engine_with(Catalogue edges, const JobOptions& options, const Query& query, bool runs,
                   Messages& messages) {
    Profile machine = chosen_profile(options.machine, edges);
    if (query.max_time && !options.explain && runs && is_built_in(machine))
        messages.notice(
            "--max-time: seconds are guesses of the built-in profile; `edgewise calibrate` "
            "measures this machine");
    return user_engine(std::move(edges), std::move(machine));
}

Asked asked_by(const JobOptions& options, bool runs, Messages& messages) {
    configure(messages, options);
    Catalogue edges = catalogue();
    Query query = spec_of(options, edges);
    const std::shared_ptr<Refinement> refinement = refinement_of(options, query);
    if (refinement) edges = watched(std::move(edges), refinement->watch());
    const Engine engine = engine_with(std::move(edges), options, query, runs, messages);
    return ask(engine, std::move(query),
               {.runs = runs, .shows = options.report.has_value(), .refinement = refinement});
}

}  // namespace

TypedRequest::TypedRequest(const JobOptions& options, bool runs)
    : options_(options),
      startup_seconds_(process_seconds()),
      reached_(asked_by(options, runs, messages_)) {}

Engine engine_of(const JobOptions& options, const Query& query, bool runs, Messages& messages) {
    return engine_with(catalogue(), options, query, runs, messages);
}

void configure(Messages& messages, const JobOptions& options) {
    messages.configure(options.log.value_or("warning"), options.progress.value_or("auto"),
                       options.quiet);
}

}  // namespace edgewise::cli
