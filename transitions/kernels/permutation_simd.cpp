#include <algorithm>
#include <cmath>
#include <span>

#include "transitions/kernels/permutation.hpp"
#include "transitions/kernels/scalar_load.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/permutation_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/gathers-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::forward {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using gathers::HWY_NAMESPACE::between;
using gathers::HWY_NAMESPACE::Floats;
using gathers::HWY_NAMESPACE::gather_one;
using gathers::HWY_NAMESPACE::gather_pairs;
using gathers::HWY_NAMESPACE::Ints;
using gathers::HWY_NAMESPACE::Pair;
using gathers::HWY_NAMESPACE::VF;
using gathers::HWY_NAMESPACE::VI;
using gathers::HWY_NAMESPACE::with_reads;

using Doubles = hn::CappedTag<double, 8>;
using Longs = hn::RebindToSigned<Doubles>;
using VD = hn::Vec<Doubles>;

constexpr double kBorderSlack = 1e-9;  // [voxel]; of the backward warp, so both see the same input
constexpr int kStretch = 128;          // sites of a row that are worked on together

/// What one stretch of a row sends, and where to.
struct Stretch {
    alignas(64) std::int64_t target[kStretch];  // index on the screen; -1: nothing is sent
    alignas(64) double source[kStretch];        // sample index of the cell, from `base`
    alignas(64) float fraction[3][kStretch];    // of the cell, for foh
    alignas(64) float value[kStretch];
    std::int64_t base = 0;
    int count = 0;
};

HWY_INLINE VD indices_from(double first) {
    const Doubles d;
    return hn::Add(hn::Set(d, first), hn::Iota(d, 0.0));
}

/// An integer of at most 2^51 that is held in a double, as bits: no conversion instruction needed.
HWY_INLINE hn::Vec<Longs> bits_of_index(VD index) {
    const Doubles d;
    const Longs dl;
    const VD shifted = hn::Add(index, hn::Set(d, 0x1p52));
    return hn::And(hn::BitCast(dl, shifted), hn::Set(dl, (std::int64_t{1} << 52) - 1));
}

HWY_INLINE VD dot(const std::array<double, 3>& by, const VD (&at)[3], double offset) {
    const Doubles d;
    VD sum = hn::MulAdd(hn::Set(d, by[0]), at[0], hn::Set(d, offset));
    sum = hn::MulAdd(hn::Set(d, by[1]), at[1], sum);
    return hn::MulAdd(hn::Set(d, by[2]), at[2], sum);
}

/// The rule for a vector of sites: `at` becomes the screen site, and `point` the object point that
/// it sees, which the roundings have moved away from the site.
HWY_INLINE void apply_rule(const PermutationWarp::Plan& plan, VD (&at)[3], VD (&point)[3]) {
    const Doubles d;
    for (int k = 0; k < plan.chain.count; ++k) {
        const Shear& shear = plan.chain.shears[k];
        const VD step = dot(shear.by, at, shear.offset);
        const VD whole = hn::Floor(hn::Add(step, hn::Set(d, 0.5)));
        const VD error = hn::Sub(whole, step);
        // Highway vectors may have no run-time index on some targets, hence no at[shear.axis].
        if (shear.axis == 0) at[0] = hn::Add(at[0], whole);
        if (shear.axis == 1) at[1] = hn::Add(at[1], whole);
        if (shear.axis == 2) at[2] = hn::Add(at[2], whole);
        for (int i = 0; i < 3; ++i)
            point[i] = hn::MulAdd(error, hn::Set(d, plan.error_moves[k][i]), point[i]);
    }
}

