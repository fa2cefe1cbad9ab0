#include <algorithm>
#include <cmath>
#include <numbers>

#include "transitions/kernels/scalar_load.hpp"
#include "transitions/kernels/shear.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/shear_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::shears {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 16>;
using Ints = hn::RebindToSigned<Floats>;
using VF = hn::Vec<Floats>;
using VI = hn::Vec<Ints>;

constexpr int kLines = 16;  // lines that are moved together
constexpr double kPole = std::numbers::sqrt3 - 2;

/// A shift of one line: output t takes its value at t + whole + fraction, in samples of `from`.
struct Shift {
    std::int64_t whole;
    float fraction;
};

Shift shift_of(const ShearPass& pass, const std::array<double, 3>& line) {
    const int axis = pass.shear.axis;
    const double exact = -pass.shear.step(line);
    const double nearest = std::floor(exact + 0.5);
    const double at = std::abs(exact - nearest) <= kWholeShift ? nearest : exact;
    const double whole = std::floor(at);
    return {std::int64_t(whole) - pass.from.begin[axis], float(at - whole)};
}

/// Strides of a box of samples, x fastest.
std::array<std::int64_t, 3> strides_of(const Region& box) {
    const Extent extent = box.extent();
    return {1, extent.x, extent.x * extent.y};
}

template <class Index>
std::int64_t offset_of(const Region& box, const Index& at) {
    const auto strides = strides_of(box);
    std::int64_t offset = 0;
    for (int i = 0; i < 3; ++i) offset += (at[i] - box.begin[i]) * strides[i];
    return offset;
}

/// Samples of a pass from one to the next along each axis, and to the sample at a place.
std::array<std::int64_t, 3> strides_of(const ShearPass& pass, const Grid& in) {
    if (in.whole()) return strides_of(pass.from);
    return {1, in.row_step(), in.slice_step()};
}

template <class Index>
std::int64_t offset_of(const ShearPass& pass, const Grid& in, const Index& at) {
    if (in.whole()) return offset_of(pass.from, at);
    return at[0] + at[1] * in.row_step() + at[2] * in.slice_step();
}

constexpr int kMostTaps = 8;
constexpr int kBefore = kMostTaps / 2;  // samples of padding before a line, and behind it

/// Four weights of the cubic B-spline, or two of the linear hold, for the taps from cell - 1 on;
/// or those of a filter from its first tap on.
struct Weights {
    float w[kMostTaps];
};

Weights weights_of(Hold hold, const Filter* filter, float f) {
    if (hold == Hold::foh) return {{0, 1 - f, f, 0}};
    if (hold == Hold::weighted) {
        double exact[kMostTaps] = {};
        filter->weights(double(f), exact);
        Weights weights;
        std::copy_n(exact, kMostTaps, weights.w);
        return weights;
    }
    const float g = 1 - f;
    return {{g * g * g / 6, 2.0f / 3 - f * f * (2 - f) / 2, 2.0f / 3 - g * g * (1 + f) / 2,
             f * f * f / 6}};
}

/// Turns 16 interleaved lines of n samples into coefficients of the cubic B-spline through them,
/// mirrored at both ends. Lines stand side by side, so the recursion runs in all of them at once.
class Prefilter {
 public:
    explicit Prefilter(std::int64_t n) : n_(n), horizon_(int(std::min<std::int64_t>(n, kHorizon))) {
        // Weights of the sum over the mirrored past of the first sample.
        const double period = double(2 * n - 2), scale = 1 / (1 - std::pow(kPole, period));
        for (int i = 0; i < horizon_; ++i) {
            const bool twice = i > 0 && i < n - 1;
            const double mirrored = twice ? std::pow(kPole, period - i) : 0;
            past_[i] = float((std::pow(kPole, i) + mirrored) * scale);
        }
    }

    void operator()(float* lines) const {
        const Floats d;
        if (n_ < 2) return;
        for (int lane = 0; lane < kLines; lane += int(hn::Lanes(d))) filter(lines + lane);
    }

 private:
    static constexpr int kHorizon = 24;  // |pole|^24 is 2e-14

