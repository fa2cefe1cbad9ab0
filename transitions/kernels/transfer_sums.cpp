#include "transitions/kernels/transfer_sums.hpp"

#include <algorithm>
#include <cmath>

#include "transitions/kernels/transfer_integrals.hpp"

namespace edgewise::kernels {
namespace {

/// Where a function bends or jumps, ascending.
SmallVector<double> bends_of(const Optics& optics) {
    constexpr double kJump = 1e-29;  // what is narrower was written for a jump
    SmallVector<double> bends;
    for (const OpticsRamp& ramp : optics.ramps) {
        const double start = ramp.start, width = 1 / static_cast<double>(ramp.inverse_width);
        bends.push_back(start);
        if (width > kJump) bends.push_back(start + width);
    }
    std::sort(bends.begin(), bends.end());
    return bends;
}

/// Adds what the function has between two numbers, where it neither bends nor jumps.
void add_smooth(const Optics& optics, double from, double to, std::array<double, 4>& sum) {
    const double half = (to - from) / 2, apart = half / std::sqrt(3.0);  // Gauss, two points
    for (const double at : {from + half - apart, from + half + apart}) {
        const std::array<double, 4> here = optics_at(optics, at);
        sum[0] += here[0] * half;
        for (std::size_t c = 1; c < 4; ++c) sum[c] += here[0] * here[c] * half;
    }
}

/// The same in four parts (an opacity near 1 has a steep logarithm), and cut at the bends.
void add_between(const Optics& optics, const SmallVector<double>& bends, double from, double to,
                 std::array<double, 4>& sum) {
    constexpr int kParts = 4;
    auto bend = std::upper_bound(bends.begin(), bends.end(), from);
    double before = from;
    for (int part = 1; part <= kParts; ++part) {
        const double end = part == kParts ? to : from + part * (to - from) / kParts;
        for (; bend != bends.end() && *bend < end; ++bend) {
            add_smooth(optics, before, *bend, sum);
            before = *bend;
        }
        add_smooth(optics, before, end, sum);
        before = end;
    }
}

}  // namespace

TransferSums transfer_sums_of(const Optics& optics) {
    constexpr int kCells = TransferSums::kCells;
    const SmallVector<double> bends = bends_of(optics);
    const double low = bends.empty() ? 0 : bends.front(), high = bends.empty() ? 0 : bends.back();
    const double range = low < high ? high - low : 1;  // of one value, or a jump, any
    // Cells as wide as f32 tells numbers apart there, or wider: a cell below all bends, one above.
    const double least =
        std::max(range / (kCells - 3), std::max(std::abs(low), std::abs(high)) * 0x1p-23);
    const double width = std::exp2(std::ceil(std::log2(least)));
    const double first = (std::floor(low / width) - 1) * width;
    TransferSums sums;
    sums.first = static_cast<float>(first);
    sums.per_number = static_cast<float>(1 / width);
    sums.width = static_cast<float>(width);

    SmallVector<std::array<double, 4>> exact(kCells + 1, std::array<double, 4>{});
    for (std::size_t i = 0; i < kCells; ++i) {
        exact[i + 1] = exact[i];
        const auto at = static_cast<double>(i);
        add_between(optics, bends, first + at * width, first + (at + 1) * width, exact[i + 1]);
    }
    const double whole = exact.back()[0];
    sums.scale = static_cast<float>(whole / TransferSums::kOne);
    const double integers = whole > 0 ? TransferSums::kOne / whole : 0;
    sums.knots.resize(kCells);
    sums.slopes.resize(kCells);
    for (std::size_t i = 0; i < kCells; ++i)
        for (std::size_t c = 0; c < 4; ++c) {
            sums.knots[i][c] = static_cast<std::int32_t>(std::lround(exact[i][c] * integers));
            sums.slopes[i][c] = static_cast<float>((exact[i + 1][c] - exact[i][c]) * integers);
        }
    return sums;
}

}  // namespace edgewise::kernels
