#include "transfer/suited.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <numeric>
#include <set>
#include <unordered_set>
#include <utility>

#include "graph/errors.hpp"
#include "graph/transfer_table.hpp"
#include "reference/stored.hpp"
#include "transfer/robust_window.hpp"

namespace edgewise {
namespace {

/// Whether some value between two is seen.
bool shows_any(const Transfer& transfer, double low, double high) {
    const auto& points = transfer.points;
    return transfer.at(low)[3] > 0 || transfer.at(high)[3] > 0 ||
           std::any_of(points.begin(), points.end(), [&](const Transfer::Point& point) {
               return point.opacity > 0 && point.value >= low && point.value <= high;
           });
}

/// Steps half way between whole numbers, for the labels that are there.
void take_labels(Transfer& transfer, const Data& data, const Statistics& statistics,
                 const Message& from) {
    constexpr std::size_t kMost = 256;
    std::set<double> labels;
    const auto take = [&](double value) {
        if (!std::isfinite(value) || value == 0) return;
        if (value != std::floor(value))
            throw RequestError(
                message("{}: {:g} is no label; expected whole numbers", from, value));
        constexpr double kLargest = 1 << 23;
        if (std::abs(value) > kLargest)
            throw RequestError(message(
                "{}: label {:.0f} is beyond {:.0f}, where 32 bits do not tell neighbours apart",
                from, value, kLargest));
        labels.insert(value);
        if (labels.size() > kMost)
            throw RequestError(message("{}: more than {} labels", from, kMost));
    };
    with_stored_type(data.what.type, [&](auto zero) {
        const auto* stored = data.as<decltype(zero)>();
        const std::int64_t n = data.what.samples();
        for (std::int64_t i = 0; i < n; ++i)
            if (i == 0 || stored[i] != stored[i - 1]) take(data.what.values(as_double(stored[i])));
    });
    const double opacity = transfer.points.back().opacity;
    transfer.points = {{std::min(statistics.low, 0.0) - 0.5, 0, {0, 0, 0}}};
    std::size_t number = 0;
    for (const double label : labels) {
        const std::array<double, 3> color = label_color(number++);
        const double before = label - 0.5, after = label + 0.5;
        transfer.points.push_back({before, transfer.points.back().opacity, color});
        if (transfer.points[transfer.points.size() - 2].value != before)
            transfer.points.back().opacity = 0;
        transfer.points.push_back({before, opacity, color});
        transfer.points.push_back({after, opacity, color});
        transfer.points.push_back({after, 0, color});
    }
}

}  // namespace

const char* name_of(TransferValues values) noexcept {
    constexpr const char* kNames[] = {"data", "hounsfield", "window", "range", "labels"};
    return kNames[static_cast<int>(values)];
}

double size_share(const Extent& extent, const Vec3& spacing) noexcept {
    constexpr double kPatient = 0.3, kStructure = 3.16;  // [mm]
    const double least = spacing.minCoeff();
    if (!(least < kPatient) || !(least > 0)) return 1;
    std::array<double, 3> sides;
    for (int axis = 0; axis < 3; ++axis)
        sides[static_cast<std::size_t>(axis)] = static_cast<double>(extent[axis]) * spacing[axis];
    std::sort(sides.begin(), sides.end());
    const double between = std::sqrt(sides[1] * least);
    // Lengths that were divided by a hundred are in the same class but for their rounding.
    constexpr double kRounding = 1e-9;
    const double tens = std::floor(std::log10(between / kStructure) + kRounding);
    return std::pow(10.0, std::min(0.0, tens));
}

namespace {

/// Lengths of a patient's scan in mm become those of this one, in its own unit.
void take_size(Suited& out, const TransferSpec& spec, double share, double millimetres) {
    out.transfer.unit *= share / millimetres;
    for (Transfer::Edge& edge : out.transfer.edges) edge.magnitude *= millimetres / share;
    if (share < 1)
        out.notices.push_back(
            message("{}: opacities are for {:.4g} mm, {:g} of a patient's, as what is scanned "
                    "seems to be so much smaller",
                    spec.from, spec.transfer.unit * share, share));
}

}  // namespace

Suited suited(const TransferSpec& spec, const Data& data, const Statistics& statistics,
              const Vec3& spacing, double millimetres, const Glance* glance) {
    const bool looks =
        spec.values == TransferValues::hounsfield || spec.values == TransferValues::window;
    if (looks && !glance) {
        const Glance own = glance_at(data, statistics);
        return suited(spec, data, statistics, spacing, millimetres, &own);
    }
    Suited out{spec.transfer, spec.warnings, {}, {}};
    if (!spec.unit_given) out.transfer.unit = spacing.minCoeff();
    if (spec.by_size)
        take_size(out, spec, size_share(data.what.extent, millimetres * spacing), millimetres);
    const bool samples = data.samples.data() != nullptr;
    switch (spec.values) {
        case TransferValues::data:
            break;
        case TransferValues::hounsfield: {
            if (!samples) break;
            const std::optional<double> shifted = glance->hounsfield;
            if (shifted) rescale(out.transfer, -*shifted, 1);
            if (shifted && *shifted != 0)
                out.warnings.push_back(
                    message("{}: the values look like Hounsfield units plus {:g}, and are "
                            "taken for that",
                            spec.from, -*shifted));
            else if (!shifted)
                out.warnings.push_back(message(
                    "{}: is for Hounsfield units, and the values ({:.6g} to {:.6g}) do not look "
                    "like these",
                    spec.from, statistics.low, statistics.high));
            break;
        }
        case TransferValues::window: {
            const ValueWindow& window = glance->window;
            rescale(out.transfer, window.low, window.high - window.low);
            break;
        }
        case TransferValues::labels:
            if (samples) take_labels(out.transfer, data, statistics, spec.from);
            break;
        case TransferValues::range:
            rescale(out.transfer, statistics.low, statistics.high - statistics.low);
            break;
    }
    out.transfer = completed(std::move(out.transfer));
    if (spec.values == TransferValues::window)
        out.window = glance->window;
    else if (spec.values == TransferValues::range || out.transfer.points.empty())
        out.window = {statistics.low, statistics.high};
    else
        out.window = {out.transfer.points.front().value, out.transfer.points.back().value};
    if (samples && !shows_any(out.transfer, statistics.low, statistics.high))
        out.warnings.push_back(
            message("{}: shows nothing: no value from {:.6g} to {:.6g} has an opacity", spec.from,
                    statistics.low, statistics.high));
    return out;
}

std::array<double, 3> label_color(std::size_t number) noexcept {
    constexpr double kTurn = 0.61803398874989485;  // of the circle of hues, the golden ratio
    const double hue = 6 * std::fmod(0.08 + kTurn * static_cast<double>(number), 1.0);
    const double light = number % 2 == 0 ? 0.95 : 0.75;
    std::array<double, 3> color;
    for (std::size_t c = 0; c < 3; ++c) {
        const double away = std::fmod(5 - 2 * static_cast<double>(c) + hue, 6.0);
        color[c] = light * (1 - 0.65 * std::clamp(std::min(away, 4 - away), 0.0, 1.0));
    }
    return color;
}

Suited label_colors(const Message& from, const Data& data, double outside,
                    const std::function<std::optional<std::array<double, 3>>(double value)>& own) {
    Suited out;
    out.transfer.points = {{0, 1, {1, 1, 1}}};
    if (!data.samples.data()) return out;
    std::unordered_set<double> found;
    double last = outside;
    for (std::int64_t i = 0; i < data.what.samples(); ++i) {
        const double value = value_at(data, i);
        if (value == last || value == outside || !std::isfinite(value)) continue;
        last = value;
        found.insert(value);
    }
    if (found.empty()) {
        out.warnings.push_back(
            message("{}: all samples are {:g}, so there is no surface", from, outside));
        return out;
    }
    std::vector<double> labels(found.begin(), found.end());
    std::sort(labels.begin(), labels.end());
    // Steps half way from one to the next.
    out.transfer.points.clear();
    for (std::size_t i = 0; i < labels.size(); ++i) {
        const std::array<double, 3> color = own(labels[i]).value_or(label_color(i));
        const double before = i > 0 ? std::midpoint(labels[i - 1], labels[i]) : labels[i],
                     after = i + 1 < labels.size() ? std::midpoint(labels[i], labels[i + 1])
                                                   : labels[i];
        out.transfer.points.push_back({before, 1, color});
        out.transfer.points.push_back({after, 1, color});
    }
    return out;
}

}  // namespace edgewise
