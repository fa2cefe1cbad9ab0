#include "transitions/kernels/adaptive_quadrature.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "transitions/kernels/ray_path.hpp"
#include "transitions/kernels/scalar_load.hpp"

namespace edgewise::kernels {

TransferPieces::TransferPieces(const Optics& optics) : unit_(optics.unit) {
    Piece level;  // what the function has reached
    level.opacity = std::clamp<double>(optics.opacity, 0, 1);
    for (std::size_t c = 0; c < 3; ++c) level.color[c] = optics.color[c];
    const auto constant = [](Piece piece) {
        piece.slope = piece.steepest_color = 0;
        piece.color_slope = {};
        piece.wall = piece.opacity >= 1 - kThinnest;
        return piece;
    };
    pieces_.push_back(constant(level));
    for (std::size_t i = 0; i < optics.ramps.size(); ++i) {
        const OpticsRamp& ramp = optics.ramps[i];
        const double from = ramp.start, width = 1 / double(ramp.inverse_width);
        const double to = i + 1 < optics.ramps.size() ? optics.ramps[i + 1].start : from + width;
        Piece next = level, rises = level;
        next.opacity = std::clamp(level.opacity + ramp.opacity, 0.0, 1.0);
        for (std::size_t c = 0; c < 3; ++c)
            next.color[c] = std::clamp<double>(level.color[c] + ramp.color[c], 0, 1);
        rises = constant(rises);
        rises.from = from;
        if (to > from) {
            rises.slope = (next.opacity - level.opacity) / (to - from);
            for (std::size_t c = 0; c < 3; ++c) {
                rises.color_slope[c] = (next.color[c] - level.color[c]) / (to - from);
                rises.steepest_color =
                    std::max(rises.steepest_color, std::abs(rises.color_slope[c]));
            }
            rises.wall = rises.wall && rises.slope == 0;
        }
        knots_.push_back(from);
        pieces_.push_back(rises);
        level = next;
        if (i + 1 == optics.ramps.size()) {
            knots_.push_back(to);
            pieces_.push_back(constant(level));
        }
    }
}

std::size_t TransferPieces::piece_at(double value) const noexcept {
    return static_cast<std::size_t>(std::lower_bound(knots_.begin(), knots_.end(), value) -
                                    knots_.begin());
}

double TransferPieces::depth(double transparency) const noexcept {
    return -std::log(std::clamp(transparency, kThinnest, 1.0)) / unit_;
}

TransferPieces::Span TransferPieces::span(double low, double high) const noexcept {
    double least = 1, most = 0;
    Span span;
    span.low.fill(1);
    span.high.fill(0);
    const auto add = [&](const Piece& piece, double value) {
        const double opacity = 1 - piece.transparency(value);
        least = std::min(least, opacity);
        most = std::max(most, opacity);
        for (std::size_t c = 0; c < 3; ++c) {
            const double color = piece.color[c] + piece.color_slope[c] * (value - piece.from);
            span.low[c] = std::min(span.low[c], color);
            span.high[c] = std::max(span.high[c], color);
        }
    };
    const std::size_t first = piece_at(low), last = piece_at(high);
    add(pieces_[first], low);
    add(pieces_[last], high);
    for (std::size_t k = first; k < last; ++k) {  // both sides of knots within
        add(pieces_[k], knots_[k]);
        add(pieces_[k + 1], knots_[k]);
    }
    const auto thickness = [&](double opacity) {
        return opacity >= 1 - kThinnest ? std::numeric_limits<double>::infinity()
                                        : depth(1 - opacity);
    };
    span.thin = thickness(least);
    span.dense = thickness(most);
    return span;
}

ValueRanges::ValueRanges(const Extent& volume, std::pmr::memory_resource* memory)
    : nodes{std::pmr::vector<Range>(memory), std::pmr::vector<Range>(memory),
            std::pmr::vector<Range>(memory)} {
    Extent below = volume;
    for (std::size_t level = 0; level < kLevels; ++level) {
        for (int axis = 0; axis < 3; ++axis) below[axis] = ((below[axis] - 1) >> kShift) + 1;
        extent[level] = below;
        nodes[level].resize(static_cast<std::size_t>(below.samples()));
    }
}

namespace quadrature {
namespace {

constexpr float kFarthest = std::numeric_limits<float>::max();

/// The range of the finite values.
struct Grown {
    float low = std::numeric_limits<float>::infinity(), high = -low;
    bool whole = true;  // all are

