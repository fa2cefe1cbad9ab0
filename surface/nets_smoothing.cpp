#include "surface/nets_smoothing.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
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
          pairs_(walls.size() * sizeof(std::uint64_t), memory),
          facing_(walls.size() * sizeof(Facing), memory),
          swept_(walls.size() * sizeof(Swept), memory),
          around_(walls.size() * sizeof(Swept), memory),
          at_points_(points.size() * sizeof(Swept), memory) {
        const auto start = span_of<std::uint64_t>(starts_, points.size() + 1);
        const auto at = span_of<std::uint32_t>(at_point_, walls.size() * 4);
        std::fill(start.begin(), start.end(), 0);
        for (const NetWall& wall : walls)
            for (const std::uint32_t point : wall.points) ++start[point];
        std::partial_sum(start.begin(), start.end(), start.begin());
        for (std::size_t w = walls.size(); w-- > 0;)
            for (const std::uint32_t point : walls[w].points)
                at[--start[point]] = static_cast<std::uint32_t>(w);
        const auto pair = span_of<std::uint64_t>(pairs_, walls.size());
        for (std::size_t w = 0; w < walls.size(); ++w) {
            const auto [low, high] = std::minmax(walls[w].below, walls[w].above);
            pair[w] = std::uint64_t{low} << 32 | high;
        }
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
        const Vector &a = moved_[wall.points[0]], &b = moved_[wall.points[1]],
                     &c = moved_[wall.points[2]], &d = moved_[wall.points[3]];
        const int u_axis = (wall.axis + 1) % 3, v_axis = (wall.axis + 2) % 3;
        const Vector u_step = Vector::Unit(u_axis), v_step = Vector::Unit(v_axis);
        constexpr float kLow = 0.21132487F, kHigh = 1 - kLow;
        float volume = 0;
        for (const float u : {kLow, kHigh})
            for (const float v : {kLow, kHigh}) {
                const Vector low = (1 - u) * a + u * b, high = (1 - u) * d + u * c;
                const Vector at = (1 - v) * low + v * high;
                const Vector by_u = (1 - v) * (b - a) + v * (c - d), by_v = high - low;
                volume += at[wall.axis] + at.dot(by_u.cross(v_step) + u_step.cross(by_v)) / 2 +
                          at.dot(by_u.cross(by_v)) / 3;
            }
        // Twice the area is the product of the diagonals.
        const Vector one = u_step + v_step + c - a, other = v_step - u_step + d - b;
        const Vector twice = one.cross(other);
        // Cut along a diagonal, the shorter one, it differs from that by half of a tetrahedron.
        const Vector side = u_step + b - a;
        const float half = side.dot(one.cross(v_step + d - a)) / 12,
                    cut = one.squaredNorm() < other.squaredNorm() ? -half : half;
        const float length = twice.norm(), sign = wall.below < wall.above ? 1.0F : -1.0F;
        facing.area = length / 2;
        facing.normal = sign * (length > 0 ? twice / length : Vector(Vector::Unit(wall.axis)));
        swept = {sign * (volume / 4 + cut), facing.area};
    }

    /// The mean over walls between the same two groups that share a point with one; itself counts
    /// four times, those along a side twice.
    void take_mean(std::span<const Swept> of, std::span<Swept> around) {
        const auto sums = span_of<Swept>(at_points_, points_.size());
        const auto* pair = static_cast<const std::uint64_t*>(pairs_.data());
        for_each(points_.size(), [&](std::size_t p) {
            Swept sum;
            if (!points_[p].many)
                for (const std::uint32_t w : walls_at(p)) sum += of[w];
            sums[p] = sum;
        });
        for_each(walls_.size(), [&](std::size_t w) {
            Swept sum;
            for (const std::uint32_t p : walls_[w].points) {
                if (!points_[p].many) {
                    sum += sums[p];
                    continue;
                }
                for (const std::uint32_t other : walls_at(p))
                    if (pair[other] == pair[w]) sum += of[other];
            }
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
        return squares.llt().solve(right);
    }

    std::span<const NetPoint> points_;
    std::span<const NetWall> walls_;
    const float bound_;
    std::span<Vector> moved_;
    Array starts_, at_point_, others_, pairs_, facing_, swept_, around_, at_points_;
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
    return (points + 1) * (sizeof(std::uint64_t) + sizeof(Vector) + sizeof(Swept)) +
           walls * (4 * sizeof(std::uint32_t) + sizeof(std::uint64_t) + sizeof(Facing) +
                    2 * sizeof(Swept));
}

}  // namespace edgewise::surface
