// Shear-warp of the largest sample: blocks of pixels stay in registers while slices go by.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "transitions/kernels/shear_warp_max.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/shear_warp_max_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using DF = hn::CappedTag<float, 16>;
using DI = hn::RebindToSigned<DF>;
using VF = hn::Vec<DF>;
constexpr std::int64_t kLanes = hn::MaxLanes(DF());

constexpr std::int64_t kColumns = 128, kRows = 16;  // of a part of a tile with states of its own
constexpr std::int64_t kTogether = 8;               // rows of states in registers
constexpr std::int64_t kSlices = 16;                // their lines in a part stay in the first cache

/// Lanes of u8 and i8: levels above the lowest, times 128. Negative slopes turn levels around.
///
/// A product is rounded to 1/128 of a level, a weight to 2^-15 (and just below 1 down): each of two
/// interpolations, one in the other, errs by at most 1.5/128 of a level, and mostly by a third.
template <class T>
struct ByteLanes {
    using Sample = T;
    using State = std::int16_t;
    using D = hn::CappedTag<std::int16_t, 32>;
    using V = hn::Vec<D>;
    static constexpr State kEmpty = -1;

    V flip;
    float offset;  // level 0 as the state of a pixel

    explicit ByteLanes(const Combining& with) {
        const bool turned = with.values.slope < 0;
        constexpr bool kSigned = std::is_signed_v<T>;
        flip = hn::Set(D(), static_cast<State>((turned ? 0xff : 0) ^ (kSigned ? 0x80 : 0)));
        offset = kSigned ? (turned ? -127.0f : -128.0f) : (turned ? -255.0f : 0.0f);
    }
    HWY_INLINE V load(const T* row) const {
        const hn::Rebind<std::uint8_t, D> narrow;
        const auto bytes = hn::LoadU(narrow, reinterpret_cast<const std::uint8_t*>(row));
        return hn::ShiftLeft<7>(hn::Xor(hn::PromoteTo(D(), bytes), flip));
    }
    static V weight(double f) {
        return hn::Set(D(), static_cast<State>(std::min(std::floor(f * 32768 + 0.5), 32767.0)));
    }
    static HWY_INLINE V mixed(V a, V b, V f) {
        return hn::Add(a, hn::MulFixedPoint15(hn::Sub(b, a), f));
    }
    HWY_INLINE VF levels(const State* row) const {
        const hn::Rebind<State, DI> narrow;
        const VF value = hn::ConvertTo(DF(), hn::PromoteTo(DI(), hn::LoadU(narrow, row)));
        const VF level = hn::MulAdd(value, hn::Set(DF(), 1.0f / 128), hn::Set(DF(), offset));
        return hn::IfThenElse(hn::Lt(value, hn::Zero(DF())),
                              hn::Set(DF(), -std::numeric_limits<float>::infinity()), level);
    }
};

template <class T>
struct FloatLanes {
    using Sample = T;
    using State = float;
    using D = DF;
    using V = VF;
    static constexpr State kEmpty = -std::numeric_limits<float>::infinity();

    V sign;

    explicit FloatLanes(const Combining& with)
        : sign(hn::Set(D(), with.values.slope < 0 ? -0.0f : 0.0f)) {}
    HWY_INLINE V load(const T* row) const {
        const hn::Rebind<T, DI> narrow;
        const auto whole = hn::PromoteTo(DI(), hn::LoadU(narrow, row));
        return hn::Xor(hn::ConvertTo(DF(), whole), sign);
    }
    static V weight(double f) { return hn::Set(D(), static_cast<float>(f)); }
    static HWY_INLINE V mixed(V a, V b, V f) { return hn::MulAdd(f, hn::Sub(b, a), a); }
    HWY_INLINE VF levels(const State* row) const { return hn::LoadU(DF(), row); }
};

struct Range {
    std::int64_t begin, end;

    bool holds(std::int64_t from, std::int64_t to) const { return begin <= from && to <= end; }
    Range within(std::int64_t from, std::int64_t to) const {
        const std::int64_t first = std::clamp(begin, from, to);
        return {first, std::clamp(end, first, to)};
    }
};