    void add(float value) {
        if (!(std::abs(value) <= kFarthest)) {
            whole = false;
            return;
        }
        low = std::min(low, value);
        high = std::max(high, value);
    }
    void add(const ValueRanges::Range& range) {
        whole = whole && range.whole;
        low = std::min(low, range.low);
        high = std::max(high, range.high);
    }
    ValueRanges::Range range() const { return {low, high, whole}; }
};

/// A cubic of the way through a cell, from 0 to 1.
struct Cubic {
    double c0 = 0, c1 = 0, c2 = 0, c3 = 0;

    /// Through values at 0, 1/3, 2/3 and 1.
    static Cubic through(const double (&v)[4]) {
        Cubic cubic;
        cubic.c0 = v[0];
        cubic.c1 = (-11 * v[0] + 18 * v[1] - 9 * v[2] + 2 * v[3]) / 2;
        cubic.c2 = 9 * (2 * v[0] - 5 * v[1] + 4 * v[2] - v[3]) / 2;
        cubic.c3 = 9 * (-v[0] + 3 * v[1] - 3 * v[2] + v[3]) / 2;
        return cubic;
    }
    double at(double s) const { return c0 + s * (c1 + s * (c2 + s * c3)); }
    double slope(double s) const { return c1 + s * (2 * c2 + s * 3 * c3); }
    /// Where it meets a value between s = low and high, at which it lies on either side of it.
    double meets(double value, double low, double high) const {
        const bool rises = at(high) > at(low);
        double s = low + (high - low) / 2;
        for (int i = 0; i < 60; ++i) {
            const double over = at(s) - value;
            ((over < 0) == rises ? low : high) = s;
            double next = s - over / slope(s);
            if (!(next > low && next < high)) next = low + (high - low) / 2;
            if (std::abs(next - s) < 1e-15) break;
            s = next;
        }
        return s;
    }
    /// Places within (0, 1) where it turns, ascending; how many.
    int turns(double (&at)[2]) const {
        int count = 0;
        const auto keep = [&](double s) {
            if (s > 0 && s < 1) at[count++] = s;
        };
        const double root = c2 * c2 - 3 * c1 * c3;
        if (!(root > 0)) return 0;
        // One root from the other avoids cancellation.
        const double far = -(c2 + std::copysign(std::sqrt(root), c2));
        if (c3 != 0) keep(far / (3 * c3));
        keep(c1 / far);
        if (count == 2 && at[0] > at[1]) std::swap(at[0], at[1]);
        return count;
    }
};

/// One ray, front to back.
class Ray {
 public:
    Ray(const AdaptiveQuadrature& by, const RayPath& path, QuadratureTaken& taken)
        : by_(by), taken_(taken), load_(scalar_load(by.cast.volume.type)), budget_(by.tolerance) {
        const double base = static_cast<double>(path.first) + 0.5;
        t_ = base + path.first_offset - 0.5 * path.first_weight;
        end_ = t_ + path.length;
        for (int a = 0; a < 3; ++a) {
            along_[a] = path.stride[static_cast<std::size_t>(a)];
            origin_[a] = path.position[static_cast<std::size_t>(a)] - base * along_[a];
        }
    }

