// Ray casting by packets: neighbouring rays, one a lane, step together.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "transitions/kernels/ray_cast.hpp"
#include "transitions/kernels/ray_path.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/ray_cast_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/ray_combine-inl.hpp"
#include "transitions/kernels/ray_samplers-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

constexpr int kChecked = 8;  // cells between looks at whether any lane still needs samples

/// Which pixels the lanes are: nearly square, so that rays stay close in the volume.
constexpr int kWidth = std::min<int>(4, kLanes);
constexpr int kHeight = static_cast<int>(kLanes) / kWidth;

/// The rays of one packet. Lanes without a hit walk along the first one that has one, unmasked.
struct Packet {
    HWY_ALIGN float position[3][kLanes] = {}, stride[3][kLanes] = {};
    HWY_ALIGN int first[kLanes] = {}, last[kLanes] = {};
    HWY_ALIGN float first_offset[kLanes] = {}, last_offset[kLanes] = {};
    HWY_ALIGN float first_weight[kLanes] = {}, last_weight[kLanes] = {};
    double length[kLanes] = {};
    bool hit[kLanes] = {};
    int begin = 0, end = 0;              // cells that some lane needs
    int inner_begin = 0, inner_end = 0;  // cells that all lanes have inside
    float steepest = 0;                  // largest stride along any axis

    bool prepare(const RayCast& cast, double x, double y, int columns, int rows);

 private:
    void set(int lane, const RayPath& path);
};

void Packet::set(int lane, const RayPath& path) {
    for (int axis = 0; axis < 3; ++axis) {
        position[axis][lane] = static_cast<float>(path.position[axis]);
        stride[axis][lane] = static_cast<float>(path.stride[axis]);
        steepest = std::max(steepest, std::abs(stride[axis][lane]));
    }
    first[lane] = static_cast<int>(path.first);
    last[lane] = static_cast<int>(path.last);
    first_offset[lane] = static_cast<float>(path.first_offset);
    last_offset[lane] = static_cast<float>(path.last_offset);
    first_weight[lane] = static_cast<float>(path.first_weight);
    last_weight[lane] = static_cast<float>(path.last_weight);
    length[lane] = path.length;
    hit[lane] = path.hit();
}

bool Packet::prepare(const RayCast& cast, double x, double y, int columns, int rows) {
    const int lanes = static_cast<int>(kLanes);
    RayPath paths[kLanes];
    const RayPath* some = nullptr;
    for (int lane = 0; lane < lanes; ++lane) {
        const int column = lane % kWidth, row = lane / kWidth;
        if (column < columns && row < rows) paths[lane] = ray_path(cast, x + column, y + row);
        if (!some && paths[lane].hit()) some = &paths[lane];
    }
    if (!some) return false;

    steepest = 0;
    std::int64_t low = some->first, high = some->last;
    std::int64_t inner_low = some->inner_first, inner_high = some->inner_last;
    for (int lane = 0; lane < lanes; ++lane) {
        const bool real = paths[lane].hit();
        const RayPath& path = real ? paths[lane] : *some;
        set(lane, path);
        hit[lane] = real;
        low = std::min(low, path.first);
        high = std::max(high, path.last);
        inner_low = std::max(inner_low, path.inner_first);
        inner_high = std::min(inner_high, path.inner_last);
    }
    begin = static_cast<int>(low);
    end = static_cast<int>(high) + 1;
    inner_begin = inner_low <= inner_high ? static_cast<int>(inner_low) : end;
    inner_end = inner_low <= inner_high ? static_cast<int>(inner_high) + 1 : end;
    return true;
}

/// Looks up what the surroundings of a packet hold.
class Levels {
 public:
    Levels(const Bricks& bricks, Hold hold, float steepest) : bricks_(bricks) {
        // A level covers a brick and its neighbours. A stretch around its middle must not reach
        // farther than a brick's width, less the taps beyond a position.
        const int reach = (1 << Bricks::kShift) - (hold == Hold::bspline3 ? 2 : 1);
        const double cells = steepest > 0 ? 2.0 * reach / steepest : 64;
        cells_ = 1 + static_cast<int>(std::min(cells, 63.0));
    }
    /// How many cells one look covers.
    int cells() const { return cells_; }
    HWY_INLINE VF at(VF x, VF y, VF z) const {
        const DI d;
        const VI i = hn::ShiftRight<Bricks::kShift>(truncated(x)),
                 j = hn::ShiftRight<Bricks::kShift>(truncated(y)),
                 k = hn::ShiftRight<Bricks::kShift>(truncated(z));
        const VI row = hn::Add(j, hn::Mul(k, hn::Set(d, static_cast<int>(bricks_.extent.y))));
        const VI brick = hn::Add(i, hn::Mul(row, hn::Set(d, static_cast<int>(bricks_.extent.x))));
        return hn::GatherIndex(DF(), bricks_.level.data(), brick);
    }

