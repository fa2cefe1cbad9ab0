#include "reference/filtered.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <tbb/parallel_for.h>

#include "graph/errors.hpp"
#include "reference/stored.hpp"

namespace edgewise {

FilteredReference::FilteredReference(const Filtering& filtering, const ReferenceField& field)
    : filtering_(filtering),
      field_(field),
      places_(static_cast<double>(filtering.stencil.places(is_linear(filtering.op)))) {}

std::vector<FilteredReference::Pass> FilteredReference::passes_of(FilterOp op) {
    const Pass dilates{Rule::most, -1}, erodes{Rule::least, 1};
    switch (op) {
        case FilterOp::convolve:
            return {{Rule::sum, -1}};
        case FilterOp::correlate:
            return {{Rule::sum, 1}};
        case FilterOp::dilate:
            return {dilates};
        case FilterOp::erode:
            return {erodes};
        case FilterOp::open:
        case FilterOp::tophat:
            return {erodes, dilates};
        case FilterOp::close:
            return {dilates, erodes};
        case FilterOp::median:
            return {{Rule::middle, 1}};
    }
    return {};
}

FilteredReference::Prepared FilteredReference::prepared(int channel) const {
    const Data& data = field_.samples();
    Numbers numbers(static_cast<std::size_t>(data.what.samples()));
    tbb::parallel_for(std::size_t{0}, numbers.size(), [&](std::size_t i) {
        numbers[i] = value_at(data, static_cast<std::int64_t>(i) * data.what.channels + channel);
    });
    const std::vector<Pass> passes = passes_of(filtering_.op);
    if (passes.size() == 1) return {.samples = {}, .last = std::move(numbers)};
    Numbers between = made_everywhere(passes.front(), numbers);
    return {.samples = std::move(numbers), .last = std::move(between)};
}

double FilteredReference::made_at(const Pass& pass, const Stencil& stencil, const Numbers& in,
                                  const std::array<std::int64_t, 3>& at) const {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const Extent& n = field_.extent();
    const std::array<std::int64_t, 3> centre = stencil.centre();
    const auto from = [&](int axis, std::int64_t k) {
        return bordered(filtering_.border, at[axis] + pass.sign * (k - centre[axis]), n[axis]);
    };
    double sum = 0, magnitude = 0, most = -kInfinity, least = kInfinity;
    Numbers all;
    for (std::int64_t c = 0; c < stencil.extent.z; ++c) {
        const std::int64_t z = from(2, c);
        for (std::int64_t b = 0; b < stencil.extent.y; ++b) {
            const std::int64_t y = from(1, b);
            for (std::int64_t a = 0; a < stencil.extent.x; ++a) {
                const double weight = stencil.at(a, b, c);
                if (std::isnan(weight) || (pass.rule == Rule::sum && weight == 0)) continue;
                const std::int64_t x = from(0, a);
                const double value = x < 0 || y < 0 || z < 0
                                         ? 0
                                         : in[static_cast<std::size_t>(x + n.x * (y + n.y * z))];
                if (!std::isfinite(value)) return std::numeric_limits<double>::quiet_NaN();
                if (pass.rule == Rule::sum) {
                    sum += weight * value;
                    magnitude += std::abs(weight * value);
                }
                if (pass.rule == Rule::most) most = std::max(most, value + weight);
                if (pass.rule == Rule::least) least = std::min(least, value - weight);
                if (pass.rule == Rule::middle) all.push_back(value);
            }
        }
    }
    switch (pass.rule) {
        case Rule::sum:
            // What cancels to less than its own rounding is 0: a derivative of a constant has no
            // range of its own.
            return std::abs(sum) <= 0x1p-50 * magnitude ? 0 : sum;
        case Rule::most:
            return most;
        case Rule::least:
            return least;
        case Rule::middle:
            break;
    }
    const auto middle = all.begin() + static_cast<std::ptrdiff_t>((all.size() - 1) / 2);
    std::nth_element(all.begin(), middle, all.end());
    return *middle;
}

FilteredReference::Numbers FilteredReference::made(const Pass& pass, const Stencil& stencil,
                                                   const Numbers& in) const {
    const Extent& n = field_.extent();
    Numbers out(in.size());
    tbb::parallel_for(std::int64_t{0}, n.y * n.z, [&](std::int64_t row) {
        for (std::int64_t x = 0; x < n.x; ++x)
            out[static_cast<std::size_t>(x + n.x * row)] =
                made_at(pass, stencil, in, {x, row % n.y, row / n.y});
    });
    return out;
}

/// The extreme over a box is that over its rows, columns and lines of slices, one after another.
FilteredReference::Numbers FilteredReference::made_everywhere(const Pass& pass,
                                                              const Numbers& in) const {
    const Stencil& stencil = filtering_.stencil;
    if (!is_flat_box()) return made(pass, stencil, in);
    Numbers out = in;
    for (int axis = 0; axis < 3; ++axis) {
        Stencil line;
        line.extent[axis] = stencil.extent[axis];
        line.weights.assign(static_cast<std::size_t>(line.extent.samples()), 0);
        out = made(pass, line, out);
    }
    return out;
}

bool FilteredReference::is_flat_box() const {
    const Stencil& stencil = filtering_.stencil;
    return stencil.flat() && stencil.places(false) == stencil.extent.samples();
}

/// Values that are read.
double FilteredReference::steps(double samples) const noexcept {
    const double passes = static_cast<double>(passes_of(filtering_.op).size());
    if (passes < 2) return samples * places_;
    const Extent& box = filtering_.stencil.extent;
    const double each = is_flat_box() ? static_cast<double>(box.x + box.y + box.z) : places_;
    return static_cast<double>(field_.extent().samples()) * each + samples * places_;
}

double FilteredReference::bytes(int /*threads*/) const noexcept {
    // What is kept of each channel, and of a box what one axis makes of it.
    const double kept = passes_of(filtering_.op).size() == 1 ? 1 : 2;
    return (kept * field_.channels() + 2) * static_cast<double>(field_.extent().samples()) *
           sizeof(double);
}

void FilteredReference::expect_affordable(double samples) const {
    constexpr double kMost = 1e12;  // about an hour of one core
    if (const double steps = this->steps(samples) * field_.channels(); steps > kMost)
        throw RequestError(
            fmt::format("--verify: a kernel of {:.0f} places, written out, would be {:.0g} steps, "
                        "which takes hours; verify fewer samples, a smaller kernel or a part of "
                        "the data",
                        places_, steps));
}

std::vector<double> FilteredReference::values(std::span<const OutputSample> samples) const {
    const auto channels = static_cast<std::size_t>(field_.channels());
    std::vector<double> values(samples.size() * channels);
    for (int channel = static_cast<int>(channels_.size()); channel < field_.channels(); ++channel)
        channels_.push_back(prepared(channel));
    const Pass last = passes_of(filtering_.op).back();
    const Extent& n = field_.extent();
    tbb::parallel_for(std::size_t{0}, samples.size(), [&](std::size_t i) {
        const OutputSample& at = samples[i];
        for (std::size_t channel = 0; channel < channels; ++channel) {
            const Prepared& of = channels_[channel];
            double value = made_at(last, filtering_.stencil, of.last, {at.x, at.y, at.z});
            if (filtering_.op == FilterOp::tophat)
                value =
                    of.samples[static_cast<std::size_t>(at.x + n.x * (at.y + n.y * at.z))] - value;
            values[i * channels + channel] = value;
        }
    });
    return values;
}

}  // namespace edgewise
