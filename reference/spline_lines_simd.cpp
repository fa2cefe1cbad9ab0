#include <algorithm>
#include <array>
#include <cmath>
#include <hwy/cache_control.h>
#include <type_traits>

#include "reference/spline_lines.hpp"
#include "reference/stored.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "reference/spline_lines_simd.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway demands.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace edgewise {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

/// The causal filter's start on a line of n samples that is mirrored at its ends: a weighted sum of
/// the line's first ones, or of all where there are few.
template <class Real>
class Start {
 public:
    explicit Start(std::int64_t n) {
        double power = kSplinePole;
        add(0, 1);
        if (n > kHorizon) {
            for (int k = 1; k < kHorizon; ++k, power *= kSplinePole) add(k, power);
            return;
        }
        const double last = std::pow(kSplinePole, static_cast<double>(n - 1));
        double back = last * last / kSplinePole;  // pole^(2n - 2 - k) at k = 1
        add(n - 1, last);
        for (std::int64_t k = 1; k < n - 1; ++k, power *= kSplinePole, back /= kSplinePole)
            add(k, power + back);
        whole_ = 1 - last * last;
    }

    /// Calls each(place, weight).
    template <class Each>
    HWY_INLINE void each(Each&& each) const {
        for (std::size_t i = 0; i < count_; ++i) each(place_[i], weight_[i]);
    }
    double whole() const { return whole_; }  // what the sum is divided by

 private:
    static constexpr int kHorizon = sizeof(Real) == 8 ? 30 : 16;  // |pole|^30 = 7e-18, ^16 = 7e-10

    void add(std::int64_t place, double weight) {
        place_[count_] = place;
        weight_[count_++] = weight;
    }
    std::size_t count_ = 0;
    std::array<std::int64_t, kHorizon + 1> place_;
    std::array<double, kHorizon + 1> weight_;
    double whole_ = 1;
};

template <class Real>
constexpr Real kPole = static_cast<Real>(kSplinePole);
template <class Real>
constexpr Real kEnd = static_cast<Real>(kSplinePole / (kSplinePole * kSplinePole - 1));

/// Prefilters kRows lines of adjacent samples at once: each hides the others' latency.
template <int kRows, class Real>
HWY_INLINE void prefilter_rows(Real* first, std::int64_t n, std::int64_t row,
                               const Start<Real>& start) {
    const Real pole = kPole<Real>;
    std::array<double, kRows> sum{};
    start.each([&](std::int64_t place, double weight) HWY_ATTR {
        for (int r = 0; r < kRows; ++r) sum[r] += weight * first[r * row + place];
    });
    std::array<Real, kRows> carry;
    for (int r = 0; r < kRows; ++r)
        carry[r] = first[r * row] = static_cast<Real>(sum[r] / start.whole());
    for (std::int64_t i = 1; i < n; ++i)
        for (int r = 0; r < kRows; ++r) {
            carry[r] = first[r * row + i] + pole * carry[r];
            first[r * row + i] = carry[r];
        }
    for (int r = 0; r < kRows; ++r) {
        Real* last = first + r * row + n - 1;
        carry[r] = *last = kEnd<Real> * (*last + pole * last[-1]);
    }
    for (std::int64_t i = n - 2; i >= 0; --i)
        for (int r = 0; r < kRows; ++r) {
            carry[r] = pole * (carry[r] - first[r * row + i]);
            first[r * row + i] = carry[r];
        }
}

/// Prefilters a vector of lines that lie side by side.
template <class Real>
class Columns {
 public:
    Columns() = default;
    Columns(Real* first, std::int64_t n, std::int64_t step, std::size_t count)
        : first_(first), n_(n), step_(step), count_(count) {}
    static std::size_t lanes() { return hn::Lanes(D()); }

    /// kTogether at once: each hides the others' latency. All have the same length.
    template <int kTogether>
    static HWY_INLINE void prefilter(const std::array<Columns, kTogether>& columns,
                                     const Start<Real>& start) {
        const D d;
        const auto pole = hn::Set(d, kPole<Real>), end = hn::Set(d, kEnd<Real>);
        const std::int64_t n = columns[0].n_;
        hn::Vec<D> carry[kTogether];
        for (int c = 0; c < kTogether; ++c) {
            columns[c].begin(start);
            carry[c] = columns[c].load(0);
        }
        for (std::int64_t i = 1; i + 1 < n; ++i)
            for (int c = 0; c < kTogether; ++c) {
                carry[c] = hn::Add(columns[c].load(i), hn::Mul(pole, carry[c]));
                columns[c].store(i, carry[c]);
            }
        for (int c = 0; c < kTogether; ++c) {
            const auto last = hn::Add(columns[c].load(n - 1), hn::Mul(pole, carry[c]));
            carry[c] = hn::Mul(end, hn::Add(last, hn::Mul(pole, carry[c])));
            columns[c].store(n - 1, carry[c]);
        }
        for (std::int64_t i = n - 2; i >= 0; --i)
            for (int c = 0; c < kTogether; ++c) {
                carry[c] = hn::Mul(pole, hn::Sub(carry[c], columns[c].load(i)));
                columns[c].store(i, carry[c]);
            }
    }

