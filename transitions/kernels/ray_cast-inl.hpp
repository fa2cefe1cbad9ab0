// Ray casting by packets: neighbouring rays, one a lane, step together. A unit a rule of combining
// includes this: ray_cast_max_simd.cpp and those beside it.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "transitions/kernels/ray_cast.hpp"
#include "transitions/kernels/ray_path.hpp"

#if defined(EDGEWISE_RAY_CAST_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef EDGEWISE_RAY_CAST_INL
#undef EDGEWISE_RAY_CAST_INL
#else
#define EDGEWISE_RAY_CAST_INL
#endif

#include "hwy/highway.h"
#include "transitions/kernels/ray_combine-inl.hpp"
#include "transitions/kernels/ray_light-inl.hpp"
#include "transitions/kernels/ray_samplers-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

constexpr int kChecked = 8;  // cells between looks at whether any lane still needs samples
constexpr int kAhead = 16;   // cells that sparse samples' lines are asked for before they are read

/// Which pixels the lanes are: nearly square, so that rays stay close in the volume.
constexpr int kWidth = std::min<int>(kPacketSide, kLanes);
constexpr int kHeight = static_cast<int>(kLanes) / kWidth;

using DD = hn::CappedTag<double, kLanes>;
using VD = hn::Vec<DD>;
constexpr std::size_t kSide = hn::MaxLanes(DD());  // lanes whose paths are reckoned at once

/// [low, high] of rays, as clip() of ray_path.hpp has it.
struct Spans {
    VD low, high;

    HWY_INLINE void clip(VD o, VD inverse, double from, double to) {
        if (from > to) {
            high = low;
            return;
        }
        const DD tag;
        const VD begin = hn::Set(tag, from), end = hn::Set(tag, to);
        const VD a = hn::Mul(hn::Sub(begin, o), inverse), b = hn::Mul(hn::Sub(end, o), inverse);
        const auto along = hn::Eq(inverse, hn::Zero(tag));
        const VD kept = hn::IfThenElse(hn::Or(hn::Lt(o, begin), hn::Gt(o, end)), low, high);
        high = hn::IfThenElse(along, kept, hn::Min(high, hn::Max(a, b)));
        low = hn::IfThenElse(along, low, hn::Max(low, hn::Min(a, b)));
    }
    /// As cut_by_plane().
    HWY_INLINE void cut(VD base, VD slope) {
        const DD tag;
        const VD zero = hn::Zero(tag), at = hn::Div(hn::Neg(base), slope);
        const auto along = hn::Lt(hn::Abs(slope), hn::Set(tag, kAlongPlane));
        const auto enters = hn::AndNot(along, hn::Gt(slope, zero));
        const auto leaves = hn::AndNot(along, hn::Lt(slope, zero));
        const auto out = hn::And(along, hn::Lt(base, hn::Set(tag, -kInPlane)));
        high = hn::IfThenElse(leaves, hn::Min(high, at), high);
        low = hn::IfThenElse(enters, hn::Max(low, at), low);
        high = hn::IfThenElse(out, low, high);
    }
    /// As cut_by_ball().
    HWY_INLINE void cut_ball(const VD (&from)[3], const VD (&along)[3]) {
        const DD tag;
        const VD zero = hn::Zero(tag);
        VD square = zero, across = zero, left = hn::Set(tag, 1.0);
        for (int axis = 0; axis < 3; ++axis) {
            square = hn::Add(square, hn::Mul(along[axis], along[axis]));
            across = hn::Add(across, hn::Mul(from[axis], along[axis]));
        }
        const VD middle = hn::Div(hn::Neg(across), square);
        for (int axis = 0; axis < 3; ++axis) {
            const VD nearest = hn::Add(from[axis], hn::Mul(middle, along[axis]));
            left = hn::Sub(left, hn::Mul(nearest, nearest));
        }
        const auto meets = hn::Gt(left, zero);
        const VD half = hn::Sqrt(hn::Div(hn::IfThenElseZero(meets, left), square));
        high = hn::IfThenElse(meets, hn::Min(high, hn::Add(middle, half)), low);
        low = hn::IfThenElse(meets, hn::Max(low, hn::Sub(middle, half)), low);
    }
};

