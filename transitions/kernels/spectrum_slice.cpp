#include "transitions/kernels/spectrum_slice.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <tbb/parallel_for.h>

#include "transitions/kernels/hartley.hpp"
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

/// Samples of a run that stand side by side.
struct Stretch {
    std::int64_t ky = 0;
    Run run;
    std::int64_t begin = 0, end = 0;  // from the first of the run

    std::int64_t size() const noexcept { return end - begin; }
};

/// Where the samples of a run are added: column kx and, conjugated, its mirror image in the row of
/// -ky.
struct Folding {
    std::int64_t column, mirrored;
    std::int64_t width;

    Folding(const SliceView& view, std::int64_t kx)
        : column(kx % view.width),
          mirrored(column == 0 ? 0 : view.width - column),
          width(view.width) {}
    void advance() noexcept {
        if (++column == width) column = 0;
        mirrored = column == 0 ? 0 : width - column;
    }
};

/// What becomes of samples in a part of the slice.
struct Target {
    const SliceView& view;
    const Region& part;

    bool has_row(std::int64_t ky) const noexcept {
        const std::int64_t row = modulo(ky, view.height);
        return row >= part.begin[1] && row < part.end[1];
    }
    bool has_column(std::int64_t column) const noexcept {
        return column >= part.begin[0] && column < part.end[0];
    }
    bool has_all_columns() const noexcept {
        return part.begin[0] == 0 && part.end[0] > view.width / 2;
    }
};

/// Calls body(stretch) for all that is added to rows b and -b of a part, in a fixed order.
template <class Body>
void each_stretch(const Target& target, std::int64_t b, std::int64_t last, const Body& body) {
    const SliceView& view = target.view;
    if (!target.has_row(b) && !target.has_row(-b)) return;
    const std::int64_t residues[] = {b, (view.height - b) % view.height};
    const int different = residues[0] == residues[1] ? 1 : 2;
    for (int which = 0; which < different; ++which)
        for (std::int64_t ky = -last + modulo(residues[which] + last, view.height); ky <= last;
             ky += view.height) {
            const bool own = target.has_row(ky), opposite = target.has_row(-ky);
            const Run run = run_of(view, ky);
            Stretch stretch{ky, run, 0, 0};
            if (own && opposite && target.has_all_columns()) {
                stretch.end = run.size();
                if (stretch.size() > 0) body(stretch);
                continue;
            }
            Folding at(view, run.first);
            for (std::int64_t i = 0; i < run.size(); ++i, at.advance()) {
                if ((own && target.has_column(at.column)) ||
                    (opposite && target.has_column(at.mirrored))) {
                    stretch.end = i + 1;
                    continue;
                }
                if (stretch.size() > 0) body(stretch);
                stretch.begin = stretch.end = i + 1;
            }
            if (stretch.size() > 0) body(stretch);
        }
}

/// Frequencies along a stretch, as sample_row takes them.
struct Line {
    std::array<double, 3> first;  // of the run [cycles per voxel]
    std::array<std::uint64_t, 3> frequency, step;

    Line(const Plane& plane, const Stretch& stretch) {
        for (int axis = 0; axis < 3; ++axis) {
            first[axis] = static_cast<double>(stretch.ky) * plane.y[axis] +
                          static_cast<double>(stretch.run.first) * plane.x[axis];
            step[axis] = fraction_of(plane.x[axis]);
            frequency[axis] =
                fraction_of(first[axis]) + static_cast<std::uint64_t>(stretch.begin) * step[axis];
        }
    }
};

struct Slicer {
    const Target target;
    const SpectrumView& spectrum;
    const Plane plane;
    const Complex* turns;  // of kx
    Complex* out;
    const Region& held;

    /// Column 0 of the row of ky, held or not.
    Complex* row(std::int64_t ky) const {
        return out + (modulo(ky, target.view.height) - held.begin[1]) * held.extent().x -
               held.begin[0];
    }
    void clear(std::int64_t ky) const {
        if (target.has_row(ky))
            std::fill(row(ky) + target.part.begin[0], row(ky) + target.part.end[0], Complex{});
    }
    /// Interpolates samples and gives them response, phase and scale.
    void interpolate(const Stretch& stretch, Complex* samples) const;
    /// What SliceView::derivative multiplies sample i of a run by, over the imaginary unit.
    float derivative_at(const Line& line, std::int64_t i) const;
    /// Adds samples to the row of ky and, conjugated, to that of -ky.
    void fold(const Stretch& stretch, const Complex* samples) const;
};

