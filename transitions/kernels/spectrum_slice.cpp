#include "transitions/kernels/spectrum_slice.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <tbb/parallel_for.h>

#include "transitions/kernels/pmr_block.hpp"
#include "transitions/kernels/spectrum_row.hpp"

namespace edgewise::kernels {
namespace {

constexpr double kPi = std::numbers::pi;

/// response() at 1024 frequencies a cycle, linear between them: error below 4e-6.
class ResponseTable {
 public:
    static constexpr int kPerCycle = 1024;
    explicit ResponseTable(Between between) : values_(2 * kPerCycle, 0.f) {
        for (int i = 0; i <= std::lround(cutoff(between) * kPerCycle) + 1; ++i)
            values_[i] = static_cast<float>(response(between, static_cast<double>(i) / kPerCycle));
    }
    /// |f| up to the cutoff.
    float at(float f) const noexcept {
        const float where = std::abs(f) * kPerCycle;
        const auto cell = static_cast<int>(where);
        return values_[cell] +
               (where - static_cast<float>(cell)) * (values_[cell + 1] - values_[cell]);
    }
    static const ResponseTable& of(Between between) {
        static const ResponseTable spline(Between::spline), linear(Between::linear);
        return between == Between::spline ? spline : linear;
    }

 private:
    std::vector<float> values_;
};

/// The plane of a view: frequency [cycles per voxel] of slice sample (kx, ky) = kx x + ky y.
struct Plane {
    std::array<double, 3> x, y;
    double at_x, at_y;  // where the origin voxel falls on the picture [pixel]
    double scale;
};

Plane plane_of(const SliceView& view) {
    const Affine& m = view.to_screen;
    const double det = m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
                       m[2] * (m[4] * m[9] - m[5] * m[8]);
    Plane plane{{}, {}, m[3], m[7], view.scale * std::abs(det)};
    for (int axis = 0; axis < 3; ++axis) {
        plane.x[axis] = m[axis] / static_cast<double>(view.width);
        plane.y[axis] = m[4 + axis] / static_cast<double>(view.height);
    }
    return plane;
}

/// Samples kx of a row that lie within the field's frequencies, first <= kx <= last.
struct Run {
    std::int64_t first = 0, last = -1;
    std::int64_t size() const noexcept { return std::max<std::int64_t>(0, last - first + 1); }
};

Run run_of(const SliceView& view, std::int64_t ky) {
    constexpr double kFar = 1e15;
    const double limit = cutoff(view.between), row = static_cast<double>(ky);
    double first = 0, last = view.folded ? kFar : static_cast<double>(view.width / 2);
    for (int axis = 0; axis < 3; ++axis) {
        const double at = row * view.to_screen[4 + axis] / static_cast<double>(view.height);
        const double step = view.to_screen[axis] / static_cast<double>(view.width);
        if (std::abs(step) * kFar < limit) {
            if (std::abs(at) > limit) return {};
            continue;
        }
        const double a = (-limit - at) / step, b = (limit - at) / step;
        first = std::max(first, std::min(a, b));
        last = std::min(last, std::max(a, b));
    }
    if (first > last) return {};
    return {static_cast<std::int64_t>(std::ceil(first)),
            static_cast<std::int64_t>(std::floor(last))};
}

/// Largest |ky| whose row can hold a sample.
std::int64_t last_row(const SliceView& view) {
    if (!view.folded) return view.height / 2;
    // v = b . f with the dual vector b of the map's second row, so |v| <= limit x sum |b|.
    const Affine& m = view.to_screen;
    double aa = 0, ab = 0, bb = 0;
    for (int axis = 0; axis < 3; ++axis) {
        aa += m[axis] * m[axis];
        ab += m[axis] * m[4 + axis];
        bb += m[4 + axis] * m[4 + axis];
    }
    double sum = 0;
    for (int axis = 0; axis < 3; ++axis)
        sum += std::abs((aa * m[4 + axis] - ab * m[axis]) / (aa * bb - ab * ab));
    return static_cast<std::int64_t>(sum * cutoff(view.between) * static_cast<double>(view.height));
}

std::int64_t longest_run(const SliceView& view) {
    std::int64_t longest = 0;
    const std::int64_t last = last_row(view);
    for (std::int64_t ky = -last; ky <= last; ++ky)
        longest = std::max(longest, run_of(view, ky).last + 1);
    return longest;
}

/// f modulo 1 as a 64-bit fraction.
std::uint64_t fraction_of(double f) {
    const double scaled = std::ldexp(f - std::floor(f), 64);
    return scaled < 0x1p64 ? static_cast<std::uint64_t>(scaled) : 0;
}

/// exp(-2 pi i k at / n), exact for large k too.
Complex turn(std::int64_t k, double at, std::int64_t n) {
    const double turns = std::remainder(std::remainder(at, static_cast<double>(n)) *
                                            static_cast<double>(k) / static_cast<double>(n),
                                        1);
    return {static_cast<float>(std::cos(2 * kPi * turns)),
            static_cast<float>(-std::sin(2 * kPi * turns))};
}

std::int64_t modulo(std::int64_t k, std::int64_t n) { return (k % n + n) % n; }

struct Slicer {
    const SliceView& view;
    const SpectrumView& spectrum;
    const Plane plane;
    const Complex* turns;  // of kx
    Complex* out;