/// The rays of one packet. Lanes without a hit walk along the first one that has one, unmasked.
struct Packet {
    HWY_ALIGN float position[3][kLanes] = {}, stride[3][kLanes] = {};
    HWY_ALIGN int first[kLanes] = {}, last[kLanes] = {};
    HWY_ALIGN int inner_first[kLanes] = {}, inner_last[kLanes] = {};
    HWY_ALIGN float first_offset[kLanes] = {}, last_offset[kLanes] = {};
    HWY_ALIGN float first_weight[kLanes] = {}, last_weight[kLanes] = {};
    HWY_ALIGN double length[kLanes] = {};
    bool hit[kLanes] = {};
    int begin = 0, end = 0;              // cells that some lane needs
    int inner_begin = 0, inner_end = 0;  // cells that all lanes have inside
    float steepest = 0;                  // largest stride along any axis
    int ahead = 0;  // so many cells before they are read lines are asked for; 0: never

    bool prepare(const RayCast& cast, const ParallelRays& shared, double x, double y, int columns,
                 int rows);

 private:
    void reckon(const RayCast& cast, const ParallelRays& shared, std::size_t lane, VD x, VD y);
    bool fill_in(int columns, int rows);
    void copy(int from, int to);
};

/// ray_path() of kSide lanes, operation for operation.
void Packet::reckon(const RayCast& cast, const ParallelRays& shared, std::size_t lane, VD x, VD y) {
    const DD d;
    const auto at = [&](const Rays::Field& field, int axis) {
        const VD right =
            hn::Add(hn::Set(d, field.base[axis]), hn::Mul(x, hn::Set(d, field.x[axis])));
        return hn::Add(right, hn::Mul(y, hn::Set(d, field.y[axis])));
    };
    VD along[3], inverse[3];
    if (shared.parallel) {
        for (int axis = 0; axis < 3; ++axis) {
            along[axis] = hn::Set(d, shared.along[axis]);
            inverse[axis] = hn::Set(d, shared.inverse[axis]);
        }
    } else {
        HWY_ALIGN double m[3][kSide], cells[kSide];
        for (int axis = 0; axis < 3; ++axis) hn::Store(at(cast.rays.measure, axis), d, m[axis]);
        for (std::size_t i = 0; i < kSide; ++i)
            cells[i] = cast.step / std::hypot(m[0][i], m[1][i], m[2][i]);
        const VD cell = hn::Load(d, cells), one = hn::Set(d, 1.0);
        for (int axis = 0; axis < 3; ++axis) {
            along[axis] = hn::Mul(at(cast.rays.direction, axis), cell);
            const auto slab = hn::Lt(hn::Abs(along[axis]), hn::Set(d, 1e-280));
            inverse[axis] = hn::IfThenZeroElse(slab, hn::Div(one, along[axis]));
        }
    }
    const Extent& n = cast.volume.extent;
    const double below = taps_below(cast);

    const hn::Rebind<float, DD> narrow;
    const hn::Rebind<int, DD> whole;
    const auto keep = [&](VD value, float* to) {
        hn::Store(hn::DemoteTo(narrow, value), narrow, to + lane);
    };
    const auto keep_cell = [&](VD value, int* to) {
        hn::Store(hn::DemoteTo(whole, value), whole, to + lane);
    };
    Spans box{hn::Set(d, cast.rays.start / cast.step), hn::Set(d, cast.rays.end / cast.step)};
    Spans inner = box;
    VD origin[3];
    for (int axis = 0; axis < 3; ++axis) {
        const double top = static_cast<double>(n[axis]) - 0.5, margin = 1e-3 + 1e-6 * top;
        origin[axis] = at(cast.rays.origin, axis);
        const auto a = static_cast<std::size_t>(axis);
        box.clip(origin[axis], inverse[axis], low_face(cast, a), high_face(cast, a));
        inner.clip(origin[axis], inverse[axis], below + margin, top - 0.5 - below - margin);
        keep(along[axis], stride[axis]);
    }
    if (cast.kept)
        for (const auto& [normal, offset] : cast.kept->planes) {
            VD inside = hn::Set(d, offset), slope = hn::Zero(d);
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const VD across = hn::Set(d, normal[axis]);
                inside = hn::Add(inside, hn::Mul(across, origin[axis]));
                slope = hn::Add(slope, hn::Mul(across, along[axis]));
            }
            box.cut(inside, slope);
        }
    if (cast.kept)
        for (const Kept::Ball& ball : cast.kept->balls) {
            const auto turned = [&](const VD(&v)[3], std::size_t row) {
                const double* m = ball.to_unit.data() + 3 * row;
                const VD two =
                    hn::Add(hn::Mul(hn::Set(d, m[0]), v[0]), hn::Mul(hn::Set(d, m[1]), v[1]));
                return hn::Add(two, hn::Mul(hn::Set(d, m[2]), v[2]));
            };
            VD away[3], from[3], step[3];
            for (std::size_t axis = 0; axis < 3; ++axis)
                away[axis] = hn::Sub(origin[axis], hn::Set(d, ball.centre[axis]));
            for (std::size_t row = 0; row < 3; ++row) {
                from[row] = turned(away, row);
                step[row] = turned(along, row);
            }
            box.cut_ball(from, step);
        }
    const VD one = hn::Set(d, 1.0), half = hn::Set(d, 0.5);
    const VD far = hn::Set(d, std::numeric_limits<double>::max());
    const auto hits = hn::And(hn::Lt(box.low, box.high), hn::And(hn::Le(hn::Abs(box.low), far),
                                                                 hn::Le(hn::Abs(box.high), far)));
    const VD sliver = hn::Set(d, kSliver);
    const VD begins = hn::Floor(hn::Add(box.low, sliver));
    const VD ends = hn::Max(begins, hn::Sub(hn::Ceil(hn::Sub(box.high, sliver)), one));
    const VD base = hn::Add(begins, half);
    for (int axis = 0; axis < 3; ++axis)
        keep(hn::Add(origin[axis], hn::Mul(base, along[axis])), position[axis]);
    const VD first_end = hn::Min(box.high, hn::Add(base, half));
    const VD last_begin = hn::Max(box.low, ends);
    keep(hn::Sub(first_end, box.low), first_weight);
    keep(hn::Sub(hn::Mul(half, hn::Add(box.low, first_end)), base), first_offset);
    keep(hn::Sub(box.high, last_begin), last_weight);
    keep(hn::Sub(hn::Mul(half, hn::Add(last_begin, box.high)), base), last_offset);
    keep_cell(begins, first);
    keep_cell(ends, last);
    const auto some = hn::Lt(inner.low, inner.high);
    keep_cell(
        hn::IfThenElseZero(some, hn::Max(hn::Add(begins, one), hn::Ceil(hn::Sub(inner.low, half)))),
        inner_first);
    keep_cell(
        hn::IfThenElse(some, hn::Min(hn::Sub(ends, one), hn::Floor(hn::Sub(inner.high, half))),
                       hn::Neg(one)),
        inner_last);
    hn::Store(hn::IfThenElseZero(hits, hn::Sub(box.high, box.low)), d, length + lane);
}