 private:
    using D = hn::ScalableTag<Real>;
    using Doubles = hn::ScalableTag<double>;
    using Part = hn::Rebind<Real, Doubles>;  // as many as there are doubles in a vector

    HWY_INLINE hn::Vec<D> load(std::int64_t i) const {
        const Real* from = first_ + i * step_;
        return count_ == lanes() ? hn::LoadU(D(), from)
                                 : hn::MaskedLoad(hn::FirstN(D(), count_), D(), from);
    }
    HWY_INLINE void store(std::int64_t i, hn::Vec<D> v) const {
        Real* to = first_ + i * step_;
        if (count_ == lanes())
            hn::StoreU(v, D(), to);
        else
            hn::BlendedStore(v, hn::FirstN(D(), count_), D(), to);
    }
    HWY_INLINE void begin(const Start<Real>& start) const {
        for (std::size_t at = 0; at < count_; at += hn::Lanes(Doubles())) {
            const auto part = hn::FirstN(Part(), std::min(count_ - at, hn::Lanes(Doubles())));
            auto sum = hn::Zero(Doubles());
            start.each([&](std::int64_t place, double weight) HWY_ATTR {
                const auto v = hn::MaskedLoad(part, Part(), first_ + at + place * step_);
                sum = hn::Add(sum, hn::Mul(hn::Set(Doubles(), weight), wide(v)));
            });
            sum = hn::Div(sum, hn::Set(Doubles(), start.whole()));
            hn::BlendedStore(narrow(sum), part, Part(), first_ + at);
        }
    }
    static HWY_INLINE hn::Vec<Doubles> wide(hn::Vec<Part> v) {
        if constexpr (sizeof(Real) == 8)
            return v;
        else
            return hn::PromoteTo(Doubles(), v);
    }
    static HWY_INLINE hn::Vec<Part> narrow(hn::Vec<Doubles> v) {
        if constexpr (sizeof(Real) == 8)
            return v;
        else
            return hn::DemoteTo(Part(), v);
    }

    Real* first_ = nullptr;
    std::int64_t n_ = 0, step_ = 0;
    std::size_t count_ = 0;
};

/// Along y of planes of x and y, `apart` from each other: or along z, with y and z exchanged.
template <class Real>
void prefilter_columns(Real* first, std::int64_t n, std::int64_t step, std::int64_t across,
                       std::int64_t planes, std::int64_t apart) {
    if (n == 1) return;
    constexpr int kTogether = 4;
    const Start<Real> start(n);
    std::array<Columns<Real>, kTogether> together;
    int waiting = 0;
    const auto lanes = static_cast<std::int64_t>(Columns<Real>::lanes());
    for (std::int64_t plane = 0; plane < planes; ++plane)
        for (std::int64_t x = 0; x < across; x += lanes) {
            together[waiting++] = {first + plane * apart + x, n, step,
                                   static_cast<std::size_t>(std::min(lanes, across - x))};
            if (waiting < kTogether) continue;
            Columns<Real>::template prefilter<kTogether>(together, start);
            waiting = 0;
        }
    for (int c = 0; c < waiting; ++c) Columns<Real>::template prefilter<1>({together[c]}, start);
}

template <class Real>
void prefilter_along_x(const Box<Real>& box) {
    if (box.n.x == 1) return;
    constexpr int kTogether = 8;
    const Start<Real> start(box.n.x);
    for (std::int64_t z = 0; z < box.n.z; ++z) {
        Real* slice = box.first + z * box.plane;
        std::int64_t y = 0;
        for (; y + kTogether <= box.n.y; y += kTogether)
            prefilter_rows<kTogether>(slice + y * box.row, box.n.x, box.row, start);
        for (; y < box.n.y; ++y) prefilter_rows<1>(slice + y * box.row, box.n.x, box.row, start);
    }
}

template <class Real>
void prefilter_box(const Box<Real>& box) {
    prefilter_along_x(box);
    prefilter_columns(box.first, box.n.y, box.row, box.n.x, box.n.z, box.plane);
    prefilter_columns(box.first, box.n.z, box.plane, box.n.x, box.n.y, box.row);
}
void PrefilterFloats(const Box<float>& box) { prefilter_box(box); }
void PrefilterDoubles(const Box<double>& box) { prefilter_box(box); }

// Plain loops, which compilers turn into vectors.

template <class Wide, class To, class T>
HWY_INLINE void map_row(const T* in, std::int64_t step, Wide slope, Wide offset, To* out,
                        std::int64_t n) {
    for (std::int64_t x = 0; x < n; ++x)
        out[x] = static_cast<To>(slope * static_cast<Wide>(in[x * step]) + offset);
}

