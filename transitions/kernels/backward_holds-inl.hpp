// The holds of the backward warp on vectors of places, compiled once a target: the value of a cell
// from its taps, away from borders and near them.
// No pragma once: the guard toggles, so that every target sees the text once.
#if defined(EDGEWISE_BACKWARD_HOLDS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef EDGEWISE_BACKWARD_HOLDS_INL
#undef EDGEWISE_BACKWARD_HOLDS_INL
#else
#define EDGEWISE_BACKWARD_HOLDS_INL
#endif

#include <array>
#include <cstdint>
#include <type_traits>

#include "hwy/highway.h"
#include "transitions/kernels/backward_rows.hpp"
#include "transitions/kernels/gathers-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using namespace gathers::HWY_NAMESPACE;  // NOLINT: the vectors and gathers

/// a + f (b - a) (EQ 14). Where f is 0 the sample itself: not 0 * NaN, and -0 keeps its sign.
/// Border cells also have f = 1, where this formula would be off by a rounding.
template <class Read, bool kBorder>
HWY_INLINE VF linear(VF a, VF b, VF f) {
    const Floats d;
    VF blend = hn::MulAdd(f, hn::Sub(b, a), a);
    if constexpr (!Read::kFloats) return blend;
    if constexpr (kBorder) blend = hn::IfThenElse(hn::Eq(f, hn::Set(d, 1.0f)), b, blend);
    return hn::IfThenElse(hn::Eq(f, hn::Zero(d)), a, blend);
}

/// Weights of the cubic B-spline for the taps at cell-1 .. cell+2.
struct CubicWeights {
    VF w[4];
};

HWY_INLINE CubicWeights cubic_weights(VF f) {
    const Floats d;
    const VF sixth = hn::Set(d, 1.0f / 6), half = hn::Set(d, 0.5f), centre = hn::Set(d, 2.0f / 3);
    const VF one = hn::Set(d, 1.0f), two = hn::Set(d, 2.0f);
    const VF g = hn::Sub(one, f), ff = hn::Mul(f, f), gg = hn::Mul(g, g);
    CubicWeights weights;
    weights.w[0] = hn::Mul(hn::Mul(gg, g), sixth);
    weights.w[1] = hn::NegMulAdd(hn::Mul(ff, half), hn::Sub(two, f), centre);
    weights.w[2] = hn::NegMulAdd(hn::Mul(gg, half), hn::Add(one, f), centre);
    weights.w[3] = hn::Mul(hn::Mul(ff, f), sixth);
    return weights;
}

/// Positions of a vector of columns: cells counted from the block's origin, and fractions in [0,
/// 1).
template <int kAxes>
struct Places {
    VI cell[kAxes];
    VF fraction[kAxes];
};

/// Byte offsets of the cells from `base`.
template <class Read, int kAxes, bool kNeighbours>
HWY_INLINE VI offsets_of(const BackwardPlan& plan, const Places<kAxes>& at) {
    const Ints di;
    VI offset = hn::Mul(at.cell[1], hn::Set(di, std::int32_t(plan.stride[1])));
    if constexpr (kAxes == 3)
        offset = hn::Add(offset, hn::Mul(at.cell[2], hn::Set(di, std::int32_t(plan.stride[2]))));
    if constexpr (!kNeighbours)
        return hn::Add(offset, hn::Mul(at.cell[0], hn::Set(di, std::int32_t(plan.stride[0]))));
    return hn::Add(offset, hn::ShiftLeft<Read::kBytes / 2>(at.cell[0]));
}

/// Bilinear or trilinear value of cells whose upper neighbours exist (or have the fraction 0).
template <class Read, int kAxes, bool kNeighbours, bool kBorder>
HWY_INLINE VF linear_value(const BackwardPlan& plan, const std::uint8_t* base, VI offset,
                           const Places<kAxes>& at) {
    constexpr int kRows = kAxes == 2 ? 2 : 4;
    const std::uint8_t* rows[kRows] = {base, base + plan.next[1]};
    if constexpr (kAxes == 3)
        for (int r = 0; r < 2; ++r) rows[2 + r] = rows[r] + plan.next[2];
    Pair taps[kRows];
    if constexpr (kNeighbours) {
        gather_pairs<Read, kRows>(rows, offset, plan.input.end, taps);
    } else {
        for (int r = 0; r < kRows; ++r)
            taps[r] = {gather_one<Read>(rows[r], offset, plan.input.end),
                       gather_one<Read>(rows[r] + plan.next[0], offset, plan.input.end)};
    }
    const auto line = [&](int r) HWY_ATTR {
        return linear<Read, kBorder>(taps[r].first, taps[r].second, at.fraction[0]);
    };
    const auto plane = [&](int r) HWY_ATTR {
        return linear<Read, kBorder>(line(r), line(r + 1), at.fraction[1]);
    };
    if constexpr (kAxes == 2) return plane(0);
    return linear<Read, kBorder>(plane(0), plane(kRows - 2), at.fraction[kAxes - 1]);
}