/// How the pixels of a part see one axis of a slice.
struct Axis {
    std::int64_t first = 0;    // sample of pixel 0; with first-order hold its lower neighbour
    double weight = 0;         // of the upper neighbour, which is one on
    std::int64_t samples = 0;  // of the slice along the axis
    Range any{0, 0};           // pixels over the slice, of which spans say whether they count
    Range sure{0, 0};          // pixels that count, whatever the rounding of spans
    Range taps{0, 0};          // those of which all taps are in the slice

    Axis() = default;
    Axis(double shift, std::int64_t pixel, std::int64_t pixels, std::int64_t n, std::int64_t slices,
         Hold hold)
        : samples(n) {
        // Rounding must not lose a pixel in a face of the volume. Spans are f32, and a place in a
        // slice moves by at most a voxel from one to the next.
        constexpr double kSlip = 1e-9;
        const double margin = 1e-6 * static_cast<double>(slices + 1);
        const double high = static_cast<double>(n) - 0.5;
        const auto range = [&](double low, double up) {
            const auto begin = static_cast<std::int64_t>(std::ceil(low - shift)) - pixel;
            const auto end = static_cast<std::int64_t>(std::floor(up - shift)) + 1 - pixel;
            return Range{begin, end}.within(0, pixels);
        };
        any = range(-0.5 - kSlip, high + kSlip);
        sure = range(-0.5 + margin, high - margin);
        const double whole = std::floor(hold == Hold::zoh ? shift + 0.5 : shift);
        weight = hold == Hold::zoh ? 0 : shift - whole;
        first = static_cast<std::int64_t>(whole) + pixel;
        taps = Range{-first, n - first - (weight > 0 ? 1 : 0)}.within(sure.begin, sure.end);
    }
    std::int64_t at(std::int64_t pixel) const {
        return std::clamp<std::int64_t>(first + pixel, 0, samples - 1);
    }
};

/// One part of the image, of at most kColumns x kRows pixels.
template <class Lanes, bool kNearest>
class Part {
    using T = typename Lanes::Sample;
    using D = typename Lanes::D;
    using V = typename Lanes::V;
    using State = typename Lanes::State;
    static constexpr std::int64_t kWide = hn::MaxLanes(D());
    static constexpr std::int64_t kPitch = kColumns + kWide;

    struct Slice {
        std::int64_t z;
        const T* samples;
        Axis x, y;
        std::int64_t next;  // samples from a tap to that on its right
        V right, down;
    };

 public:
    Part(const ShearWarp& warp, std::int64_t i, std::int64_t j, std::int64_t width,
         std::int64_t height, const PixelSpans& spans, const PixelStates& states)
        : warp_(warp),
          lanes_(warp.with),
          i_(i),
          j_(j),
          width_(width),
          height_(height),
          spans_(spans),
          states_(states) {}

    void run() {
        std::fill(best_, best_ + kRows * kPitch, Lanes::kEmpty);
        const std::int64_t slices = warp_.volume.extent.z;
        for (std::int64_t z = 0; z < slices; z += kSlices) add(z, std::min(z + kSlices, slices));
        for (std::int64_t row = 0; row < height_; ++row) {
            float* state = states_.first + row * states_.pitch;
            const State* best = best_ + row * kPitch;
            for (std::int64_t i = 0; i < width_; i += kLanes) {
                const VF level = hn::Max(hn::LoadU(DF(), state + i), lanes_.levels(best + i));
                hn::StoreU(level, DF(), state + i);
            }
        }
    }

 private:
    Slice slice(std::int64_t z) const {
        const Extent& n = warp_.volume.extent;
        const double k = static_cast<double>(z);
        // The place of a pixel is a whole number from that of any other, so tiles show nowhere.
        const Axis x(warp_.x + k * warp_.dx, i_, width_, n.x, n.z, warp_.hold);
        const Axis y(warp_.y + k * warp_.dy, j_, height_, n.y, n.z, warp_.hold);
        return {z,
                warp_.volume.template as<T>() + z * warp_.volume.slice_step(),
                x,
                y,
                x.weight > 0 ? 1 : 0,
                Lanes::weight(x.weight),
                Lanes::weight(y.weight)};
    }

