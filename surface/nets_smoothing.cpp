#include "surface/nets_smoothing.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace edgewise::surface {
namespace {

using Vector = Eigen::Vector3f;

constexpr std::size_t kLeaf = 1 << 12;           // points, walls
constexpr int kSteps = 16, kStepsToRestore = 4;  // drawn together, and between two restorations
constexpr int kAtTheEnd = 6;                     // restorations more
constexpr std::size_t kMostWalls = 12;           // that meet at a corner of voxels
constexpr int kPasses = 12, kPassesAtTheEnd = 6, kPassesOfThin = 2;  // of means over what is around

/// Where a wall faces, how large it is, and by how much it should go that way to be back.
struct Facing {
    Vector normal = Vector::Zero();  // of length one, from the lower of its two groups to the other
    float area = 0, back = 0;
};
/// What walls have swept that way, and their area.
struct Swept {
    float volume = 0, area = 0;

    Swept& operator+=(const Swept& other) noexcept {
        volume += other.volume;
        area += other.area;
        return *this;
    }
};

template <class Body>
void for_each(std::size_t count, Body body) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, kLeaf), [&](const auto& part) {
        for (std::size_t i = part.begin(); i != part.end(); ++i) body(i);
    });
}

template <class T>
std::span<T> span_of(Array& array, std::size_t count) {
    return {static_cast<T*>(array.data()), count};
}

class Smoother {
 public:
    Smoother(std::span<const NetPoint> points, std::span<const NetWall> walls, float share,
             std::span<Vector> moved, std::pmr::memory_resource* memory)
        : points_(points),
          walls_(walls),
          bound_(share / 2),
          moved_(moved),
          starts_((points.size() + 1) * sizeof(std::uint64_t), memory),
          at_point_(walls.size() * 4 * sizeof(std::uint32_t), memory),
          others_(points.size() * sizeof(Vector), memory),
          local_(walls.size() * 4, memory),
          first_sheets_((points.size() + 1) * sizeof(std::uint32_t), memory),
          sheets_(walls.size() * sizeof(Quad), memory),
          facing_(walls.size() * sizeof(Facing), memory),
          swept_(walls.size() * sizeof(Swept), memory),
          around_(walls.size() * sizeof(Swept), memory) {
        const auto start = span_of<std::uint64_t>(starts_, points.size() + 1);
        const auto at = span_of<std::uint32_t>(at_point_, walls.size() * 4);
        std::fill(start.begin(), start.end(), 0);
        for (const NetWall& wall : walls)
            for (const std::uint32_t point : wall.points) ++start[point];
        std::partial_sum(start.begin(), start.end(), start.begin());
        for (std::size_t w = walls.size(); w-- > 0;)
            for (const std::uint32_t point : walls[w].points)
                at[--start[point]] = static_cast<std::uint32_t>(w);
        find_sheets(memory);
    }

    void draw_together() {
        const auto to = span_of<Vector>(others_, points_.size());
        for_each(points_.size(), [&](std::size_t p) { to[p] = drawn(p); });
        for_each(points_.size(), [&](std::size_t p) { moved_[p] = to[p]; });
    }

    void restore(int passes) {
        const auto facing = span_of<Facing>(facing_, walls_.size());
        auto of = span_of<Swept>(swept_, walls_.size()),
             around = span_of<Swept>(around_, walls_.size());
        for_each(walls_.size(), [&](std::size_t w) { measure(walls_[w], facing[w], of[w]); });
        for (int pass = 0; pass < passes; ++pass) {
            take_mean(of, around);
            std::swap(of, around);
            if (pass + 1 != kPassesOfThin && pass + 1 != passes) continue;
            for_each(walls_.size(), [&](std::size_t w) {
                if (walls_[w].thin && pass + 1 != kPassesOfThin) return;
                facing[w].back = of[w].area > 0 ? -of[w].volume / of[w].area : 0;
            });
        }
        for_each(points_.size(), [&](std::size_t p) { moved_[p] = kept(p, moved_[p] + back(p)); });
        hold_thickness();
    }

 private:
    std::span<const std::uint32_t> walls_at(std::size_t point) const noexcept {
        const auto* start = static_cast<const std::uint64_t*>(starts_.data());
        const auto* at = static_cast<const std::uint32_t*>(at_point_.data());
        return {at + start[point], at + start[point + 1]};
    }

    Vector kept(std::size_t point, Vector to) const noexcept {
        for (int axis = 0; axis < 3; ++axis)
            to[axis] =
                (points_[point].free >> axis & 1) != 0 ? std::clamp(to[axis], -bound_, bound_) : 0;
        return to;
    }

    /// Both ends go half of the way, or one of them all of it.
    void hold_thickness() {
        const auto to = span_of<Vector>(others_, points_.size());
        for_each(points_.size(), [&](std::size_t p) { to[p] = held(p); });
        for_each(points_.size(), [&](std::size_t p) { moved_[p] = to[p]; });
    }