    /// A ray ends where no more is left to see than of its budget.
    void cross() {
        double failed[ValueRanges::kLevels];  // before this t the node of a level is too uneven
        std::fill_n(failed, ValueRanges::kLevels, -std::numeric_limits<double>::infinity());
        while (t_ < end_ && left_ > budget_) {
            find_cell();
            bool passed = false;
            for (int level = ValueRanges::kLevels; level-- > 0 && !passed;) {
                if (t_ < failed[level]) continue;
                const double leaves = leaves_node(level);
                failed[level] = leaves;
                const ValueRanges::Range range = node(level);
                if (range.nothing()) {
                    t_ = leaves;
                    passed = true;
                }
                passed = passed || (range.known() && takes_range(range.low, range.high, leaves));
            }
            if (!passed) cross_cell();
        }
    }
    double left() const { return left_; }
    double light(std::size_t channel) const { return light_[channel]; }

 private:
    // The least share of the remaining budget that a piece may have, however short it is.
    static constexpr double kSlice = 1.0 / 256;

    double allowed(double until) const {
        return budget_ * std::min(1.0, std::max((until - t_) / (end_ - t_), kSlice));
    }
    /// @param bound  of the piece's error, as a share of the light that reaches it
    void take(double bound, double transparency, const double (&light)[3], double until) {
        budget_ -= std::min(left_ * bound, allowed(until));
        for (std::size_t c = 0; c < 3; ++c) light_[c] += left_ * light[c];
        left_ *= transparency;
        t_ = until;
    }

    /// The cell ahead of a place. Places in a face belong to the next one.
    void find_cell() {
        constexpr double kNudge = 1e-9;
        for (int a = 0; a < 3; ++a) {
            const double nudge = along_[a] > 0 ? kNudge : along_[a] < 0 ? -kNudge : 0;
            cell_[a] = static_cast<std::int64_t>(std::floor(origin_[a] + t_ * along_[a] + nudge));
            cell_[a] = std::clamp<std::int64_t>(cell_[a], -1, by_.cast.volume.extent[a] - 1);
        }
    }
    /// Where the ray meets faces low[a] or low[a] + width.
    double leaves(const std::int64_t (&low)[3], std::int64_t width, bool outermost) const {
        double at = end_;
        for (int a = 0; a < 3; ++a) {
            if (along_[a] == 0 || (outermost && along_[a] < 0 && low[a] == 0)) continue;
            const std::int64_t face = along_[a] > 0 ? low[a] + width : low[a];
            at = std::min(at, (static_cast<double>(face) - origin_[a]) / along_[a]);
        }
        return std::max(at, t_ + 1e-10);
    }
    double leaves_node(int level) const {
        const int shift = ValueRanges::kShift * (level + 1);
        std::int64_t low[3];
        for (int a = 0; a < 3; ++a) low[a] = std::max<std::int64_t>(cell_[a], 0) >> shift << shift;
        return leaves(low, std::int64_t{1} << shift, true);
    }
    ValueRanges::Range node(int level) const {
        const int shift = ValueRanges::kShift * (level + 1);
        std::int64_t i[3];
        for (int a = 0; a < 3; ++a) i[a] = std::max<std::int64_t>(cell_[a], 0) >> shift;
        return by_.ranges.at(level, i[0], i[1], i[2]);
    }

    /// Takes a stretch whose values are known to lie in a range, if that bounds the error: optical
    /// depth and colour are the middles of their ranges.
    bool takes_range(double low, double high, double until) {
        const TransferPieces::Span span = by_.transfer.span(low, high);
        const double h = until - t_;
        double bound = 0, transparency = 1, light[3] = {0, 0, 0};
        if (span.dense > 0) {
            const double least = -std::expm1(-span.thin * h), most = -std::expm1(-span.dense * h);
            double apart = 0;
            for (std::size_t c = 0; c < 3; ++c) apart = std::max(apart, span.high[c] - span.low[c]);
            bound = (most - least) / 2 + most * apart / 2;
            if (left_ * bound > allowed(until)) return false;
            const double opacity = (least + most) / 2;
            transparency = (std::exp(-span.thin * h) + std::exp(-span.dense * h)) / 2;
            for (std::size_t c = 0; c < 3; ++c)
                light[c] = opacity * (span.low[c] + span.high[c]) / 2;
        }
        ++taken_.stretches;
        take(bound, transparency, light, until);
        return true;
    }