    void add(std::int64_t begin, std::int64_t end) {
        alignas(64) Slice slices[kSlices];
        std::int64_t count = 0;
        for (std::int64_t z = begin; z < end; ++z) {
            slices[count] = slice(z);
            const Slice& s = slices[count];
            if (s.x.any.begin < s.x.any.end && s.y.any.begin < s.y.any.end) ++count;
        }
        for (std::int64_t row = 0; row < height_; row += kTogether)
            for (std::int64_t i = 0; i < width_; i += kWide) {
                add_block(slices, count, row, i);
                for (std::int64_t n = 0; n < count; ++n)
                    if (!whole(slices[n], row, i)) add_part(slices[n], row, i);
            }
        for (std::int64_t n = 0; n < count; ++n) add_edges(slices[n]);
    }

    /// Every pixel of a block counts, and no line is clamped.
    static bool whole(const Slice& s, std::int64_t row, std::int64_t i) {
        return s.x.taps.holds(i, i + kWide) && s.y.taps.holds(row, row + kTogether) &&
               s.y.first + row + kTogether < s.y.samples;
    }

    HWY_INLINE V line(const Slice& s, const T* samples) const {
        if constexpr (kNearest) return lanes_.load(samples);
        return Lanes::mixed(lanes_.load(samples), lanes_.load(samples + s.next), s.right);
    }

    void add_block(const Slice* slices, std::int64_t count, std::int64_t row, std::int64_t i) {
        const D d;
        State* states = best_ + row * kPitch + i;
        const std::int64_t pitch = warp_.volume.row_step();
        V b0 = hn::LoadU(d, states), b1 = hn::LoadU(d, states + kPitch);
        V b2 = hn::LoadU(d, states + 2 * kPitch), b3 = hn::LoadU(d, states + 3 * kPitch);
        V b4 = hn::LoadU(d, states + 4 * kPitch), b5 = hn::LoadU(d, states + 5 * kPitch);
        V b6 = hn::LoadU(d, states + 6 * kPitch), b7 = hn::LoadU(d, states + 7 * kPitch);
        for (std::int64_t n = 0; n < count; ++n) {
            const Slice& s = slices[n];
            if (!whole(s, row, i)) continue;
            const T* samples = s.samples + (s.y.first + row) * pitch + s.x.first + i;
            V upper = line(s, samples);
            const auto advance = [&](V& best) HWY_ATTR {
                samples += pitch;
                const V lower = line(s, samples);
                best = hn::Max(best, kNearest ? upper : Lanes::mixed(upper, lower, s.down));
                upper = lower;
            };
            advance(b0), advance(b1), advance(b2), advance(b3);
            advance(b4), advance(b5), advance(b6), advance(b7);
        }
        hn::StoreU(b0, d, states), hn::StoreU(b1, d, states + kPitch);
        hn::StoreU(b2, d, states + 2 * kPitch), hn::StoreU(b3, d, states + 3 * kPitch);
        hn::StoreU(b4, d, states + 4 * kPitch), hn::StoreU(b5, d, states + 5 * kPitch);
        hn::StoreU(b6, d, states + 6 * kPitch), hn::StoreU(b7, d, states + 7 * kPitch);
    }

    /// The pixels of a block that surely count, of which those in the taps' range.
    void add_part(const Slice& s, std::int64_t row, std::int64_t i) {
        const Range columns = s.x.taps.within(i, std::min(i + kWide, width_));
        const Range rows = s.y.sure.within(row, std::min(row + kTogether, height_));
        if (columns.begin < columns.end)
            for (std::int64_t r = rows.begin; r < rows.end; ++r)
                add_pixels(s, r, columns, s.x.first + columns.begin, s.next);
    }