/// Where the values of a vector of sites go; -1 beyond the screen, or where the point lies outside
/// the input.
HWY_INLINE hn::Vec<Longs> target_of(const PermutationWarp::Plan& plan, const VD (&at)[3],
                                    const VD (&point)[3]) {
    const Doubles d;
    auto sent = hn::Ge(at[0], hn::Zero(d));
    for (int i = 0; i < 3; ++i) {
        const double low = -0.5 - kBorderSlack;
        const double high = double(plan.object.extent[i]) - 0.5 + kBorderSlack;
        sent = hn::And(sent, hn::And(hn::Ge(at[i], hn::Set(d, double(plan.box.begin[i]))),
                                     hn::Lt(at[i], hn::Set(d, double(plan.box.end[i])))));
        sent = hn::And(
            sent, hn::And(hn::Ge(point[i], hn::Set(d, low)), hn::Le(point[i], hn::Set(d, high))));
    }
    const Extent n = plan.box.extent();
    const double first =
        double(plan.box.begin[0]) +
        double(n.x) * (double(plan.box.begin[1]) + double(n.y) * double(plan.box.begin[2]));
    VD index = hn::MulAdd(at[2], hn::Set(d, double(n.y)), at[1]);
    index = hn::Sub(hn::MulAdd(index, hn::Set(d, double(n.x)), at[0]), hn::Set(d, first));
    const Longs dl;
    return hn::IfThenElse(hn::RebindMask(dl, sent), bits_of_index(index), hn::Set(dl, -1));
}

/// Cell and fraction of a point, with the border rule: the nearest sample continues.
template <Send kSend>
HWY_INLINE VD cell_of(VD point, std::int64_t n, VD& fraction) {
    const Doubles d;
    const VD zero = hn::Zero(d), last = hn::Set(d, double(n - 1));
    if constexpr (kSend == Send::zoh) {
        const VD nearest = hn::Floor(hn::Add(point, hn::Set(d, 0.5)));
        return hn::Min(hn::Max(nearest, zero), last);
    } else {
        const VD held = hn::Min(hn::Max(point, zero), last);
        // The last centre is the far end of the last cell, so that both taps exist.
        const VD far = hn::Set(d, double(std::max<std::int64_t>(n - 2, 0)));
        const VD cell = hn::Min(hn::Floor(held), far);
        fraction = hn::Sub(held, cell);
        return cell;
    }
}

template <Send kSend>
void place_stretch(const PermutationWarp::Plan& plan, const PermutationWarp::Row& row,
                   std::int64_t begin, Stretch& stretch) {
    const Doubles d;
    const hn::Rebind<float, Doubles> df;
    const Extent& n = plan.object.extent;
    const int lanes = int(hn::Lanes(d));
    // Up to a whole vector of floats: the lanes behind the last site gather too.
    const int count = (stretch.count + 15) & ~15;
    for (int i = 0; i < count; i += lanes) {
        const VD x = indices_from(double(begin + i));
        VD point[3] = {x, hn::Set(d, double(row.y)), hn::Set(d, double(row.z))};
        VD at[3];
        for (int a = 0; a < 3; ++a)
            at[a] = hn::MulAdd(x, hn::Set(d, row.step[a]), hn::Set(d, row.start[a]));
        apply_rule(plan, at, point);
        hn::Store(target_of(plan, at, point), Longs(), stretch.target + i);
        if constexpr (kSend == Send::me) continue;
        VD source = hn::Set(d, -double(stretch.base)), fraction = hn::Zero(d);
        const double strides[3] = {1, double(plan.object.row_step()),
                                   double(plan.object.slice_step())};
        for (int a = 0; a < 3; ++a) {
            const VD cell = cell_of<kSend>(point[a], n[a], fraction);
            source = hn::MulAdd(cell, hn::Set(d, strides[a]), source);
            if constexpr (kSend == Send::foh)
                hn::Store(hn::DemoteTo(df, fraction), df, stretch.fraction[a] + i);
        }
        hn::Store(source, d, stretch.source + i);
    }
}

/// Byte offsets of a vector of cells.
template <class T>
HWY_INLINE VI offsets_at(const double* source) {
    const Ints di;
    const hn::Half<Ints> half;
    const hn::Rebind<double, hn::Half<Ints>> dd;
    constexpr int kShift = sizeof(T) / 2;  // 1, 2, 4 bytes: 0, 1, 2
#if HWY_TARGET == HWY_SCALAR
    (void)half;
    (void)dd;
    return hn::ShiftLeft<kShift>(hn::Set(di, std::int32_t(*source)));
#else
    const auto low = hn::DemoteTo(half, hn::Load(dd, source));
    const auto high = hn::DemoteTo(half, hn::Load(dd, source + hn::Lanes(dd)));
    return hn::ShiftLeft<kShift>(hn::Combine(di, high, low));
#endif
}

