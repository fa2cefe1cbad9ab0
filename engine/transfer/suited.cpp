#include "engine/transfer/suited.hpp"

#include <algorithm>
#include <fmt/format.h>

#include "engine/transfer/robust_window.hpp"

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

void shift(Transfer& transfer, double by) {
    for (Transfer::Point& point : transfer.points) point.value += by;
}

void stretch(Transfer& transfer, double low, double high) {
    for (Transfer::Point& point : transfer.points) point.value = low + point.value * (high - low);
}

}  // namespace

const char* name_of(TransferValues values) noexcept {
    constexpr const char* kNames[] = {"data", "hounsfield", "window", "range"};
    return kNames[static_cast<int>(values)];
}

Suited suited(const TransferSpec& spec, const Data& data, const Statistics& statistics,
              double spacing) {
    Suited out{spec.transfer, spec.warnings};
    if (!spec.unit_given) out.transfer.unit = spacing;
    const bool samples = data.samples.data() != nullptr;
    switch (spec.values) {
        case TransferValues::data:
            break;
        case TransferValues::hounsfield: {
            if (!samples) break;
            const std::optional<double> shifted = hounsfield_shift(data, statistics);
            if (shifted) shift(out.transfer, -*shifted);
            if (shifted && *shifted != 0)
                out.warnings.push_back(
                    fmt::format("{}: the values look like Hounsfield units plus {:g}, and are "
                                "taken for that",
                                spec.from, -*shifted));
            else if (!shifted)
                out.warnings.push_back(fmt::format(
                    "{}: is for Hounsfield units, and the values ({:.6g} to {:.6g}) do not look "
                    "like these",
                    spec.from, statistics.low, statistics.high));
            break;
        }
        case TransferValues::window: {
            const ValueWindow window = robust_window(data, statistics);
            stretch(out.transfer, window.low, window.high);
            break;
        }
        case TransferValues::range:
            stretch(out.transfer, statistics.low, statistics.high);
            break;
    }
    if (samples && !shows_any(out.transfer, statistics.low, statistics.high))
        out.warnings.push_back(
            fmt::format("{}: shows nothing: no value from {:.6g} to {:.6g} has an opacity",
                        spec.from, statistics.low, statistics.high));
    return out;
}

std::string suiting_preset(const Data& data, const Statistics& statistics,
                           const std::string& modality) {
    const bool maybe = modality.empty() || modality == "CT";
    const bool units = maybe && data.samples.data() &&
                       (modality == "CT" || hounsfield_shift(data, statistics) == 0);
    return units ? "ct-bone" : "general";
}

}  // namespace edgewise
