#include <Eigen/LU>
#include <cmath>
#include <fmt/format.h>

#include "graph/errors.hpp"
#include "request/geometry.hpp"

namespace edgewise {
namespace {

struct Turn {
    double cosine, sine;
};

/// Exact where the angle is a multiple of 90 degrees, so that quarter turns are permutations.
Turn turn_of(double degrees) {
    const double within = std::fmod(degrees, 360.0);
    const double quarters = within / 90;
    if (quarters == std::round(quarters)) {
        constexpr double kCosines[] = {1, 0, -1, 0};
        const int quarter = (static_cast<int>(quarters) + 4) % 4;
        return {kCosines[quarter], kCosines[(quarter + 3) % 4]};
    }
    const double radians = within * (3.14159265358979323846 / 180);
    return {std::cos(radians), std::sin(radians)};
}

Mat4 linear(const Mat3& matrix) {
    Mat4 map = Mat4::Identity();
    map.topLeftCorner<3, 3>() = matrix;
    return map;
}

constexpr std::size_t kMostViews = 100000;
constexpr std::size_t kMatrix = 16;  // numbers of a 4x4

void expect_count(const Message& option, const std::vector<double>& values,
                  std::initializer_list<std::size_t> counts, const char* what) {
    for (const std::size_t count : counts)
        if (values.size() == count) return;
    throw RequestError(message("{}: {} numbers given; {}", option, values.size(), what));
}

Mat4 rotate_step(const std::vector<double>& angles, const InputGrid& input) {
    if (input.axes == 2) {
        expect_count(setting("rotate"), angles, {1}, "an image takes one angle");
        return linear(rotation_of(0, 0, angles[0]));
    }
    // A single plane can only turn in itself, so one angle says all.
    if (angles.size() == 1 && input.extent.z == 1) return linear(rotation_of(0, 0, angles[0]));
    expect_count(setting("rotate"), angles, {3}, "a volume takes three angles X,Y,Z");
    return linear(rotation_of(angles[0], angles[1], angles[2]));
}

Mat4 scale_step(std::vector<double> by, const InputGrid& input) {
    if (by.size() == 1) by.assign(input.axes, by[0]);
    expect_count(setting("scale"), by, {static_cast<std::size_t>(input.axes)},
                 input.axes == 2 ? "an image takes one or two" : "a volume takes one or three");
    Mat4 map = Mat4::Identity();
    for (int k = 0; k < input.axes; ++k) map(k, k) = by[k];
    return map;
}

Mat4 translate_step(const std::vector<double>& by, const InputGrid& input) {
    expect_count(setting("translate"), by, {static_cast<std::size_t>(input.axes)},
                 input.axes == 2 ? "an image takes X,Y" : "a volume takes X,Y,Z");
    Mat4 map = Mat4::Identity();
    for (int k = 0; k < input.axes; ++k) map(k, 3) = by[k];
    return map;
}

Mat4 shear_step(const std::vector<double>& numbers, const InputGrid& input) {
    Mat4 map = Mat4::Identity();
    if (numbers.empty() || numbers.size() % 3 != 0)
        throw RequestError(message("@shear: expected two axes and a number each"));
    for (std::size_t i = 0; i < numbers.size(); i += 3) {
        const double to = numbers[i], by = numbers[i + 1];
        const auto is_axis = [&](double axis) {
            return axis == std::floor(axis) && axis >= 0 && axis < input.axes;
        };
        if (!is_axis(to) || !is_axis(by) || to == by)
            throw RequestError(
                message("@shear: expected two different axes of {} and a number, as xy=0.2",
                        input.axes == 2 ? "x and y" : "x, y and z"));
        Mat4 shear = Mat4::Identity();
        shear(static_cast<int>(to), static_cast<int>(by)) = numbers[i + 2];
        map = shear * map;
    }
    return map;
}

/// Rows of an image's matrix: 2x2, 2x3, or a 3x3 homography.
Mat4 image_matrix(const std::vector<double>& v) {
    expect_count(setting("matrix"), v, {4, 6, 9}, "an image takes 4 (2x2), 6 (2x3) or 9 (3x3)");
    const std::size_t columns = v.size() == 4 ? 2 : 3;
    constexpr int kPlace[] = {0, 1, 3};  // z stays
    Mat4 map = Mat4::Identity();
    for (std::size_t i = 0; i < v.size(); ++i) map(kPlace[i / columns], kPlace[i % columns]) = v[i];
    // H and -H are one homography; the centre is to lie in front of the horizon.
    if (map(3, 3) < 0)
        for (const int row : kPlace) map.row(row) *= -1;
    return map;
}

/// @param option  what messages call it
Mat4 volume_matrix(const Message& option, const std::vector<double>& v) {
    expect_count(option, v, {9, 12, 16}, "a volume takes 9 (3x3), 12 (3x4) or 16 (4x4)");
    const std::size_t columns = v.size() == 9 ? 3 : 4;
    Mat4 map = Mat4::Identity();
    for (std::size_t i = 0; i < v.size(); ++i)
        map(static_cast<int>(i / columns), static_cast<int>(i % columns)) = v[i];
    if (map.row(3) != Eigen::RowVector4d(0, 0, 0, 1))
        throw RequestError(message("{}: the last row of a volume's 4x4 must be 0,0,0,1", option));
    return map;
}

constexpr double kSingular = 1e-12;

/// |det| of a map whose rows are made of length one: 0 where two directions agree, whatever the
/// scale. An affine map's shift does not count.
double normalised_determinant(Mat4 map) {
    const bool affine = map.row(3).head<3>().isZero(0);
    if (affine) map.topRightCorner<3, 1>().setZero();
    for (int row = 0; row < 4; ++row) {
        const double length = map.row(row).norm();
        if (!(length > 0)) return 0;
        map.row(row) /= length;
    }
    return std::abs(map.determinant());
}

void expect_finite(const Message& option, const std::vector<double>& numbers) {
    for (const double number : numbers)
        if (!std::isfinite(number))
            throw RequestError(message("{}: {} is not finite", option, number));
}

void expect_regular(const Message& option, const std::vector<double>& by, const Mat4& map,
                    const InputGrid& input) {
    if (!(normalised_determinant(map) > kSingular))
        throw RequestError(message("{} {}: is singular, it flattens the {}", option,
                                   fmt::join(by, ","), input.axes == 2 ? "image" : "volume"));
}

std::vector<Mat4> turntable_maps(const std::vector<double>& by) {
    const double count = by.empty() || by.size() > 2 ? 0 : by[0];
    if (!(count >= 1 && count <= double(kMostViews) && count == std::floor(count)))
        throw RequestError(message("@turntable: {} given; expected a whole number from 1 to {}",
                                   fmt::join(by, ","), kMostViews));
    const double arc = by.size() == 2 ? by[1] : 360;
    if (!std::isfinite(arc) || arc == 0)
        throw RequestError(message(
            "@turntable: an arc of {} degrees; expected a finite number other than 0", arc));
    std::vector<Mat4> maps;
    for (double i = 0; i < count; ++i) maps.push_back(linear(rotation_of(0, arc * i / count, 0)));
    return maps;
}

std::vector<Mat4> path_maps(const std::vector<double>& numbers, const InputGrid& input) {
    const std::size_t count = numbers.size() / kMatrix;
    if (count == 0 || count > kMostViews || numbers.size() % kMatrix != 0)
        throw RequestError(message("@path: {} numbers given; expected 16 a view, of 1 to {}",
                                   numbers.size(), kMostViews));
    std::vector<Mat4> maps;
    for (std::size_t i = 0; i < count; ++i) {
        const auto* first = numbers.data() + i * kMatrix;
        const std::vector<double> by(first, first + kMatrix);
        const Message option = message("@path: matrix {}", i + 1);
        expect_finite(option, by);
        maps.push_back(volume_matrix(option, by));
        expect_regular(option, by, maps.back(), input);
    }
    return maps;
}

}  // namespace

Mat3 rotation_of(double a, double b, double c) {
    const Turn x = turn_of(a), y = turn_of(b), z = turn_of(c);
    Mat3 rx, ry, rz;
    rx << 1, 0, 0, 0, x.cosine, -x.sine, 0, x.sine, x.cosine;
    ry << y.cosine, 0, y.sine, 0, 1, 0, -y.sine, 0, y.cosine;
    rz << z.cosine, -z.sine, 0, z.sine, z.cosine, 0, 0, 0, 1;
    return rz * ry * rx;
}

Mat4 map_of(const GeometryStep& step, const InputGrid& input) {
    using Kind = GeometryStep::Kind;
    const std::vector<double>& by = step.numbers;
    const Message option = setting_of(step.kind);
    expect_finite(option, by);
    Mat4 map;
    switch (step.kind) {
        case Kind::rotate:
            map = rotate_step(by, input);
            break;
        case Kind::scale:
            map = scale_step(by, input);
            break;
        case Kind::translate:
            map = translate_step(by, input);
            break;
        case Kind::shear:
            map = shear_step(by, input);
            break;
        case Kind::matrix:
            map = input.axes == 2 ? image_matrix(by) : volume_matrix(setting("matrix"), by);
            break;
        case Kind::turntable:
        case Kind::path:
            throw RequestError(message("{}: is many maps, not one", option));
    }
    expect_regular(option, by, map, input);
    return map;
}

bool makes_views(GeometryStep::Kind kind) noexcept {
    return kind == GeometryStep::Kind::turntable || kind == GeometryStep::Kind::path;
}

std::vector<Mat4> maps_of(const GeometryStep& step, const InputGrid& input) {
    return step.kind == GeometryStep::Kind::path ? path_maps(step.numbers, input)
                                                 : turntable_maps(step.numbers);
}

}  // namespace edgewise
