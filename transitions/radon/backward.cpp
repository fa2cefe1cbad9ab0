#include "transitions/radon/backward.hpp"

#include "transitions/radon/radon_edge.hpp"
#include "transitions/radon/walk.hpp"

namespace edgewise {

Transition radon_backward() {
    return radon_edge({
        .name = "radon.backward",
        .source = "Radon 1917; Joseph 1982",
        .work = [](const RadonAsk& ask) -> Work {
            // Mean of max(|cos|, |sin|), cells of a strip, operations of a cell. One by one:
            // vectors hold eight.
            constexpr double kCrossed = 0.9, kCells = 1.6, kCell = 30, kAlone = 8;
            const double cells = ask.visits() * kCrossed * kCells;
            return {.operations = cells * kCell * kAlone, .scratch = 64};
        },
        .error = [](const RadonAsk& ask) -> Error { return {.noise = ask.rounding()}; },
        .run =
            [](const RadonRun& run) {
                for_each_angle(run, [&](int k) {
                    const LineWalk walk(run.lines, run.plane, k);
                    for (std::int64_t m = 0; m < run.lines.offsets; ++m)
                        run.row(k)[m] = static_cast<float>(walk.along(m));
                });
            },
        .trials = [] { return line_trials(RadonSetting::To::sinogram); },
        .factors = {{"", 0.9}},
    });
}

}  // namespace edgewise