    void filter(float* at) const {
        const Floats d;
        const VF pole = hn::Set(d, float(kPole)), gain = hn::Set(d, 6.0f);
        VF sum = hn::Zero(d);
        for (int i = 0; i < horizon_; ++i)
            sum = hn::MulAdd(hn::Load(d, at + i * kLines), hn::Set(d, past_[i]), sum);
        VF last = hn::Mul(gain, sum);
        hn::Store(last, d, at);
        for (std::int64_t i = 1; i < n_; ++i) {
            last = hn::MulAdd(pole, last, hn::Mul(gain, hn::Load(d, at + i * kLines)));
            hn::Store(last, d, at + i * kLines);
        }
        const VF before = hn::Load(d, at + (n_ - 2) * kLines);
        last =
            hn::Mul(hn::Set(d, float(kPole / (kPole * kPole - 1))), hn::MulAdd(pole, before, last));
        hn::Store(last, d, at + (n_ - 1) * kLines);
        for (std::int64_t i = n_ - 2; i >= 0; --i) {
            last = hn::Mul(pole, hn::Sub(last, hn::Load(d, at + i * kLines)));
            hn::Store(last, d, at + i * kLines);
        }
    }

    std::int64_t n_;
    int horizon_;
    float past_[kHorizon] = {};
};

/// A row of stored numbers as f32, values mapped.
void load_row(const Grid& in, std::int64_t offset, std::int64_t n, float* row) {
    const bool mapped = !in.values.identity();
    const float slope = float(in.values.slope), shift = float(in.values.offset);
    const auto fill = [&](auto sample) {
        using T = decltype(sample);
        const T* from = in.as<T>() + offset;
        for (std::int64_t i = 0; i < n; ++i) row[i] = float(from[i]);
    };
    switch (in.type) {
        case Type::u8:
            fill(std::uint8_t{});
            break;
        case Type::i8:
            fill(std::int8_t{});
            break;
        case Type::u16:
            fill(std::uint16_t{});
            break;
        case Type::i16:
            fill(std::int16_t{});
            break;
        case Type::f32:
            fill(float{});
            break;
        default: {
            const ScalarLoad load = scalar_load(in.type);
            for (std::int64_t i = 0; i < n; ++i) row[i] = load(in.samples, offset + i);
        }
    }
    if (!mapped) return;
    for (std::int64_t i = 0; i < n; ++i) row[i] = slope * row[i] + shift;
}

bool plain(const Grid& in) { return in.type == Type::f32 && in.values.identity(); }

// ---- lines along x ------------------------------------------------------------------------------

/// One row: the same weights for every sample. `row` has n samples (or coefficients; but for a
/// linear hold with as many more on either side as taps reach); first and last are the samples that
/// continue beyond its ends.
void move_row(const float* row, std::int64_t n, const Shift& shift, Hold hold, const Filter* filter,
              float first, float last, std::int64_t begin, std::int64_t end, float* out) {
    const Floats d;
    // Output t has its cell at t + whole; cells 0 .. n-2 have both neighbours.
    const std::int64_t inner = std::clamp<std::int64_t>(-shift.whole, begin, end);
    const std::int64_t beyond = std::clamp<std::int64_t>(n - 1 - shift.whole, inner, end);
    std::fill(out, out + (inner - begin), first);
    std::fill(out + (beyond - begin), out + (end - begin), last);
    const float* from = row + shift.whole;
    if (hold != Hold::bspline3 && shift.fraction == 0) {  // not 0 * NaN
        std::copy(from + inner, from + beyond, out + (inner - begin));
        return;
    }
    const Weights weights = weights_of(hold, filter, shift.fraction);
    const int taps = hold == Hold::weighted ? filter->taps : hold == Hold::foh ? 2 : 4;
    const int below = taps / 2 - 1;
    const auto value = [&](const auto load) HWY_ATTR {
        if (hold == Hold::weighted) {
            VF sum = hn::Zero(d);
            for (int k = 0; k < taps; ++k)
                sum = hn::MulAdd(hn::Set(d, weights.w[k]), load(k - below), sum);
            return sum;
        }
        VF sum = hn::Mul(hn::Set(d, weights.w[1]), load(0));
        sum = hn::MulAdd(hn::Set(d, weights.w[2]), load(1), sum);
        if (hold == Hold::foh) return sum;
        sum = hn::MulAdd(hn::Set(d, weights.w[0]), load(-1), sum);
        return hn::MulAdd(hn::Set(d, weights.w[3]), load(2), sum);
    };
    const auto lanes = std::int64_t(hn::Lanes(d));
    std::int64_t t = inner;
    for (; t + lanes <= beyond; t += lanes)
        hn::StoreU(value([&](int tap) HWY_ATTR { return hn::LoadU(d, from + t + tap); }), d,
                   out + (t - begin));
    if (t < beyond) {
        // The last vector's spare lanes would read behind the row.
        HWY_ALIGN float copied[kMostTaps][kLines] = {}, result[kLines];
        const auto rest = std::size_t(beyond - t);
        for (int k = 0; k < taps; ++k) std::copy_n(from + t + k - below, rest, copied[k]);
        hn::Store(value([&](int tap) HWY_ATTR { return hn::Load(d, copied[tap + below]); }), d,
                  result);
        std::copy_n(result, rest, out + (t - begin));
    }
}

