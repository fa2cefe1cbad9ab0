// Ray casting: compositing whose steps grow as transparency falls.
#include "transitions/kernels/importance_cast.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/importance_cast_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/ray_cast-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

/// Lights and transparencies of the rays of a packet.
class Composited {
 public:
    explicit Composited(double bound)
        : left_(hn::Set(DF(), 1.0f)), bound_(hn::Set(DF(), static_cast<float>(bound))) {
        for (VF& light : light_) light = hn::Zero(DF());
    }
    VF left() const { return left_; }
    MF alive() const { return hn::Gt(left_, hn::Zero(DF())); }
    HWY_INLINE bool needs(VF opacity) const {
        return !hn::AllFalse(DF(), hn::Gt(hn::Min(opacity, left_), hn::Zero(DF())));
    }

    HWY_INLINE void add(const VF (&light)[3], VF opacity) {
        const VF caught = hn::Mul(left_, opacity);
        for (int c = 0; c < 3; ++c) light_[c] = hn::MulAdd(caught, light[c], light_[c]);
        left_ = hn::Sub(left_, caught);
        left_ = hn::IfThenElseZero(hn::Ge(left_, bound_), left_);
    }
    void store(float (&lights)[3][kLanes], float (&left)[kLanes]) const {
        for (int c = 0; c < 3; ++c) hn::Store(light_[c], DF(), lights[c]);
        hn::Store(left_, DF(), left);
    }

 private:
    VF light_[3], left_, bound_;
};

// Below cells count from each ray's own first one: whole numbers, which f32 holds.

/// What lies ahead of each ray of a packet. A question is about as many cells as a ray's own
/// strides allow, whatever those of its neighbours: a level is that of a brick and the ones around
/// it, and samples at a ray's ends lie up to half a cell from the middles of their cells.
class Ahead {
 public:
    Ahead(const RayCast& cast, const Packet& packet, const Lanes& lanes)
        : levels_(cast, packet.steepest, false), bounds_(cast.volume.extent) {
        const DF d;
        const int reach =
            (1 << Bricks::kShift) - (1 + static_cast<int>(taps_below(cast)));  // [voxel]
        VF steepest = hn::Set(d, 1e-6f);
        for (const VF& stride : lanes.stride) steepest = hn::Max(steepest, hn::Abs(stride));
        const VF cells = hn::Div(hn::Set(d, 2.0f * static_cast<float>(reach)), steepest);
        cells_ = hn::Floor(hn::Min(cells, hn::Set(d, 63.0f)));
        middle_ = hn::MulSub(hn::Set(d, 0.5f), cells_, hn::Set(d, 0.5f));
        // Cells before these were asked about.
        known_ = hn::Set(d, std::numeric_limits<float>::max());
        const VF zero = hn::Zero(d);
        if (cast.bricks) known_ = hn::IfThenElse(hn::Gt(cells_, zero), zero, known_);
    }

    /// Takes rays whose next stretch is empty to its end.
    /// @return those of `running` whose next cell may matter
    HWY_INLINE MF look(const Lanes& lanes, MF running, VF& cell) {
        const DF d;
        const MF ask = hn::And(running, hn::Ge(cell, known_));
        if (hn::AllFalse(d, ask)) return running;
        const VF middle = hn::Add(cell, middle_);
        const VF level = levels_.at(bounds_.clamped(lanes.at(middle, 0), 0),
                                    bounds_.clamped(lanes.at(middle, 1), 1),
                                    bounds_.clamped(lanes.at(middle, 2), 2));
        const MF empty = hn::AndNot(hn::Gt(level, hn::Zero(d)), ask);
        const VF beyond = hn::Add(cell, cells_);
        known_ = hn::IfThenElse(ask, beyond, known_);
        cell = hn::IfThenElse(empty, beyond, cell);
        return hn::AndNot(empty, running);
    }

 private:
    Levels levels_;
    Bounds bounds_;
    VF cells_, middle_, known_;
};

/// The next piece of each ray.
struct Pieces {
    VF cells;           // whole ones
    VF offset, length;  // of the sample; of the piece
    MF inside;          // whose taps need no clamping
};

