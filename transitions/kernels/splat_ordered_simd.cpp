// Footprints of classified voxels: composited one by one, or sheet by sheet.
#include "transitions/kernels/splat_ordered.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/splat_ordered_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/classified_rows-inl.hpp"
#include "transitions/kernels/splat-inl.hpp"
//
#include "hwy/contrib/math/math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

constexpr int kWholeCellBits = 5;
static_assert(Footprints::Shape{}.cells == 1 << kWholeCellBits);

/// Which places of a row have footprints that may meet the sums.
class PlacesMeeting {
 public:
    PlacesMeeting(const OrderedSplat& of, const SplatSums& sums) : splat_(of.splat) {
        const auto along = static_cast<std::size_t>(of.rows.axes[0]);
        length_ = static_cast<double>(of.rows.count(0));
        for (std::size_t i = 0; i < 2; ++i) {
            low_[i] = double(sums.begin[i]) - splat_.reach[i] - 1;
            high_[i] = double(sums.end[i]) + splat_.reach[i];
            // Steps below move a row of 2^20 voxels by less than a pixel.
            const double step = splat_.screen[i].voxel[along];
            inverse_[i] = std::abs(step) < 1e-6 ? 0 : 1 / step;
        }
    }
    HWY_INLINE SplatSpan operator()(const VoxelPlace& at, std::size_t) const {
        double from = 0, to = length_;
        for (std::size_t i = 0; i < 2; ++i) {
            const double start = splat_.screen[i].of(double(at[0]), double(at[1]), double(at[2]));
            const double low = low_[i] - start, high = high_[i] - start;
            if (inverse_[i] == 0) {
                if (low > 1 || high < -1) return {};
                continue;
            }
            const double one = low * inverse_[i], other = high * inverse_[i];
            from = std::max(from, std::floor(std::min(one, other)));
            to = std::min(to, std::ceil(std::max(one, other)) + 1);
        }
        if (!(from < to)) return {};
        return {static_cast<std::int32_t>(from), static_cast<std::int32_t>(to)};
    }

 private:
    const Splat& splat_;
    double length_;
    std::array<double, 2> low_, high_, inverse_;
};

/// Calls use(voxel, weights, pixels) for each vector of a slice's footprints.
template <class Read, bool kShort, class Use>
void each_vector(const OrderedSplat& of, std::int64_t slice, const SplatSums& sums,
                 const Use& use) {
    using To = Vectors<kShort>;
    const Splat& splat = of.splat;
    const Lookup<kShort, kWholeCellBits> lookup(splat);
    const FixedPlace &a = splat.across[0], &b = splat.across[1];
    each_classified(
        of.rows, slice, PlacesMeeting(of, sums),
        [&](const ClassifiedVoxel& voxel, const VoxelPlace& at) {
            const auto [x, y, z] = at;
            const Patch patch(splat, double(x), double(y), double(z));
            if (!patch.meets(splat, sums)) return;
            const auto* table = reinterpret_cast<const std::uint8_t*>(table_of(splat, x, y, z));
            const auto left = static_cast<std::int32_t>(patch.left);
            const auto top = static_cast<std::int32_t>(patch.top);
            const std::uint32_t one = a.of(x, y, z) + a.right(left) + a.down(top);
            const std::uint32_t other = b.of(x, y, z) + b.right(left) + b.down(top);
            float* first = sums.first + (top - sums.begin[1]) * sums.pitch + left - sums.begin[0];
            for (int j = 0; j < splat.patch[1]; j += To::kRows)
                for (int i = 0; i < splat.patch[0]; i += To::kColumns) {
                    const VW place =
                        lookup.places(one + a.right(i) + a.down(j), other + b.right(i) + b.down(j));
                    const VF weights =
                        gather_one<Read>(table, hn::BitCast(Ints(), hn::ShiftLeft<2>(place)));
                    use(voxel, weights, first + j * sums.pitch + i);
                }
        });
}

/// Less light is left behind a medium by so much, as a share: exp(-depth) - 1.
HWY_INLINE VF gained(VF depth) { return hn::Expm1(Floats(), hn::Neg(depth)); }

struct Composited {
    const OrderedSplat& of;
    std::int64_t slice;
    const SplatSums& sums;
    std::ptrdiff_t plane;
    float bound;

    template <class Read>
    void run() const {
        const Floats d;
        const VF least = hn::Set(d, bound);
        each_vector<Read, false>(
            of, slice, sums, [&](const ClassifiedVoxel& voxel, VF weights, float* pixels) {
                const VF left = hn::LoadU(d, pixels);
                // What lies beside a footprint is not touched: other tiles do not see it either.
                const auto seen = hn::And(hn::Gt(left, least), hn::Gt(weights, hn::Zero(d)));
                const VF gain = gained(hn::Mul(weights, hn::Set(d, voxel.depth)));
                const VF change = hn::IfThenElseZero(seen, hn::Mul(left, gain));
                hn::StoreU(hn::Add(left, change), d, pixels);
                for (std::size_t c = 0; c < 3; ++c) {
                    float* to = pixels + static_cast<std::ptrdiff_t>(c + 1) * plane;
                    const VF light = hn::Mul(change, hn::Set(d, voxel.color[c]));
                    hn::StoreU(hn::Sub(hn::LoadU(d, to), light), d, to);
                }
            });
    }
};

