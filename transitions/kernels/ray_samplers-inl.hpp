// Reconstruction at a vector of positions. Compiled once a target: see Highway's foreach_target.h.
#if defined(EDGEWISE_RAY_SAMPLERS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef EDGEWISE_RAY_SAMPLERS_INL
#undef EDGEWISE_RAY_SAMPLERS_INL
#else
#define EDGEWISE_RAY_SAMPLERS_INL
#endif

#include <cstring>
#include <limits>
#include <type_traits>

#include "hwy/highway.h"
#include "transitions/kernels/gathers-inl.hpp"
#include "transitions/kernels/grid.hpp"
#include "transitions/kernels/optics-inl.hpp"
#include "transitions/kernels/scalar_load.hpp"
#include "transitions/kernels/tap_polynomials.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {  // other kernels have names of their own in this namespace

/// Truncation without Highway's mending of overflow, which positions inside a volume never have.
HWY_INLINE VI truncated(VF v) {
#if HWY_TARGET == HWY_AVX3
    if constexpr (kLanes == 16) return VI{_mm512_cvttps_epi32(v.raw)};
#elif HWY_TARGET == HWY_AVX2
    if constexpr (kLanes == 8) return VI{_mm256_cvttps_epi32(v.raw)};
#endif
    return hn::ConvertTo(DI(), v);
}

/// a0 b0 + a1 b1 of the two 16-bit halves of each lane.
HWY_INLINE VI dot_of_halves(VI a, VI b) {
#if HWY_TARGET == HWY_AVX3
    if constexpr (kLanes == 16) return VI{_mm512_madd_epi16(a.raw, b.raw)};
#elif HWY_TARGET == HWY_AVX2
    if constexpr (kLanes == 8) return VI{_mm256_madd_epi16(a.raw, b.raw)};
#endif
    const auto low = [](VI v) { return hn::ShiftRight<16>(hn::ShiftLeft<16>(v)); };
    return hn::Add(hn::Mul(low(a), low(b)), hn::Mul(hn::ShiftRight<16>(a), hn::ShiftRight<16>(b)));
}

/// The extent of a volume as vectors, and clamping to it.
struct Bounds {
    VF top[3];   // n - 1
    VI last[3];  // n - 1

    explicit Bounds(const Extent& n) {
        for (int axis = 0; axis < 3; ++axis) {
            top[axis] = hn::Set(DF(), static_cast<float>(n[axis] - 1));
            last[axis] = hn::Set(DI(), static_cast<int>(n[axis] - 1));
        }
    }
    HWY_INLINE VF clamped(VF p, int axis) const {
        return hn::Min(hn::Max(p, hn::Zero(DF())), top[axis]);
    }
};

/// Reads of one sample by 32-bit byte offsets: volumes below 2^31 bytes, of types up to 32 bits.
template <class Reads>
class Gathered {
    using T = typename Reads::Sample;

 public:
    static constexpr bool kFloats = Reads::kFloats;
    static constexpr bool kPrefetches = gathers::HWY_NAMESPACE::kPrefetches<Reads>;
    static constexpr bool kPairs = sizeof(T) <= 2;  // one 32-bit read holds a sample and the next

    explicit Gathered(const Grid& grid)
        : base_(static_cast<const std::uint8_t*>(grid.samples)),
          row_(static_cast<int>(grid.row_step() * sizeof(T))),
          slice_(static_cast<int>(grid.slice_step() * sizeof(T))),
          end_(grid.end) {}