    /// Pixels beside the outermost samples, and those in a face, which may count or not.
    void add_edges(const Slice& s) {
        const auto one = [&](std::int64_t row, std::int64_t i) {
            const float* low = spans_.low + row * spans_.pitch;
            const float* high = spans_.high + row * spans_.pitch;
            const auto z = static_cast<float>(s.z);
            if (z < low[i] || z > high[i]) return;
            const std::int64_t at = s.x.at(i);
            const std::int64_t next =
                s.x.first + i < 0 ? 0 : std::min(at + s.next, s.x.samples - 1) - at;
            add_pixels(s, row, {i, i + 1}, at, next);
        };
        for (std::int64_t row = s.y.any.begin; row < s.y.any.end; ++row) {
            const bool sure = row >= s.y.sure.begin && row < s.y.sure.end;
            const Range done = sure ? s.x.taps : Range{s.x.any.end, s.x.any.end};
            for (std::int64_t i = s.x.any.begin; i < done.begin; ++i) one(row, i);
            for (std::int64_t i = done.end; i < s.x.any.end; ++i) one(row, i);
        }
    }

    /// At most kWide pixels of a row; the first sees `column` and the one `next` on.
    HWY_INLINE void add_pixels(const Slice& s, std::int64_t row, const Range& pixels,
                               std::int64_t column, std::int64_t next) {
        const D d;
        const std::int64_t pitch = warp_.volume.row_step();
        const auto along = [&](std::int64_t y) HWY_ATTR {
            const T* samples = warp_.volume.tail.of(s.samples + y * pitch) + column;
            if constexpr (kNearest) return lanes_.load(samples);
            return Lanes::mixed(lanes_.load(samples), lanes_.load(samples + next), s.right);
        };
        V value = along(s.y.at(row));
        if constexpr (!kNearest) value = Lanes::mixed(value, along(s.y.at(row + 1)), s.down);
        State* state = best_ + row * kPitch + pixels.begin;
        const V best = hn::LoadU(d, state);
        const auto these = hn::FirstN(d, static_cast<std::size_t>(pixels.end - pixels.begin));
        hn::StoreU(hn::IfThenElse(these, hn::Max(best, value), best), d, state);
    }

    const ShearWarp& warp_;
    const Lanes lanes_;
    std::int64_t i_, j_, width_, height_;
    PixelSpans spans_;
    PixelStates states_;
    HWY_ALIGN State best_[kRows * kPitch];
};

template <class Lanes>
void each_part(const ShearWarp& warp, std::int64_t i, std::int64_t j, std::int64_t width,
               std::int64_t height, const PixelSpans& spans, const PixelStates& states) {
    for (std::int64_t y = 0; y < height; y += kRows)
        for (std::int64_t x = 0; x < width; x += kColumns) {
            const std::int64_t columns = std::min(kColumns, width - x);
            const std::int64_t rows = std::min(kRows, height - y);
            const std::ptrdiff_t span = y * spans.pitch + x;
            const PixelSpans part_spans{spans.low + span, spans.high + span, spans.pitch};
            const PixelStates part_states{states.first + y * states.pitch + x, states.pitch,
                                          states.plane};
            if (warp.hold == Hold::zoh)
                Part<Lanes, true>(warp, i + x, j + y, columns, rows, part_spans, part_states).run();
            else
                Part<Lanes, false>(warp, i + x, j + y, columns, rows, part_spans, part_states)
                    .run();
        }
}

bool shear_warp_max_on(const ShearWarp& warp, std::int64_t i, std::int64_t j, std::int64_t width,
                       std::int64_t height, const PixelSpans& spans, const PixelStates& states) {
    const auto with = [&]<class Lanes>() {
        each_part<Lanes>(warp, i, j, width, height, spans, states);
        return true;
    };
    switch (warp.volume.type) {
        case Type::u8:
            return with.template operator()<ByteLanes<std::uint8_t>>();
        case Type::i8:
            return with.template operator()<ByteLanes<std::int8_t>>();
        case Type::u16:
            return with.template operator()<FloatLanes<std::uint16_t>>();
        case Type::i16:
            return with.template operator()<FloatLanes<std::int16_t>>();
        default:
            return false;
    }
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(shear_warp_max_on);

bool shear_warp_max(const ShearWarp& warp, std::int64_t i, std::int64_t j, std::int64_t width,
                    std::int64_t height, const PixelSpans& spans, const PixelStates& states) {
    return warp.with.rule == Combine::max &&
           HWY_DYNAMIC_DISPATCH(shear_warp_max_on)(warp, i, j, width, height, spans, states);
}

}  // namespace edgewise::kernels
#endif