/// Cubic B-spline value where all taps exist.
template <class Read, int kAxes, bool kNeighbours>
HWY_INLINE VF cubic_value(const BackwardPlan& plan, const std::uint8_t* base, VI offset,
                          const Places<kAxes>& at) {
    const CubicWeights wx = cubic_weights(at.fraction[0]), wy = cubic_weights(at.fraction[1]);
    const auto pair = [&](const std::uint8_t* const(&starts)[2], Pair(&taps)[2]) HWY_ATTR {
        if constexpr (kNeighbours)
            return gather_pairs<Read, 2>(starts, offset, plan.input.end, taps);
        for (int i = 0; i < 2; ++i)
            taps[i] = {gather_one<Read>(starts[i], offset, plan.input.end),
                       gather_one<Read>(starts[i] + plan.stride[0], offset, plan.input.end)};
    };
    const auto plane = [&](const std::uint8_t* slice) HWY_ATTR {
        VF sum = hn::Zero(Floats());
        for (int j = 0; j < 4; ++j) {
            const std::uint8_t* row = slice + (j - 1) * plan.stride[1];
            Pair taps[2];
            pair({row - plan.stride[0], row + plan.stride[0]}, taps);
            VF line = hn::Mul(wx.w[0], taps[0].first);
            line = hn::MulAdd(wx.w[1], taps[0].second, line);
            line = hn::MulAdd(wx.w[2], taps[1].first, line);
            line = hn::MulAdd(wx.w[3], taps[1].second, line);
            sum = hn::MulAdd(wy.w[j], line, sum);
        }
        return sum;
    };
    if constexpr (kAxes == 2) {
        return plane(base);
    } else {
        const CubicWeights wz = cubic_weights(at.fraction[2]);
        VF sum = hn::Zero(Floats());
        for (int k = 0; k < 4; ++k)
            sum = hn::MulAdd(wz.w[k], plane(base + (k - 1) * plan.stride[2]), sum);
        return sum;
    }
}

/// Weights of a filter's taps at a vector of fractions, and 0 behind the last of them.
struct TapWeights {
    static constexpr int kMost = TapPolynomials::kMostTaps;

    VF w[kMost];

    HWY_INLINE TapWeights(const TapPolynomials& polynomials, VF fraction) {
        const Floats d;
        for (int tap = 0; tap < kMost; ++tap) w[tap] = hn::Zero(d);
        for (int tap = 0; tap < polynomials.taps(); ++tap) {
            VF sum = hn::Set(d, polynomials.coefficient(tap, polynomials.degree()));
            for (int power = polynomials.degree(); power-- > 0;)
                sum = hn::MulAdd(sum, fraction, hn::Set(d, polynomials.coefficient(tap, power)));
            w[tap] = sum;
        }
    }
};

/// The sum of weighted taps along one axis. Where a place lies on a sample it is that, bit for bit.
HWY_INLINE VF on_sample_or(const BackwardPlan& plan, VF fraction, VF sample, VF sum) {
    if (!plan.interpolates) return sum;
    return hn::IfThenElse(hn::Eq(fraction, hn::Zero(Floats())), sample, sum);
}

/// Samples that follow each other in memory, as many as come with one gather.
template <class Read>
inline constexpr int kRun = Read::kBytes == 1 ? 4 : 2;