    HWY_INLINE VI offset(VI x, VI y, VI z) const {
        const DI d;
        const VI across = hn::ShiftLeft < sizeof(T) == 1 ? 0 : sizeof(T) == 2 ? 1 : 2 > (x);
        return hn::Add(hn::Add(hn::Mul(z, hn::Set(d, slice_)), hn::Mul(y, hn::Set(d, row_))),
                       across);
    }
    /// Asks for the lines of samples, and of as many rows below as are to be read.
    template <int kRows>
    HWY_INLINE void prefetch(VI offset) const {
        const std::uint8_t* rows[kRows];
        for (int r = 0; r < kRows; ++r) rows[r] = base_ + r * row_;
        gathers::HWY_NAMESPACE::prefetch<Reads, 1, kRows>(rows, 0, offset);
    }
    /// The sample itself.
    HWY_INLINE VF at(VI offset) const {
        return gathers::HWY_NAMESPACE::gather_one<Reads>(base_, offset, end_);
    }
    using Pair = gathers::HWY_NAMESPACE::Pair;
    /// The sample and the next along x in each of four rows. Of narrow types more is read: there
    /// has to be a row behind the last one, or two samples behind the next.
    HWY_INLINE static void pairs_at(const std::uint8_t* const (&rows)[4], VI offset,
                                    Pair (&pairs)[4]) {
        gathers::HWY_NAMESPACE::gather_pairs<Reads, 4>(rows, offset, 0, pairs);
    }
    /// The sample before one, itself and the two behind it along x, in each of four rows.
    HWY_INLINE static void four_taps(const std::uint8_t* const (&rows)[4], VI offset,
                                     VF (&taps)[4][4]) {
        constexpr int kBytes = sizeof(T);
        const std::uint8_t* before[4];
        const std::uint8_t* behind[4];
        for (int r = 0; r < 4; ++r) {
            before[r] = rows[r] - kBytes;
            behind[r] = rows[r] + kBytes;
        }
        if constexpr (kBytes == 1) {
            VI words[4];
            gathers::HWY_NAMESPACE::gather_words<Reads, 4>(before, offset, words);
            for (int r = 0; r < 4; ++r) {
                taps[r][0] = gathers::HWY_NAMESPACE::sample_in<T, 0>(words[r]);
                taps[r][1] = gathers::HWY_NAMESPACE::sample_in<T, 1>(words[r]);
                const VI upper = hn::ShiftRight<16>(words[r]);
                taps[r][2] = gathers::HWY_NAMESPACE::sample_in<T, 0>(upper);
                taps[r][3] = gathers::HWY_NAMESPACE::sample_in<T, 1>(upper);
            }
        } else {
            Pair low[4], high[4];
            pairs_at(before, offset, low);
            pairs_at(behind, offset, high);
            for (int r = 0; r < 4; ++r) {
                taps[r][0] = low[r].first;
                taps[r][1] = low[r].second;
                taps[r][2] = high[r].first;
                taps[r][3] = high[r].second;
            }
        }
    }
    /// Of the sample and the three around it along x, in each of four rows: what lies at f between
    /// the inner two, and the difference of what lies one sample behind and one before.
    HWY_INLINE static void four_along(const std::uint8_t* const (&rows)[4], VI offset, VF f,
                                      VF (&own)[4], VF (&differences)[4]) {
        VF taps[4][4];
        four_taps(rows, offset, taps);
        for (int r = 0; r < 4; ++r) {
            own[r] = between(taps[r][1], taps[r][2], f);
            differences[r] =
                between(hn::Sub(taps[r][2], taps[r][0]), hn::Sub(taps[r][3], taps[r][1]), f);
        }
    }
    /// (1 - f) sample + f next sample of four rows, times 2^14, less `kMiddle` times 2^14. The
    /// weights have 14 bits: at most 3e-5 of the difference between two samples is lost.
    HWY_INLINE void along_x(const std::uint8_t* const (&rows)[4], VI offset, VF f,
                            VF (&values)[4]) const {
        const DI d;
        const VI weight = truncated(hn::MulAdd(f, hn::Set(DF(), 16384.0f), hn::Set(DF(), 0.5f)));
        const VI weights = hn::Add(hn::Sub(hn::ShiftLeft<16>(weight), weight),
                                   hn::Set(d, 16384));  // (weight << 16) | (16384 - weight)
        VI pairs[4];
        gathers::HWY_NAMESPACE::gather_words<Reads, 4>(rows, offset, end_, pairs);
        for (int n = 0; n < 4; ++n) {
            VI pair = pairs[n];
            if constexpr (sizeof(T) == 1) {
                if constexpr (std::is_signed_v<T>)
                    pair = hn::Xor(pair, hn::Set(d, static_cast<int>(0x80808080u)));
                pair = widened_pair(pair);
            } else if constexpr (!std::is_signed_v<T>) {
                pair = hn::Xor(pair, hn::Set(d, static_cast<int>(0x80008000u)));
            }
            values[n] = hn::ConvertTo(DF(), dot_of_halves(pair, weights));
        }
    }
    /// What the bit flips of along_x took away.
    static constexpr float kMiddle = std::is_same_v<T, std::int8_t>     ? -128.0f
                                     : std::is_same_v<T, std::uint16_t> ? 32768.0f
                                                                        : 0.0f;

    const std::uint8_t* base() const { return base_; }
    int row() const { return row_; }
    int slice() const { return slice_; }