    /// The eight samples around a cell, and their range.
    void read(double (&corner)[8], Grown& range) {
        const Grid& volume = by_.cast.volume;
        ++taken_.cells;
        for (int which = 0; which < 8; ++which) {
            std::int64_t i[3];
            for (int a = 0; a < 3; ++a)
                i[a] =
                    std::clamp<std::int64_t>(cell_[a] + (which >> a & 1), 0, volume.extent[a] - 1);
            const float value =
                load_(volume.samples, (i[2] * volume.extent.y + i[1]) * volume.extent.x + i[0]);
            corner[which] = value;
            range.add(value);
        }
    }
    /// The field beside samples that are not finite, as all casts have it: that of the others, by
    /// their shares, where the nearest one is finite.
    double beside_gap(const double (&corner)[8], const Grown& range, double t) const {
        double part[3];
        for (int a = 0; a < 3; ++a)
            part[a] = std::clamp(origin_[a] + t * along_[a] - double(cell_[a]), 0.0, 1.0);
        double sum = 0, share = 0;
        for (int which = 0; which < 8; ++which) {
            if (!std::isfinite(corner[which])) continue;
            double weight = 1;
            for (int a = 0; a < 3; ++a) weight *= which >> a & 1 ? part[a] : 1 - part[a];
            sum += weight * corner[which];
            share += weight;
        }
        return std::clamp<double>(sum / share, range.low, range.high);
    }
    /// The nearest sample changes where a ray is in the middle between two.
    void cross_gap(const double (&corner)[8], const Grown& range, double until) {
        constexpr int kParts = 4;  // cubics that stand for a stretch
        double cut[5] = {t_, until, until, until, until};
        for (int a = 0; a < 3; ++a) {
            const double at = (double(cell_[a]) + 0.5 - origin_[a]) / along_[a];
            if (at > t_ && at < until) cut[a + 1] = at;
        }
        std::sort(cut, cut + 5);
        for (int i = 0; i < 4; ++i) {
            if (!(cut[i + 1] > cut[i])) continue;
            const double middle = (cut[i] + cut[i + 1]) / 2;
            int nearest = 0;
            for (int a = 0; a < 3; ++a)
                if (origin_[a] + middle * along_[a] - double(cell_[a]) >= 0.5) nearest |= 1 << a;
            if (std::isfinite(corner[nearest]))
                for (int part = 0; part < kParts; ++part) {
                    const double width = (cut[i + 1] - cut[i]) / kParts;
                    const double from = cut[i] + part * width;
                    double at[4];
                    for (int k = 0; k < 4; ++k)
                        at[k] = beside_gap(corner, range, from + k * width / 3);
                    t_ = from;
                    cross_stretch(Cubic::through(at), from + width);
                }
            t_ = cut[i + 1];
        }
    }
    Cubic along_ray(const double (&v)[8], double until) const {
        double at[3], way[3];
        for (int a = 0; a < 3; ++a) {
            at[a] = origin_[a] + t_ * along_[a] - static_cast<double>(cell_[a]);
            way[a] = (until - t_) * along_[a];
        }
        const double x = v[1] - v[0], y = v[2] - v[0], z = v[4] - v[0];
        const double xy = v[3] - v[2] - x, xz = v[5] - v[4] - x, yz = v[6] - v[4] - y;
        const double xyz = (v[7] - v[6] - v[5] + v[4]) - (v[3] - v[2] - v[1] + v[0]);
        const double in_xy = xy + at[2] * xyz, in_xz = xz + at[1] * xyz, in_yz = yz + at[0] * xyz;
        Cubic cubic;
        cubic.c0 = v[0] + at[0] * (x + at[1] * in_xy) + at[1] * (y + at[2] * yz) +
                   at[2] * (z + at[0] * xz);
        cubic.c1 = way[0] * (x + at[1] * in_xy + at[2] * xz) +
                   way[1] * (y + at[0] * in_xy + at[2] * yz) +
                   way[2] * (z + at[0] * in_xz + at[1] * yz);
        cubic.c2 = way[0] * way[1] * in_xy + way[0] * way[2] * in_xz + way[1] * way[2] * in_yz;
        cubic.c3 = way[0] * way[1] * way[2] * xyz;
        return cubic;
    }