void linear_rows(const ShearPass& pass, const Grid& in, float* out, const Region& held,
                 const Region& part, float* scratch) {
    const std::int64_t n = pass.from.extent().x;
    for (std::int64_t z = part.begin[2]; z < part.end[2]; ++z)
        for (std::int64_t y = part.begin[1]; y < part.end[1]; ++y) {
            const std::int64_t offset = offset_of(pass, in, std::array{pass.from.begin[0], y, z});
            const float* row = in.as<float>() + offset;
            if (!plain(in)) {
                load_row(in, offset, n, scratch);
                row = scratch;
            }
            move_row(row, n, shift_of(pass, {0, double(y), double(z)}), Hold::foh, nullptr, row[0],
                     row[n - 1], part.begin[0], part.end[0],
                     out + offset_of(held, std::array{part.begin[0], y, z}));
        }
}

/// Mirrors coefficients over both ends of a line: two samples before it and three behind.
void pad(float* line, std::int64_t n, std::int64_t stride, int count) {
    const auto mirrored = [n](std::int64_t i) {
        if (n == 1) return std::int64_t{0};
        const std::int64_t period = 2 * n - 2;
        i = ((i % period) + period) % period;
        return i < n ? i : period - i;
    };
    for (const std::int64_t i : {std::int64_t{-2}, std::int64_t{-1}, n, n + 1, n + 2})
        std::copy_n(line + mirrored(i) * stride, count, line + i * stride);
}

void cubic_rows(const ShearPass& pass, const Grid& in, float* out, const Region& held,
                const Region& part, float* scratch) {
    const std::int64_t n = pass.from.extent().x;
    const Prefilter prefilter(n);
    float* lines = scratch;
    float* row = scratch + (n + 16) * kLines + 8;  // one line, with room for the padding
    for (std::int64_t z = part.begin[2]; z < part.end[2]; ++z)
        for (std::int64_t y0 = part.begin[1]; y0 < part.end[1]; y0 += kLines) {
            const int count = int(std::min<std::int64_t>(kLines, part.end[1] - y0));
            for (int lane = 0; lane < kLines; ++lane) {
                const std::int64_t y = y0 + std::min(lane, count - 1);
                load_row(in, offset_of(pass, in, std::array{pass.from.begin[0], y, z}), n, row);
                for (std::int64_t i = 0; i < n; ++i) lines[i * kLines + lane] = row[i];
            }
            HWY_ALIGN float first[kLines], last[kLines];
            std::copy_n(lines, kLines, first);
            std::copy_n(lines + (n - 1) * kLines, kLines, last);
            prefilter(lines);
            for (int lane = 0; lane < count; ++lane) {
                for (std::int64_t i = 0; i < n; ++i) row[i] = lines[i * kLines + lane];
                pad(row, n, 1, 1);
                const std::int64_t y = y0 + lane;
                move_row(row, n, shift_of(pass, {0, double(y), double(z)}), Hold::bspline3, nullptr,
                         first[lane], last[lane], part.begin[0], part.end[0],
                         out + offset_of(held, std::array{part.begin[0], y, z}));
            }
        }
}

/// Continues a line by its outermost samples.
void continue_line(float* line, std::int64_t n, std::int64_t stride, int count) {
    for (int i = 0; i < kBefore; ++i) {
        std::copy_n(line, count, line - (i + 1) * stride);
        std::copy_n(line + (n - 1) * stride, count, line + (n + i) * stride);
    }
}

