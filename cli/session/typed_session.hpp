#pragma once

#include "cli/request/job_options.hpp"
#include "cli/request/messages.hpp"
#include "engine/session.hpp"

namespace edgewise::cli {

/// The session of a request that was typed, with the machine and the messages that its words name.
class TypedSession {
 public:
    /// @param options  outlives it. @throws RequestError, InputError
    explicit TypedSession(const JobOptions& options);

    const JobOptions& options() const noexcept { return options_; }
    Session& operator*() noexcept { return session_; }
    Session* operator->() noexcept { return &session_; }
    const Session& operator*() const noexcept { return session_; }
    const Session* operator->() const noexcept { return &session_; }
    Messages& messages() noexcept { return messages_; }
    /// Of the process, before it took the request.
    double startup_seconds() const noexcept { return startup_seconds_; }

 private:
    const JobOptions& options_;
    double startup_seconds_;
    Messages messages_;
    Session session_;
};

/// Says what --log, --progress and --quiet let through.
void configure(Messages& messages, const JobOptions& options);

}  // namespace edgewise::cli