 private:
    /// Bytes 0 and 1 of each lane as its two 16-bit halves.
    HWY_INLINE static VI widened_pair(VI word) {
#if HWY_TARGET == HWY_SCALAR
        const DI d;
        return hn::Or(hn::And(word, hn::Set(d, 0xff)),
                      hn::And(hn::ShiftLeft<8>(word), hn::Set(d, 0xff0000)));
#else
        const hn::Repartition<std::uint8_t, DI> bytes;
        HWY_ALIGN static constexpr std::uint8_t kSpread[16] = {
            0, 0x80, 1, 0x80, 4, 0x80, 5, 0x80, 8, 0x80, 9, 0x80, 12, 0x80, 13, 0x80};
        return hn::BitCast(DI(), hn::TableLookupBytesOr0(hn::BitCast(bytes, word),
                                                         hn::LoadDup128(bytes, kSpread)));
#endif
    }

    const std::uint8_t* base_;
    int row_, slice_;
    std::uintptr_t end_;
};

/// Reads of any type and of volumes of any size, one lane after the other with 64-bit indices.
class Walked {
 public:
    static constexpr bool kFloats = false, kPairs = false, kPrefetches = false;
    explicit Walked(const Grid& grid)
        : samples_(grid.samples),
          load_(scalar_load(grid.type)),
          row_(grid.row_step()),
          slice_(grid.slice_step()) {}

    HWY_NOINLINE VF at(VI x, VI y, VI z) const {
        HWY_ALIGN int ix[kLanes], iy[kLanes], iz[kLanes];
        HWY_ALIGN float v[kLanes];
        hn::Store(x, DI(), ix);
        hn::Store(y, DI(), iy);
        hn::Store(z, DI(), iz);
        for (std::size_t lane = 0; lane < kLanes; ++lane)
            v[lane] = load_(samples_, iz[lane] * slice_ + iy[lane] * row_ + ix[lane]);
        return hn::Load(DF(), v);
    }

 private:
    const void* samples_;
    ScalarLoad load_;
    std::int64_t row_, slice_;
};

/// Nearest sample, ties upwards.
template <class Read>
class NearestSampler {
 public:
    static constexpr bool kPrefetches = Read::kPrefetches, kWeighted = false;
    explicit NearestSampler(const Grid& grid) : read_(grid), bounds_(grid.extent) {}

    template <bool kInner>
    HWY_INLINE VF at(VF x, VF y, VF z) const {
        const VI i = index<kInner>(x, 0), j = index<kInner>(y, 1), k = index<kInner>(z, 2);
        if constexpr (std::is_same_v<Read, Walked>)
            return read_.at(i, j, k);
        else
            return read_.at(read_.offset(i, j, k));
    }
    /// Asks for the lines that at() will read; places may lie outside the volume.
    HWY_INLINE void prefetch(VF x, VF y, VF z) const {
        read_.template prefetch<1>(
            read_.offset(index<true>(x, 0), index<true>(y, 1), index<true>(z, 2)));
    }

 private:
    template <bool kInner>
    HWY_INLINE VI index(VF p, int axis) const {
        if constexpr (!kInner) p = bounds_.clamped(p, axis);
        return truncated(hn::Add(p, hn::Set(DF(), 0.5f)));
    }
    Read read_;
    Bounds bounds_;
};

/// The taps of a place along one axis, their weights, and the weights' derivatives.
template <int kMost>
struct SlopedTaps {
    VI index[kMost];
    VF weight[kMost], slope[kMost];
};

/// The derivatives along x, y and z of a sum over `count` taps an axis.
/// @param value  (i, j, k): a tap
template <int kMost, class Value>
HWY_INLINE void sum_slopes(const SlopedTaps<kMost> (&along)[3], int count, const Value& value,
                           VF (&slopes)[3]) {
    const auto& [x, y, z] = along;
    for (VF& slope : slopes) slope = hn::Zero(DF());
    for (int c = 0; c < count; ++c)
        for (int b = 0; b < count; ++b) {
            VF row = hn::Zero(DF()), steep = row;
            for (int a = 0; a < count; ++a) {
                const VF tap = value(x.index[a], y.index[b], z.index[c]);
                row = hn::MulAdd(x.weight[a], tap, row);
                steep = hn::MulAdd(x.slope[a], tap, steep);
            }
            slopes[0] = hn::MulAdd(hn::Mul(y.weight[b], z.weight[c]), steep, slopes[0]);
            slopes[1] = hn::MulAdd(hn::Mul(y.slope[b], z.weight[c]), row, slopes[1]);
            slopes[2] = hn::MulAdd(hn::Mul(y.weight[b], z.slope[c]), row, slopes[2]);
        }
}

/// Trilinear; not finite where the nearest sample is not.
template <class Read>
class LinearSampler {
 public:
    using Reads = Read;
    static constexpr bool kPrefetches = Read::kPrefetches, kWeighted = false;
    explicit LinearSampler(const Grid& grid) : read_(grid), bounds_(grid.extent) {
        if constexpr (!std::is_same_v<Read, Walked>) {
            if (grid.extent.y > 1) down_ = read_.row();
            if (grid.extent.z > 1) deep_ = read_.slice();
        }
    }