template <class Read>
HWY_INLINE void gather_runs(const std::uint8_t* const (&rows)[2], VI offset, std::uintptr_t end,
                            VF (&runs)[2][kRun<Read>]) {
    if constexpr (Read::kFloats) {
        Pair pairs[2];
        gather_pairs<Read, 2>(rows, offset, end, pairs);
        for (int r = 0; r < 2; ++r) {
            runs[r][0] = pairs[r].first;
            runs[r][1] = pairs[r].second;
        }
    } else {
        using T = typename Read::Sample;
        VI words[2];
        gather_words<Read, 2>(rows, offset, end, words);
        for (int r = 0; r < 2; ++r) {
            runs[r][0] = sample_in<T, 0>(words[r]);
            runs[r][1] = sample_in<T, 1>(words[r]);
            if constexpr (kRun<Read> == 4) {
                runs[r][2] = sample_in<T, 2>(words[r]);
                runs[r][3] = sample_in<T, 3>(words[r]);
            }
        }
    }
}

/// The sample in each of two rows.
template <class Read>
HWY_INLINE void gather_two(const std::uint8_t* const (&rows)[2], VI offset, std::uintptr_t end,
                           VF (&samples)[2]) {
    VI words[2];
    gather_words<Read, 2>(rows, offset, end, words);
    for (int r = 0; r < 2; ++r) {
        if constexpr (Read::kFloats)
            samples[r] = hn::BitCast(Floats(), words[r]);
        else
            samples[r] = sample_in<typename Read::Sample, 0>(words[r]);
    }
}

/// Two rows of taps, weighted along x. `rows` point at the first tap of the origin.
template <class Read, bool kNeighbours>
HWY_INLINE void weighted_lines(const BackwardPlan& plan, const std::uint8_t* const (&rows)[2],
                               VI offset, VF fraction, const TapWeights& x, VF (&lines)[2]) {
    VF on[2];
    for (int r = 0; r < 2; ++r) lines[r] = on[r] = hn::Zero(Floats());
    const auto add = [&](int tap, const VF& first, const VF& second) HWY_ATTR {
        lines[0] = hn::MulAdd(x.w[tap], first, lines[0]);
        lines[1] = hn::MulAdd(x.w[tap], second, lines[1]);
        if (tap != plan.below) return;
        on[0] = first;
        on[1] = second;
    };
    const int taps = plan.weights->taps();
    if constexpr (kNeighbours) {
        for (int tap = 0; tap < taps; tap += kRun<Read>) {
            VF runs[2][kRun<Read>];
            gather_runs<Read>({rows[0] + tap * Read::kBytes, rows[1] + tap * Read::kBytes}, offset,
                              plan.input.end, runs);
            for (int k = 0; k < kRun<Read>; ++k) add(tap + k, runs[0][k], runs[1][k]);
        }
    } else {
        for (int tap = 0; tap < taps; ++tap) {
            VF samples[2];
            const std::int64_t at = tap * plan.stride[0];
            gather_two<Read>({rows[0] + at, rows[1] + at}, offset, plan.input.end, samples);
            add(tap, samples[0], samples[1]);
        }
    }
    for (int r = 0; r < 2; ++r) lines[r] = on_sample_or(plan, fraction, on[r], lines[r]);
}

/// Value by the weights of any filter with an even number of taps, all of which exist.
template <class Read, int kAxes, bool kNeighbours>
HWY_NOINLINE VF weighted_value(const BackwardPlan& plan, const std::uint8_t* base, VI offset,
                               const Places<kAxes>& at) {
    const TapPolynomials& polynomials = *plan.weights;
    const int taps = polynomials.taps();
    const TapWeights x(polynomials, at.fraction[0]), y(polynomials, at.fraction[1]);
    for (int a = 0; a < kAxes; ++a) base -= plan.below * plan.stride[a];
    const auto plane = [&](const std::uint8_t* slice) HWY_ATTR {
        VF sum = hn::Zero(Floats()), on = sum;
        for (int j = 0; j < taps; j += 2) {
            const std::uint8_t* const row = slice + j * plan.stride[1];
            VF lines[2];
            weighted_lines<Read, kNeighbours>(plan, {row, row + plan.stride[1]}, offset,
                                              at.fraction[0], x, lines);
            for (int r = 0; r < 2; ++r) {
                sum = hn::MulAdd(y.w[j + r], lines[r], sum);
                if (j + r == plan.below) on = lines[r];
            }
        }
        return on_sample_or(plan, at.fraction[1], on, sum);
    };
    if constexpr (kAxes == 2) {
        return plane(base);
    } else {
        const TapWeights z(polynomials, at.fraction[2]);
        VF sum = hn::Zero(Floats()), on = sum;
        for (int k = 0; k < taps; ++k) {
            const VF value = plane(base + k * plan.stride[2]);
            sum = hn::MulAdd(z.w[k], value, sum);
            if (k == plan.below) on = value;
        }
        return on_sample_or(plan, at.fraction[2], on, sum);
    }
}