float Slicer::derivative_at(const Line& line, std::int64_t i) const {
    const SliceView& view = target.view;
    double sum = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double f = line.first[axis] + static_cast<double>(i) * plane.x[axis];
        const double turn = 2 * kPi * f;
        sum += view.derivative[axis] * (view.between == Between::linear ? std::sin(turn) : turn);
    }
    return static_cast<float>(sum);
}

void Slicer::interpolate(const Stretch& stretch, Complex* samples) const {
    const SliceView& view = target.view;
    const Line line(plane, stretch);
    const auto sample = spectrum.hartley ? sample_hartley_row : sample_row;
    sample(spectrum, line.frequency, line.step, stretch.size(), samples);
    const bool derived = view.derivative != std::array<double, 3>{};
    const bool edge = !view.folded && 2 * std::abs(stretch.ky) == view.height;
    const Complex factor =
        turn(stretch.ky, plane.at_y, view.height) *
        static_cast<float>(plane.scale * (edge ? 0.5 : 1) * (derived ? 1 : view.value));
    const ResponseTable& response = ResponseTable::of(view.between);
    for (std::int64_t i = stretch.begin; i < stretch.end; ++i) {
        Complex weight = factor * turns[stretch.run.first + i];
        if (derived) weight *= Complex(static_cast<float>(view.value), derivative_at(line, i));
        for (int axis = 0; axis < 3 && view.between != Between::band; ++axis)
            weight *= response.at(
                static_cast<float>(line.first[axis] + static_cast<double>(i) * plane.x[axis]));
        samples[i - stretch.begin] *= weight;
    }
    // Half of the sample at the picture's highest frequency belongs to each of its two signs.
    if (!view.folded && 2 * stretch.run.last == view.width && stretch.end == stretch.run.size())
        samples[stretch.size() - 1] *= 0.5f;
}

void Slicer::fold(const Stretch& stretch, const Complex* samples) const {
    Complex *own = row(stretch.ky), *opposite = row(-stretch.ky);
    // No column is above half of the width.
    const Region none{}, &part = target.part;
    const Region &to_own = target.has_row(stretch.ky) ? part : none,
                 &to_opposite = target.has_row(-stretch.ky) ? part : none;
    const std::int64_t first = stretch.run.first + stretch.begin;
    Folding at(target.view, first);
    for (std::int64_t i = 0; i < stretch.size(); ++i, at.advance()) {
        if (at.column >= to_own.begin[0] && at.column < to_own.end[0]) own[at.column] += samples[i];
        // A row and its opposite are both computed where kx = 0.
        if (at.mirrored >= to_opposite.begin[0] && at.mirrored < to_opposite.end[0] &&
            first + i > 0)
            opposite[at.mirrored] += std::conj(samples[i]);
    }
}