struct Summed {
    const OrderedSplat& of;
    std::int64_t slice;
    const SplatSums& sums;
    std::ptrdiff_t plane;

    template <class Read, bool kShort>
    void add() const {
        const Floats d;
        each_vector<Read, kShort>(
            of, slice, sums, [&](const ClassifiedVoxel& voxel, VF weights, float* pixels) {
                const VF depth = hn::Mul(weights, hn::Set(d, voxel.depth));
                Vectors<kShort>::add(depth, pixels, sums.pitch);
                for (std::size_t c = 0; c < 3; ++c)
                    Vectors<kShort>::add(hn::Mul(depth, hn::Set(d, voxel.color[c])),
                                         pixels + static_cast<std::ptrdiff_t>(c + 1) * plane,
                                         sums.pitch);
            });
    }
    template <class Read>
    void run() const {
        if constexpr (kMost >= kNarrow)
            if (of.splat.patch[0] <= kNarrow) return add<Read, true>();
        add<Read, false>();
    }
};

template <class Body>
void by_gathers(const Body& body) {
#if EDGEWISE_LOADS
    if (gathers_are_slow()) return body.template run<Reads<float, true>>();
#endif
    body.template run<Reads<float, false>>();
}

void composite_voxels_on(const OrderedSplat& of, std::int64_t slice, const SplatSums& pixels,
                         std::ptrdiff_t plane, float bound) {
    by_gathers(Composited{of, slice, pixels, plane, bound});
}

void add_to_sheet_on(const OrderedSplat& of, std::int64_t slice, const SplatSums& sheet,
                     std::ptrdiff_t plane) {
    by_gathers(Summed{of, slice, sheet, plane});
}

bool composite_sheet_on(const SplatSums& sheet, std::ptrdiff_t plane, const float* lengths,
                        const PixelStates& pixels, float bound) {
    const Floats d;
    const VF least = hn::Set(d, bound), none = hn::Zero(d);
    const std::int64_t width = sheet.end[0] - sheet.begin[0];
    bool any = false;
    for (std::int64_t y = 0; y < sheet.end[1] - sheet.begin[1]; ++y)
        for (std::int64_t x = 0; x < width; x += kMost) {
            const std::ptrdiff_t i = y * pixels.pitch + x;
            const float* sums = sheet.first + y * sheet.pitch + x;
            float* to = pixels.first + i;
            const VF left = hn::LoadU(d, to), scale = hn::LoadU(d, lengths + i);
            const VF depth = hn::Mul(hn::LoadU(d, sums), scale);
            const auto seen = hn::And(hn::Gt(left, least), hn::Gt(depth, none));
            // Of all that is emitted in the sheet, what leaves it: (1 - exp(-D)) / D.
            const VF change = hn::IfThenElseZero(seen, hn::Mul(left, gained(depth)));
            const VF behind = hn::Add(left, change);
            const VF share = hn::IfThenElseZero(seen, hn::Div(hn::Mul(change, scale), depth));
            hn::StoreU(behind, d, to);
            for (std::ptrdiff_t c = 1; c < 4; ++c) {
                const VF light = hn::Mul(share, hn::LoadU(d, sums + c * plane));
                float* color = to + c * pixels.plane;
                hn::StoreU(hn::Sub(hn::LoadU(d, color), light), d, color);
            }
            const auto inside =
                hn::FirstN(d, static_cast<std::size_t>(std::min<std::int64_t>(kMost, width - x)));
            any = any || !hn::AllFalse(d, hn::And(inside, hn::Gt(behind, least)));
        }
    return any;
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(composite_voxels_on);
HWY_EXPORT(add_to_sheet_on);
HWY_EXPORT(composite_sheet_on);

void composite_voxels(const OrderedSplat& of, std::int64_t slice, const SplatSums& pixels,
                      std::ptrdiff_t plane, float bound) {
    HWY_DYNAMIC_DISPATCH(composite_voxels_on)(of, slice, pixels, plane, bound);
}

void add_to_sheet(const OrderedSplat& of, std::int64_t slice, const SplatSums& sheet,
                  std::ptrdiff_t plane) {
    HWY_DYNAMIC_DISPATCH(add_to_sheet_on)(of, slice, sheet, plane);
}

bool composite_sheet(const SplatSums& sheet, std::ptrdiff_t plane, const float* lengths,
                     const PixelStates& pixels, float bound) {
    return HWY_DYNAMIC_DISPATCH(composite_sheet_on)(sheet, plane, lengths, pixels, bound);
}

}  // namespace edgewise::kernels
#endif