 private:
    const Bricks& bricks_;
    int cells_;
};

/// The rays of a packet as vectors.
struct Lanes {
    VF position[3], stride[3];
    VI first;

    explicit Lanes(const Packet& packet) : first(hn::Load(DI(), packet.first)) {
        for (int axis = 0; axis < 3; ++axis) {
            position[axis] = hn::Load(DF(), packet.position[axis]);
            stride[axis] = hn::Load(DF(), packet.stride[axis]);
        }
    }
    /// Cells from each ray's own first cell.
    HWY_INLINE VF offset(int cell) const {
        return hn::ConvertTo(DF(), hn::Sub(hn::Set(DI(), cell), first));
    }
    HWY_INLINE VF at(VF offset, int axis) const {
        return hn::MulAdd(offset, stride[axis], position[axis]);
    }
};

/// Cells [begin, end), some of which belong to some lanes only, or are cut by the box.
template <class Sampler, class Sum>
HWY_NOINLINE void walk_ends(const Packet& packet, const Sampler& sampler, Sum& sum, int begin,
                            int end) {
    const DF d;
    const Lanes lanes(packet);
    const VF first_offset = hn::Load(d, packet.first_offset),
             last_offset = hn::Load(d, packet.last_offset),
             first_weight = hn::Load(d, packet.first_weight),
             last_weight = hn::Load(d, packet.last_weight);
    const VI last = hn::Load(DI(), packet.last);
    for (int cell = begin; cell < end; ++cell) {
        const VI now = hn::Set(DI(), cell);
        const MF is_first = hn::RebindMask(d, hn::Eq(now, lanes.first));
        const MF is_last = hn::RebindMask(d, hn::Eq(now, last));
        const MF outside = hn::RebindMask(d, hn::Or(hn::Lt(now, lanes.first), hn::Gt(now, last)));
        VF offset = lanes.offset(cell), weight = hn::Set(d, 1.0f);
        offset = hn::IfThenElse(is_first, first_offset, offset);
        offset = hn::IfThenElse(is_last, last_offset, offset);
        weight = hn::IfThenElse(is_first, first_weight, weight);
        weight = hn::IfThenElse(is_last, last_weight, weight);
        const VF value = sampler.template at<false>(lanes.at(offset, 0), lanes.at(offset, 1),
                                                    lanes.at(offset, 2));
        sum.add_part(value, weight, outside, cell);
    }
}

/// Cells [begin, end), whole and inside for all lanes, of which none is left out.
template <class Sampler, class Sum>
HWY_INLINE void walk_all(const Lanes& lanes, const Sampler& sampler, Sum& sum, int begin, int end,
                         int stride = 1) {
    for (int cell = begin; cell < end; cell += stride) {
        const VF offset = lanes.offset(cell);
        sum.add(sampler.template at<true>(lanes.at(offset, 0), lanes.at(offset, 1),
                                          lanes.at(offset, 2)),
                cell);
    }
}

/// Adds cells times the rays that have them, where somebody counts.
class Count {
 public:
    Count(const RayCast& cast, const Packet& packet)
        : taken_(cast.taken),
          rays_(cast.taken ? std::count(packet.hit, packet.hit + kLanes, true) : 0) {}
    HWY_INLINE void operator()(int cells) const {
        if (taken_) *taken_ += cells * rays_;
    }

 private:
    std::int64_t* taken_;
    std::int64_t rays_;
};

template <class Sampler, class Sum>
HWY_NOINLINE void walk_inside(const RayCast& cast, const Packet& packet, const Sampler& sampler,
                              Sum& sum) {
    const Lanes lanes(packet);
    const int begin = packet.inner_begin, end = packet.inner_end;
    const Count count(cast, packet);
    if constexpr (Sum::kSkips) {
        if (cast.bricks) {
            const Levels levels(*cast.bricks, cast.hold, packet.steepest);
            // A few of the samples, taken first, tell early which stretches cannot matter.
            if constexpr (Sum::kAnyOrder) {
                walk_all(lanes, sampler, sum, begin + kChecked, end, 2 * kChecked);
                count((end - begin) / (2 * kChecked));
            }
            for (int cell = begin; cell < end && sum.alive(); cell += levels.cells()) {
                const VF middle =
                    hn::Add(lanes.offset(cell), hn::Set(DF(), 0.5f * (levels.cells() - 1)));
                // The middle of the last stretch may lie beyond the inside.
                const VF inside = hn::Min(middle, lanes.offset(end - 1));
                const VF level =
                    levels.at(lanes.at(inside, 0), lanes.at(inside, 1), lanes.at(inside, 2));
                if (!sum.needs(level)) continue;
                const int next = std::min(cell + levels.cells(), end);
                walk_all(lanes, sampler, sum, cell, next);
                count(next - cell);
            }
            return;
        }
    }
    for (int cell = begin; cell < end && sum.alive(); cell += kChecked) {
        const int next = std::min(cell + kChecked, end);
        walk_all(lanes, sampler, sum, cell, next);
        count(next - cell);
    }
}