template <class Read, Send kSend>
void reconstruct_lanes(const PermutationWarp::Plan& plan, Stretch& stretch) {
    using T = typename Read::Sample;
    const Floats d;
    const Extent& n = plan.object.extent;
    const std::uint8_t* base =
        plan.object.as<std::uint8_t>() + stretch.base * std::int64_t(sizeof(T));
    const std::int64_t next_y = n.y > 1 ? plan.object.row_step() * std::int64_t(sizeof(T)) : 0;
    const std::int64_t next_z = n.z > 1 ? plan.object.slice_step() * std::int64_t(sizeof(T)) : 0;
    for (int i = 0; i < stretch.count; i += int(hn::Lanes(d))) {
        const VI offset = offsets_at<T>(stretch.source + i);
        VF value;
        if constexpr (kSend == Send::zoh) {
            value = gather_one<Read>(base, offset, plan.object.end);
        } else {
            const VF fx = hn::Load(d, stretch.fraction[0] + i);
            const VF fy = hn::Load(d, stretch.fraction[1] + i);
            const auto plane = [&](const std::uint8_t* start) HWY_ATTR {
                Pair taps[2];
                gather_pairs<Read, 2>({start, start + next_y}, offset, plan.object.end, taps);
                return between<T>(between<T>(taps[0].first, taps[0].second, fx),
                                  between<T>(taps[1].first, taps[1].second, fx), fy);
            };
            value = plane(base);
            if (next_z != 0)
                value =
                    between<T>(value, plane(base + next_z), hn::Load(d, stretch.fraction[2] + i));
        }
        hn::Store(value, d, stretch.value + i);
    }
}

/// The samples of the sites themselves: a stretch of a row, its ends held beyond the border.
template <class T>
void own_samples(const PermutationWarp::Plan& plan, const PermutationWarp::Row& row,
                 std::int64_t begin, Stretch& stretch) {
    const Extent& n = plan.object.extent;
    const std::int64_t y = std::clamp<std::int64_t>(row.y, 0, n.y - 1);
    const std::int64_t z = std::clamp<std::int64_t>(row.z, 0, n.z - 1);
    const T* line = plan.object.as<T>() + z * plan.object.slice_step() + y * plan.object.row_step();
    const int first = int(std::clamp<std::int64_t>(-begin, 0, stretch.count));
    const int last = int(std::clamp<std::int64_t>(n.x - begin, first, stretch.count));
    for (int i = 0; i < first; ++i) stretch.value[i] = float(line[0]);
    for (int i = first; i < last; ++i) stretch.value[i] = float(line[begin + i]);
    for (int i = last; i < stretch.count; ++i) stretch.value[i] = float(line[n.x - 1]);
}

/// Scatters one channel of a stretch.
void send(const PermutationWarp::Plan& plan, const Stretch& stretch, int channel, float* screen) {
    const bool mapped = !plan.object.values.identity();
    const float slope = float(plan.object.values.slope);
    const float offset = float(plan.object.values.offset);
    const int channels = plan.object.channels;
    for (int i = 0; i < stretch.count; ++i) {
        if (stretch.target[i] < 0) continue;
        const float value = stretch.value[i];
        screen[stretch.target[i] * channels + channel] = mapped ? slope * value + offset : value;
    }
}

