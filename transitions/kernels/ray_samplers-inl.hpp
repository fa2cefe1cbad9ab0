// Reconstruction at a vector of positions. Compiled once a target: see Highway's foreach_target.h.
#if defined(EDGEWISE_RAY_SAMPLERS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef EDGEWISE_RAY_SAMPLERS_INL
#undef EDGEWISE_RAY_SAMPLERS_INL
#else
#define EDGEWISE_RAY_SAMPLERS_INL
#endif

#include <cstring>
#include <type_traits>

#include "hwy/highway.h"
#include "transitions/kernels/grid.hpp"
#include "transitions/kernels/optics-inl.hpp"
#include "transitions/kernels/scalar_load.hpp"

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
template <class T>
class Gathered {
 public:
    static constexpr bool kPairs = sizeof(T) <= 2;  // one 32-bit read holds a sample and the next

    explicit Gathered(const Grid& grid)
        : base_(static_cast<const char*>(grid.samples)),
          row_(static_cast<int>(grid.extent.x * sizeof(T))),
          slice_(static_cast<int>(grid.extent.x * grid.extent.y * sizeof(T))) {}

    HWY_INLINE VI offset(VI x, VI y, VI z) const {
        const DI d;
        const VI across = hn::ShiftLeft < sizeof(T) == 1 ? 0 : sizeof(T) == 2 ? 1 : 2 > (x);
        return hn::Add(hn::Add(hn::Mul(z, hn::Set(d, slice_)), hn::Mul(y, hn::Set(d, row_))),
                       across);
    }
    /// The sample itself.
    HWY_INLINE VF at(VI offset) const {
        const DF d;
        if constexpr (std::is_same_v<T, float>)
            return hn::GatherOffset(d, reinterpret_cast<const float*>(base_), offset);
        else
            return hn::ConvertTo(d, low(word(base_, offset)));
    }
    /// (1 - f) sample + f next sample along x, times 2^14, less `kMiddle` times 2^14. The weights
    /// have 14 bits: at most 3e-5 of the difference between two samples is lost.
    HWY_INLINE VF along_x(const char* base, VI offset, VI weights) const {
        const DI d;
        VI pair = word(base, offset);
        if constexpr (sizeof(T) == 1) {
            if constexpr (std::is_signed_v<T>)
                pair = hn::Xor(pair, hn::Set(d, static_cast<int>(0x80808080u)));
            pair = widened_pair(pair);
        } else if constexpr (!std::is_signed_v<T>) {
            pair = hn::Xor(pair, hn::Set(d, static_cast<int>(0x80008000u)));
        }
        return hn::ConvertTo(DF(), dot_of_halves(pair, weights));
    }
    /// What the bit flips of along_x took away.
    static constexpr float kMiddle = std::is_same_v<T, std::int8_t>     ? -128.0f
                                     : std::is_same_v<T, std::uint16_t> ? 32768.0f
                                                                        : 0.0f;

    const char* base() const { return base_; }
    int row() const { return row_; }
    int slice() const { return slice_; }

 private:
    HWY_INLINE static VI word(const char* base, VI offset) {
        return hn::GatherOffset(DI(), reinterpret_cast<const int*>(base), offset);
    }
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
    HWY_INLINE static VI low(VI word) {
        constexpr int kUnused = 32 - 8 * static_cast<int>(sizeof(T));
        if constexpr (kUnused == 0) return word;
        const VI up = hn::ShiftLeft<kUnused>(word);
        if constexpr (std::is_signed_v<T>) return hn::ShiftRight<kUnused>(up);
        return hn::BitCast(DI(),
                           hn::ShiftRight<kUnused>(hn::BitCast(hn::RebindToUnsigned<DI>(), up)));
    }

    const char* base_;
    int row_, slice_;
};

/// Reads of any type and of volumes of any size, one lane after the other with 64-bit indices.
class Walked {
 public:
    explicit Walked(const Grid& grid)
        : samples_(grid.samples),
          load_(scalar_load(grid.type)),
          nx_(grid.extent.x),
          ny_(grid.extent.y) {}

    HWY_NOINLINE VF at(VI x, VI y, VI z) const {
        HWY_ALIGN int ix[kLanes], iy[kLanes], iz[kLanes];
        HWY_ALIGN float v[kLanes];
        hn::Store(x, DI(), ix);
        hn::Store(y, DI(), iy);
        hn::Store(z, DI(), iz);
        for (std::size_t lane = 0; lane < kLanes; ++lane)
            v[lane] = load_(samples_, (iz[lane] * ny_ + iy[lane]) * nx_ + ix[lane]);
        return hn::Load(DF(), v);
    }

 private:
    const void* samples_;
    ScalarLoad load_;
    std::int64_t nx_, ny_;
};

/// Nearest sample, ties upwards.
template <class Read>
class NearestSampler {
 public:
    explicit NearestSampler(const Grid& grid) : read_(grid), bounds_(grid.extent) {}

