#include "request/radon.hpp"

#include <cmath>
#include <fmt/format.h>

#include "graph/errors.hpp"

namespace edgewise {

namespace {

/// The distance of angles that are even, else 1 [degree].
double apart(const std::vector<double>& degrees) {
    if (degrees.size() < 2) return 1;
    const double step = degrees[1] - degrees[0];
    for (std::size_t k = 1; k < degrees.size(); ++k)
        if (std::abs(degrees[k] - degrees[k - 1] - step) > 1e-6) return 1;
    return step > 0 ? step : 1;
}

/// The way back: rows are angles, and the image has the distance of offsets.
Geometry take_image(Request& want, const RadonSetting& setting, const InputGrid& grid) {
    const RadonBack back(grid.extent, grid.spacing[0], setting);
    constexpr double kMost = 1 << 30;
    if (static_cast<double>(back.image.samples()) > kMost)
        throw RequestError(
            message("@size: {} samples; expected at most 2^30", text_of(back.image, 3)));
    Geometry geometry;
    geometry.views = {Mat4::Identity()};
    geometry.grid.extent = back.image;
    geometry.grid.spacing = {back.step, back.step, grid.spacing[2]};
    want.screen = back.image;
    want.setting = JobSetting::of(setting);
    return geometry;
}

/// Even over half a turn from 0 on, as rows without a list of angles are read again.
bool is_even(const std::vector<double>& degrees) {
    for (std::size_t k = 0; k < degrees.size(); ++k)
        if (std::abs(degrees[k] - 180.0 * double(k) / double(degrees.size())) > 1e-6) return false;
    return true;
}

}  // namespace

Message remark_on_angles(const RadonSetting& given) {
    const bool back = given.to == RadonSetting::To::image;
    if (back && given.angles == 0 && given.degrees.empty())
        return message("rows are taken as even angles over 180 degrees; @angles says others");
    if (!back && !is_even(given.degrees))
        return message(
            "the file does not hold these angles: `@command(radon) @inverse` needs @angles again");
    return {};
}

Geometry take_radon(Request& want, const RadonSetting& given, const Input& input) {
    RadonSetting setting = given;
    const bool back = setting.to == RadonSetting::To::image;
    const auto rows = grid_of(input).extent.y;
    if (back && setting.angles == 0 && rows <= RadonSetting::kMostAngles)
        setting.angles = static_cast<int>(rows);
    if (setting.angles < 1 || setting.angles > RadonSetting::kMostAngles)
        throw RequestError(
            message("@angles: {}; expected 1 to {}", setting.angles, RadonSetting::kMostAngles));
    if (back && setting.angles != rows)
        throw RequestError(message(
            "@angles: {} angles, but {} has {} rows, one for each; say as many as it has rows",
            setting.angles, input.name, rows));
    for (const double degrees : setting.degrees)
        if (!std::isfinite(degrees))
            throw RequestError(message("@angles: expected finite degrees"));
    if (!std::isfinite(setting.threshold))
        throw RequestError(message("@threshold: expected a finite number"));
    if (input.channels() > 1)
        throw RequestError(message("{}: {} has {} channels, from 0; say which by @channel",
                                   name_of(want.job), input.name, input.channels()));
    const InputGrid grid = grid_of(input);
    want.axes = grid.axes;
    want.input = grid.extent;
    want.spacing = grid.spacing;
    want.frames = 1;
    want.views = Placement(Mat4::Identity());
    want.field = Field::linear;
    if (back) return take_image(want, setting, grid);
    const RadonLines lines(grid.extent, {grid.spacing[0], grid.spacing[1]}, setting);
    constexpr double kHalfTurn = 180;  // degrees
    Geometry geometry;
    geometry.views = {Mat4::Identity()};
    geometry.grid.extent = lines.extent();
    geometry.grid.spacing = {
        lines.step, setting.degrees.empty() ? kHalfTurn / setting.angles : apart(setting.degrees),
        grid.spacing[2]};
    want.screen = lines.extent();
    want.setting = JobSetting::of(setting);
    return geometry;
}

}  // namespace edgewise