void fill_offsets(std::int64_t period, int width, std::int64_t stride, std::ptrdiff_t* out) {
    for (std::int64_t i = 0; i < period + width; ++i)
        out[i] = modulo(i - taps_before(width), period) * stride;
}
/// The same of the samples at -k.
void fill_offsets_back(std::int64_t period, int width, std::int64_t stride, std::ptrdiff_t* out) {
    for (std::int64_t i = 0; i < period + width; ++i)
        out[i] = modulo(taps_before(width) - i, period) * stride;
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

void slice_of_spectrum(const Grid& spectrum, const Extent& period, const KaiserBessel& window,
                       const SliceView& view, Complex* out, const Region& held, const Region& part,
                       std::pmr::memory_resource* memory, const Stop& stop) {
    const int width = window.width();
    Block<std::ptrdiff_t> rows(period.y + width, memory), planes(period.z + width, memory);
    fill_offsets(period.y, width, spectrum.row_step(), rows.data());
    fill_offsets(period.z, width, spectrum.slice_step(), planes.data());
    const TapTable& table = TapTable::of(window);
    SpectrumView source{spectrum.as<Complex>() + SpectrumShape::kColumnsBefore,
                        {static_cast<std::uint64_t>(period.x), static_cast<std::uint64_t>(period.y),
                         static_cast<std::uint64_t>(period.z)},
                        rows.data(),
                        planes.data(),
                        width,
                        table.taps.data(),
                        table.pairs.data()};
    const bool hartley = spectrum.type == Type::f32;
    Block<std::ptrdiff_t> rows_back(hartley ? period.y + width : 1, memory),
        planes_back(hartley ? period.z + width : 1, memory);
    if (hartley) {
        fill_offsets_back(period.y, width, spectrum.row_step(), rows_back.data());
        fill_offsets_back(period.z, width, spectrum.slice_step(), planes_back.data());
        source.hartley = spectrum.as<float>() + HartleyShape::kColumnsBefore;
        source.rows_back = rows_back.data();
        source.planes_back = planes_back.data();
    }

    const Plane plane = plane_of(view);
    const std::int64_t longest = longest_run(view), last = last_row(view);
    Block<Complex> turns(longest + 1, memory);
    for (std::int64_t k = 0; k < longest; ++k) turns[k] = turn(k, plane.at_x, view.width);
    const Slicer slicer{{view, part}, source, plane, turns.data(), out, held};

    // One task owns rows b and -b and all that is folded into them, in a fixed order.
    tbb::parallel_for(std::int64_t{0}, view.height / 2 + 1, [&](std::int64_t b) {
        if (stopped(stop)) return;
        slicer.clear(b);
        slicer.clear(-b);
        Block<Complex> samples(longest + 1, memory);
        each_stretch(slicer.target, b, last, [&](const Stretch& stretch) {
            slicer.interpolate(stretch, samples.data());
            slicer.fold(stretch, samples.data());
        });
    });
}

Region spectrum_read(const Extent& period, const KaiserBessel& window, const SliceView& view,
                     const Region& part) {
    const Plane plane = plane_of(view);
    const Target target{view, part};
    const std::int64_t last = last_row(view), width = window.width(),
                       before = taps_before(window.width());
    const std::array periods{static_cast<std::uint64_t>(period.x),
                             static_cast<std::uint64_t>(period.y),
                             static_cast<std::uint64_t>(period.z)};
    Region cells;  // that samples lie in
    const auto add = [&](std::size_t axis, std::int64_t cell) {
        const bool first = cells.end[axis] == 0;
        cells.begin[axis] = first ? cell : std::min(cells.begin[axis], cell);
        cells.end[axis] = std::max(cells.end[axis], cell + 1);
    };
    for (std::int64_t b = 0; b <= view.height / 2; ++b)
        each_stretch(target, b, last, [&](const Stretch& stretch) {
            Line line(plane, stretch);
            for (std::int64_t i = 0; i < stretch.size(); ++i) {
                const auto at = cells_at(line.frequency, periods, window.width());
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    add(axis, at[axis]);
                    line.frequency[axis] += line.step[axis];
                }
            }
        });
    if (cells.empty()) return {};
    Region read;
    read.begin[0] = cells.begin[0] + SpectrumShape::kColumnsBefore - before;
    read.end[0] =
        cells.end[0] - 1 + SpectrumShape::kColumnsBefore - before + columns_read(window.width());
    for (std::size_t axis = 1; axis < 3; ++axis) {
        const std::int64_t n = period[static_cast<int>(axis)];
        read.begin[axis] = cells.begin[axis] - before;
        read.end[axis] = cells.end[axis] - before + width - 1;
        // Taps beyond one end are at the other.
        if (read.begin[axis] < 0 || read.end[axis] > n) read.begin[axis] = 0, read.end[axis] = n;
    }
    return read;
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
    // Offsets, also those of -k, which only a Hartley transform has.
    return slice_scratch(view) +
           2. * static_cast<double>(period.y + period.z + 16) * sizeof(std::ptrdiff_t);
}

}  // namespace edgewise::kernels