/// Finds the lanes with a hit and lets the others walk along with one. @return false: there is none
bool Packet::fill_in(int columns, int rows) {
    constexpr int kCount = static_cast<int>(kLanes);
    int some = -1;
    for (int lane = kCount - 1; lane >= 0; --lane) {
        hit[lane] = length[lane] > 0 && lane % kWidth < columns && lane / kWidth < rows;
        if (hit[lane]) some = lane;
    }
    if (some < 0) return false;
    for (int lane = 0; lane < kCount; ++lane)
        if (!hit[lane]) copy(some, lane);
    return true;
}

void Packet::copy(int from, int to) {
    for (int axis = 0; axis < 3; ++axis) {
        position[axis][to] = position[axis][from];
        stride[axis][to] = stride[axis][from];
    }
    for (int* of : {first, last, inner_first, inner_last}) of[to] = of[from];
    for (float* of : {first_offset, last_offset, first_weight, last_weight}) of[to] = of[from];
}

bool Packet::prepare(const RayCast& cast, const ParallelRays& shared, double x, double y,
                     int columns, int rows) {
    constexpr int kCount = static_cast<int>(kLanes);
    HWY_ALIGN double px[kLanes], py[kLanes];
    for (int lane = 0; lane < kCount; ++lane) {
        px[lane] = x + lane % kWidth;
        py[lane] = y + lane / kWidth;
    }
    for (std::size_t lane = 0; lane < kLanes; lane += kSide)
        reckon(cast, shared, lane, hn::Load(DD(), px + lane), hn::Load(DD(), py + lane));
    bool all_hit = columns == kWidth && rows == kHeight;
    for (std::size_t lane = 0; lane < kLanes && all_hit; lane += kSide)
        all_hit = hn::AllTrue(DD(), hn::Gt(hn::Load(DD(), length + lane), hn::Zero(DD())));
    if (all_hit)
        std::fill_n(hit, kCount, true);
    else if (!fill_in(columns, rows))
        return false;

    const DI d;
    begin = hn::GetLane(hn::MinOfLanes(d, hn::Load(d, first)));
    end = hn::GetLane(hn::MaxOfLanes(d, hn::Load(d, last))) + 1;
    const int inner_low = hn::GetLane(hn::MaxOfLanes(d, hn::Load(d, inner_first)));
    const int inner_high = hn::GetLane(hn::MinOfLanes(d, hn::Load(d, inner_last)));
    inner_begin = inner_low <= inner_high ? inner_low : end;
    inner_end = inner_low <= inner_high ? inner_high + 1 : end;
    VF steep = hn::Zero(DF());
    for (const auto& along : stride) steep = hn::Max(steep, hn::Abs(hn::Load(DF(), along)));
    steepest = hn::GetLane(hn::MaxOfLanes(DF(), steep));
    return true;
}

