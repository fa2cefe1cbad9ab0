#pragma once

#include "cli/request/job_options.hpp"
#include "cli/request/messages.hpp"
#include "engine/reached.hpp"

namespace edgewise::cli {

/// A request that was typed, with the machine and the messages that its words name.
class TypedRequest {
 public:
    /// @param options  outlives it
    /// @param runs     and is not only planned
    /// @throws RequestError, InputError
    TypedRequest(const JobOptions& options, bool runs);

    const JobOptions& options() const noexcept { return options_; }
    Reached& reached() noexcept { return reached_; }
    const Reached& reached() const noexcept { return reached_; }
    Messages& messages() noexcept { return messages_; }
    const Messages& messages() const noexcept { return messages_; }
    /// Of the process, before it took the request.
    double startup_seconds() const noexcept { return startup_seconds_; }

 private:
    const JobOptions& options_;
    double startup_seconds_;
    Messages messages_;
    Reached reached_;
};

/// Says what --log, --progress and --quiet let through.
void configure(Messages& messages, const JobOptions& options);

/// The edges, and the machine that the words name. What is guessed of its seconds is said where
/// they decide, unless the plan is shown with that.
Engine engine_of(const JobOptions& options, const Query& query, bool runs, Messages& messages);

}  // namespace edgewise::cli