    template <bool kInner>
    HWY_INLINE VF at(VF x, VF y, VF z) const {
        const DF d;
        if constexpr (!kInner) {
            x = bounds_.clamped(x, 0);
            y = bounds_.clamped(y, 1);
            z = bounds_.clamped(z, 2);
        }
        VI i = truncated(x), j = truncated(y), k = truncated(z);
        if constexpr (!kInner && kClampsCells) {
            i = clamped_cell(i, 0);
            j = clamped_cell(j, 1);
            k = clamped_cell(k, 2);
        }
        const VF f = hn::Sub(x, hn::ConvertTo(d, i)), g = hn::Sub(y, hn::ConvertTo(d, j)),
                 h = hn::Sub(z, hn::ConvertTo(d, k));
        VF value;
        if constexpr (std::is_same_v<Read, Walked>)
            value = walked(i, j, k, f, g, h);
        else
            value = gathered<kInner>(i, j, k, f, g, h);
        if constexpr (!Read::kPairs) {
            const MF finite = is_finite(value);
            if (HWY_UNLIKELY(!hn::AllTrue(d, finite)))
                value = hn::IfThenElse(finite, value, near_gap(i, j, k, f, g, h));
        }
        return value;
    }
    /// Central differences: half the difference of the values one sample behind and before a place,
    /// along each axis, from 12 rows instead of the 24 of six values. @return lanes whose
    /// neighbours all lie inside; of the others nothing is worked out, since what one gets must not
    /// hang on those beside it
    HWY_INLINE MF differences(VF x, VF y, VF z, VF (&slopes)[3]) const {
        for (VF& slope : slopes) slope = hn::Zero(DF());
        if constexpr (std::is_same_v<Read, Walked>) {
            return hn::FirstN(DF(), 0);
        } else {
            const DF d;
            VI i = truncated(x), j = truncated(y), k = truncated(z);
            const auto between_two =
                hn::And(is_inner(i, 0), hn::And(is_inner(j, 1), is_inner(k, 2)));
            if (hn::AllFalse(DI(), between_two)) return hn::FirstN(d, 0);
            if (!hn::AllTrue(DI(), between_two)) {
                // The others read what one of these reads.
                const auto one =
                    static_cast<std::size_t>(hn::FindKnownFirstTrue(DI(), between_two));
                for (VI* cell : {&i, &j, &k})
                    *cell = hn::IfThenElse(between_two, *cell,
                                           hn::Set(DI(), hn::ExtractLane(*cell, one)));
            }
            const VF f = hn::Sub(x, hn::ConvertTo(d, i)), g = hn::Sub(y, hn::ConvertTo(d, j)),
                     h = hn::Sub(z, hn::ConvertTo(d, k));
            const VI offset = read_.offset(i, j, k);
            const std::uint8_t* const base = read_.base();
            const std::uint8_t* const inner[4] = {base, base + down_, base + deep_,
                                                  base + down_ + deep_};
            const std::uint8_t* const beside_y[4] = {
                base - down_, base + 2 * down_, base + deep_ - down_, base + deep_ + 2 * down_};
            const std::uint8_t* const beside_z[4] = {base - deep_, base + down_ - deep_,
                                                     base + 2 * deep_, base + down_ + 2 * deep_};
            VF along[4], own[4], ys[4], zs[4];
            read_.four_along(inner, offset, f, own, along);
            ends(beside_y, offset, f, ys);
            ends(beside_z, offset, f, zs);
            // Of rows (y, z), (y + 1, z), (y, z + 1), (y + 1, z + 1).
            const auto across = [&](VF v00, VF v10, VF v01, VF v11) HWY_ATTR {
                return between(between(v00, v10, g), between(v01, v11, g), h);
            };
            const VF half = hn::Set(d, 0.5f);
            slopes[0] = hn::Mul(half, across(along[0], along[1], along[2], along[3]));
            slopes[1] = hn::Mul(half, across(hn::Sub(own[1], ys[0]), hn::Sub(ys[1], own[0]),
                                             hn::Sub(own[3], ys[2]), hn::Sub(ys[3], own[2])));
            slopes[2] = hn::Mul(half, across(hn::Sub(own[2], zs[0]), hn::Sub(own[3], zs[1]),
                                             hn::Sub(zs[2], own[0]), hn::Sub(zs[3], own[1])));
            return hn::RebindMask(d, between_two);
        }
    }
    /// Sobel's operator, interpolated: of the four samples around a place along each axis. Places
    /// lie inside.
    HWY_INLINE void sobel(VF x, VF y, VF z, VF (&slopes)[3]) const {
        const DF d;
        const DI di;
        const VF half = hn::Set(d, 0.5f), quarter = hn::Set(d, 0.25f);
        const VF place[3] = {x, y, z};
        SlopedTaps<4> along[3];
        VI cells[3];
        auto inner = hn::Eq(hn::Zero(di), hn::Zero(di));
        for (int axis = 0; axis < 3; ++axis) {
            auto& [index, weight, slope] = along[axis];
            const VI cell = cells[axis] = truncated(place[axis]);
            inner = hn::And(inner, is_inner(cell, axis));
            const VF f = hn::Sub(place[axis], hn::ConvertTo(d, cell)),
                     g = hn::Sub(hn::Set(d, 1.0f), f);
            for (int tap = 0; tap < 4; ++tap)
                index[tap] = hn::Min(hn::Max(hn::Add(cell, hn::Set(di, tap - 1)), hn::Zero(di)),
                                     bounds_.last[axis]);
            // 1 2 1 and -1 0 1 of both ends of the cell.
            weight[0] = hn::Mul(quarter, g);
            weight[1] = hn::MulAdd(quarter, g, quarter);
            weight[2] = hn::MulAdd(quarter, f, quarter);
            weight[3] = hn::Mul(quarter, f);
            slope[0] = hn::Neg(hn::Mul(half, g));
            slope[1] = hn::Neg(hn::Mul(half, f));
            slope[2] = hn::Mul(half, g);
            slope[3] = hn::Mul(half, f);
        }
        for (VF& axis : slopes) axis = hn::Zero(d);
        const auto add = [&](int c, const VF(&taps)[4][4]) HWY_ATTR {
            for (int b = 0; b < 4; ++b) {
                VF row = hn::Zero(d), steep = row;
                for (int a = 0; a < 4; ++a) {
                    row = hn::MulAdd(along[0].weight[a], taps[b][a], row);
                    steep = hn::MulAdd(along[0].slope[a], taps[b][a], steep);
                }
                slopes[0] =
                    hn::MulAdd(hn::Mul(along[1].weight[b], along[2].weight[c]), steep, slopes[0]);
                slopes[1] =
                    hn::MulAdd(hn::Mul(along[1].slope[b], along[2].weight[c]), row, slopes[1]);
                slopes[2] =
                    hn::MulAdd(hn::Mul(along[1].weight[b], along[2].slope[c]), row, slopes[2]);
            }
        };
        VF taps[4][4];
        if constexpr (!std::is_same_v<Read, Walked>) {
            // Samples of one row are read together where all lanes have all of them: the same
            // numbers, so what a lane gets does not hang on those beside it.
            if (hn::AllTrue(di, inner)) {
                const VI offset = read_.offset(cells[0], cells[1], cells[2]);
                for (int c = 0; c < 4; ++c) {
                    const std::uint8_t* const first = read_.base() + (c - 1) * deep_;
                    const std::uint8_t* const rows[4] = {first - down_, first, first + down_,
                                                         first + 2 * down_};
                    read_.four_taps(rows, offset, taps);
                    add(c, taps);
                }
                return;
            }
        }
        for (int c = 0; c < 4; ++c) {
            for (int b = 0; b < 4; ++b)
                for (int a = 0; a < 4; ++a)
                    taps[b][a] = at_index(along[0].index[a], along[1].index[b], along[2].index[c]);
            add(c, taps);
        }
    }
    /// Asks for the lines that at() will read, but those of the next slice: where it comes to
    /// that, the next sample's are there.
    HWY_INLINE void prefetch(VF x, VF y, VF z) const {
        read_.template prefetch<2>(read_.offset(truncated(x), truncated(y), truncated(z)));
    }