    Complex* row(std::int64_t ky) const {
        return out + modulo(ky, view.height) * (view.width / 2 + 1);
    }
    /// Interpolates the samples of a run and gives them response, phase and scale.
    void interpolate(std::int64_t ky, const Run& run, Complex* samples) const;
    /// Adds a run to the row of ky and, conjugated, to that of -ky.
    void fold(std::int64_t ky, const Run& run, const Complex* samples) const;
};

void Slicer::interpolate(std::int64_t ky, const Run& run, Complex* samples) const {
    std::array<double, 3> first;
    std::array<std::uint64_t, 3> frequency, step;
    for (int axis = 0; axis < 3; ++axis) {
        first[axis] = static_cast<double>(ky) * plane.y[axis] +
                      static_cast<double>(run.first) * plane.x[axis];
        frequency[axis] = fraction_of(first[axis]);
        step[axis] = fraction_of(plane.x[axis]);
    }
    sample_row(spectrum, frequency, step, run.size(), samples);
    const bool edge = !view.folded && 2 * std::abs(ky) == view.height;
    const Complex factor =
        turn(ky, plane.at_y, view.height) * static_cast<float>(plane.scale * (edge ? 0.5 : 1));
    const ResponseTable& response = ResponseTable::of(view.between);
    for (std::int64_t i = 0; i < run.size(); ++i) {
        Complex weight = factor * turns[run.first + i];
        for (int axis = 0; axis < 3 && view.between != Between::band; ++axis)
            weight *= response.at(
                static_cast<float>(first[axis] + static_cast<double>(i) * plane.x[axis]));
        samples[i] *= weight;
    }
    // Half of the sample at the picture's highest frequency belongs to each of its two signs.
    if (!view.folded && 2 * run.last == view.width) samples[run.size() - 1] *= 0.5f;
}

void Slicer::fold(std::int64_t ky, const Run& run, const Complex* samples) const {
    Complex *own = row(ky), *opposite = row(-ky);
    const std::int64_t half = view.width / 2;
    std::int64_t column = run.first % view.width;
    for (std::int64_t i = 0; i < run.size(); ++i) {
        const std::int64_t mirrored = column == 0 ? 0 : view.width - column;
        if (column <= half) own[column] += samples[i];
        // A row and its opposite are both computed where kx = 0.
        if (mirrored <= half && run.first + i > 0) opposite[mirrored] += std::conj(samples[i]);
        if (++column == view.width) column = 0;
    }
}

void fill_offsets(std::int64_t period, int width, std::int64_t stride, std::ptrdiff_t* out) {
    for (std::int64_t i = 0; i < period + width; ++i)
        out[i] = modulo(i - (width / 2 - 1), period) * stride;
}

}  // namespace

double response(Between between, double f) noexcept {
    if (between == Between::band) return std::abs(f) <= 0.5 ? 1 : 0;
    const double sinc = f == 0 ? 1 : std::sin(kPi * f) / (kPi * f);
    if (between == Between::linear) return sinc * sinc;
    return sinc * sinc * sinc * sinc * 3 / (2 + std::cos(2 * kPi * f));
}

double cutoff(Between between) noexcept {
    // The responses are 0.012 and 0.09 there: of white noise 3e-5 and 1e-2 of the energy lie
    // beyond.
    return between == Between::spline ? 0.75 : between == Between::linear ? 0.75 : 0.5;
}

void slice_of_spectrum(const Complex* spectrum, const Extent& period, const KaiserBessel& window,
                       const SliceView& view, Complex* out, std::pmr::memory_resource* memory,
                       const Stop& stop) {
    const Extent stored = SpectrumShape::stored_of(period);
    const int width = window.width();
    Block<std::ptrdiff_t> rows(period.y + width, memory), planes(period.z + width, memory);
    fill_offsets(period.y, width, stored.x, rows.data());
    fill_offsets(period.z, width, stored.x * stored.y, planes.data());
    const TapTable& table = TapTable::of(window);
    const SpectrumView source{
        spectrum + SpectrumShape::kColumnsBefore,
        {static_cast<std::uint64_t>(period.x), static_cast<std::uint64_t>(period.y),
         static_cast<std::uint64_t>(period.z)},
        rows.data(),
        planes.data(),
        width,
        table.taps.data(),
        table.pairs.data()};

    const Plane plane = plane_of(view);
    const std::int64_t longest = longest_run(view), last = last_row(view);
    Block<Complex> turns(longest + 1, memory);
    for (std::int64_t k = 0; k < longest; ++k) turns[k] = turn(k, plane.at_x, view.width);
    const Slicer slicer{view, source, plane, turns.data(), out};

    // One task owns rows b and -b and all that is folded into them, in a fixed order.
    tbb::parallel_for(std::int64_t{0}, view.height / 2 + 1, [&](std::int64_t b) {
        if (stopped(stop)) return;
        std::fill_n(slicer.row(b), view.width / 2 + 1, Complex{});
        std::fill_n(slicer.row(-b), view.width / 2 + 1, Complex{});
        Block<Complex> samples(longest + 1, memory);
        const std::int64_t residues[] = {b, (view.height - b) % view.height};
        const int different = residues[0] == residues[1] ? 1 : 2;
        for (int which = 0; which < different; ++which)
            for (std::int64_t ky = -last + modulo(residues[which] + last, view.height); ky <= last;
                 ky += view.height) {
                const Run run = run_of(view, ky);
                if (run.size() == 0) continue;
                slicer.interpolate(ky, run, samples.data());
                slicer.fold(ky, run, samples.data());
            }
    });
}

double slice_samples(const SliceView& view) noexcept {
    double samples = 0;
    const std::int64_t last = last_row(view);
    for (std::int64_t ky = -last; ky <= last; ++ky)
        samples += static_cast<double>(run_of(view, ky).size());
    return samples;
}

double slice_scratch(const SliceView& view) noexcept {
    return static_cast<double>(longest_run(view) + 1) * sizeof(Complex);
}

double slice_workspace(const SliceView& view, const Extent& period) noexcept {
    return slice_scratch(view) +
           static_cast<double>(period.y + period.z + 16) * sizeof(std::ptrdiff_t);
}

}  // namespace edgewise::kernels