/// Reconstruction where all taps exist. `base` points at the origin's sample.
template <class Read, Hold kHold, int kAxes, bool kNeighbours>
HWY_INLINE VF inner_value(const BackwardPlan& plan, const std::uint8_t* base,
                          const Places<kAxes>& at) {
    const VI offset = offsets_of<Read, kAxes, kNeighbours>(plan, at);
    if constexpr (kHold == Hold::zoh) {
        return gather_one<Read>(base, offset, plan.input.end);
    } else if constexpr (kHold == Hold::foh) {
        return linear_value<Read, kAxes, kNeighbours, false>(plan, base, offset, at);
    } else if constexpr (kHold == Hold::bspline3) {
        return cubic_value<Read, kAxes, kNeighbours>(plan, base, offset, at);
    } else {
        return weighted_value<Read, kAxes, kNeighbours>(plan, base, offset, at);
    }
}

/// Whole-sample mirror for taps at most three samples outside; axes of 1 and 2 samples included.
HWY_INLINE VI mirror_lanes(VI index, VI low, VI high) {
    index = hn::Add(low, hn::Abs(hn::Sub(index, low)));
    index = hn::Sub(high, hn::Abs(hn::Sub(high, index)));
    index = hn::Add(low, hn::Abs(hn::Sub(index, low)));
    return hn::Min(hn::Max(index, low), high);
}

/// The four mirrored taps of one axis near a border: byte offsets from `base`, and weights.
struct MirroredTaps {
    VI offset[4];
    CubicWeights weights;

    HWY_INLINE MirroredTaps(VI cell, VF fraction, VI low, VI high, VI stride)
        : weights(cubic_weights(fraction)) {
        for (int i = 0; i < 4; ++i) {
            const VI index = hn::Add(cell, hn::Set(Ints(), i - 1));
            offset[i] = hn::Mul(mirror_lanes(index, low, high), stride);
        }
    }

    template <class Value>
    HWY_INLINE VF join(const Value& value) const {
        VF sum = hn::Mul(weights.w[0], value(offset[0]));
        for (int i = 1; i < 4; ++i) sum = hn::MulAdd(weights.w[i], value(offset[i]), sum);
        return sum;
    }
};

/// The taps of one axis near a border by the weights of any filter: beyond the ends the outermost
/// samples continue, coefficients are mirrored.
struct ContinuedTaps {
    VI offset[TapWeights::kMost];
    VF fraction;
    TapWeights weights;
    const BackwardPlan& plan;

    HWY_INLINE ContinuedTaps(const BackwardPlan& all, VI cell, VF part, VI low, VI high, VI stride)
        : fraction(part), weights(*all.weights, part), plan(all) {
        for (int tap = 0; tap < all.weights->taps(); ++tap) {
            const VI index = hn::Add(cell, hn::Set(Ints(), tap - all.below));
            const VI there = all.interpolates ? hn::Min(hn::Max(index, low), high)
                                              : mirror_lanes(index, low, high);
            offset[tap] = hn::Mul(there, stride);
        }
    }

    /// The same sum as that of taps that all exist.
    template <class Value>
    HWY_INLINE VF join(const Value& value) const {
        VF sum = hn::Zero(Floats()), on = sum;
        for (int tap = 0; tap < plan.weights->taps(); ++tap) {
            const VF one = value(offset[tap]);
            sum = hn::MulAdd(weights.w[tap], one, sum);
            if (tap == plan.below) on = one;
        }
        return on_sample_or(plan, fraction, on, sum);
    }
};

/// Clamps cells to low..high; the fraction becomes 0 below and `beyond` above.
HWY_INLINE void clamp_place(VI& cell, VF& fraction, VI low, VI high, VF beyond) {
    const Floats d;
    fraction = hn::IfThenZeroElse(hn::RebindMask(d, hn::Lt(cell, low)), fraction);
    fraction = hn::IfThenElse(hn::RebindMask(d, hn::Gt(cell, high)), beyond, fraction);
    cell = hn::Min(hn::Max(cell, low), high);
}

