#include "engine/request/radon.hpp"

#include <cmath>
#include <fmt/format.h>

#include "graph/errors.hpp"

namespace edgewise {

Geometry take_radon(Request& want, const RadonSetting& setting, const Input& input) {
    if (setting.angles < 1 || setting.angles > RadonSetting::kMostAngles)
        throw RequestError(fmt::format("--angles: {}; expected 1 to {}", setting.angles,
                                       RadonSetting::kMostAngles));
    if (!std::isfinite(setting.threshold))
        throw RequestError("--threshold: expected a finite number");
    if (input.channels() > 1)
        throw RequestError(fmt::format("{}: {} has {} channels, from 0; say which by --channel",
                                       name_of(want.job), input.name, input.channels()));
    const InputGrid grid = grid_of(input);
    const RadonLines lines(grid.extent, {grid.spacing[0], grid.spacing[1]}, setting.angles);
    constexpr double kHalfTurn = 180;  // degrees
    Geometry geometry;
    geometry.views = {Mat4::Identity()};
    geometry.grid.extent = lines.extent();
    geometry.grid.spacing = {lines.step, kHalfTurn / setting.angles, grid.spacing[2]};
    want.axes = grid.axes;
    want.input = grid.extent;
    want.spacing = grid.spacing;
    want.frames = 1;
    want.views = Placement(Mat4::Identity());
    want.screen = lines.extent();
    want.field = Field::linear;
    want.setting = JobSetting::of(setting);
    return geometry;
}

}  // namespace edgewise