/// Looks up what the surroundings of a packet hold.
class Levels {
 public:
    Levels() = default;
    /// @param pieces  what lies between the samples counts too, from the one before a stretch on
    Levels(const RayCast& cast, float steepest, bool pieces) : bricks_(cast.bricks) {
        // A level covers a brick and its neighbours. A stretch around its middle must not reach
        // farther than a brick's width, less the taps beyond a position.
        const int beyond = 1 + static_cast<int>(taps_below(cast));
        const int reach = (1 << Bricks::kShift) - beyond;
        const double cells = steepest > 0 ? 2.0 * reach / steepest : 64;
        cells_ = (pieces ? -1 : 1) + static_cast<int>(std::min(cells, 63.0));
    }
    /// How many cells one look covers; below 1: none.
    int cells() const { return cells_; }
    /// The same of end cells, whose samples may lie half a cell from their middles.
    int end_cells() const { return cells_ - 1; }
    /// Of places inside the volume.
    HWY_INLINE VF at(VF x, VF y, VF z) const {
        const DI d;
        const VI i = hn::ShiftRight<Bricks::kShift>(truncated(x)),
                 j = hn::ShiftRight<Bricks::kShift>(truncated(y)),
                 k = hn::ShiftRight<Bricks::kShift>(truncated(z));
        const VI row = hn::Add(j, hn::Mul(k, hn::Set(d, static_cast<int>(bricks_->extent.y))));
        const VI brick = hn::Add(i, hn::Mul(row, hn::Set(d, static_cast<int>(bricks_->extent.x))));
        return hn::GatherIndex(DF(), bricks_->level.data(), brick);
    }

 private:
    const Bricks* bricks_ = nullptr;
    int cells_ = 0;
};

/// The rays of a packet as vectors.
struct Lanes {
    VF position[3], stride[3];
    VI first;
    int ahead;

    explicit Lanes(const Packet& packet)
        : first(hn::Load(DI(), packet.first)), ahead(packet.ahead) {
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
    template <class Sampler>
    HWY_INLINE void prefetch(const Sampler& sampler, int cell) const {
        const VF far = offset(cell + ahead);
        sampler.prefetch(at(far, 0), at(far, 1), at(far, 2));
    }
};

/// Where the eye is for each lane's pixel, unit length.
[[maybe_unused]] inline void aim_at_eye(const RayCast& cast, double x, double y, VF (&to_eye)[3]) {
    HWY_ALIGN float eye[3][kLanes];
    for (int lane = 0; lane < static_cast<int>(kLanes); ++lane) {
        const auto m = cast.rays.measure.at(x + lane % kWidth, y + lane / kWidth);
        const double length = std::hypot(m[0], m[1], m[2]);
        for (std::size_t axis = 0; axis < 3; ++axis)
            eye[axis][lane] = static_cast<float>(-m[axis] / length);
    }
    for (int axis = 0; axis < 3; ++axis) to_eye[axis] = hn::Load(DF(), eye[axis]);
}

/// How light falls off along the rays of a packet whose corner is pixel (x, y).
[[maybe_unused]] inline Fading fading_of(const RayCast& cast, const Packet& packet, double x,
                                         double y) {
    HWY_ALIGN float depth[kLanes], deeper[kLanes];
    for (int lane = 0; lane < static_cast<int>(kLanes); ++lane) {
        const auto m = cast.rays.measure.at(x + lane % kWidth, y + lane / kWidth);
        const double cosine = m[2] / std::hypot(m[0], m[1], m[2]);
        const double t = (packet.first[lane] + 0.5) * cast.step;
        depth[lane] = static_cast<float>((cast.cue->near + cosine * t) * cast.cue->unit);
        deeper[lane] = static_cast<float>(cosine * cast.step * cast.cue->unit);
    }
    return {hn::Load(DF(), depth), hn::Load(DF(), deeper),
            static_cast<float>(cast.cue->by.per_length), cast.cue->by.linear};
}

/// A sample of each ray, for rules that ask where it is.
template <bool kFinite, class Sampler>
struct Spot {
    const RayCast& cast;
    const Sampler& sampler;
    const Lanes& lanes;
    VF offset;  // cells from the middle of each ray's own first cell

