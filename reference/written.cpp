#include "reference/written.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace edgewise {
namespace {

bool over_background(const Request& want) noexcept {
    return want.job->of_rays() && want.mode->over_background && !want.keeps_alpha;
}

}  // namespace

int written_channels(const Request& want, int delivered) noexcept {
    return over_background(want) ? 3 : delivered;
}

void as_written(const Request& want, double* values) noexcept {
    if (!over_background(want)) return;
    const double through = 1 - values[3];
    for (int c = 0; c < 3; ++c) values[c] += through * want.background[c];
}

double mean_square(const double* a, const double* b, int channels) noexcept {
    double sum = 0;
    for (int c = 0; c < channels; ++c) sum += (a[c] - b[c]) * (a[c] - b[c]);
    return sum / channels;
}

double range_of(const Request& want, double low, double high) noexcept {
    if (want.job->of_points() && want.field == Field::nearest) return 1;
    return want.range.value_or(range_between(
        low, high, want.job->of_rays() && want.mode->cancelled ? want.mode->cancelled(want) : 0));
}

}  // namespace edgewise
