#include "request/describe.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

#include "graph/errors.hpp"
#include "graph/picture_facts.hpp"
#include "request/numbers.hpp"

namespace edgewise {
namespace {

constexpr std::int64_t kLargestSide = 1 << 20;
constexpr const char* kForm = "describe:WxH[xD]:TYPE[:spacing=S[,S,S]][:occupied=F][:spectrum=E]";

void take_key(Described& described, const std::string& name, const std::string& pair) {
    const std::size_t equals = pair.find('=');
    const std::string key = pair.substr(0, equals);
    if (equals == std::string::npos || (key != "spacing" && key != "occupied" && key != "spectrum"))
        throw RequestError(
            fmt::format("{}: '{}' is none of spacing=, occupied=, spectrum=", name, pair));
    const std::vector<double> values = numbers_of(name, pair.substr(equals + 1));
    const std::size_t axes = described.volume ? 3 : 2;
    if (key == "spacing" ? values.size() != 1 && values.size() != axes : values.size() != 1)
        throw RequestError(fmt::format("{}: {} takes 1{} number", name, key,
                                       key == "spacing" ? fmt::format(" or {}", axes) : ""));
    const double least = *std::min_element(values.begin(), values.end());
    if (!(least > 0) || (key == "occupied" && least > 1))
        throw RequestError(fmt::format("{}: {}: {} is not {}", name, key, least,
                                       key == "occupied" ? "from 0 to 1" : "greater than 0"));
    if (key == "occupied") described.occupied = values[0];
    if (key == "spectrum") described.spectrum = values[0];
    if (key == "spacing")
        for (std::size_t axis = 0; axis < axes; ++axis)
            described.spacing[axis] = values[values.size() == 1 ? 0 : axis];
}

/// Error power of a hold at a frequency [cycles/sample]: what it loses of it, and what repeats.
struct HoldErrors {
    double zoh, foh, bspline3;
};

HoldErrors errors_at(double frequency) {
    const double x = std::numbers::pi * frequency;
    const double sinc = x > 1e-9 ? std::sin(x) / x : 1;
    const auto cosine = [&](int k) { return std::cos(2 * x * k); };
    // Sums over all repeats of sinc^2, sinc^4 and sinc^8: the samples of B-splines of degree 1, 3
    // and 7.
    const double fourth = (2 + cosine(1)) / 3;
    const double eighth = (2416 + 2382 * cosine(1) + 240 * cosine(2) + 2 * cosine(3)) / 5040;
    const double spline = std::pow(sinc, 4) / fourth;
    return {2 - 2 * sinc, 1 - 2 * sinc * sinc + fourth,
            1 - 2 * spline + eighth / (fourth * fourth)};
}

/// Mean error power along one axis, of a radial spectrum of power 1.
HoldErrors mean_errors(const Described& described) {
    constexpr int kSteps = 512;
    const double e = described.spectrum;
    const double band = e > 1 ? 0.5 : 0.5 * e;
    // The lowest frequencies of a falling spectrum are those of the longest side.
    const double lowest =
        1.0 /
        static_cast<double>(std::max({described.extent.x, described.extent.y, described.extent.z}));
    HoldErrors sum{0, 0, 0};
    double power = 0;
    for (int i = 0; i < kSteps; ++i) {
        const double from = std::min(lowest, band / 2);
        const double f = from * std::pow(band / from, (i + 0.5) / kSteps);  // even in log f
        const double weight = f * (e > 1 ? std::pow(f, -e) : 1);
        const HoldErrors at = errors_at(f);
        power += weight;
        sum.zoh += weight * at.zoh;
        sum.foh += weight * at.foh;
        sum.bspline3 += weight * at.bspline3;
    }
    return {sum.zoh / power, sum.foh / power, sum.bspline3 / power};
}

}  // namespace

Described described_by(const std::string& name) {
    const auto words = split(name, ':');
    if (words.size() < 3) throw RequestError(fmt::format("{}: expected {}", name, kForm));
    Described described;
    const auto sides = split(words[1], 'x');
    if (sides.size() != 2 && sides.size() != 3)
        throw RequestError(fmt::format("{}: '{}' is no size; expected {}", name, words[1], kForm));
    described.volume = sides.size() == 3;
    for (std::size_t axis = 0; axis < sides.size(); ++axis)
        described.extent[static_cast<int>(axis)] = whole_of(name, sides[axis], 1, kLargestSide);
    described.type = type_named(words[2]);
    if (described.type == Type::c64)
        throw RequestError(fmt::format("{}: c64 samples have no order", name));
    for (std::size_t i = 3; i < words.size(); ++i) take_key(described, name, words[i]);
    return described;
}

store::Header header_of(const std::string& name, const Described& described) {
    store::Header header;
    header.file = name;
    header.format = "describe";
    header.volume = described.volume;
    header.extent = described.extent;
    header.type = described.type;
    header.spacing = described.spacing;
    return header;
}

Statistics described_statistics(const Described& described, const store::Header& header) {
    Statistics statistics;
    statistics.high = is_integer(header.type) ? limits_of(header.type)[1] : 1;
    statistics.mean = statistics.high / 4;
    statistics.highest = header.extent.samples() - 1;
    statistics.occupied = Region::all(header.extent);
    statistics.occupied_fraction = described.occupied;
    return statistics;
}

Scene described_scene(const Described& described, const store::Header& header) {
    const Statistics statistics = described_statistics(described, header);
    Scene scene{.low = statistics.low, .high = statistics.high, .mean = statistics.mean};
    scene.occupied = statistics.occupied;
    scene.occupied_fraction = described.occupied;
    scene.range = statistics.high - statistics.low;
    // Values spread evenly over the range deviate by range / sqrt(12); so do most scans within 2x.
    const double deviation = scene.range / std::sqrt(12.0);
    const HoldErrors power = mean_errors(described);
    const double axes = described.volume ? 3 : 2;
    const auto error = [&](double each) {
        return deviation * std::sqrt(std::min(axes * each, 2.0));
    };
    scene.facts[kFieldError("zoh")] = error(power.zoh);
    scene.facts[kFieldError("foh")] = error(power.foh);
    scene.facts[kFieldError("bspline3")] = error(power.bspline3);
    return scene;
}

}  // namespace edgewise