    HWY_INLINE VF place(int axis) const { return lanes.at(offset, axis); }
    HWY_INLINE VF value_at(VF where) const {
        return sampler.template at<false>(lanes.at(where, 0), lanes.at(where, 1),
                                          lanes.at(where, 2));
    }
    HWY_INLINE void gradient_at(VF where, VF value, VF (&gradient)[3]) const {
        gradient_of<kFinite>(cast, sampler, lanes.at(where, 0), lanes.at(where, 1),
                             lanes.at(where, 2), value, gradient);
    }
};

/// Hands a rule its samples in order, with the places where rays enter and leave: begin_at(mask,
/// value, offset) says where rays are before their next sample, take(value, offset, outside, spot)
/// that one.
template <class Rule>
class InOrder {
 public:
    void ends(MF first, MF last) {
        first_ = first;
        last_ = last;
    }
    template <class At>
    HWY_INLINE void add(VF value, int cell, const At& spot) {
        const MF none = hn::FirstN(DF(), 0);
        if (cell != next_) begin_anew(none, spot);
        rule().take(value, spot.offset, none, spot);
        next_ = cell + 1;
    }
    template <class At>
    HWY_INLINE void add_part(VF value, VF weight, MF outside, int cell, const At& spot) {
        if (!rule().alive()) return;
        const VF half = hn::Mul(hn::Set(DF(), 0.5f), weight);
        if (cell != next_) begin_anew(hn::Or(first_, outside), spot);
        if (!hn::AllFalse(DF(), first_)) {
            const VF enters = hn::Sub(spot.offset, half);
            rule().begin_at(first_, spot.value_at(enters), enters);
        }
        rule().take(value, spot.offset, outside, spot);
        if (!hn::AllFalse(DF(), last_)) {
            const VF leaves = hn::Add(spot.offset, half);
            rule().take(spot.value_at(leaves), leaves, hn::Not(last_), spot);
        }
        next_ = cell + 1;
    }

 protected:
    InOrder() { first_ = last_ = hn::FirstN(DF(), 0); }
    void begin(const Packet& packet) { next_ = packet.begin; }

 private:
    Rule& rule() { return static_cast<Rule&>(*this); }
    /// After a stretch that was left out: the sample before this one.
    template <class At>
    HWY_NOINLINE void begin_anew(MF kept, const At& spot) {
        const VF at = hn::Sub(spot.offset, hn::Set(DF(), 1.0f));
        rule().begin_at(hn::Not(kept), spot.value_at(at), at);
    }

    MF first_, last_;
    int next_ = 0;
};

/// Whether a rule asks where samples are, and where the eye is.
template <class Sum>
inline constexpr bool kAims = requires(Sum& sum, const Packet& packet) {
    sum.aim(packet, 0.0, 0.0);
};

/// Whether a rule adds up what lies between samples.
template <class Sum>
inline constexpr bool kPieces = requires {
    Sum::kPieces;
};

/// Whether a rule asks which samples are the first and the last of a ray.
template <class Sum>
inline constexpr bool kEnds = requires(Sum& sum, MF mask) {
    sum.ends(mask, mask);
};

/// Cells [begin, end), some of which belong to some lanes only, or are cut by the box.
template <class Sampler, class Sum>
HWY_NOINLINE void walk_partial(const Packet& packet, const Lanes& lanes, const Sampler& sampler,
                               Sum& sum, int begin, int end) {
    const DF d;
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
        const VF x = lanes.at(offset, 0), y = lanes.at(offset, 1), z = lanes.at(offset, 2);
        const VF value = sampler.template at<false>(x, y, z);
        if constexpr (kEnds<Sum>) sum.ends(is_first, is_last);
        if constexpr (kAims<Sum>)
            sum.add_part(value, weight, outside, cell,
                         Spot<Sum::kFinite, Sampler>{sum.cast(), sampler, lanes, offset});
        else
            sum.add_part(value, weight, outside, cell);
    }
}

