#include "transitions/radon/forward.hpp"

#include <algorithm>

#include "transitions/radon/footprint.hpp"
#include "transitions/radon/radon_edge.hpp"

namespace edgewise {
namespace {

/// Adds all samples to the lines of an angle. @param sums  of all offsets, in f64
template <bool kFinite>
void spread(const RadonRun& run, int k, double* sums) {
    const RadonLines& lines = run.lines;
    const auto [a, b] = lines.slopes(k);
    const Footprint footprint(a, b);
    const double reach = footprint.reach();
    const std::int64_t nx = lines.input.x, ny = lines.input.y, last = lines.offsets - 1;
    const double x_centre = 0.5 * static_cast<double>(nx - 1),
                 y_centre = 0.5 * static_cast<double>(ny - 1);
    for (std::int64_t y = 0; y < ny; ++y) {
        const float* row = run.plane.row(y);
        const double in_row = (static_cast<double>(y) - y_centre) * b - x_centre * a +
                              static_cast<double>(lines.middle());
        for (std::int64_t x = 0; x < nx; ++x) {
            const double value = row[x];
            if (value == 0) continue;
            const double at = in_row + static_cast<double>(x) * a;
            // All lines that it meets are among those of the job, so that places are positive.
            const std::int64_t begin =
                std::max<std::int64_t>(0, static_cast<std::int64_t>(at - reach));
            const std::int64_t end = std::min(last, static_cast<std::int64_t>(at + reach));
            for (std::int64_t m = begin; m <= end; ++m) {
                const double weight = footprint(static_cast<double>(m) - at);
                if constexpr (kFinite)
                    sums[m] += weight * value;
                else if (weight > kTouched)
                    sums[m] += weight * value;
            }
        }
    }
}

}  // namespace

Transition radon_forward() {
    return radon_edge({
        .name = "radon.forward",
        .source = "[W93] FIGURE 10; Westover 1990",
        .work = [](const RadonAsk& ask) -> Work {
            constexpr double kLines = 2.5, kLine = 28, kPlace = 12, kAlone = 8, kLooked = 4;
            const double share = ask.scene.commonest == 0 ? ask.scene.occupied_fraction : 1;
            return {
                .operations = ask.visits() * (kLooked + share * (kLines * kLine + kPlace) * kAlone),
                .scratch = static_cast<double>(ask.lines.offsets) * sizeof(double)};
        },
        .error = [](const RadonAsk& ask) -> Error { return {.noise = ask.rounding()}; },
        .run =
            [](const RadonRun& run) {
                const RadonLines& lines = run.lines;
                const double scale = lines.spacing[0] * lines.spacing[1] / lines.step;
                const auto n = static_cast<std::size_t>(lines.offsets);
                for_each_angle(run, [&](int k) {
                    kernels::Block<double> sums(n, run.context.memory);
                    std::fill_n(sums.data(), n, 0.0);
                    if (run.plane.finite())
                        spread<true>(run, k, sums.data());
                    else
                        spread<false>(run, k, sums.data());
                    for (std::size_t m = 0; m < n; ++m)
                        run.row(k)[m] = static_cast<float>(scale * sums[m]);
                });
            },
        .trials = [] { return line_trials(RadonSetting::To::sinogram); },
        .factors = {{"", 0.85}},
    });
}

}  // namespace edgewise
