#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "graph/errors.hpp"

namespace edgewise {

/// No plan serves the request within its budgets.
struct NoPlan : Exception {
    using Exception::Exception;
};

/// What values of a setting make sense: numbers, words, or either.
struct Limits {
    std::optional<double> least = {}, greatest = {};
    bool open_below = false, open_above = false;  // the end itself is out
    std::vector<std::string> allowed = {};        // words, in any case

    static Limits from(double least) { return {.least = least}; }
    static Limits above(double least) { return {.least = least, .open_below = true}; }
    static Limits between(double least, double greatest) {
        return {.least = least, .greatest = greatest};
    }
    /// Both ends are out.
    static Limits within(double least, double greatest) {
        return {.least = least, .greatest = greatest, .open_below = true, .open_above = true};
    }
    static Limits words(std::vector<std::string> allowed) {
        return {.allowed = std::move(allowed)};
    }

    bool none() const noexcept { return !least && !greatest && allowed.empty(); }
    bool hold(double number) const noexcept {
        const bool high_enough = !least || (open_below ? number > *least : number >= *least);
        return high_enough &&
               (!greatest || (open_above ? number < *greatest : number <= *greatest));
    }
};

/// A value is out of the limits of its setting, or nothing that they speak of.
class OutOfLimits : public RequestError {
 public:
    OutOfLimits(const Message& message, Limits limits)
        : RequestError(message), limits_(std::make_shared<const Limits>(std::move(limits))) {}

    const Limits& limits() const noexcept { return *limits_; }

 private:
    std::shared_ptr<const Limits> limits_;  // exceptions are copied, and that must not fail
};

}  // namespace edgewise