 private:
    /// The last sample is the far end of the last cell. Floats are not blended there: 0 * NaN.
    static constexpr bool kClampsCells = Read::kPairs;

    /// Whether cells have samples on both sides of them.
    HWY_INLINE hn::Mask<DI> is_inner(VI i, int axis) const {
        const DI d;
        return hn::And(hn::Gt(i, hn::Zero(d)),
                       hn::Lt(i, hn::Sub(bounds_.last[axis], hn::Set(d, 1))));
    }
    HWY_INLINE VI clamped_cell(VI i, int axis) const {
        const DI d;
        const VI last = hn::Sub(bounds_.last[axis], hn::Set(d, 1));
        return hn::Max(hn::Min(i, last), hn::Zero(d));
    }
    HWY_INLINE VI next(VI i, int axis) const {
        return hn::Min(hn::Add(i, hn::Set(DI(), 1)), bounds_.last[axis]);
    }
    HWY_INLINE VF at_index(VI i, VI j, VI k) const {
        if constexpr (std::is_same_v<Read, Walked>)
            return read_.at(i, j, k);
        else
            return read_.at(read_.offset(i, j, k));
    }
    HWY_INLINE VF walked(VI i, VI j, VI k, VF f, VF g, VF h) const {
        const VI i1 = next(i, 0), j1 = next(j, 1), k1 = next(k, 2);
        const VF a = between(read_.at(i, j, k), read_.at(i1, j, k), f);
        const VF b = between(read_.at(i, j1, k), read_.at(i1, j1, k), f);
        const VF c = between(read_.at(i, j, k1), read_.at(i1, j, k1), f);
        const VF e = between(read_.at(i, j1, k1), read_.at(i1, j1, k1), f);
        return between(between(a, b, g), between(c, e, g), h);
    }
    /// The same where a sample is not finite: in its own voxel there is nothing; elsewhere the
    /// weights of the finite ones add up to 1, as in ReferenceField.
    HWY_NOINLINE VF near_gap(VI i, VI j, VI k, VF f, VF g, VF h) const {
        const DF d;
        const VF one = hn::Set(d, 1.0f);
        const VI x[2] = {i, next(i, 0)}, y[2] = {j, next(j, 1)}, z[2] = {k, next(k, 2)};
        const VF u[2] = {hn::Sub(one, f), f}, v[2] = {hn::Sub(one, g), g},
                 w[2] = {hn::Sub(one, h), h};
        VF sum = hn::Zero(d), share = sum;
        VF least = hn::Set(d, std::numeric_limits<float>::max()), most = hn::Neg(least);
        for (int corner = 0; corner < 8; ++corner) {
            const int a = corner & 1, b = corner >> 1 & 1, c = corner >> 2;
            const VF weight = hn::Mul(hn::Mul(u[a], v[b]), w[c]);
            const VF value = at_index(x[a], y[b], z[c]);
            const MF finite = is_finite(value);
            sum = hn::IfThenElse(finite, hn::MulAdd(weight, value, sum), sum);
            share = hn::Add(share, hn::IfThenElseZero(finite, weight));
            least = hn::IfThenElse(finite, hn::Min(least, value), least);
            most = hn::IfThenElse(finite, hn::Max(most, value), most);
        }
        const auto nearer = [&](const VI(&cell)[2], VF part) HWY_ATTR {
            const auto beyond = hn::RebindMask(DI(), hn::Ge(part, hn::Set(d, 0.5f)));
            return hn::IfThenElse(beyond, cell[1], cell[0]);
        };
        const VF nearest = at_index(nearer(x, f), nearer(y, g), nearer(z, h));
        // A rounding must not lift it above its brick.
        const VF mean = hn::Min(hn::Max(hn::Div(sum, share), least), most);
        return hn::IfThenElse(is_finite(nearest), mean, nearest);
    }
    template <bool kInner>
    HWY_INLINE VF gathered(VI i, VI j, VI k, VF f, VF g, VF h) const {
        VF v[4];
        if constexpr (kInner || kClampsCells) {
            // One vector of offsets and four rows.
            const std::uint8_t* row = read_.base();
            const std::uint8_t* const rows[4] = {row, row + down_, row + deep_,
                                                 row + down_ + deep_};
            if constexpr (Read::kPairs)
                read_.along_x(rows, read_.offset(i, j, k), f, v);
            else
                ends(rows, read_.offset(i, j, k), f, v);
        } else {
            clamped_ends(i, j, k, f, v);
        }
        const VF value =
            blended<kInner>(blended<kInner>(v[0], v[1], g), blended<kInner>(v[2], v[3], g), h);
        if constexpr (Read::kPairs)
            return hn::MulAdd(value, hn::Set(DF(), 1.0f / 16384), hn::Set(DF(), Read::kMiddle));
        return value;
    }
    /// The far end of a cell is the sample itself: else a rounding could lift it above its brick.
    template <bool kInner>
    HWY_INLINE static VF blended(VF a, VF b, VF f) {
        const VF blend = between(a, b, f);
        if constexpr (kInner || !kClampsCells) return blend;
        return hn::IfThenElse(hn::Eq(f, hn::Set(DF(), 1.0f)), b, blend);
    }
    HWY_INLINE static void ends(const std::uint8_t* const (&rows)[4], VI offset, VF f, VF (&v)[4]) {
        typename Read::Pair pairs[4];
        Read::pairs_at(rows, offset, pairs);
        for (int n = 0; n < 4; ++n) v[n] = between(pairs[n].first, pairs[n].second, f);
    }
    /// At the ends a missing neighbour is replaced by the sample itself, lane by lane.
    HWY_INLINE void clamped_ends(VI i, VI j, VI k, VF f, VF (&v)[4]) const {
        const DI d;
        const auto step_to_next = [&](VI cell, int axis, int bytes) HWY_ATTR {
            return hn::IfThenElseZero(hn::Lt(cell, bounds_.last[axis]), hn::Set(d, bytes));
        };
        const VI right = step_to_next(i, 0, sizeof(float)), down = step_to_next(j, 1, read_.row()),
                 deep = step_to_next(k, 2, read_.slice());
        const VI offset = read_.offset(i, j, k);
        const VI offsets[4] = {offset, hn::Add(offset, down), hn::Add(offset, deep),
                               hn::Add(offset, hn::Add(down, deep))};
        for (int n = 0; n < 4; ++n)
            v[n] = between(read_.at(offsets[n]), read_.at(hn::Add(offsets[n], right)), f);
    }

