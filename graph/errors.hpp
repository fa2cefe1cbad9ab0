#pragma once

#include <stdexcept>
#include <string>

namespace edgewise {

/// The request or the command line makes no sense; names the argument, its value, what was
/// expected.
struct RequestError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// An input cannot be read; names the file, what was wrong, and where.
struct InputError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// A step failed while it ran (not for lack of memory, which is std::bad_alloc).
struct RunError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Thrown by a step that noticed Context::stop; never an error of its own.
struct Cancelled : std::runtime_error {
    Cancelled() : std::runtime_error("cancelled") {}
};

}  // namespace edgewise
