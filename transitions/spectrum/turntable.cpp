#include "transitions/spectrum/turntable.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

#include "transitions/kernels/fourier.hpp"

namespace edgewise {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kSame = 1e-7;       // of directions, and of places [pixel]
constexpr double kSameAngle = 1e-9;  // [turns]

Vec3 middle_of(const Extent& n) {
    return 0.5 * Vec3(static_cast<double>(n.x - 1), static_cast<double>(n.y - 1),
                      static_cast<double>(n.z - 1));
}

Mat3 turn_about_y(double turns) {
    const double c = std::cos(kTurn * turns), s = std::sin(kTurn * turns);
    Mat3 turn;
    turn << c, 0, s, 0, 1, 0, -s, 0, c;
    return turn;
}

}  // namespace

Turntable::Turntable(const Request& want) : first(want.views.at(0).matrix()), pixel(want.pixel) {
    const Vec3 steps(pixel[0], pixel[1], 1), centre = middle_of(want.input);
    const Mat3 start = steps.asDiagonal() * first.topLeftCorner<3, 3>();
    middle = want.views.at(0).apply(centre);
    axis = std::round(2 * middle.x()) / 2;
    if (std::abs(axis - middle.x()) > kSame) {
        refused = fmt::format("the axis lies at {:.6g} pixels: neither on a pixel nor half-way",
                              middle.x());
        return;
    }
    for (int variant = 0; variant < want.views.different(); ++variant) {
        const int view = want.views.first_view(variant);
        const Mat3 here = steps.asDiagonal() * want.views.at(view).matrix().topLeftCorner<3, 3>();
        const Mat3 turned = here * start.inverse();
        const double turns = std::atan2(turned(0, 2), turned(0, 0)) / kTurn;
        if ((turned - turn_about_y(turns)).cwiseAbs().maxCoeff() > kSame) {
            refused = fmt::format(
                "view {} is not the first one turned about the screen's y: no turntable", view);
            return;
        }
        const Vec3 moved = want.views.at(view).apply(centre) - middle;
        if (moved.head<2>().cwiseAbs().maxCoeff() > kSame) {
            refused =
                fmt::format("view {} turns about another axis than the volume's middle", view);
            return;
        }
        angles.push_back(turns - std::floor(turns));
    }
    finest = start.colwise().norm().minCoeff();
    for (int corner = 0; corner < 8; ++corner) {
        Vec3 from = centre + Vec3::Constant(0.5);
        for (int k = 0; k < 3; ++k)
            if (corner >> k & 1) from[k] = -from[k];
        const Vec3 seen = start * from;
        radius = std::max(radius, std::hypot(seen.x(), seen.z()));
    }
}

Mat4 Turntable::view_at(double turns) const {
    const Vec3 steps(pixel[0], pixel[1], 1);
    const Mat3 about = steps.cwiseInverse().asDiagonal() * turn_about_y(turns) * steps.asDiagonal();
    Mat4 turn = Mat4::Identity();
    turn.topLeftCorner<3, 3>() = about;
    turn.topRightCorner<3, 1>() = middle - about * middle;
    return turn * first;
}

std::int64_t Turntable::parts(std::int64_t most) const {
    for (std::int64_t n = 2; n <= most; n += 2)
        if (std::all_of(angles.begin(), angles.end(), [&](double angle) {
                const double place = angle * static_cast<double>(n);
                return std::abs(place - std::round(place)) < kSameAngle * static_cast<double>(n);
            }))
            return n;
    return 0;
}

std::int64_t Turntable::needed(double cutoff, double padding) const {
    const double least = 2 * padding * kTurn * cutoff / finest * radius;
    return kernels::good_length(std::max<std::int64_t>(16, std::llround(std::ceil(least))), 2);
}

}  // namespace edgewise