    void cross_cell() {
        const double until = leaves({cell_[0], cell_[1], cell_[2]}, 1, false);
        double corner[8];
        Grown range;
        read(corner, range);
        if (!range.whole)
            cross_gap(corner, range, until);
        else if (!takes_range(range.low, range.high, until))
            cross_stretch(along_ray(corner, until), until);
        t_ = std::max(t_, until);
    }
    /// A stretch of a cell on which the value is a cubic.
    void cross_stretch(const Cubic& cubic, double until) {
        start_ = t_;
        length_ = until - t_;
        cubic_ = cubic;
        double turns[2];
        const int count = cubic_.turns(turns);
        double low = std::min(cubic_.at(0), cubic_.at(1)), high = cubic_.at(0) + cubic_.at(1) - low;
        for (int i = 0; i < count; ++i) {
            low = std::min(low, cubic_.at(turns[i]));
            high = std::max(high, cubic_.at(turns[i]));
        }
        const TransferPieces& transfer = by_.transfer;
        if (transfer.piece_at(low) == transfer.piece_at(high))
            return cross_piece(0, 1, transfer.piece(transfer.piece_at(low)));
        double from = 0;
        for (int i = 0; i <= count; ++i) {
            const double to = i < count ? turns[i] : 1;
            cross_monotone(from, to);
            from = to;
        }
    }
    /// Cuts where a knot is met.
    void cross_monotone(double from, double to) {
        const TransferPieces& transfer = by_.transfer;
        const std::vector<double>& knots = transfer.knots();
        const double first = cubic_.at(from), last = cubic_.at(to);
        const bool rises = last > first;
        std::size_t at = transfer.piece_at(first);
        const std::size_t end = transfer.piece_at(last);
        while (at != end && left_ > budget_) {
            const double knot = rises ? knots[at] : knots[at - 1];
            double meets = from;  // a knot at the start, or what rounding left of one
            if (knot == last)
                meets = to;
            else if (knot != first && (first < knot) != (last < knot))
                meets = cubic_.meets(knot, from, to);
            cross_piece(from, meets, transfer.piece(at));
            from = std::max(from, meets);
            at += rises ? 1 : std::size_t(-1);
        }
        cross_piece(from, to, transfer.piece(at));
    }

    /// Halves a piece of a cell until its bound is small enough.
    void cross_piece(double from, double to, const TransferPieces::Piece& piece) {
        if (piece.slope == 0 && piece.opacity == 0) {
            t_ = start_ + to * length_;
            return;
        }
        constexpr int kDeepest = 48;
        double ends[kDeepest + 1];
        int deep = 0;
        ends[0] = to;
        while (deep >= 0 && left_ > budget_) {
            const double end = ends[deep];
            if (!(end > from)) {
                --deep;
                continue;
            }
            if (takes_piece(from, end, piece, deep == kDeepest)) {
                from = end;
                --deep;
            } else {
                ends[++deep] = from + (end - from) / 2;
            }
        }
    }

