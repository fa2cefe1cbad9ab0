#include "reference/backprojected.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numbers>
#include <tbb/parallel_for.h>

#include "graph/errors.hpp"
#include "graph/range.hpp"
#include "reference/stored.hpp"

namespace edgewise {
namespace {

/// The transform of |f| up to half a cycle, at whole numbers.
double ramp_at(std::int64_t n) {
    if (n == 0) return 0.25;
    if (n % 2 == 0) return 0;
    return -1 /
           (std::numbers::pi * std::numbers::pi * static_cast<double>(n) * static_cast<double>(n));
}

}  // namespace

BackprojectedReference::BackprojectedReference(const Request& want, const RadonSetting& setting,
                                               const ReferenceField& field)
    : field_(field), back_(want.input, want.spacing[0], setting), given_range_(want.range) {}

double BackprojectedReference::value(const OutputSample& at) const {
    const std::int64_t offsets = back_.sinogram.x;
    const auto from_middle = [](std::int64_t i, std::int64_t n) {
        return static_cast<double>(i) - 0.5 * static_cast<double>(n - 1);
    };
    double sum = 0;
    for (std::int64_t k = 0; k < back_.sinogram.y; ++k) {
        const auto [cosine, sine] = back_.directions[static_cast<std::size_t>(k)];
        const double offset = from_middle(at.x, back_.image.x) * cosine -
                              from_middle(at.y, back_.image.y) * sine +
                              0.5 * static_cast<double>(offsets - 1);
        const double left = std::floor(offset);
        const auto i = static_cast<std::int64_t>(left);
        // Rows end at their last offsets: beyond them what is read is 0.
        const double weights[] = {i >= 0 && i < offsets ? 1 - (offset - left) : 0,
                                  i >= -1 && i + 1 < offsets ? offset - left : 0};
        double row = 0;
        for (std::int64_t m = 0; m < offsets; ++m) {
            const double ramp = weights[0] * ramp_at(i - m) + weights[1] * ramp_at(i + 1 - m);
            if (ramp != 0)
                row +=
                    ramp * value_at(field_.samples(), m + offsets * (k + back_.sinogram.y * at.z));
        }
        sum += back_.weights[static_cast<std::size_t>(k)] * row;
    }
    return sum / back_.step;
}

std::vector<double> BackprojectedReference::values(std::span<const OutputSample> samples) const {
    std::vector<double> values(samples.size());
    tbb::parallel_for(std::size_t{0}, samples.size(),
                      [&](std::size_t i) { values[i] = value(samples[i]); });
    return values;
}

double BackprojectedReference::bytes(int /*threads*/) const noexcept { return 0; }

void BackprojectedReference::expect_affordable(double samples) const {
    constexpr double kMost = 1e12;  // values that are read: about an hour of one core
    const double steps =
        samples * static_cast<double>(back_.sinogram.x) * static_cast<double>(back_.sinogram.y);
    if (steps > kMost)
        throw RequestError(
            message("@verify: a sinogram of {}x{} values, written out, would be {:.0g} steps, "
                    "which takes hours; verify fewer samples",
                    back_.sinogram.x, back_.sinogram.y, steps));
}

std::optional<double> BackprojectedReference::range() const {
    const double length = back_.step * static_cast<double>(back_.sinogram.x);
    if (given_range_) return *given_range_ / length;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (std::int64_t i = 0; i < field_.samples().what.samples(); ++i) {
        const double value = value_at(field_.samples(), i);
        if (!std::isfinite(value)) continue;
        low = std::min(low, value);
        high = std::max(high, value);
    }
    return range_between(low, high) / length;
}

}  // namespace edgewise