    Vector held(std::size_t p) const noexcept {
        const NetPoint& point = points_[p];
        float sum = 0, count = 0;
        for (std::size_t side = 0; side < 2; ++side) {
            const std::uint32_t other = point.across[side];
            if (other == NetPoint::kNone) continue;
            const float grown =
                (moved_[p][point.axis] - moved_[other][point.axis]) * (side == 0 ? 1.0F : -1.0F);
            const float most = kThickness * static_cast<float>(point.thickness[side]);
            const float excess = grown - std::clamp(grown, -most, most);
            const float share = (points_[other].free >> point.axis & 1) != 0 ? 0.5F : 1.0F;
            sum += share * excess * (side == 0 ? -1.0F : 1.0F);
            ++count;
        }
        Vector to = moved_[p];
        if (count > 0) to[point.axis] += sum / count;
        return kept(p, to);
    }

    Vector drawn(std::size_t p) const noexcept {
        const NetPoint& point = points_[p];
        Vector sum = Vector::Zero();
        float count = 0;
        for (int way = 0; way < 6; ++way) {
            const std::uint32_t other = point.neighbours[static_cast<std::size_t>(way)];
            if (other == NetPoint::kNone) continue;
            const float weight = (point.twice >> way & 1) != 0 ? 2 : 1;
            Vector place = moved_[other];
            place[way / 2] += way % 2 == 0 ? -1.0F : 1.0F;
            sum += weight * place;
            count += weight;
        }
        if (count == 0) return moved_[p];
        return kept(p, (moved_[p] + sum / count) / 2);
    }

    /// The volume between where a wall is and where it began, by the ruled surfaces that its sides
    /// sweep: those of neighbours agree. Of points x = b + t d, 0 <= t <= 1, it is the integral of
    /// d (x_u x x_v); its integrand has degree 2 in u and v, which two points of Gauss integrate.
    void measure(const NetWall& wall, Facing& facing, Swept& swept) const noexcept {
        // Along u, v and the axis, in this order.
        const int axes[] = {(wall.axis + 1) % 3, (wall.axis + 2) % 3, wall.axis};
        const auto moved = [&](std::size_t corner) {
            const Vector& by = moved_[wall.points[corner]];
            return Vector(by[axes[0]], by[axes[1]], by[axes[2]]);
        };
        const Vector a = moved(0), b = moved(1), c = moved(2), d = moved(3);
        constexpr float kLow = 0.21132487F, kHigh = 1 - kLow;
        float volume = 0;
        for (const float u : {kLow, kHigh})
            for (const float v : {kLow, kHigh}) {
                const Vector low = (1 - u) * a + u * b, high = (1 - u) * d + u * c;
                const Vector at = (1 - v) * low + v * high;
                const Vector by_u = (1 - v) * (b - a) + v * (c - d), by_v = high - low;
                // d (e_u x d_v + d_u x e_v), written out.
                const float bent = at[2] * (by_u[0] + by_v[1]) - at[0] * by_u[2] - at[1] * by_v[2];
                volume += at[2] + bent / 2 + at.dot(by_u.cross(by_v)) / 3;
            }
        // Twice the area is the product of the diagonals.
        const Vector one = Vector(1, 1, 0) + c - a, other = Vector(-1, 1, 0) + d - b;
        const Vector twice = one.cross(other);
        // Cut along a diagonal, the shorter one, it differs from that by half of a tetrahedron.
        const Vector side = Vector(1, 0, 0) + b - a;
        const float half = side.dot(one.cross(Vector(0, 1, 0) + d - a)) / 12,
                    cut = one.squaredNorm() < other.squaredNorm() ? -half : half;
        const float length = twice.norm(), sign = wall.below < wall.above ? 1.0F : -1.0F;
        const Vector normal = length > 0 ? Vector(twice * (sign / length)) : Vector(0, 0, sign);
        facing.area = length / 2;
        for (int k = 0; k < 3; ++k) facing.normal[axes[k]] = normal[k];
        swept = {sign * (volume / 4 + cut), facing.area};
    }