    /// With x from -1 to 1 in the piece, the value is v0 + v1 x + v2 x^2 + v3 x^3, the transparency
    /// of a unit Q (1 - y) with y = y1 x + y2 x^2 + y3 x^3.
    bool takes_piece(double from, double to, const TransferPieces::Piece& piece, bool anyway) {
        const TransferPieces& transfer = by_.transfer;
        const double until = start_ + to * length_, r = (to - from) / 2, mid = from + r;
        const double half = r * length_;  // [t]
        t_ = start_ + from * length_;
        if (piece.wall) {
            double light[3];
            const double beyond = cubic_.at(from) - piece.from;
            for (std::size_t c = 0; c < 3; ++c)
                light[c] = std::clamp(piece.color[c] + piece.color_slope[c] * beyond, 0.0, 1.0);
            take(0, 0, light, until);
            return true;
        }
        const double v0 = cubic_.at(mid), v1 = cubic_.slope(mid) * r,
                     v2 = (cubic_.c2 + 3 * cubic_.c3 * mid) * r * r, v3 = cubic_.c3 * r * r * r;
        const double clear = std::max(piece.transparency(v0), TransferPieces::kThinnest);
        const double depth = transfer.depth(clear);
        ++taken_.samples;

        // The bound, before all samples are taken.
        const double scale = std::abs(piece.slope) / clear;
        const double y1 = std::abs(v1) * scale, y2 = std::abs(v2) * scale,
                     y3 = std::abs(v3) * scale;
        constexpr double kMost = 1e3, kLogFive = 1.6094379124341003;  // |y| <= 0.8 within R
        const double R = std::min({kMost, 0.5 / y1, std::sqrt(0.15 / y2), std::cbrt(0.15 / y3)});
        const double w = std::abs(v1) + std::abs(v2) + std::abs(v3);
        const double apart = std::min(1.0, w * piece.steepest_color);
        const double Z = depth * half;
        double bound = 1;
        if (R > 1) {
            const double varies = -std::log1p(-(y1 + y2 + y3)) / transfer.unit();
            const double rho = R + std::sqrt(R * R - 1);
            const double gauss = 64.0 / 15 / (std::pow(rho, 4) * (rho * rho - 1));
            const double M = scale > 0 ? kLogFive / transfer.unit() : 0;
            const double of_depth = half * gauss * M;
            const double thin = half * std::max(0.0, depth - varies);  // of half the piece
            const double dense = 2 * half * (depth + varies);
            const double W = R * (std::abs(v1) + R * (std::abs(v2) + R * std::abs(v3)));
            const double of_moment = scale > 0 ? half * gauss * W * (depth + M) * (1 + Z * R) : 0;
            const double v = half * varies;
            const double of_way = std::exp(v) * (Z * Z / 2 + std::expm1(2 * v));
            const double of_opacity = std::min(1.0, of_depth * std::exp(of_depth - 2 * thin));
            const double of_color = piece.steepest_color * std::exp(-thin) * of_moment +
                                    apart * dense * (of_depth / 2 * (1 + Z) + of_way);
            bound = of_opacity * (1 + 2 * apart);
            if (apart > 0) bound += std::min(of_color, -2 * apart * std::expm1(-dense));
        }
        if (R <= 2) {
            // Where it is steep, by the ends of its range.
            const double spread = std::abs(piece.slope) * w;
            const double thin = 2 * half * transfer.depth(std::min(1.0, clear + spread)),
                         dense = 2 * half * transfer.depth(clear - spread);
            bound = std::min(bound, (std::exp(-thin) - std::exp(-dense)) * (1 + 2 * apart) -
                                        2 * apart * std::expm1(-dense));
        }
        anyway = anyway || until - t_ <= by_.least;
        if (!(left_ * bound <= allowed(until))) {
            if (!anyway) return false;
            ++taken_.least;
        }

        // Gauss's rule of three points.
        constexpr double kPlace = 0.7745966692414834;
        const double odd = kPlace * (v1 + kPlace * kPlace * v3), even = kPlace * kPlace * v2;
        const double before = even - odd, behind = even + odd;
        const double depth_before = transfer.depth(clear - piece.slope * before),
                     depth_behind = transfer.depth(clear - piece.slope * behind);
        taken_.samples += 2;
        const double all = half * (8 * depth + 5 * (depth_before + depth_behind)) / 9;
        const double moment =
            half * 5 / 9 *
            (before * depth_before * (1 + Z * kPlace) + behind * depth_behind * (1 - Z * kPlace)) *
            std::exp(-all / 2);
        const double opacity = -std::expm1(-all);
        double light[3];
        for (std::size_t c = 0; c < 3; ++c) {
            const double color = piece.color[c] + piece.color_slope[c] * (v0 - piece.from);
            const double reach = std::abs(piece.color_slope[c]) * w * opacity;
            light[c] = opacity * color + std::clamp(piece.color_slope[c] * moment, -reach, reach);
            light[c] = std::clamp(light[c], 0.0, opacity);
        }
        take(bound, std::exp(-all), light, until);
        return true;
    }

