#include "reference/lines.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numeric>
#include <tbb/parallel_for.h>
#include <utility>

#include "graph/errors.hpp"
#include "graph/range.hpp"
#include "reference/stored.hpp"

namespace edgewise {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Where a line crosses the lines -1, 0 ... n of a grid, one after another [file unit from its
/// nearest point].
class Crossings {
 public:
    /// @param at,along  of the line, in terms of the grid
    Crossings(double at, double along, std::int64_t n) noexcept
        : at_(at), along_(along), last_(n + 1), left_(along == 0 ? 0 : n + 2) {}

    /// The next one; infinite after the last.
    double next() const noexcept {
        if (left_ == 0) return kInfinity;
        const std::int64_t passed = last_ + 1 - left_;
        const std::int64_t index = along_ > 0 ? passed - 1 : last_ - 1 - passed;
        return (static_cast<double>(index) - at_) / along_;
    }
    void pass() noexcept { --left_; }

 private:
    double at_, along_;
    std::int64_t last_, left_;
};

}  // namespace

LineReference::LineReference(const Request& want, const RadonSetting& setting,
                             const ReferenceField& field)
    : setting_(setting),
      field_(field),
      lines_(want.input, {want.spacing[0], want.spacing[1]}, setting),
      given_range_(want.range) {}

double LineReference::sample(std::int64_t x, std::int64_t y, std::int64_t z) const {
    const Extent& n = lines_.input;
    if (x < 0 || y < 0 || x >= n.x || y >= n.y) return 0;
    return value_at(field_.samples(), x + n.x * (y + n.y * z));
}

LineReference::Line LineReference::line_of(std::int64_t angle, std::int64_t offset) const {
    const auto [cosine, sine] = setting_.direction(static_cast<int>(angle));
    const double distance = static_cast<double>(offset - lines_.middle()) * lines_.step;
    // y goes down: x cosine - y sine is the distance of all distance (cosine, -sine) + t (sine,
    // cosine).
    return {
        .x = 0.5 * static_cast<double>(lines_.input.x - 1) + distance * cosine / lines_.spacing[0],
        .y = 0.5 * static_cast<double>(lines_.input.y - 1) - distance * sine / lines_.spacing[1],
        .dx = sine / lines_.spacing[0],
        .dy = cosine / lines_.spacing[1]};
}

/// A sample without a weight does not count, whatever it is.
double LineReference::field_at(double x, double y, std::int64_t z) const {
    const double left = std::floor(x), top = std::floor(y);
    const double u = x - left, v = y - top;
    const auto i = static_cast<std::int64_t>(left), j = static_cast<std::int64_t>(top);
    double sum = 0;
    const auto add = [&](std::int64_t column, std::int64_t row, double weight) {
        if (weight > 0) sum += weight * sample(column, row, z);
    };
    add(i, j, (1 - u) * (1 - v));
    add(i + 1, j, u * (1 - v));
    add(i, j + 1, (1 - u) * v);
    add(i + 1, j + 1, u * v);
    return sum;
}

double LineReference::integral(const Line& line, std::int64_t z) const {
    Crossings columns(line.x, line.dx, lines_.input.x), rows(line.y, line.dy, lines_.input.y);
    const auto take = [&] {
        const double next = std::min(columns.next(), rows.next());
        if (columns.next() == next) columns.pass();
        if (rows.next() == next) rows.pass();
        return next;
    };
    const auto at = [&](double t) {
        return field_at(line.x + t * line.dx, line.y + t * line.dy, z);
    };
    double sum = 0, from = take();
    while (std::isfinite(from)) {
        const double to = take();
        if (!std::isfinite(to)) break;
        const double middle = 0.5 * (from + to);
        const double piece = (to - from) / 6 * (at(from) + 4 * at(middle) + at(to));
        // A piece of rounding alone spoils nothing.
        if (to - from > 1e-12 * lines_.diagonal || std::isfinite(piece)) sum += piece;
        from = to;
    }
    return std::isfinite(sum) ? sum : std::numeric_limits<double>::quiet_NaN();
}

std::vector<double> LineReference::votes(std::int64_t angle, std::int64_t z) const {
    const auto [across, down] = lines_.slopes(static_cast<int>(angle));
    const Extent& n = lines_.input;
    const double centre_x = 0.5 * static_cast<double>(n.x - 1);
    const double centre_y = 0.5 * static_cast<double>(n.y - 1);
    std::vector<double> counts(static_cast<std::size_t>(lines_.offsets), 0);
    for (std::int64_t y = 0; y < n.y; ++y)
        for (std::int64_t x = 0; x < n.x; ++x) {
            const auto value = static_cast<float>(sample(x, y, z));
            if (!(value >= static_cast<float>(setting_.threshold))) continue;
            // In this order of roundings, as samples may lie halfway between two lines.
            const double from_middle = (static_cast<double>(x) - centre_x) * across +
                                       (static_cast<double>(y) - centre_y) * down;
            const double place = from_middle + (static_cast<double>(lines_.middle()) + 0.5);
            ++counts[static_cast<std::size_t>(std::floor(place))];
        }
    return counts;
}

std::vector<double> LineReference::values(std::span<const OutputSample> samples) const {
    std::vector<double> values(samples.size());
    if (setting_.to == RadonSetting::To::sinogram) {
        tbb::parallel_for(std::size_t{0}, samples.size(), [&](std::size_t i) {
            values[i] = integral(line_of(samples[i].y, samples[i].x), samples[i].z);
        });
        return values;
    }
    // Of one angle all votes are counted at once.
    std::vector<std::size_t> order(samples.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto row = [&](std::size_t i) { return std::pair(samples[i].z, samples[i].y); };
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return row(a) < row(b); });
    std::vector<std::size_t> begins;
    for (std::size_t i = 0; i < order.size(); ++i)
        if (i == 0 || row(order[i]) != row(order[i - 1])) begins.push_back(i);
    begins.push_back(order.size());
    tbb::parallel_for(std::size_t{1}, begins.size(), [&](std::size_t group) {
        const auto [z, angle] = row(order[begins[group - 1]]);
        const std::vector<double> counts = votes(angle, z);
        for (std::size_t i = begins[group - 1]; i < begins[group]; ++i)
            values[order[i]] = counts[static_cast<std::size_t>(samples[order[i]].x)];
    });
    return values;
}

