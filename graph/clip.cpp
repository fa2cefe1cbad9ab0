#include "graph/clip.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

namespace edgewise {
namespace {

using Polygon = std::vector<Vec3>;

/// Share of a box's volume. Planes that only touch the box leave less than this, by rounding.
constexpr double kNothing = 1e-13;

std::vector<Vec3> corners_of(const Vec3& low, const Vec3& high) {
    std::vector<Vec3> corners;
    for (int i = 0; i < 8; ++i)
        corners.emplace_back(i & 1 ? high.x() : low.x(), i & 2 ? high.y() : low.y(),
                             i & 4 ? high.z() : low.z());
    return corners;
}

std::vector<Polygon> faces_of(const Vec3& low, const Vec3& high) {
    const std::vector<Vec3> corner = corners_of(low, high);
    std::vector<Polygon> faces;
    for (int axis = 0; axis < 3; ++axis)
        for (const int side : {0, 1 << axis}) {
            const int b = 1 << (axis + 1) % 3, c = 1 << (axis + 2) % 3;
            Polygon face;
            for (const int i : {side, side + b, side + b + c, side + c})
                face.push_back(corner[static_cast<std::size_t>(i)]);
            faces.push_back(std::move(face));
        }
    return faces;
}

/// Points of a plane in order around their middle.
Polygon ordered(Polygon points, const Vec3& normal) {
    Vec3 middle = Vec3::Zero();
    for (const Vec3& p : points) middle += p / static_cast<double>(points.size());
    const Vec3 across = normal.unitOrthogonal(), up = normal.cross(across);
    const auto angle = [&](const Vec3& p) {
        return std::atan2((p - middle).dot(up), (p - middle).dot(across));
    };
    std::sort(points.begin(), points.end(),
              [&](const Vec3& a, const Vec3& b) { return angle(a) < angle(b); });
    return points;
}

/// The faces of a convex body that a half space leaves, and the new one (Sutherland and Hodgman
/// 1974).
std::vector<Polygon> cut(const std::vector<Polygon>& faces, const HalfSpace& plane) {
    std::vector<Polygon> left;
    Polygon cap;
    for (const Polygon& face : faces) {
        Polygon kept;
        for (std::size_t i = 0; i < face.size(); ++i) {
            const Vec3 &here = face[i], &next = face[(i + 1) % face.size()];
            const double at = plane.at(here), then = plane.at(next);
            if (at >= 0) kept.push_back(here);
            if ((at >= 0) == (then >= 0)) continue;
            kept.push_back(here + at / (at - then) * (next - here));
            cap.push_back(kept.back());
        }
        if (kept.size() > 2) left.push_back(std::move(kept));
    }
    if (cap.size() > 2) left.push_back(ordered(std::move(cap), plane.normal));
    return left;
}

/// Tetrahedra from a point inside to the triangles of all faces.
double volume_of(const std::vector<Polygon>& faces) {
    Vec3 inside = Vec3::Zero();
    double points = 0;
    for (const Polygon& face : faces)
        for (const Vec3& p : face) inside += p, ++points;
    if (points > 0) inside /= points;
    double volume = 0;
    for (const Polygon& face : faces)
        for (std::size_t i = 2; i < face.size(); ++i) {
            const Vec3 a = face[0] - inside, b = face[i - 1] - inside, c = face[i] - inside;
            volume += std::abs(a.dot(b.cross(c))) / 6;
        }
    return volume;
}

void measure_planes(Clip& clip) {
    clip.least = clip.low, clip.most = clip.high;
    const Vec3 size = (clip.high - clip.low).cwiseMax(0);
    clip.volume = size.prod();
    if (clip.planes.empty() || clip.volume == 0) return;
    std::vector<Polygon> faces = faces_of(clip.low, clip.high);
    for (const HalfSpace& plane : clip.planes) faces = cut(faces, plane);
    const double volume = volume_of(faces);
    clip.volume = volume > kNothing * clip.volume ? volume : 0;
    if (clip.volume == 0) return;
    clip.least = clip.high, clip.most = clip.low;
    for (const Polygon& face : faces)
        for (const Vec3& p : face) {
            clip.least = clip.least.cwiseMin(p);
            clip.most = clip.most.cwiseMax(p);
        }
    clip.least = clip.least.cwiseMax(clip.low);
    clip.most = clip.most.cwiseMin(clip.high);
}

/// Whether some point is inside of all. Each that it is outside of pulls it over its own face
/// (relaxation; Agmon 1954, Polyak 1969), which ends where they have more than faces in common.
bool has_inside(const Clip& clip) {
    constexpr int kRounds = 2000;
    constexpr double kOver = 1.5;  // of the distance to a face
    const std::vector<HalfSpace> planes = half_spaces_of(clip);
    Vec3 p = 0.5 * (clip.least + clip.most);
    for (int round = 0; round < kRounds; ++round) {
        bool inside = true;
        const auto pull = [&](double beyond, const Vec3& outwards) {
            if (beyond <= 0) return;
            inside = false;
            p -= kOver * beyond / outwards.squaredNorm() * outwards;
        };
        for (const Ball& ball : clip.balls) {
            const Vec3 from = ball.from_centre(p);
            const double far = from.norm();
            pull(far - 1, ball.to_unit.transpose() * from / far);
        }
        for (const HalfSpace& plane : planes) pull(-plane.at(p), -plane.normal);
        if (inside) return true;
    }
    return false;
}

/// The sum over lines along z, at even distances across them.
double volume_by_lines(const Clip& clip) {
    constexpr int kLines = 64;
    const Vec3 size = clip.most - clip.least;
    const auto numbers = [](const Vec3& v) { return std::array{v[0], v[1], v[2]}; };
    double sum = 0;
    for (int j = 0; j < kLines; ++j)
        for (int i = 0; i < kLines; ++i) {
            const Vec3 share((i + 0.5) / kLines, (j + 0.5) / kLines, 0);
            const Vec3 p = clip.least + share.cwiseProduct(size);
            double low = 0, high = size.z();
            for (const HalfSpace& plane : clip.planes)
                cut_by_plane(plane.at(p), plane.normal.z(), low, high);
            for (const Ball& ball : clip.balls)
                cut_by_ball(numbers(ball.from_centre(p)), numbers(ball.to_unit.col(2)), low, high);
            sum += std::max(0.0, high - low);
        }
    return sum / (kLines * kLines) * size.x() * size.y();
}

void measure(Clip& clip) {
    measure_planes(clip);
    if (clip.balls.empty() || clip.volume == 0) return;
    for (const Ball& ball : clip.balls) {
        clip.least = clip.least.cwiseMax(ball.centre - ball.reach());
        clip.most = clip.most.cwiseMin(ball.centre + ball.reach());
    }
    if ((clip.least.array() < clip.most.array()).all() && has_inside(clip)) {
        // Lines may miss a thin part, whose volume is not zero.
        clip.volume = std::max(volume_by_lines(clip), kNothing * clip.volume);
        return;
    }
    clip.least = clip.low, clip.most = clip.high;
    clip.volume = 0;
}

Vec3 last_of(const Extent& input) {
    return Vec3(static_cast<double>(input.x), static_cast<double>(input.y),
                static_cast<double>(input.z)) -
           Vec3::Constant(0.5);
}

}  // namespace

Vec3 Ball::reach() const {
    // The determinant of a very large or small ball would be no number.
    const double scale = to_unit.cwiseAbs().maxCoeff();
    return Eigen::Matrix3d(to_unit / scale).inverse().rowwise().norm() / scale;
}

bool Clip::keeps_all(const Extent& input) const noexcept {
    return planes.empty() && balls.empty() && low == Vec3::Constant(-0.5) && high == last_of(input);
}

Clip clip_of(const Extent& input, std::span<const HalfSpace> planes, std::span<const Ball> balls) {
    Clip clip{Vec3::Constant(-0.5), last_of(input), {}, {}, {}, {}};
    for (const HalfSpace& plane : planes)
        for (int axis = 0; axis < 3; ++axis) {
            if (plane.normal[axis] == 1) clip.low[axis] = std::max(clip.low[axis], -plane.offset);
            if (plane.normal[axis] == -1) clip.high[axis] = std::min(clip.high[axis], plane.offset);
        }
    const std::vector<Vec3> corners = corners_of(clip.low, clip.high);
    for (const HalfSpace& plane : planes) {
        const bool is_face = plane.normal.cwiseAbs().maxCoeff() == 1;
        const bool cuts = std::any_of(corners.begin(), corners.end(), [&](const Vec3& corner) {
            return plane.at(corner) < -kInPlane;
        });
        if (!is_face && cuts) clip.planes.push_back(plane);
    }
    for (const Ball& ball : balls)
        if (!std::all_of(corners.begin(), corners.end(),
                         [&](const Vec3& corner) { return ball.has(corner); }))
            clip.balls.push_back(ball);
    measure(clip);
    return clip;
}

std::vector<HalfSpace> half_spaces_of(const Clip& clip) {
    std::vector<HalfSpace> planes;
    for_each_half_space(clip, [&](const HalfSpace& plane) { planes.push_back(plane); });
    return planes;
}

}  // namespace edgewise