    template <bool kInner>
    HWY_INLINE VF at(VF x, VF y, VF z) const {
        const VI i = index<kInner>(x, 0), j = index<kInner>(y, 1), k = index<kInner>(z, 2);
        if constexpr (std::is_same_v<Read, Walked>)
            return read_.at(i, j, k);
        else
            return read_.at(read_.offset(i, j, k));
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

/// Trilinear.
template <class Read>
class LinearSampler {
 public:
    explicit LinearSampler(const Grid& grid) : read_(grid), bounds_(grid.extent) {}

    template <bool kInner>
    HWY_INLINE VF at(VF x, VF y, VF z) const {
        const DF d;
        if constexpr (!kInner) {
            x = bounds_.clamped(x, 0);
            y = bounds_.clamped(y, 1);
            z = bounds_.clamped(z, 2);
        }
        const VI i = truncated(x), j = truncated(y), k = truncated(z);
        const VF f = hn::Sub(x, hn::ConvertTo(d, i)), g = hn::Sub(y, hn::ConvertTo(d, j)),
                 h = hn::Sub(z, hn::ConvertTo(d, k));
        if constexpr (std::is_same_v<Read, Walked>)
            return walked(i, j, k, f, g, h);
        else
            return gathered<kInner>(i, j, k, f, g, h);
    }

 private:
    HWY_INLINE VI next(VI i, int axis) const {
        return hn::Min(hn::Add(i, hn::Set(DI(), 1)), bounds_.last[axis]);
    }
    HWY_INLINE VF walked(VI i, VI j, VI k, VF f, VF g, VF h) const {
        const VI i1 = next(i, 0), j1 = next(j, 1), k1 = next(k, 2);
        const VF a = between(read_.at(i, j, k), read_.at(i1, j, k), f);
        const VF b = between(read_.at(i, j1, k), read_.at(i1, j1, k), f);
        const VF c = between(read_.at(i, j, k1), read_.at(i1, j, k1), f);
        const VF e = between(read_.at(i, j1, k1), read_.at(i1, j1, k1), f);
        return between(between(a, b, g), between(c, e, g), h);
    }
    template <bool kInner>
    HWY_INLINE VF gathered(VI i, VI j, VI k, VF f, VF g, VF h) const {
        const DI d;
        const VI offset = read_.offset(i, j, k);
        // The inside needs one vector of offsets and four bases; at the ends a missing neighbour is
        // replaced by the sample itself, lane by lane.
        VI down = hn::Zero(d), deep = hn::Zero(d);
        const char* base[4] = {read_.base(), read_.base(), read_.base(), read_.base()};
        if constexpr (kInner) {
            base[1] += read_.row();
            base[2] += read_.slice();
            base[3] += read_.row() + read_.slice();
        } else {
            down = hn::IfThenElseZero(hn::Lt(j, bounds_.last[1]), hn::Set(d, read_.row()));
            deep = hn::IfThenElseZero(hn::Lt(k, bounds_.last[2]), hn::Set(d, read_.slice()));
        }
        const VI offsets[4] = {offset, hn::Add(offset, down), hn::Add(offset, deep),
                               hn::Add(offset, hn::Add(down, deep))};
        VF v[4];
        if constexpr (Read::kPairs) {
            const VI weight =
                truncated(hn::MulAdd(f, hn::Set(DF(), 16384.0f), hn::Set(DF(), 0.5f)));
            const VI weights = hn::Add(hn::Sub(hn::ShiftLeft<16>(weight), weight),
                                       hn::Set(d, 16384));  // (weight << 16) | (16384 - weight)
            for (int n = 0; n < 4; ++n)
                v[n] = read_.along_x(base[n], kInner ? offset : offsets[n], weights);
        } else {
            for (int n = 0; n < 4; ++n) v[n] = ends<kInner>(base[n], offsets[n], i, f);
        }
        const VF value = between(between(v[0], v[1], g), between(v[2], v[3], g), h);
        if constexpr (Read::kPairs)
            return hn::MulAdd(value, hn::Set(DF(), 1.0f / 16384), hn::Set(DF(), Read::kMiddle));
        return value;
    }
    template <bool kInner>
    HWY_INLINE VF ends(const char* base, VI offset, VI i, VF f) const {
        const DF d;
        const float* samples = reinterpret_cast<const float*>(base);
        const VF a = hn::GatherOffset(d, samples, offset);
        if constexpr (kInner) return between(a, hn::GatherOffset(d, samples + 1, offset), f);
        const VI right =
            hn::IfThenElseZero(hn::Lt(i, bounds_.last[0]), hn::Set(DI(), sizeof(float)));
        return between(a, hn::GatherOffset(d, samples, hn::Add(offset, right)), f);
    }

    Read read_;
    Bounds bounds_;
};

/// Cubic B-spline of coefficients, which are mirrored at the end samples.
template <class Read>
class SplineSampler {
 public:
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

 private:
    HWY_INLINE VF value(VI i, VI j, VI k) const {
        if constexpr (std::is_same_v<Read, Walked>)
            return read_.at(i, j, k);
        else
            return read_.at(read_.offset(i, j, k));
    }
    template <bool kInner>
    HWY_INLINE void taps(VF p, int axis, VI index[4], VF weight[4]) const {
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
    }
    Read read_;
    Bounds bounds_;
};

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