/// Rows of a small box of a large input lie far apart: processors do not foresee the next one.
template <class T>
HWY_INLINE void fetch_row(const T* row, std::int64_t n) {
    const auto* begin = reinterpret_cast<const char*>(row);
    const auto* end = reinterpret_cast<const char*>(row + n);
    for (const char* at = begin; at < end; at += 64) hwy::Prefetch(at);
    hwy::Prefetch(end - 1);
}

template <class Wide, class To>
void map_to(const StoredBox& from, Wide slope, Wide offset, const Box<To>& box) {
    constexpr std::int64_t kAhead = 24;  // rows
    const std::int64_t rows = box.n.y * box.n.z;
    with_stored_type(from.type, [&](auto zero) HWY_ATTR {
        const auto* stored = static_cast<const decltype(zero)*>(from.first);
        const auto row_of = [&](std::int64_t i) {
            return stored + i / box.n.y * from.plane + i % box.n.y * from.row;
        };
        for (std::int64_t i = 0; i < std::min(kAhead, rows); ++i)
            fetch_row(row_of(i), box.n.x * from.step);
        for (std::int64_t i = 0; i < rows; ++i) {
            if (i + kAhead < rows) fetch_row(row_of(i + kAhead), box.n.x * from.step);
            To* out = box.first + i / box.n.y * box.plane + i % box.n.y * box.row;
            if (from.step == 1)
                map_row(row_of(i), 1, slope, offset, out, box.n.x);
            else
                map_row(row_of(i), from.step, slope, offset, out, box.n.x);
        }
    });
}
void MapToFloats(const StoredBox& from, double slope, double offset, const Box<float>& to) {
    map_to(from, slope, offset, to);
}
void MapInDoubles(const StoredBox& from, double slope, double offset, const Box<double>& to) {
    map_to(from, slope, offset, to);
}
void MapInFloats(const StoredBox& from, float slope, float offset, const Box<float>& to) {
    map_to(from, slope, offset, to);
}

template <class Real>
bool is_finite(const Box<Real>& box) {
    using Count = std::conditional_t<sizeof(Real) == 8, std::int64_t, std::int32_t>;
    for (std::int64_t z = 0; z < box.n.z; ++z)
        for (std::int64_t y = 0; y < box.n.y; ++y) {
            const Real* row = box.first + z * box.plane + y * box.row;
            Count others = 0;
            for (std::int64_t x = 0; x < box.n.x; ++x) others |= row[x] - row[x] == 0 ? 0 : 1;
            if (others != 0) return false;
        }
    return true;
}
bool FloatsFinite(const Box<float>& box) { return is_finite(box); }
bool DoublesFinite(const Box<double>& box) { return is_finite(box); }

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace edgewise
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise {

HWY_EXPORT(PrefilterFloats);
HWY_EXPORT(PrefilterDoubles);
HWY_EXPORT(MapToFloats);
HWY_EXPORT(MapInDoubles);
HWY_EXPORT(MapInFloats);
HWY_EXPORT(FloatsFinite);
HWY_EXPORT(DoublesFinite);

StoredBox stored_box(const Data& data, const std::array<std::int64_t, 3>& begin, int channel,
                     std::int64_t step) {
    const Extent& n = data.what.extent;
    const std::int64_t channels = data.what.channels;
    const std::int64_t at = channel + channels * (begin[0] + n.x * (begin[1] + n.y * begin[2]));
    const void* first = with_stored_type(
        data.what.type, [&](auto zero) -> const void* { return data.as<decltype(zero)>() + at; });
    return {first, data.what.type, step, channels * n.x, channels * n.x * n.y};
}

void prefilter(const Box<float>& box) { HWY_DYNAMIC_DISPATCH(PrefilterFloats)(box); }
void prefilter(const Box<double>& box) { HWY_DYNAMIC_DISPATCH(PrefilterDoubles)(box); }

void map_box(const StoredBox& from, double slope, double offset, const Box<float>& to) {
    HWY_DYNAMIC_DISPATCH(MapToFloats)(from, slope, offset, to);
}
void map_box(const StoredBox& from, double slope, double offset, const Box<double>& to) {
    HWY_DYNAMIC_DISPATCH(MapInDoubles)(from, slope, offset, to);
}
void map_box(const StoredBox& from, float slope, float offset, const Box<float>& to) {
    HWY_DYNAMIC_DISPATCH(MapInFloats)(from, slope, offset, to);
}

bool all_finite(const Box<float>& box) { return HWY_DYNAMIC_DISPATCH(FloatsFinite)(box); }
bool all_finite(const Box<double>& box) { return HWY_DYNAMIC_DISPATCH(DoublesFinite)(box); }

}  // namespace edgewise
#endif