double LineReference::bytes(int threads) const noexcept {
    // What is counted of an angle; the places of samples in order are as many as the samples, which
    // the caller counts with room to spare.
    return setting_.to == RadonSetting::To::hough
               ? threads * static_cast<double>(lines_.offsets) * sizeof(double)
               : 0;
}

void LineReference::expect_affordable(double samples) const {
    constexpr double kMost = 1e12;  // values that are read: about an hour of one core
    const Extent& n = lines_.input;
    const double rows = std::min(samples, static_cast<double>(lines_.angles * n.z));
    const double steps = setting_.to == RadonSetting::To::hough
                             ? rows * static_cast<double>(n.x * n.y)
                             : samples * 12 * static_cast<double>(n.x + n.y);
    if (steps > kMost)
        throw RequestError(
            message("@verify: lines of {}x{} samples, written out, would be {:.0g} steps, which "
                    "takes hours; verify fewer samples or a part of the data",
                    n.x, n.y, steps));
}

std::optional<double> LineReference::range() const {
    if (setting_.to != RadonSetting::To::sinogram) return {};
    if (given_range_) return *given_range_ * lines_.diagonal;
    double low = kInfinity, high = -kInfinity;
    for (std::int64_t i = 0; i < field_.samples().what.samples(); ++i) {
        const double value = value_at(field_.samples(), i);
        if (!std::isfinite(value)) continue;
        low = std::min(low, value);
        high = std::max(high, value);
    }
    return range_between(low, high) * lines_.diagonal;
}

}  // namespace edgewise
