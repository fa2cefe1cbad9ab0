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
      places_(static_cast<double>(filtering.stencil.places(is_linear(filtering.op)))) {
    if (filtering.op != FilterOp::gradient) return;
    places_ = 0;
    for (const Stencil& one : filtering.derivatives)
        places_ += static_cast<double>(one.places(true));
}

std::vector<FilteredReference::Pass> FilteredReference::passes_of(FilterOp op) {
    const Pass dilates{Rule::most, -1}, erodes{Rule::least, 1};
    switch (grey_of(op)) {
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
        default:
            return {{Rule::sum, 1}};
    }
}

/// Of a mask 1 and 0.
double FilteredReference::sample_value(const Data& data, std::int64_t number) const {
    const double value = value_at(data, number);
    if (!is_binary(filtering_.op)) return value;
    return value == 0 || std::isnan(value) ? 0 : 1;
}

FilteredReference::Prepared FilteredReference::prepared(int channel) const {
    const Data& data = field_.samples();
    Numbers numbers(static_cast<std::size_t>(data.what.samples()));
    tbb::parallel_for(std::size_t{0}, numbers.size(), [&](std::size_t i) {
        numbers[i] =
            sample_value(data, static_cast<std::int64_t>(i) * data.what.channels + channel);
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
                if (pass.rule == Rule::middle && std::isnan(value)) continue;
                if (pass.rule != Rule::middle && !std::isfinite(value))
                    return std::numeric_limits<double>::quiet_NaN();
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
    if (all.empty()) return std::numeric_limits<double>::quiet_NaN();
    const auto middle = all.begin() + static_cast<std::ptrdiff_t>((all.size() - 1) / 2);
    std::nth_element(all.begin(), middle, all.end());
    return *middle;
}

double FilteredReference::gradient_at(const Numbers& in,
                                      const std::array<std::int64_t, 3>& at) const {
    double squares = 0;
    for (const Stencil& along : filtering_.derivatives) {
        const double derivative = made_at({Rule::sum, 1}, along, in, at);
        squares += derivative * derivative;
    }
    return std::sqrt(squares);
}

/// Every result within reach says by itself whether it read the sample: by one place of the kernel
/// or by several.
double FilteredReference::adjoint_at(const Pass& pass, const Prepared& of,
                                     const std::array<std::int64_t, 3>& at) const {
    const Numbers& in = of.last;
    const Stencil& stencil = filtering_.stencil;
    const Extent& n = field_.extent();
    const auto centre = stencil.centre();
    const int first_sign = -pass.sign;
    double most = -std::numeric_limits<double>::infinity();
    bool is_read = false;
    std::array<std::int64_t, 3> k{};
    for (k[2] = 0; k[2] < stencil.extent.z; ++k[2])
        for (k[1] = 0; k[1] < stencil.extent.y; ++k[1])
            for (k[0] = 0; k[0] < stencil.extent.x; ++k[0]) {
                const double weight = stencil.at(k[0], k[1], k[2]);
                if (std::isnan(weight)) continue;
                // Along each axis: results that read `at` by this place of the kernel.
                std::array<std::vector<std::int64_t>, 3> readers;
                for (int axis = 0; axis < 3; ++axis) {
                    const auto i = static_cast<std::size_t>(axis);
                    const std::int64_t reach = stencil.extent[axis];
                    const auto add = [&](std::int64_t low, std::int64_t high) {
                        for (std::int64_t p = std::max<std::int64_t>(low, 0);
                             p <= std::min(high, n[axis] - 1); ++p)
                            if (bordered(filtering_.border, p + first_sign * (k[i] - centre[i]),
                                         n[axis]) == at[i])
                                readers[i].push_back(p);
                    };
                    if (reach >= n[axis])
                        add(0, n[axis] - 1);
                    else
                        add(at[i] - reach, at[i] + reach);
                }
                for (const std::int64_t z : readers[2])
                    for (const std::int64_t y : readers[1])
                        for (const std::int64_t x : readers[0]) {
                            const double value =
                                in[static_cast<std::size_t>(x + n.x * (y + n.y * z))];
                            if (!std::isfinite(value))
                                return std::numeric_limits<double>::quiet_NaN();
                            is_read = true;
                            most = std::max(
                                most, pass.rule == Rule::most ? value + weight : weight - value);
                        }
            }
    if (!is_read) return of.samples[static_cast<std::size_t>(at[0] + n.x * (at[1] + n.y * at[2]))];
    return pass.rule == Rule::most ? most : -most;
}

double FilteredReference::result_at(const Prepared& of,
                                    const std::array<std::int64_t, 3>& at) const {
    if (filtering_.op == FilterOp::gradient) return gradient_at(of.last, at);
    const std::vector<Pass> passes = passes_of(filtering_.op);
    const Extent& n = field_.extent();
    const Extent& box = filtering_.stencil.extent;
    bool near_border = false;
    for (int axis = 0; axis < 3; ++axis) {
        const auto k = static_cast<std::size_t>(axis);
        near_border =
            near_border || (box[axis] > 1 && (at[k] < box[axis] || at[k] + box[axis] >= n[axis]));
    }
    // Far from borders the two definitions are one.
    const bool adjoins =
        passes.size() > 1 && near_border &&
        (filtering_.border == Border::mirror || filtering_.border == Border::clamp);
    double value = adjoins ? adjoint_at(passes.back(), of, at)
                           : made_at(passes.back(), filtering_.stencil, of.last, at);
    if (filtering_.op == FilterOp::tophat)
        value = of.samples[static_cast<std::size_t>(at[0] + n.x * (at[1] + n.y * at[2]))] - value;
    return is_binary(filtering_.op) ? filtering_.inside * value : value;
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
            message("@verify: a kernel of {:.0f} places, written out, would be {:.0g} steps, which "
                    "takes hours; verify fewer samples, a smaller kernel or a part of the data",
                    places_, steps));
}

std::vector<double> FilteredReference::values(std::span<const OutputSample> samples) const {
    const auto channels = static_cast<std::size_t>(field_.channels());
    std::vector<double> values(samples.size() * channels);
    for (int channel = static_cast<int>(channels_.size()); channel < field_.channels(); ++channel)
        channels_.push_back(prepared(channel));
    tbb::parallel_for(std::size_t{0}, samples.size(), [&](std::size_t i) {
        const OutputSample& at = samples[i];
        for (std::size_t channel = 0; channel < channels; ++channel)
            values[i * channels + channel] = result_at(channels_[channel], {at.x, at.y, at.z});
    });
    return values;
}

}  // namespace edgewise
