#pragma once

#include "graph/range.hpp"
#include "graph/request.hpp"

namespace edgewise {

// What of an output sample is written: errors and ranges are of this, and of nothing else. Every
// measurement of an error (reference, verifier, preview) turns what edges deliver into it by
// as_written().

/// The number of delivered channels that are written. A composite goes over a background, so only
/// its colours are written.
int written_channels(const Request& want, int delivered) noexcept;

/// Turns the delivered channels of one output sample into the written ones, in place. They come
/// first; what is left over is meaningless.
void as_written(const Request& want, double* values) noexcept;

/// Mean over the written channels of the squared difference of two samples, both as_written().
double mean_square(const double* a, const double* b, int channels) noexcept;

/// What counts as an error of 1 where the reference of a request lies between two values: the range
/// that is given, else as range_between(); of labels 1.
double range_of(const Request& want, double low, double high) noexcept;

}  // namespace edgewise