/// The cells of the rays of a packet.
class Path {
 public:
    Path(const Packet& packet, const Lanes& lanes, double loss)
        : last_(counted(packet.last, lanes)),
          inner_first_(counted(packet.inner_first, lanes)),
          inner_last_(counted(packet.inner_last, lanes)),
          first_offset_(hn::Load(DF(), packet.first_offset)),
          last_offset_(hn::Load(DF(), packet.last_offset)),
          first_weight_(hn::Load(DF(), packet.first_weight)),
          last_weight_(hn::Load(DF(), packet.last_weight)),
          growth_(hn::Set(DF(), static_cast<float>(4 * loss))),
          no_inner_(hn::Gt(inner_first_, inner_last_)) {}

    HWY_INLINE MF has(VF cell) const { return hn::Le(cell, last_); }
    /// How many cells one sample may stand for where so much is left; perhaps 0.
    HWY_INLINE VF pace(VF left) const {
        const DF d;
        // Behind what is opaque there is no piece: any number will do.
        const VF share = hn::Div(growth_, hn::Max(left, hn::Set(d, 1e-6f)));
        return hn::Floor(hn::Sqrt(share));
    }
    /// Rays that want no sample get one that is inside, where they have any there.
    HWY_INLINE Pieces next(VF cell, VF pace, MF wanted) const {
        const DF d;
        const VF one = hn::Set(d, 1.0f);
        const MF is_first = hn::Eq(cell, hn::Zero(d)), is_last = hn::Eq(cell, last_);
        Pieces next;
        // Cells at the ends are pieces of their own.
        next.cells = hn::Max(hn::Min(pace, hn::Sub(last_, cell)), one);
        next.cells = hn::IfThenElse(is_first, one, next.cells);
        const VF beyond = hn::Sub(next.cells, one);
        const MF outer =
            hn::Or(hn::Lt(cell, inner_first_), hn::Gt(hn::Add(cell, beyond), inner_last_));
        next.inside = hn::Not(hn::Or(hn::And(wanted, outer), hn::AndNot(wanted, no_inner_)));
        next.offset = hn::MulAdd(hn::Set(d, 0.5f), beyond, cell);
        next.offset = hn::IfThenElse(is_first, first_offset_, next.offset);
        next.offset = hn::IfThenElse(is_last, last_offset_, next.offset);
        next.offset = hn::IfThenElse(wanted, next.offset, inner_first_);
        next.length = hn::IfThenElse(is_first, first_weight_, next.cells);
        next.length = hn::IfThenElse(is_last, last_weight_, next.length);
        return next;
    }

 private:
    static VF counted(const int* cells, const Lanes& lanes) {
        return hn::ConvertTo(DF(), hn::Sub(hn::Load(DI(), cells), lanes.first));
    }

    VF last_, inner_first_, inner_last_;
    VF first_offset_, last_offset_, first_weight_, last_weight_, growth_;
    MF no_inner_;
};

template <bool kFinite, class Sampler>
HWY_NOINLINE void walk(const RayCast& cast, double loss, const Packet& packet,
                       const Sampler& sampler, Composited& sum) {
    const DF d;
    const Lanes lanes(packet);
    const Path path(packet, lanes, loss);
    Ahead ahead(cast, packet, lanes);
    const WholeCells cells(cast);
    const VF one = hn::Set(d, 1.0f), zero = hn::Zero(d);
    HWY_ALIGN float hit[kLanes];
    for (std::size_t lane = 0; lane < kLanes; ++lane) hit[lane] = packet.hit[lane] ? 1.0f : 0.0f;
    const MF hits = hn::Gt(hn::Load(d, hit), zero);
    // The pace is told by what was left before the sample before: so places of samples do not wait
    // for the light of the last ones. Rays that have ended go on for the same reason.
    VF cell = zero, pace = one;
    MF running = hits;
    std::int64_t samples = 0;
    while (!hn::AllFalse(d, hn::And(running, sum.alive()))) {
        const MF wanted = ahead.look(lanes, running, cell);
        if (!hn::AllFalse(d, wanted)) {
            const Pieces piece = path.next(cell, pace, wanted);
            const VF x = lanes.at(piece.offset, 0), y = lanes.at(piece.offset, 1),
                     z = lanes.at(piece.offset, 2);
            const VF value = hn::AllTrue(d, piece.inside) ? sampler.template at<true>(x, y, z)
                                                          : sampler.template at<false>(x, y, z);
            if (cast.taken)
                samples +=
                    static_cast<std::int64_t>(hn::CountTrue(d, hn::And(wanted, sum.alive())));
            VF color[3], opacity = look_up<3>(*cast.optics, value, color);
            opacity = hn::IfThenElseZero(wanted, opacity);
            if constexpr (!kFinite) opacity = hn::IfThenElseZero(is_finite(value), opacity);
            pace = hn::IfThenElse(wanted, path.pace(sum.left()), pace);
            if (sum.needs(opacity)) {
                const bool whole = hn::AllTrue(d, hn::Eq(piece.length, one));
                sum.add(color, whole ? cells(opacity) : cells(opacity, piece.length));
            }
            cell = hn::IfThenElse(wanted, hn::Add(cell, piece.cells), cell);
        }
        running = hn::And(hits, path.has(cell));
    }
    if (cast.taken) cast.taken->samples += samples;
}