/// The separable sum of taps, which `taps(axis)` gives for each axis.
template <class Read, int kAxes, class Taps>
HWY_INLINE VF joined_taps(const std::uint8_t* base, std::uintptr_t end, const Taps& taps) {
    const auto x = taps(0), y = taps(1);
    const auto plane = [&](VI slice) HWY_ATTR {
        return y.join([&](VI row) HWY_ATTR {
            const VI line = hn::Add(slice, row);
            return x.join([&](VI column) HWY_ATTR {
                return gather_one<Read>(base, hn::Add(line, column), end);
            });
        });
    };
    if constexpr (kAxes == 2) {
        return plane(hn::Zero(Ints()));
    } else {
        return taps(2).join(plane);
    }
}

/// Reconstruction with the border rule. `corner` is the cell of `base`; cells count from there.
template <class Read, Hold kHold, int kAxes, bool kNeighbours>
HWY_INLINE VF border_value(const BackwardPlan& plan, const std::uint8_t* base,
                           const std::array<std::int64_t, 3>& corner, Places<kAxes> at) {
    const Ints di;
    const VF one = hn::Set(Floats(), 1.0f);
    VI low[kAxes], high[kAxes];
    for (int a = 0; a < kAxes; ++a) {
        low[a] = hn::Set(di, std::int32_t(-corner[a]));
        high[a] = hn::Set(di, std::int32_t(plan.extent[a] - 1 - corner[a]));
    }
    if constexpr (kHold == Hold::zoh) {
        for (int a = 0; a < kAxes; ++a) at.cell[a] = hn::Min(hn::Max(at.cell[a], low[a]), high[a]);
        return gather_one<Read>(base, offsets_of<Read, kAxes, kNeighbours>(plan, at),
                                plan.input.end);
    } else if constexpr (kHold == Hold::foh) {
        // The last centre is the far end of the last cell, so that both taps exist.
        for (int a = 0; a < kAxes; ++a) {
            const bool thin = plan.extent[a] == 1;
            if (thin) at.fraction[a] = hn::Zero(Floats());
            clamp_place(at.cell[a], at.fraction[a], low[a],
                        thin ? high[a] : hn::Sub(high[a], hn::Set(di, 1)),
                        thin ? hn::Zero(Floats()) : one);
        }
        const VI offset = offsets_of<Read, kAxes, kNeighbours>(plan, at);
        return linear_value<Read, kAxes, kNeighbours, true>(plan, base, offset, at);
    } else if constexpr (kHold == Hold::bspline3) {
        for (int a = 0; a < kAxes; ++a)
            clamp_place(at.cell[a], at.fraction[a], low[a], hn::Sub(high[a], hn::Set(di, 1)), one);
        return joined_taps<Read, kAxes>(base, plan.input.end, [&](int a) HWY_ATTR {
            return MirroredTaps(at.cell[a], at.fraction[a], low[a], high[a],
                                hn::Set(di, std::int32_t(plan.stride[a])));
        });
    } else {
        // From the last sample on a place is on it.
        for (int a = 0; a < kAxes; ++a) {
            const VI before_last = hn::Sub(high[a], hn::Set(di, 1));
            const VF zero = hn::Zero(Floats());
            const auto beyond = hn::RebindMask(Floats(), hn::Gt(at.cell[a], before_last));
            at.fraction[a] = hn::IfThenZeroElse(beyond, at.fraction[a]);
            clamp_place(at.cell[a], at.fraction[a], low[a], high[a], zero);
        }
        return joined_taps<Read, kAxes>(base, plan.input.end, [&](int a) HWY_ATTR {
            return ContinuedTaps(plan, at.cell[a], at.fraction[a], low[a], high[a],
                                 hn::Set(di, std::int32_t(plan.stride[a])));
        });
    }
}

HWY_INLINE VF mapped_value(const BackwardPlan& plan, VF value) {
    if (!plan.mapped) return value;
    const Floats d;
    return hn::MulAdd(value, hn::Set(d, plan.slope), hn::Set(d, plan.offset));
}

}  // namespace HWY_NAMESPACE
}  // namespace edgewise::kernels
HWY_AFTER_NAMESPACE();

#endif