template <class Sampler, class Sum>
void fill(const RayCast& cast, const Sampler& sampler, std::int64_t x, std::int64_t y,
          std::int64_t width, std::int64_t height, float* out, std::ptrdiff_t row_floats) {
    Packet packet;
    for (std::int64_t row = 0; row < height; row += kHeight) {
        const int rows = static_cast<int>(std::min<std::int64_t>(kHeight, height - row));
        for (std::int64_t column = 0; column < width; column += kWidth) {
            const int columns = static_cast<int>(std::min<std::int64_t>(kWidth, width - column));
            Sum sum(cast);
            const bool any = packet.prepare(cast, static_cast<double>(x + column),
                                            static_cast<double>(y + row), columns, rows);
            if (any) {
                walk_ends(packet, sampler, sum, packet.begin,
                          std::min(packet.inner_begin, packet.end));
                walk_inside(cast, packet, sampler, sum);
                walk_ends(packet, sampler, sum, packet.inner_end, packet.end);
            }
            const typename Sum::Lanewise result(sum);
            for (int r = 0; r < rows; ++r)
                for (int c = 0; c < columns; ++c) {
                    const int lane = r * kWidth + c;
                    const bool hit = any && packet.hit[lane];
                    result.write(cast, lane, hit, hit ? packet.length[lane] : 0,
                                 out + (row + r) * row_floats + (column + c) * Sum::kChannels);
                }
        }
    }
}

/// The call with its types: what is sampled how, and combined how.
struct Call {
    const RayCast& cast;
    std::int64_t x, y, width, height;
    float* out;
    std::ptrdiff_t row_floats;

    template <class Sampler, bool kFinite>
    void combined() const {
        const Sampler sampler(cast.volume);
        switch (cast.rule) {
            case Combine::max:
                return with<Sampler, MaxSum<kFinite>>(sampler);
            case Combine::sum:
            case Combine::mean:
                return with<Sampler, LineSum<kFinite>>(sampler);
            case Combine::over:
                return cast.optics->grey ? with<Sampler, OverSum<kFinite, 1>>(sampler)
                                         : with<Sampler, OverSum<kFinite, 3>>(sampler);
        }
    }
    template <class Sampler, class Sum>
    void with(const Sampler& sampler) const {
        fill<Sampler, Sum>(cast, sampler, x, y, width, height, out, row_floats);
    }
    template <class Read, bool kFinite>
    void held() const {
        switch (cast.hold) {
            case Hold::zoh:
                return combined<NearestSampler<Read>, kFinite>();
            case Hold::foh:
                return combined<LinearSampler<Read>, kFinite>();
            case Hold::bspline3:
                // Coefficients are f32; of other types they are merely allowed.
                if constexpr (std::is_same_v<Read, Gathered<float>>)
                    return combined<SplineSampler<Read>, kFinite>();
                else
                    return combined<SplineSampler<Walked>, kFinite>();
        }
    }
};

void ray_cast_on(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                 std::int64_t height, float* out, std::ptrdiff_t row_floats) {
    const Call call{cast, x, y, width, height, out, row_floats};
    const Grid& volume = cast.volume;
    const double bytes =
        static_cast<double>(volume.extent.samples()) * static_cast<double>(bytes_of(volume.type));
    if (bytes < 2147483648.0) {  // offsets of 32 bits
        switch (volume.type) {
            case Type::u8:
                return call.held<Gathered<std::uint8_t>, true>();
            case Type::i8:
                return call.held<Gathered<std::int8_t>, true>();
            case Type::u16:
                return call.held<Gathered<std::uint16_t>, true>();
            case Type::i16:
                return call.held<Gathered<std::int16_t>, true>();
            case Type::f32:
                return call.held<Gathered<float>, false>();
            default:
                break;
        }
    }
    call.held<Walked, false>();
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(ray_cast_on);

void ray_cast(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
              std::int64_t height, float* out, std::ptrdiff_t row_floats) {
    HWY_DYNAMIC_DISPATCH(ray_cast_on)(cast, x, y, width, height, out, row_floats);
}

}  // namespace edgewise::kernels
#endif