template <bool kFinite, class Sampler>
void fill_tile(const RayCast& cast, double loss, const Sampler& sampler, const Tile& tile) {
    Packet packet;
    const ParallelRays shared(cast);
    const Shadow shadow(cast, shared, static_cast<double>(tile.x), static_cast<double>(tile.y),
                        static_cast<double>(tile.width), static_cast<double>(tile.height));
    for (std::int64_t row = 0; row < tile.height; row += kHeight) {
        const int rows = static_cast<int>(std::min<std::int64_t>(kHeight, tile.height - row));
        const double top = static_cast<double>(tile.y + row);
        const Shadow::Columns seen = shadow.columns(top, top + rows - 1);
        for (std::int64_t column = 0; column < tile.width; column += kWidth) {
            const int columns =
                static_cast<int>(std::min<std::int64_t>(kWidth, tile.width - column));
            const double left = static_cast<double>(tile.x + column);
            const bool beside = left + columns - 1 < seen.first || left > seen.last;
            const bool any = !beside && packet.prepare(cast, shared, left, top, columns, rows);
            Composited sum(cast.bound);
            if (any) walk<kFinite>(cast, loss, packet, sampler, sum);
            HWY_ALIGN float lights[3][kLanes], clear[kLanes];
            sum.store(lights, clear);
            for (int r = 0; r < rows; ++r)
                for (int c = 0; c < columns; ++c) {
                    const int lane = r * kWidth + c;
                    const bool hit = any && packet.hit[lane];
                    float* out = tile.out + (row + r) * tile.row_floats + (column + c) * 4;
                    for (int color = 0; color < 3; ++color)
                        out[color] = hit ? lights[color][lane] : 0.0f;
                    out[3] = hit ? 1.0f - clear[lane] : 0.0f;
                }
        }
    }
}

template <bool kFinite, class Read>
void fill_held(const RayCast& cast, double loss, const Tile& tile) {
    if (cast.hold != Hold::bspline3)
        return fill_tile<kFinite>(cast, loss, LinearSampler<Read>(cast.volume), tile);
    // Coefficients are f32; of other types they are merely allowed.
    if constexpr (Read::kFloats)
        fill_tile<kFinite>(cast, loss, SplineSampler<Read>(cast.volume), tile);
    else
        fill_tile<kFinite>(cast, loss, SplineSampler<Walked>(cast.volume), tile);
}

void importance_cast_on(const RayCast& cast, double loss, std::int64_t x, std::int64_t y,
                        std::int64_t width, std::int64_t height, float* out,
                        std::ptrdiff_t row_floats) {
    const Tile tile{cast, x, y, width, height, out, row_floats};
    const Grid& volume = cast.volume;
    const double bytes =
        static_cast<double>(volume.extent.samples()) * static_cast<double>(bytes_of(volume.type));
    if (kPlainLoops || !(bytes < 2147483648.0) || !in_lanes(volume.type))
        return fill_held<false, Walked>(cast, loss, tile);
    if constexpr (!kPlainLoops)
        gathers::HWY_NAMESPACE::with_reads(volume.type, [&](auto reads) {
            using Reads = decltype(reads);
            constexpr bool kFinite = std::is_integral_v<typename Reads::Sample>;
            fill_held<kFinite, Gathered<Reads>>(cast, loss, tile);
        });
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(importance_cast_on);

void importance_cast(const RayCast& cast, double loss, std::int64_t x, std::int64_t y,
                     std::int64_t width, std::int64_t height, float* out,
                     std::ptrdiff_t row_floats) {
    HWY_DYNAMIC_DISPATCH(importance_cast_on)(cast, loss, x, y, width, height, out, row_floats);
}

}  // namespace edgewise::kernels
#endif