void weighted_rows(const ShearPass& pass, const Grid& in, float* out, const Region& held,
                   const Region& part, float* scratch) {
    const std::int64_t n = pass.from.extent().x;
    float* row = scratch + kLines;
    for (std::int64_t z = part.begin[2]; z < part.end[2]; ++z)
        for (std::int64_t y = part.begin[1]; y < part.end[1]; ++y) {
            load_row(in, offset_of(pass, in, std::array{pass.from.begin[0], y, z}), n, row);
            continue_line(row, n, 1, 1);
            move_row(row, n, shift_of(pass, {0, double(y), double(z)}), Hold::weighted, pass.filter,
                     row[0], row[n - 1], part.begin[0], part.end[0],
                     out + offset_of(held, std::array{part.begin[0], y, z}));
        }
}

// ---- lines along y or z, sixteen neighbours in x at a time ------------------------------------

/// Sixteen lines side by side, each with a shift of its own.
struct Beam {
    const float* lines;  // [n] x 16; coefficients with padding for bspline3
    std::int64_t n;
    int taps;  // of Hold::weighted
    alignas(64) std::int32_t whole[kLines];
    alignas(64) float weights[kMostTaps][kLines];
    alignas(64) float first[kLines], last[kLines];
};

/// Values of the output sample t in a vector of lines.
template <Hold kHold>
HWY_INLINE VF beam_value(const Beam& beam, std::int64_t t, int lane) {
    const Floats d;
    const Ints di;
    const VI cell = hn::Add(hn::Load(di, beam.whole + lane), hn::Set(di, std::int32_t(t)));
    const VI last = hn::Set(di, std::int32_t(beam.n - 1));
    const VI held = hn::Min(hn::Max(cell, hn::Zero(di)), last);
    const VI index = hn::Add(hn::ShiftLeft<4>(held), hn::Iota(di, lane));
    const auto tap = [&](int k)
                         HWY_ATTR { return hn::GatherIndex(d, beam.lines + k * kLines, index); };
    const auto weight = [&](int k) HWY_ATTR { return hn::Load(d, beam.weights[k] + lane); };
    const VF nearest = tap(0);
    VF sum;
    if constexpr (kHold == Hold::foh) {
        // Where the fraction is 0 the sample itself: not 0 * NaN.
        const VF blend = hn::MulAdd(weight(2), tap(1), hn::Mul(weight(1), nearest));
        sum = hn::IfThenElse(hn::Eq(weight(2), hn::Zero(d)), nearest, blend);
    } else if constexpr (kHold == Hold::weighted) {
        sum = hn::Zero(d);
        for (int k = 0; k < beam.taps; ++k)
            sum = hn::MulAdd(weight(k), tap(k + 1 - beam.taps / 2), sum);
    } else {
        sum = hn::MulAdd(weight(2), tap(1), hn::Mul(weight(1), nearest));
        sum = hn::MulAdd(weight(0), tap(-1), sum);
        sum = hn::MulAdd(weight(3), tap(2), sum);
    }
    const auto before = hn::RebindMask(d, hn::Lt(cell, hn::Zero(di)));
    const auto behind = hn::RebindMask(d, hn::Gt(cell, hn::Sub(last, hn::Set(di, 1))));
    sum = hn::IfThenElse(before, hn::Load(d, beam.first + lane), sum);
    return hn::IfThenElse(behind, hn::Load(d, beam.last + lane), sum);
}

template <Hold kHold>
void store_beam(const Beam& beam, std::int64_t begin, std::int64_t end, int count, float* out,
                std::int64_t stride) {
    const Floats d;
    const int lanes = int(hn::Lanes(d));
    for (std::int64_t t = begin; t < end; ++t, out += stride) {
        if (count == kLines) {
            for (int lane = 0; lane < kLines; lane += lanes)
                hn::StoreU(beam_value<kHold>(beam, t, lane), d, out + lane);
            continue;
        }
        HWY_ALIGN float values[kLines];
        for (int lane = 0; lane < kLines; lane += lanes)
            hn::Store(beam_value<kHold>(beam, t, lane), d, values + lane);
        std::copy_n(values, count, out);
    }
}