    Read read_;
    Bounds bounds_;
    int down_ = 0, deep_ = 0;  // bytes to the next row and slice, where there is one
};

/// Cubic B-spline of coefficients, which are mirrored at the end samples.
template <class Read>
class SplineSampler {
 public:
    static constexpr bool kPrefetches = false;  // 16 rows of 4 taps: arithmetic takes longer
    static constexpr bool kWeighted = false;
    explicit SplineSampler(const Grid& grid) : read_(grid), bounds_(grid.extent) {}

    template <bool kInner>
    HWY_INLINE VF at(VF x, VF y, VF z) const {
        VI i[4], j[4], k[4];
        VF u[4], v[4], w[4];
        taps<kInner>(x, 0, i, u);
        taps<kInner>(y, 1, j, v);
        taps<kInner>(z, 2, k, w);
        VF sum = hn::Zero(DF());
        for (int c = 0; c < 4; ++c) {
            VF plane = hn::Zero(DF());
            for (int b = 0; b < 4; ++b) {
                VF row = hn::Zero(DF());
                for (int a = 0; a < 4; ++a) row = hn::MulAdd(u[a], value(i[a], j[b], k[c]), row);
                plane = hn::MulAdd(v[b], row, plane);
            }
            sum = hn::MulAdd(w[c], plane, sum);
        }
        return sum;
    }
    /// The derivatives along x, y and z.
    HWY_NOINLINE void gradient(VF x, VF y, VF z, VF (&slopes)[3]) const {
        SlopedTaps<4> along[3];
        const VF place[3] = {x, y, z};
        for (int axis = 0; axis < 3; ++axis)
            taps<false>(place[axis], axis, along[axis].index, along[axis].weight,
                        along[axis].slope);
        sum_slopes(
            along, 4, [&](VI i, VI j, VI k) HWY_ATTR { return value(i, j, k); }, slopes);
    }