    const AdaptiveQuadrature& by_;
    QuadratureTaken& taken_;
    ScalarLoad load_;
    double origin_[3], along_[3];  // origin + t along [input index]
    double t_, end_;
    std::int64_t cell_[3];
    double budget_;  // what of the tolerance is left
    double left_ = 1, light_[3] = {0, 0, 0};
    // The cell that is crossed.
    double start_ = 0, length_ = 0;
    Cubic cubic_;
};

}  // namespace
}  // namespace quadrature

void range_layer(const Grid& volume, std::int64_t layer, ValueRanges& ranges) {
    constexpr std::int64_t kSide = 1 << ValueRanges::kShift;
    const Extent& n = volume.extent;
    const Extent& nodes = ranges.extent[0];
    const ScalarLoad load = scalar_load(volume.type);
    for (std::int64_t j = 0; j < nodes.y; ++j)
        for (std::int64_t i = 0; i < nodes.x; ++i) {
            quadrature::Grown grown;
            for (std::int64_t z = kSide * layer; z <= std::min(kSide * (layer + 1), n.z - 1); ++z)
                for (std::int64_t y = kSide * j; y <= std::min(kSide * (j + 1), n.y - 1); ++y)
                    for (std::int64_t x = kSide * i; x <= std::min(kSide * (i + 1), n.x - 1); ++x)
                        grown.add(load(volume.samples, (z * n.y + y) * n.x + x));
            ranges.nodes[0][static_cast<std::size_t>((layer * nodes.y + j) * nodes.x + i)] =
                grown.range();
        }
}

void join_ranges(ValueRanges& ranges) {
    constexpr std::int64_t kSide = 1 << ValueRanges::kShift;
    for (int level = 1; level < ValueRanges::kLevels; ++level) {
        const Extent &below = ranges.extent[static_cast<std::size_t>(level - 1)],
                     &n = ranges.extent[static_cast<std::size_t>(level)];
        std::size_t node = 0;
        for (std::int64_t k = 0; k < n.z; ++k)
            for (std::int64_t j = 0; j < n.y; ++j)
                for (std::int64_t i = 0; i < n.x; ++i, ++node) {
                    quadrature::Grown grown;
                    for (std::int64_t z = kSide * k; z < std::min(kSide * (k + 1), below.z); ++z)
                        for (std::int64_t y = kSide * j; y < std::min(kSide * (j + 1), below.y);
                             ++y)
                            for (std::int64_t x = kSide * i; x < std::min(kSide * (i + 1), below.x);
                                 ++x) {
                                const ValueRanges::Range& range = ranges.at(level - 1, x, y, z);
                                grown.add(range);
                            }
                    ranges.nodes[static_cast<std::size_t>(level)][node] = grown.range();
                }
    }
}

void adaptive_quadrature(const AdaptiveQuadrature& by, std::int64_t x, std::int64_t y,
                         std::int64_t width, std::int64_t height, float* out,
                         std::ptrdiff_t row_floats) {
    QuadratureTaken taken;
    for (std::int64_t j = 0; j < height; ++j)
        for (std::int64_t i = 0; i < width; ++i) {
            float* pixel = out + j * row_floats + 4 * i;
            std::fill_n(pixel, 4, 0.0f);
            const RayPath path =
                ray_path(by.cast, static_cast<double>(x + i), static_cast<double>(y + j));
            if (!path.hit()) continue;
            quadrature::Ray ray(by, path, taken);
            ray.cross();
            pixel[3] = static_cast<float>(1 - ray.left());
            for (std::size_t c = 0; c < 3; ++c)
                pixel[c] = std::min(static_cast<float>(ray.light(c)), pixel[3]);
        }
    if (!by.taken) return;
    by.taken->samples += taken.samples;
    by.taken->cells += taken.cells;
    by.taken->stretches += taken.stretches;
    by.taken->least += taken.least;
}

}  // namespace edgewise::kernels
