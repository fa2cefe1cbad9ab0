#include "transitions/radon/fourier.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <fmt/format.h>
#include <numbers>

#include "transitions/radon/plane_spectrum.hpp"
#include "transitions/radon/walk.hpp"

namespace edgewise {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

/// Offsets in the transform of an angle: they repeat after so many.
std::int64_t offset_period(const RadonLines& lines) noexcept {
    constexpr std::int64_t kLeast = 8;
    return kernels::good_length(std::max(kLeast, lines.offsets), 2);
}

/// The frequency [cycles a step] from which on the field's transform stays below the cut: it falls
/// as the product of 1 / (pi a f)^2 and 1 / (pi b f)^2, where these are below 1.
struct Reach {
    double frequency;
    int power = 2;  // by which it falls from there on, at least

    Reach(const std::array<double, 2>& slopes, double cut) noexcept {
        const double a = std::abs(slopes[0]), b = std::abs(slopes[1]);
        const double p = std::max(a, b), q = std::min(a, b);
        frequency = 1 / (std::numbers::pi * std::sqrt(p * q) * std::sqrt(std::sqrt(cut)));
        if (std::numbers::pi * q * frequency >= 1)
            power = 4;
        else
            frequency = 1 / (std::numbers::pi * p * std::sqrt(cut));
        frequency = std::max(0.5, frequency);
    }
};

/// sin(pi x) / (pi x), squared: of linear interpolation.
double of_triangle(double x) noexcept {
    const double at = std::numbers::pi * x;
    if (std::abs(at) < 1e-8) return 1;
    const double sinc = std::sin(at) / at;
    return sinc * sinc;
}

bool along_an_axis(const std::array<double, 2>& slopes) noexcept {
    return slopes[0] == 0 || slopes[1] == 0;
}

/// The spectrum of an angle's integrals, folded to the frequencies of its offsets.
void slice_at(const PlaneSpectrum& spectrum, const RadonLines& lines, int k, double cut,
              std::int64_t period, kernels::Complex* folded) {
    const auto [a, b] = lines.slopes(k);
    const std::int64_t half = period / 2;
    std::fill_n(folded, half + 1, kernels::Complex{});
    // From the spectrum's origin to the middle of the image, and on to line 0.
    const auto from_middle = [](std::int64_t n) { return n % 2 == 0 ? 0.5 : 0.0; };
    const double origin = from_middle(lines.input.x) * a + from_middle(lines.input.y) * b +
                          static_cast<double>(lines.middle());
    const double scale =
        lines.spacing[0] * lines.spacing[1] / (lines.step * static_cast<double>(period));
    const auto count = static_cast<std::int64_t>(
        std::ceil(Reach({a, b}, cut).frequency * static_cast<double>(period)));
    for (std::int64_t i = 0, at = 0; i <= count; ++i, at = at + 1 < period ? at + 1 : 0) {
        const double f = static_cast<double>(i) / static_cast<double>(period);
        const double fx = f * a, fy = f * b;
        // Phases by whole turns less: their sines are exact to the last bits.
        const double turns = f * origin;
        const std::complex<double> value =
            spectrum.at(fx, fy) * std::polar(scale * of_triangle(fx) * of_triangle(fy),
                                             -kTurn * (turns - std::floor(turns)));
        // It stands at i, and conjugate at -i; both come again with every period.
        const std::int64_t opposite = at == 0 ? 0 : period - at;
        if (at <= half) folded[at] += kernels::Complex(value);
        if (i > 0 && opposite <= half) folded[opposite] += kernels::Complex(std::conj(value));
    }
}

void run_by_slices(const RadonRun& run) {
    const RadonLines& lines = run.lines;
    const double cut = run.with.number("cut");
    const PlaneSpectrum spectrum(lines.input, run.plane, run.context.memory);
    run.context.poll();
    const std::int64_t period = offset_period(lines);
    const kernels::Fourier back = kernels::Fourier::to_real_row(period);
    for_each_angle(run, [&](int k) {
        if (along_an_axis(lines.slopes(k))) {
            const LineWalk walk(lines, run.plane, k);
            for (std::int64_t m = 0; m < lines.offsets; ++m)
                run.row(k)[m] = static_cast<float>(walk.along(m));
            return;
        }
        kernels::Block<kernels::Complex> folded(static_cast<std::size_t>(period / 2 + 1),
                                                run.context.memory);
        kernels::Block<float> row(static_cast<std::size_t>(period), run.context.memory);
        slice_at(spectrum, lines, k, cut, period, folded.data());
        back.run(folded.data(), row.data());
        std::copy_n(row.data(), lines.offsets, run.row(k));
    });
}

/// Over angles of all kinds, but for those along an axis.
double mean_over_angles(const RadonLines& lines,
                        const std::function<double(const std::array<double, 2>&)>& value) {
    constexpr int kAngles = 64;
    const RadonLines looked(lines.input, lines.spacing, kAngles);
    double sum = 0;
    for (int k = 0; k < kAngles; ++k)
        if (!along_an_axis(looked.slopes(k))) sum += value(looked.slopes(k));
    return sum / kAngles;
}

Work work_by_slices(const RadonAsk& ask) {
    // Taps, their weights of both axes, four sines; one by one: vectors hold eight.
    constexpr double kAlone = 8, kSine = 120, kPlace = kAlone * (36 * 4 + 80 + 4 * kSine);
    const double cut = ask.with.number("cut");
    const auto period = static_cast<double>(offset_period(ask.lines));
    const Extent spectrum = PlaneSpectrum::period_of(ask.lines.input);
    const auto padded = static_cast<double>(spectrum.samples());
    const double places = mean_over_angles(ask.lines,
                                           [&](const std::array<double, 2>& slopes) {
                                               return Reach(slopes, cut).frequency;
                                           }) *
                          period * ask.lines.angles;
    const double rows = ask.lines.angles * (2.5 * period * std::log2(period) + period);
    const double slices = static_cast<double>(ask.lines.input.z);
    return {.operations =
                slices * (places * kPlace + rows + 2.5 * padded * std::log2(padded) + 2 * padded),
            .scratch = period * 2 * sizeof(float) + period * sizeof(float),
            .workspace = PlaneSpectrum::bytes(ask.lines.input)};
}

/// Half of the largest magnitude, at random, at each sample: what is left of its transform beyond
/// the reach, where that falls from the cut with a power of the frequency.
double beyond_cut(const RadonAsk& ask) {
    const double cut = ask.with.number("cut");
    const RadonLines& lines = ask.lines;
    const double left = mean_over_angles(lines, [&](const std::array<double, 2>& slopes) {
        const Reach reach(slopes, cut);
        return 2 * cut * cut * reach.frequency / (2 * reach.power - 1);
    });
    const double samples = lines.diagonal * lines.step / (lines.spacing[0] * lines.spacing[1]);
    const double value = lines.spacing[0] * lines.spacing[1] / lines.step;
    return 0.5 * ask.magnitude() * value * std::sqrt(samples * left) / lines.diagonal;
}

Error error_by_slices(const RadonAsk& ask) {
    const kernels::KaiserBessel window(PlaneSpectrum::kWidth, PlaneSpectrum::kPadding);
    constexpr double kTable = 8e-6;  // of two axes
    const double ghosts = 2 * window.ghost(1 / (2 * PlaneSpectrum::kPadding)) + kTable;
    const Extent spectrum = PlaneSpectrum::period_of(ask.lines.input);
    const double values = static_cast<double>(spectrum.samples() * offset_period(ask.lines));
    return {.bias = ghosts * ask.magnitude() + beyond_cut(ask),
            .noise = 0x1p-24 * std::log2(values) * ask.magnitude()};
}

}  // namespace

Transition radon_fourier() {
    return radon_edge({
        .name = "radon.fourier",
        .source = "Bracewell 1956; Jackson et al. 1991",
        .not_the_other = "a count has steps, and up to f cycles an offset they are 0.32/sqrt(f) of "
                         "a vote off (RMS), so no band counts whole votes",
        .parameters = {{"cut", number(1e-6, 0.1, {1e-3},
                                      "share of the field's transform below which frequencies are "
                                      "left out")}},
        .refused = [](const RadonAsk& ask) -> std::string {
            if (ask.scene.non_finite == 0) return {};
            return fmt::format(
                "{} values are not finite, and a transform would spread them over "
                "all lines",
                ask.scene.non_finite);
        },
        .work = work_by_slices,
        .error = error_by_slices,
        .run = run_by_slices,
        .trials = [] { return line_trials(RadonSetting::To::sinogram); },
    });
}

}  // namespace edgewise
