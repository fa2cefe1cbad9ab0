#pragma once

#include <optional>
#include <string>
#include <vector>

#include "graph/filtering.hpp"
#include "graph/request.hpp"
#include "io/store.hpp"
#include "request/tail.hpp"

namespace edgewise {

/// What values of a filter's result are stored as, where the format holds it.
struct FilterResult {
    store::Header header;  // the input's, with type and values of the result
    double low = 0, high = 0;
    bool keeps_sign = false;  // the type became a signed one
    std::vector<Message> notes;
};

/// Whether a kernel's weights are of both signs and add up to 0: it makes no values of its input's
/// kind, but differences.
bool is_derivative(const Stencil& kernel);

/// Integers stay of their type, but for derivatives of unsigned ones (weights of both signs that
/// add up to 0), whose sign is kept: they become signed and as wide as they may need.
/// Lengths of gradients are f32. Of other jobs nothing changes.
/// @param low,high  of the input's values
FilterResult filter_result(const Request& want, const store::Header& input, double low,
                           double high);

/// That some of a filter's values are beyond the ends of the integer type that they are written in,
/// and how many; or nothing.
std::optional<Message> cut_off_text(const Request& want, const Data& result, const Tail& tail);

}  // namespace edgewise