 private:
    HWY_INLINE VF value(VI i, VI j, VI k) const {
        if constexpr (std::is_same_v<Read, Walked>)
            return read_.at(i, j, k);
        else
            return read_.at(read_.offset(i, j, k));
    }
    /// @param slope  derivatives of the weights; null: nobody asks
    template <bool kInner>
    HWY_INLINE void taps(VF p, int axis, VI index[4], VF weight[4], VF* slope = nullptr) const {
        const DF d;
        const DI di;
        const VI one = hn::Set(di, 1), last = bounds_.last[axis];
        if constexpr (!kInner) p = bounds_.clamped(p, axis);
        VI i = truncated(p);
        // At the last sample the cell before it is used, so that one reflection is enough.
        if constexpr (!kInner) i = hn::Max(hn::Min(i, hn::Sub(last, one)), hn::Zero(di));
        const VF f = hn::Sub(p, hn::ConvertTo(d, i)), g = hn::Sub(hn::Set(d, 1.0f), f);
        index[0] = hn::Sub(i, one);
        index[1] = i;
        index[2] = hn::Add(i, one);
        index[3] = hn::Add(index[2], one);
        if constexpr (!kInner) {
            index[0] = hn::Min(hn::Abs(index[0]), last);
            index[2] = hn::Min(index[2], last);
            const VI beyond = hn::Max(hn::Sub(index[3], last), hn::Zero(di));
            index[3] = hn::Max(hn::Sub(hn::Min(index[3], last), beyond), hn::Zero(di));
        }
        const VF sixth = hn::Set(d, 1.0f / 6), half = hn::Set(d, 0.5f),
                 two_thirds = hn::Set(d, 2.0f / 3);
        const VF ff = hn::Mul(f, f), gg = hn::Mul(g, g);
        weight[0] = hn::Mul(sixth, hn::Mul(gg, g));
        weight[1] = hn::MulAdd(hn::Mul(half, f), ff, hn::Sub(two_thirds, ff));
        weight[2] = hn::MulAdd(hn::Mul(half, g), gg, hn::Sub(two_thirds, gg));
        weight[3] = hn::Mul(sixth, hn::Mul(ff, f));
        if (!slope) return;
        const VF two = hn::Set(d, 2.0f), three_halves = hn::Set(d, 1.5f);
        slope[0] = hn::Neg(hn::Mul(half, gg));
        slope[1] = hn::MulSub(three_halves, ff, hn::Mul(two, f));
        slope[2] = hn::NegMulAdd(three_halves, gg, hn::Mul(two, g));
        slope[3] = hn::Mul(half, ff);
    }
    Read read_;
    Bounds bounds_;
};