/// Cells [begin, end) before or behind those that are inside for all lanes.
template <class Sampler, class Sum>
void walk_ends(const RayCast& cast, const Packet& packet, const Sampler& sampler, Sum& sum,
               int begin, int end) {
    const Lanes lanes(packet);
    if constexpr (Sum::kSkips) {
        if (cast.bricks) {
            const Levels levels(cast, packet.steepest, kPieces<Sum>);
            const Bounds bounds(cast.volume.extent);
            const int cells = levels.end_cells();
            if (cells < 1) return walk_partial(packet, lanes, sampler, sum, begin, end);
            for (int cell = begin; cell < end; cell += cells) {
                // Brought into the volume, a place comes no farther from those that are in it.
                const VF middle = hn::Add(lanes.offset(cell), hn::Set(DF(), 0.5f * (cells - 1)));
                const VF level = levels.at(bounds.clamped(lanes.at(middle, 0), 0),
                                           bounds.clamped(lanes.at(middle, 1), 1),
                                           bounds.clamped(lanes.at(middle, 2), 2));
                if (sum.needs(level))
                    walk_partial(packet, lanes, sampler, sum, cell, std::min(cell + cells, end));
            }
            return;
        }
    }
    walk_partial(packet, lanes, sampler, sum, begin, end);
}

/// Cells [begin, end), whole and inside for all lanes, of which none is left out.
template <bool kPrefetch, class Sampler, class Sum>
HWY_INLINE void walk_cells(const Lanes& lanes, const Sampler& sampler, Sum& sum, int begin, int end,
                           int stride) {
    for (int cell = begin; cell < end; cell += stride) {
        if constexpr (kPrefetch) lanes.prefetch(sampler, cell);
        const VF offset = lanes.offset(cell);
        const VF x = lanes.at(offset, 0), y = lanes.at(offset, 1), z = lanes.at(offset, 2);
        const VF value = sampler.template at<true>(x, y, z);
        if constexpr (kAims<Sum>)
            sum.add(value, cell, Spot<Sum::kFinite, Sampler>{sum.cast(), sampler, lanes, offset});
        else
            sum.add(value, cell);
    }
}

template <class Sampler, class Sum>
HWY_INLINE void walk_all(const Lanes& lanes, const Sampler& sampler, Sum& sum, int begin, int end,
                         int stride = 1) {
    if constexpr (Sampler::kPrefetches)
        if (lanes.ahead > 0) return walk_cells<true>(lanes, sampler, sum, begin, end, stride);
    walk_cells<false>(lanes, sampler, sum, begin, end, stride);
}

/// Adds cells times the rays that have them, where somebody counts.
class Count {
 public:
    Count(const RayCast& cast, const Packet& packet)
        : taken_(cast.taken),
          rays_(cast.taken ? std::count(packet.hit, packet.hit + kLanes, true) : 0) {}
    HWY_INLINE void operator()(int cells) const {
        if (taken_) taken_->samples += cells * rays_;
    }

 private:
    Taken* taken_;
    std::int64_t rays_;
};

