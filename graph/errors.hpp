#pragma once

#include <memory>
#include <stdexcept>
#include <string>

#include "graph/message.hpp"

namespace edgewise {

/// What went wrong, as data. what() says it in the voice of the library; message() names the
/// settings that it is about.
class Exception : public std::runtime_error {
 public:
    explicit Exception(Message message)
        : std::runtime_error(message.text()),
          message_(std::make_shared<const Message>(std::move(message))) {}

    const Message& message() const noexcept { return *message_; }

 private:
    std::shared_ptr<const Message> message_;  // exceptions are copied, and that must not fail
};

/// The request or the command line makes no sense; names the setting, its value, what was
/// expected.
struct RequestError : Exception {
    using Exception::Exception;

    /// The setting that is wrong, or "": the message names none.
    std::string field() const { return first().field; }
    /// The value that it has in the message, or "".
    std::string value() const { return first().value; }

 private:
    Setting first() const {
        const std::vector<Setting> settings = message().settings();
        return settings.empty() ? Setting{} : settings.front();
    }
};

/// An input cannot be read; names the file, what was wrong, and where.
struct InputError : Exception {
    using Exception::Exception;
};

/// A step failed while it ran (not for lack of memory, which is std::bad_alloc).
struct RunError : Exception {
    using Exception::Exception;
};

/// Thrown by a step that noticed Context::stop; never an error of its own.
struct Cancelled : std::runtime_error {
    Cancelled() : std::runtime_error("cancelled") {}
};

}  // namespace edgewise
