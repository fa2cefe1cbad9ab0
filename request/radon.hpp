#pragma once

#include "request/geometry.hpp"
#include "request/input.hpp"

namespace edgewise {

/// Lines of an image, or of each slice of a volume. Their spacing in the file is the offset's step
/// [file unit] and the angle's [degree]; the file's origin is the first line.
/// @throws RequestError several channels; angles or a threshold that make no sense
Geometry take_radon(Request& want, const RadonSetting& setting, const Input& input);
/// What a file does not say of angles: those of a list that is not even, and on the way back those
/// that nobody gave. "" where it says all.
Message remark_on_angles(const RadonSetting& given);

}  // namespace edgewise
