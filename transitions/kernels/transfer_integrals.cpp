#include "transitions/kernels/transfer_integrals.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace edgewise::kernels {

std::array<double, 4> optics_at(const Optics& optics, double stored) {
    constexpr double kMostDepth = 100;  // nothing is left of an opaque unit
    std::array<double, 4> at{optics.opacity, optics.color[0], optics.color[1], optics.color[2]};
    for (const OpticsRamp& ramp : optics.ramps) {
        const double along = std::clamp(
            (stored - static_cast<double>(ramp.start)) * static_cast<double>(ramp.inverse_width),
            0.0, 1.0);
        at[0] += along * static_cast<double>(ramp.opacity);
        for (std::size_t c = 0; c < 3; ++c) at[c + 1] += along * static_cast<double>(ramp.color[c]);
    }
    const double opacity = std::clamp(at[0], 0.0, 1.0);
    at[0] = std::min(kMostDepth, -std::log1p(-opacity)) / optics.unit;
    return at;
}

TransferIntegrals transfer_integrals_of(const Optics& optics) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const OpticsRamp& ramp : optics.ramps) {
        const double start = ramp.start;
        low = std::min(low, start);
        high = std::max(high, start + 1 / static_cast<double>(ramp.inverse_width));
    }
    if (!(low < high)) {  // one value throughout
        if (!std::isfinite(low)) low = 0;
        high = low + 1;
    }
    // A cell beyond either end, where all goes on evenly.
    constexpr int kInner = TransferIntegrals::kCells - 2;
    const double width = (high - low) / kInner;
    TransferIntegrals integrals;
    integrals.first = static_cast<float>(low - width);
    integrals.per_number = static_cast<float>(1 / width);
    integrals.width = static_cast<float>(width);
    std::array<double, 4> sum{};
    integrals.knots.reserve(TransferIntegrals::kCells + 1);
    for (int i = 0; i <= TransferIntegrals::kCells; ++i) {
        std::array<float, 4> knot;
        for (std::size_t c = 0; c < 4; ++c) knot[c] = static_cast<float>(sum[c]);
        integrals.knots.push_back(knot);
        constexpr int kPieces = 8;
        for (int piece = 0; piece < kPieces; ++piece) {
            const double at = low + (i - 1 + (piece + 0.5) / kPieces) * width;
            const std::array<double, 4> here = optics_at(optics, at);
            sum[0] += here[0] * width / kPieces;
            for (std::size_t c = 1; c < 4; ++c) sum[c] += here[0] * here[c] * width / kPieces;
        }
    }
    return integrals;
}

}  // namespace edgewise::kernels