/// Any filter, by its weights; beyond the ends the outermost samples continue.
template <class Read>
class WeightedSampler {
 public:
    static constexpr bool kPrefetches = false, kWeighted = true;
    WeightedSampler(const Grid& grid, const TapPolynomials& weights)
        : read_(grid), bounds_(grid.extent), weights_(weights), taps_(weights.taps()) {}

    template <bool kInner>
    HWY_INLINE VF at(VF x, VF y, VF z) const {
        VI i[kMost], j[kMost], k[kMost];
        VF u[kMost], v[kMost], w[kMost];
        taps<kInner>(x, 0, i, u);
        taps<kInner>(y, 1, j, v);
        taps<kInner>(z, 2, k, w);
        VF sum = hn::Zero(DF());
        for (int c = 0; c < taps_; ++c) {
            VF plane = hn::Zero(DF());
            for (int b = 0; b < taps_; ++b) {
                VF row = hn::Zero(DF());
                for (int a = 0; a < taps_; ++a)
                    row = hn::MulAdd(u[a], value(i[a], j[b], k[c]), row);
                plane = hn::MulAdd(v[b], row, plane);
            }
            sum = hn::MulAdd(w[c], plane, sum);
        }
        return sum;
    }
    /// The derivatives along x, y and z.
    HWY_NOINLINE void gradient(VF x, VF y, VF z, VF (&slopes)[3]) const {
        SlopedTaps<kMost> along[3];
        const VF place[3] = {x, y, z};
        for (int axis = 0; axis < 3; ++axis)
            taps<false>(place[axis], axis, along[axis].index, along[axis].weight,
                        along[axis].slope);
        sum_slopes(
            along, taps_, [&](VI i, VI j, VI k) HWY_ATTR { return value(i, j, k); }, slopes);
    }

 private:
    static constexpr int kMost = TapPolynomials::kMostTaps;

    HWY_INLINE VF value(VI i, VI j, VI k) const {
        if constexpr (std::is_same_v<Read, Walked>)
            return read_.at(i, j, k);
        else
            return read_.at(read_.offset(i, j, k));
    }
    /// @param slope  derivatives of the weights; null: nobody asks
    template <bool kInner>
    HWY_INLINE void taps(VF p, int axis, VI index[kMost], VF weight[kMost],
                         VF* slope = nullptr) const {
        const DF d;
        const DI di;
        if constexpr (!kInner) p = bounds_.clamped(p, axis);
        const VI i = truncated(p);
        const VF f = hn::Sub(p, hn::ConvertTo(d, i));
        for (int tap = 0; tap < taps_; ++tap) {
            index[tap] = hn::Add(i, hn::Set(di, tap + 1 - taps_ / 2));
            if constexpr (!kInner)
                index[tap] = hn::Min(hn::Max(index[tap], hn::Zero(di)), bounds_.last[axis]);
            VF sum = hn::Set(d, weights_.coefficient(tap, weights_.degree()));
            for (int power = weights_.degree(); power-- > 0;)
                sum = hn::MulAdd(sum, f, hn::Set(d, weights_.coefficient(tap, power)));
            weight[tap] = sum;
            if (!slope) continue;
            VF steep = hn::Zero(d);
            for (int power = weights_.degree(); power > 0; --power)
                steep = hn::MulAdd(
                    steep, f,
                    hn::Set(d, static_cast<float>(power) * weights_.coefficient(tap, power)));
            slope[tap] = steep;
        }
    }
    Read read_;
    Bounds bounds_;
    const TapPolynomials& weights_;
    int taps_;
};

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
