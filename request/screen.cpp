#include "request/screen.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "graph/errors.hpp"
#include "graph/words.hpp"
#include "request/errors.hpp"

namespace edgewise {
namespace {

constexpr double kMostSamplesAnAxis = 2147483647;
constexpr double kMostSamples = 1e18;  // further on, counts of bytes would leave 64 bits
/// Lengths that should be whole numbers of samples are so to this part of them: spacings and steps
/// that come from f32 are off by a few units of 2^-24 (store::without_noise), and both the length
/// and the spacing that it is divided by may be.
constexpr double kSlack = 0x1p-20;

struct Box {
    Vec3 low = Vec3::Constant(1e300), high = Vec3::Constant(-1e300);

    void add(const Vec3& point) {
        low = low.cwiseMin(point);
        high = high.cwiseMax(point);
    }
};

Box box_of(const std::vector<Mat4>& maps, const std::vector<Vec3>& corners) {
    Box box;
    for (const Mat4& map : maps)
        for (const Vec3& corner : corners) {
            const std::optional<Vec3> to = sent(map, corner);
            if (!to)
                throw RequestError(
                    message("@matrix: the horizon of this homography crosses the image; @size WxH "
                            "says what to show of it"));
            box.add(*to);
        }
    return box;
}

std::int64_t whole_samples(double length, double spacing, const Message& what) {
    const double count = std::max(1.0, std::ceil(length / spacing * (1 - kSlack)));
    if (!(count <= kMostSamplesAnAxis))
        throw RequestError(message("{}: makes {:.4g} samples along an axis; at most {}", what,
                                   count, kMostSamplesAnAxis));
    return static_cast<std::int64_t>(count);
}

void expect_countable(const Extent& extent) {
    const double samples = double(extent.x) * double(extent.y) * double(extent.z);
    if (samples > kMostSamples)
        throw NoPlan(fmt::format("an output of {}x{}x{} samples does not fit into any memory",
                                 extent.x, extent.y, extent.z));
}

/// The samples of each axis; of one number, those of the longer side, the others in proportion to
/// `field`.
Extent size_of(const OutputSize& size, const Extent& field, int axes, const char* expected) {
    for (const std::int64_t side : size.sides)
        if (side < 1 || double(side) > kMostSamplesAnAxis)
            throw RequestError(
                message("@size: {} is not from 1 to {}", side, std::int64_t(kMostSamplesAnAxis)));
    Extent extent;
    if (size.sides.size() == 1) {
        std::int64_t longest = 1;
        for (int k = 0; k < axes; ++k) longest = std::max(longest, field[k]);
        const double factor = double(size.sides[0]) / double(longest);
        for (int k = 0; k < axes; ++k)
            extent[k] = whole_samples(double(field[k]) * factor, 1, setting("size"));
        return extent;
    }
    if (static_cast<int>(size.sides.size()) != axes)
        throw RequestError(message("@size: '{}' given; expected {}", size.text(), expected));
    for (int k = 0; k < axes; ++k) extent[k] = size.sides[static_cast<std::size_t>(k)];
    return extent;
}

/// `spacing`: one number for all axes, or one each.
Vec3 spacing_of(std::vector<double> numbers, int axes, const Vec3& otherwise) {
    if (numbers.size() == 1) numbers.assign(axes, numbers[0]);
    if (static_cast<int>(numbers.size()) != axes)
        throw RequestError(
            message("@spacing: {} numbers given; expected 1 or {}", numbers.size(), axes));
    Vec3 spacing = otherwise;
    for (int k = 0; k < axes; ++k) {
        if (!(numbers[k] > 0))
            throw RequestError(message("@spacing: {} is not greater than 0", numbers[k]));
        spacing[k] = numbers[k];
    }
    return spacing;
}

/// The one factor by which `field` (samples) is shrunk or enlarged so that it fits into `size`. A
/// single plane is chosen out of a volume, not a volume made as thin.
double one_factor(const Extent& field, const Extent& size, int axes) {
    if (axes == 3 && size.z == 1) axes = 2;
    double factor = 1e300;
    for (int k = 0; k < axes; ++k) factor = std::min(factor, double(size[k]) / double(field[k]));
    return factor;
}

/// A plane of a volume that becomes a picture: no viewer would heed its spacing, so its pixels are
/// square, as many as show all of the plane.
void take_picture_size(ScreenGrid& grid, const GeometrySpec& spec, const char* expected) {
    const double unit = grid.spacing.minCoeff();
    Extent field = grid.extent;  // in square pixels
    for (int k = 0; k < 2; ++k)
        field[k] = whole_samples(double(grid.extent[k]) * grid.spacing[k], unit, setting("size"));
    const Extent size = size_of(*spec.size, field, 3, expected);
    double pixel = 0;
    for (int k = 0; k < 2; ++k)
        pixel = std::max(pixel, double(grid.extent[k]) * grid.spacing[k] / double(size[k]));
    grid.spacing.head<2>().setConstant(pixel);
    grid.extent = size;
}

void take_size(ScreenGrid& grid, const GeometrySpec& spec, int axes, const char* expected) {
    if (axes == 3 && spec.upright && !spec.spacing) {
        take_picture_size(grid, spec, expected);
        return;
    }
    const Extent size = size_of(*spec.size, grid.extent, axes, expected);
    if (!spec.spacing) {
        const double factor = one_factor(grid.extent, size, axes);
        for (int k = 0; k < axes; ++k) grid.spacing[k] /= factor;
    }
    for (int k = 0; k < axes; ++k) grid.extent[k] = size[k];
}

/// The depth of a picture's scene.
void take_depth(ScreenGrid& grid, const Box& box) {
    grid.extent.z = whole_samples(box.high.z() - box.low.z(), grid.spacing.z(), "the geometry");
    grid.centre = Vec3(0, 0, (box.low.z() + box.high.z()) / 2);
}

bool says_fit(const GeometrySpec& spec) { return spec.size && spec.size->fit; }

}  // namespace

ScreenGrid warp_grid(const GeometrySpec& spec, const InputGrid& input, const Mat4& map,
                     const std::vector<Vec3>& corners) {
    ScreenGrid grid{input.extent, input.spacing};
    if (spec.spacing) grid.spacing = spacing_of(*spec.spacing, input.axes, input.spacing);
    if (says_fit(spec)) {
        const Box box = box_of({map}, corners);
        for (int k = 0; k < input.axes; ++k)
            grid.extent[k] =
                whole_samples(box.high[k] - box.low[k], grid.spacing[k], setting("size", "fit"));
        grid.centre = (box.low + box.high) / 2;
        if (input.axes == 2) grid.centre.z() = 0;
        expect_countable(grid.extent);
        return grid;
    }
    if (spec.spacing)
        for (int k = 0; k < input.axes; ++k)
            grid.extent[k] = whole_samples(double(input.extent[k]) * input.spacing[k],
                                           grid.spacing[k], setting("spacing"));
    if (spec.size)
        take_size(grid, spec, input.axes,
                  input.axes == 2 ? "WxH, N or fit" : "WxHxD, N or fit for a volume");
    expect_countable(grid.extent);
    return grid;
}

ScreenGrid picture_grid(const GeometrySpec& spec, const InputGrid& input,
                        const std::vector<Mat4>& maps, const std::vector<Vec3>& corners) {
    const double unit = input.spacing.minCoeff();
    const Box box = box_of(maps, corners);
    ScreenGrid grid{{}, Vec3::Constant(unit)};
    if (spec.spacing) grid.spacing = spacing_of(*spec.spacing, 2, grid.spacing);
    for (int k = 0; k < 2; ++k)
        grid.extent[k] = whole_samples(2 * std::max(box.high[k], -box.low[k]), grid.spacing[k],
                                       spec.spacing ? setting("spacing") : "the geometry");
    if (says_fit(spec))
        throw RequestError(message("@size(fit): of warp; a picture is never cut off"));
    if (spec.size && !spec.size->native) take_size(grid, spec, 2, "WxH, N or native for a picture");
    grid.spacing.z() = unit;
    take_depth(grid, box);
    expect_countable(grid.extent);
    return grid;
}

void zoom(ScreenGrid& grid, double factor, Job job) {
    if (job == Job::warp)
        throw RequestError(message("@zoom: of render; @scale and @spacing do so here"));
    if (!(factor > 0)) throw RequestError(message("@zoom: {} is not greater than 0", factor));
    // Beyond this rays of a picture are one ray, or all but one miss.
    constexpr double kMost = 1e6;
    if (!(factor >= 1 / kMost && factor <= kMost))
        throw RequestError(message("@zoom: {:g} given; expected from 1e-6 to 1e6", factor));
    grid.spacing.head<2>() /= factor;
}

namespace {

/// Half the height of a picture over its distance.
double slope_of(double angle) {
    if (!(angle > 0 && angle < 180))
        throw RequestError(message("@perspective: {} degrees; expected between 0 and 180", angle));
    return std::tan(angle * (3.14159265358979323846 / 360));
}

/// @param z     depth of the eye in centred screen space [file unit]
/// @param away  how far from it the plane is that pixels are counted in [file unit]
Eye eye_before(const ScreenGrid& grid, double z, double away) {
    const auto depth = [&](double at) {
        return (at - grid.centre.z()) / grid.spacing.z() + (grid.extent.z - 1) / 2.0;
    };
    Eye eye;
    eye.at = {(grid.extent.x - 1) / 2.0, (grid.extent.y - 1) / 2.0, depth(z)};
    eye.plane = depth(z + away);
    take_steps(eye, grid);
    return eye;
}

}  // namespace

Eye eye_of(double angle, const ScreenGrid& grid, const std::vector<Mat4>& maps,
           const std::vector<Vec3>& corners) {
    const double up = slope_of(angle);
    const double half_height = grid.extent.y * grid.spacing.y() / 2;
    const double half_width = grid.extent.x * grid.spacing.x() / 2;
    const double aside = up * half_width / half_height;
    double z = 1e300;
    for (const Mat4& map : maps)
        for (const Vec3& corner : corners) {
            const Vec3 p = sent(map, corner).value();
            z = std::min(z, p.z() - std::max(std::abs(p.y()) / up, std::abs(p.x()) / aside));
        }
    return eye_before(grid, z, half_height / up);
}

Eye eye_at_origin(double angle, ScreenGrid& grid, const std::vector<Mat4>& maps,
                  const std::vector<Vec3>& corners) {
    const double up = slope_of(angle);
    take_depth(grid, box_of(maps, corners));
    return eye_before(grid, 0, grid.extent.y * grid.spacing.y() / 2 / up);
}

void take_steps(Eye& eye, const ScreenGrid& grid) {
    eye.width = grid.spacing.x() / grid.spacing.z();
    eye.height = grid.spacing.y() / grid.spacing.z();
}

}  // namespace edgewise