template <class Sampler, class Sum>
HWY_NOINLINE void walk_inside(const RayCast& cast, const Packet& packet, const Sampler& sampler,
                              Sum& sum) {
    const Lanes lanes(packet);
    const int begin = packet.inner_begin, end = packet.inner_end;
    const Count count(cast, packet);
    if constexpr (Sum::kSkips) {
        const Levels levels = cast.bricks ? Levels(cast, packet.steepest, kPieces<Sum>) : Levels();
        if (levels.cells() > 0) {
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
    const ParallelRays shared(cast);
    const Shadow shadow(cast, shared, static_cast<double>(x), static_cast<double>(y),
                        static_cast<double>(width), static_cast<double>(height));
    const typename Sum::Lanewise missed{Sum(cast)};
    if constexpr (Sampler::kPrefetches) packet.ahead = is_sparse(cast) ? kAhead : 0;
    for (std::int64_t row = 0; row < height; row += kHeight) {
        const int rows = static_cast<int>(std::min<std::int64_t>(kHeight, height - row));
        const double top = static_cast<double>(y + row);
        const Shadow::Columns seen = shadow.columns(top, top + rows - 1);
        for (std::int64_t column = 0; column < width; column += kWidth) {
            const int columns = static_cast<int>(std::min<std::int64_t>(kWidth, width - column));
            const double left = static_cast<double>(x + column);
            float* const corner = out + row * row_floats + column * Sum::kChannels;
            if (left + columns - 1 < seen.first || left > seen.last) {
                for (int r = 0; r < rows; ++r)
                    for (int c = 0; c < columns; ++c)
                        missed.write(cast, 0, false, 0,
                                     corner + r * row_floats + c * Sum::kChannels);
                continue;
            }
            Sum sum(cast);
            const bool any = packet.prepare(cast, shared, left, top, columns, rows);
            if (any) {
                if constexpr (kAims<Sum>) sum.aim(packet, left, top);
                const int inner = std::min(packet.inner_begin, packet.end);
                // What the inside has leaves little of the ends.
                if constexpr (Sum::kAnyOrder) walk_inside(cast, packet, sampler, sum);
                walk_ends(cast, packet, sampler, sum, packet.begin, inner);
                if constexpr (!Sum::kAnyOrder) walk_inside(cast, packet, sampler, sum);
                walk_ends(cast, packet, sampler, sum, packet.inner_end, packet.end);
            }
            const typename Sum::Lanewise result(sum);
            for (int r = 0; r < rows; ++r)
                for (int c = 0; c < columns; ++c) {
                    const int lane = r * kWidth + c;
                    const bool hit = any && packet.hit[lane];
                    result.write(cast, lane, hit, hit ? packet.length[lane] : 0,
                                 corner + r * row_floats + c * Sum::kChannels);
                }
        }
    }
}

/// A cast and the part of its picture that is filled.
struct Tile {
    const RayCast& cast;
    std::int64_t x, y, width, height;
    float* out;
    std::ptrdiff_t row_floats;

    template <class Sum, class Read>
    void held() const {
        switch (cast.hold) {
            case Hold::zoh:
                return filled<NearestSampler<Read>, Sum>();
            case Hold::foh:
                return filled<LinearSampler<Read>, Sum>();
            case Hold::bspline3:
                // Coefficients are f32; of other types they are merely allowed.
                if constexpr (Read::kFloats)
                    return filled<SplineSampler<Read>, Sum>();
                else
                    return filled<SplineSampler<Walked>, Sum>();
            case Hold::weighted:
                // Other types are read one lane after the other: what is planned often is f32.
                if constexpr (Read::kFloats)
                    return filled<WeightedSampler<Read>, Sum>();
                else
                    return filled<WeightedSampler<Walked>, Sum>();
        }
    }

 private:
    template <class Sampler, class Sum>
    void filled() const {
        if constexpr (Sampler::kWeighted)
            fill<Sampler, Sum>(cast, Sampler(cast.volume, *cast.weights), x, y, width, height, out,
                               row_floats);
        else
            fill<Sampler, Sum>(cast, Sampler(cast.volume), x, y, width, height, out, row_floats);
    }
};

/// Where a vector is made of plain loops, samples of all types are read one lane after the other:
/// kernels for each type would double the time that this takes to compile, for processors from
/// before 2013.
inline constexpr bool kPlainLoops = HWY_TARGET == HWY_EMU128 || HWY_TARGET == HWY_SCALAR;

/// Fills the tile by the sum whose kFinite says that every sample is a number.
template <template <bool> class Sum>
void cast_tile(const Tile& tile) {
    const Grid& volume = tile.cast.volume;
    const double bytes =
        static_cast<double>(volume.extent.samples()) * static_cast<double>(bytes_of(volume.type));
    const bool short_offsets = bytes < 2147483648.0;
    if (kPlainLoops || !short_offsets || !in_lanes(volume.type))
        return tile.held<Sum<false>, Walked>();
    if constexpr (!kPlainLoops)
        gathers::HWY_NAMESPACE::with_reads(volume.type, [&](auto reads) {
            using Reads = decltype(reads);
            constexpr bool kFinite = std::is_integral_v<typename Reads::Sample>;
            tile.held<Sum<kFinite>, Gathered<Reads>>();
        });
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
