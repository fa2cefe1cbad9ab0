#include "cli/session/typed_session.hpp"

#include "engine/measure/machine.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise::cli {
namespace {

Session session_of(const JobOptions& options, Messages& messages) {
    configure(messages, options);
    Catalogue edges = catalogue();
    RequestSpec spec = spec_of(options, edges);
    return Session(std::move(spec), std::move(edges), chosen_profile(options.machine), messages);
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