    /// Walls at a point between the same two groups are a sheet. Each point has its sheets one
    /// after another; a wall belongs to one at each corner.
    void find_sheets(std::pmr::memory_resource* memory) {
        const auto first = span_of<std::uint32_t>(first_sheets_, points_.size() + 1);
        auto* local = static_cast<std::uint8_t*>(local_.data());
        const auto* at = static_cast<const std::uint32_t*>(at_point_.data());
        first[0] = 0;
        for_each(points_.size(), [&](std::size_t p) {
            std::array<std::uint32_t, kMostWalls> found;  // a wall of each sheet
            std::uint8_t sheets = 0;
            for (const std::uint32_t& w : walls_at(p)) {
                std::uint8_t sheet = 0;
                while (sheet < sheets && !same_groups(walls_[found[sheet]], walls_[w])) ++sheet;
                if (sheet == sheets) found[sheets++] = w;
                local[&w - at] = sheet;
            }
            first[p + 1] = sheets;
        });
        std::partial_sum(first.begin(), first.end(), first.begin());
        const auto sheets = span_of<Quad>(sheets_, walls_.size());
        for_each(points_.size(), [&](std::size_t p) {
            for (const std::uint32_t& w : walls_at(p))
                for (std::size_t corner = 0; corner < 4; ++corner)
                    if (walls_[w].points[corner] == p)
                        sheets[w][corner] = first[p] + local[&w - at];
        });
        of_sheets_ = Array(first.back() * sizeof(Swept), memory);
    }

    static bool same_groups(const NetWall& a, const NetWall& b) noexcept {
        return std::minmax(a.below, a.above) == std::minmax(b.below, b.above);
    }

    /// The mean over walls between the same two groups that share a point with one; itself counts
    /// four times, those along a side twice.
    void take_mean(std::span<const Swept> of, std::span<Swept> around) {
        const auto* first = static_cast<const std::uint32_t*>(first_sheets_.data());
        const auto* start = static_cast<const std::uint64_t*>(starts_.data());
        const auto* at = static_cast<const std::uint32_t*>(at_point_.data());
        const auto* local = static_cast<const std::uint8_t*>(local_.data());
        auto* sums = static_cast<Swept*>(of_sheets_.data());
        for_each(points_.size(), [&](std::size_t p) {
            Swept* here = sums + first[p];
            std::fill(here, sums + first[p + 1], Swept{});
            for (std::uint64_t i = start[p]; i != start[p + 1]; ++i) here[local[i]] += of[at[i]];
        });
        const auto* sheets = static_cast<const Quad*>(sheets_.data());
        for_each(walls_.size(), [&](std::size_t w) {
            Swept sum;
            for (const std::uint32_t sheet : sheets[w]) sum += sums[sheet];
            around[w] = {sum.volume / 16, sum.area / 16};
        });
    }

    /// How far a point goes for its walls to go back: least squares, weighted by area.
    Vector back(std::size_t p) const noexcept {
        const auto* facing = static_cast<const Facing*>(facing_.data());
        Eigen::Matrix3f squares = Eigen::Matrix3f::Zero();
        Vector right = Vector::Zero();
        for (const std::uint32_t w : walls_at(p)) {
            const Facing& wall = facing[w];
            squares += wall.area * wall.normal * wall.normal.transpose();
            right += wall.area * wall.back * wall.normal;
        }
        // Along a smooth surface nothing says how far: it stays.
        constexpr float kStays = 0.05F;
        const float size = squares.trace();
        if (!(size > 0)) return Vector::Zero();
        for (int axis = 0; axis < 3; ++axis) {
            squares(axis, axis) += kStays * size;
            if ((points_[p].free >> axis & 1) != 0) continue;
            squares.row(axis).setZero();
            squares.col(axis).setZero();
            squares(axis, axis) = size;
            right[axis] = 0;
        }
        // By cofactors: what stays keeps the condition at most 21.
        return squares.inverse() * right;
    }

    std::span<const NetPoint> points_;
    std::span<const NetWall> walls_;
    const float bound_;
    std::span<Vector> moved_;
    Array starts_, at_point_;  // of each point its walls, one point after another
    Array others_;
    Array local_, first_sheets_, sheets_, of_sheets_;
    Array facing_, swept_, around_;
};

}  // namespace

void smooth_net(std::span<const NetPoint> points, std::span<const NetWall> walls, float share,
                std::span<Vector> moved, std::pmr::memory_resource* memory,
                const std::function<void()>& poll) {
    std::fill(moved.begin(), moved.end(), Vector(Vector::Zero()));
    if (!(share > 0) || walls.empty()) return;
    Smoother smoother(points, walls, share, moved, memory);
    for (int step = 1; step <= kSteps + kAtTheEnd; ++step) {
        if (poll) poll();
        if (step <= kSteps) smoother.draw_together();
        if (step > kSteps || step % kStepsToRestore == 0)
            smoother.restore(step > kSteps ? kPassesAtTheEnd : kPasses);
    }
}

double smoothing_scratch(double points, double walls) noexcept {
    // Where three groups meet, a point has three sheets; elsewhere one.
    constexpr double kSheets = 1.5;
    return (points + 1) * (sizeof(std::uint64_t) + sizeof(Vector) + sizeof(std::uint32_t) +
                           kSheets * sizeof(Swept)) +
           walls *
               (4 * sizeof(std::uint32_t) + 4 + sizeof(Quad) + sizeof(Facing) + 2 * sizeof(Swept));
}

}  // namespace edgewise::surface
