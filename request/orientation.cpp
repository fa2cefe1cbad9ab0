#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <string>
#include <utility>
#include <vector>

#include "graph/errors.hpp"
#include "graph/words.hpp"
#include "request/geometry.hpp"

namespace edgewise {
namespace {

/// The letters that mean + and - along the axes of LPS.
constexpr const char* kLetters[3] = {"LR", "PA", "SI"};

/// Which axis of LPS each axis of the file is nearest to, and with which sign.
Mat3 nearest_axes(const Mat3& direction) {
    std::array<int, 3> order{0, 1, 2}, best = order;
    double most = -1;
    do {
        double sum = 0;
        for (int k = 0; k < 3; ++k) sum += std::abs(direction(order[k], k));
        // The least margin keeps the first of equals, whatever the rounding of the cosines.
        if (sum > most + 1e-9) most = sum, best = order;
    } while (std::next_permutation(order.begin(), order.end()));
    Mat3 axes = Mat3::Zero();
    for (int k = 0; k < 3; ++k) axes(best[k], k) = direction(best[k], k) < 0 ? -1 : 1;
    return axes;
}

struct View {
    const char* name;
    std::array<double, 3> down, away;  // in LPS; right is their cross product, so never mirrored
};

constexpr View kViews[] = {
    {"front", {0, 0, -1}, {0, 1, 0}}, {"back", {0, 0, -1}, {0, -1, 0}},
    {"left", {0, 0, -1}, {-1, 0, 0}}, {"right", {0, 0, -1}, {1, 0, 0}},
    {"top", {0, 1, 0}, {0, 0, -1}},   {"bottom", {0, 1, 0}, {0, 0, 1}},
};

/// Planes by the names that radiology has for them.
constexpr std::pair<const char*, const char*> kPlanes[] = {
    {"coronal", "front"}, {"sagittal", "left"}, {"axial", "bottom"}};

Mat3 rows(const Vec3& right, const Vec3& down, const Vec3& away) {
    Mat3 matrix;
    matrix << right.transpose(), down.transpose(), away.transpose();
    return matrix;
}

}  // namespace

Mat3 directions_of(const std::string& letters) {
    Mat3 direction = Mat3::Zero();
    for (std::size_t k = 0; k < 3 && letters.size() == 3; ++k)
        for (int axis = 0; axis < 3; ++axis)
            for (int negative = 0; negative < 2; ++negative)
                if (std::toupper(static_cast<unsigned char>(letters[k])) ==
                    kLetters[axis][negative])
                    direction(axis, static_cast<int>(k)) = negative ? -1 : 1;
    if (std::abs(direction.determinant()) != 1)
        throw RequestError(message(
            "@orient: '{}' is no orientation; expected one letter each of RL, AP and SI, as RAS",
            letters));
    return direction;
}

std::string letters_of(const Mat3& direction) {
    const Mat3 axes = nearest_axes(direction);
    std::string letters;
    for (int k = 0; k < 3; ++k)
        for (int axis = 0; axis < 3; ++axis)
            if (axes(axis, k) != 0) letters += kLetters[axis][axes(axis, k) < 0];
    return letters;
}

Mat3 view_of(const std::string& typed, const Mat3& direction) {
    std::string name = lower(typed);
    for (const auto& [plane, side] : kPlanes)
        if (name == plane) name = side;
    const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
    if (name == "z") return Mat3::Identity();
    if (name == "x") return rows(y, z, x);
    if (name == "y") return rows(x, z, -y);
    for (const View& view : kViews) {
        if (name != view.name) continue;
        const Vec3 down(view.down.data()), away(view.away.data());
        const Vec3 right(down.y() * away.z() - down.z() * away.y(),
                         down.z() * away.x() - down.x() * away.z(),
                         down.x() * away.y() - down.y() * away.x());
        return rows(right, down, away) * nearest_axes(direction);
    }
    std::vector<std::string> names = {"x", "y", "z"};
    for (const View& view : kViews) names.emplace_back(view.name);
    for (const auto& [plane, side] : kPlanes) names.emplace_back(plane);
    throw RequestError(message("@view: there is no side '{}'; {}", typed, instead_of(name, names)));
}

Mat3 looking_along(const Vec3& along) {
    // Numbers beside the largest, whose squares could overflow.
    const Vec3 towards = along / along.cwiseAbs().maxCoeff();
    const Vec3 away = towards / towards.norm();
    const double level = std::hypot(away.x(), away.z());
    constexpr double kUpright = 1e-9;  // rounding would say where right is
    const Vec3 right =
        level > kUpright ? Vec3(away.z() / level, 0, -away.x() / level) : Vec3(1, 0, 0);
    const Vec3 down(away.y() * right.z() - away.z() * right.y(),
                    away.z() * right.x() - away.x() * right.z(),
                    away.x() * right.y() - away.y() * right.x());
    return rows(right, down.normalized(), away);
}

}  // namespace edgewise