/// Types, channels and strides that gathers do not take; one number at a time.
template <Send kSend>
void reconstruct_one_by_one(const PermutationWarp::Plan& plan, const PermutationWarp::Row& row,
                            std::int64_t begin, int channel, Stretch& stretch) {
    const ScalarLoad load = scalar_load(plan.object.type);
    const Extent& n = plan.object.extent;
    const int channels = plan.object.channels;
    const auto at = [&](std::int64_t index) {
        return load(plan.object.samples, index * channels + channel);
    };
    const auto mix = [](float a, float b, float f) {
        return f == 0 ? a : f == 1 ? b : a + f * (b - a);
    };
    const std::int64_t next_y = n.y > 1 ? plan.object.row_step() : 0;
    const std::int64_t next_z = n.z > 1 ? plan.object.slice_step() : 0;
    const std::int64_t next_x = n.x > 1 ? 1 : 0;
    for (int i = 0; i < stretch.count; ++i) {
        if (stretch.target[i] < 0) continue;
        if constexpr (kSend == Send::me) {
            const std::int64_t x = std::clamp<std::int64_t>(begin + i, 0, n.x - 1);
            const std::int64_t y = std::clamp<std::int64_t>(row.y, 0, n.y - 1);
            const std::int64_t z = std::clamp<std::int64_t>(row.z, 0, n.z - 1);
            stretch.value[i] = at(z * plan.object.slice_step() + y * plan.object.row_step() + x);
            continue;
        }
        const std::int64_t cell = stretch.base + std::int64_t(stretch.source[i]);
        if constexpr (kSend == Send::zoh) {
            stretch.value[i] = at(cell);
        } else {
            const float fx = stretch.fraction[0][i], fy = stretch.fraction[1][i];
            const auto line = [&](std::int64_t c) { return mix(at(c), at(c + next_x), fx); };
            const auto plane = [&](std::int64_t c) { return mix(line(c), line(c + next_y), fy); };
            stretch.value[i] = mix(plane(cell), plane(cell + next_z), stretch.fraction[2][i]);
        }
    }
}

template <class Read, Send kSend>
void permute_row(const PermutationWarp::Plan& plan, const PermutationWarp::Row& row,
                 Stretch& stretch, float* screen) {
    const Extent& n = plan.object.extent;
    const std::int64_t y = std::clamp<std::int64_t>(row.y, 0, n.y - 1);
    const std::int64_t z = std::clamp<std::int64_t>(row.z, 0, n.z - 1);
    for (std::int64_t x = row.sites.begin; x < row.sites.end; x += kStretch) {
        stretch.count = int(std::min<std::int64_t>(kStretch, row.sites.end - x));
        stretch.base = z * plan.object.slice_step() + y * plan.object.row_step() +
                       std::clamp<std::int64_t>(x, 0, n.x - 1);
        place_stretch<kSend>(plan, row, x, stretch);
        if (plan.lanes) {
            if constexpr (kSend == Send::me)
                own_samples<typename Read::Sample>(plan, row, x, stretch);
            else
                reconstruct_lanes<Read, kSend>(plan, stretch);
            send(plan, stretch, 0, screen);
            continue;
        }
        for (int c = 0; c < plan.object.channels; ++c) {
            reconstruct_one_by_one<kSend>(plan, row, x, c, stretch);
            send(plan, stretch, c, screen);
        }
    }
}

void permute(const PermutationWarp::Plan& plan, std::span<const PermutationWarp::Row> rows,
             float* screen) {
    with_reads(plan.object.type, [&](auto read) {
        using Read = decltype(read);
        Stretch stretch;
        for (const PermutationWarp::Row& row : rows) {
            if (plan.send == Send::me)
                permute_row<Read, Send::me>(plan, row, stretch, screen);
            else if (plan.send == Send::zoh)
                permute_row<Read, Send::zoh>(plan, row, stretch, screen);
            else
                permute_row<Read, Send::foh>(plan, row, stretch, screen);
        }
    });
}

}  // namespace HWY_NAMESPACE
}  // namespace edgewise::kernels::forward
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {
namespace forward {
HWY_EXPORT(permute);
}  // namespace forward

void permute_simd(const PermutationWarp::Plan& plan, std::span<const PermutationWarp::Row> rows,
                  float* screen) noexcept {
    using namespace forward;
    HWY_DYNAMIC_DISPATCH(permute)(plan, rows, screen);
}

}  // namespace edgewise::kernels
#endif