/// Loads sixteen neighbouring lines; spare ones repeat the last, so that no lane is undefined.
void load_beam(const Grid& in, std::int64_t offset, std::int64_t stride, std::int64_t n, int count,
               float* lines) {
    for (std::int64_t i = 0; i < n; ++i) {
        float* to = lines + i * kLines;
        if (count == kLines && plain(in))
            std::copy_n(in.as<float>() + offset + i * stride, kLines, to);
        else
            load_row(in, offset + i * stride, count, to);
        for (int lane = count; lane < kLines; ++lane) to[lane] = to[count - 1];
    }
}

template <Hold kHold>
void beams(const ShearPass& pass, const Grid& in, float* out, const Region& held,
           const Region& part, float* scratch) {
    const int axis = pass.shear.axis, other = 3 - axis;
    const std::int64_t n = pass.from.extent()[axis];
    const std::int64_t in_stride = strides_of(pass, in)[axis], out_stride = strides_of(held)[axis];
    const Prefilter prefilter(kHold == Hold::bspline3 ? n : 1);
    float* lines = scratch + kBefore * kLines;
    const int taps = kHold == Hold::weighted ? pass.filter->taps : 4;
    Beam beam{
        .lines = lines, .n = n, .taps = taps, .whole = {}, .weights = {}, .first = {}, .last = {}};
    for (std::int64_t o = part.begin[other]; o < part.end[other]; ++o)
        for (std::int64_t x = part.begin[0]; x < part.end[0]; x += kLines) {
            const int count = int(std::min<std::int64_t>(kLines, part.end[0] - x));
            std::array<std::int64_t, 3> at{};
            at[0] = x;
            at[other] = o;
            at[axis] = pass.from.begin[axis];
            load_beam(in, offset_of(pass, in, at), in_stride, n, count, lines);
            std::copy_n(lines, kLines, beam.first);
            std::copy_n(lines + (n - 1) * kLines, kLines, beam.last);
            if constexpr (kHold == Hold::bspline3) {
                prefilter(lines);
                pad(lines, n, kLines, kLines);
            } else if constexpr (kHold == Hold::weighted) {
                continue_line(lines, n, kLines, kLines);
            } else {
                std::copy_n(lines + (n - 1) * kLines, kLines, lines + n * kLines);
            }
            for (int lane = 0; lane < kLines; ++lane) {
                std::array<double, 3> line{};
                line[0] = double(x + std::min(lane, count - 1));
                line[other] = double(o);
                const Shift shift = shift_of(pass, line);
                beam.whole[lane] = std::int32_t(shift.whole);
                const Weights weights = weights_of(kHold, pass.filter, shift.fraction);
                for (int k = 0; k < taps; ++k) beam.weights[k][lane] = weights.w[k];
            }
            at[axis] = part.begin[axis];
            store_beam<kHold>(beam, part.begin[axis], part.end[axis], count,
                              out + offset_of(held, at), out_stride);
        }
}

void run(const ShearPass& pass, const Grid& in, float* out, const Region& held, Hold hold,
         const Region& part, float* scratch) {
    if (moves_whole(pass.shear)) hold = Hold::foh;
    if (hold == Hold::foh)
        return pass.shear.axis == 0 ? linear_rows(pass, in, out, held, part, scratch)
                                    : beams<Hold::foh>(pass, in, out, held, part, scratch);
    if (hold == Hold::weighted)
        return pass.shear.axis == 0 ? weighted_rows(pass, in, out, held, part, scratch)
                                    : beams<Hold::weighted>(pass, in, out, held, part, scratch);
    if (pass.shear.axis == 0) return cubic_rows(pass, in, out, held, part, scratch);
    beams<Hold::bspline3>(pass, in, out, held, part, scratch);
}

}  // namespace HWY_NAMESPACE
}  // namespace edgewise::kernels::shears
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {
namespace shears {
HWY_EXPORT(run);
}  // namespace shears

void run_shear_pass(const ShearPass& pass, const Grid& in, float* out, const Region& held,
                    Hold hold, const Region& part, float* scratch) noexcept {
    if (part.empty()) return;
    using namespace shears;
    HWY_DYNAMIC_DISPATCH(run)(pass, in, out, held, hold, part, scratch);
}

}  // namespace edgewise::kernels
#endif
