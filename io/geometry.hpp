#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "io/store.hpp"

namespace edgewise::store {

double determinant(const std::array<Vector, 3>& columns) noexcept;
double length(const Vector& v) noexcept;
Vector cross(const Vector& a, const Vector& b) noexcept;
double dot(const Vector& a, const Vector& b) noexcept;

/// Takes steps between samples (columns: spacing times direction) apart into both. Spacings lose
/// what f32 cannot tell apart.
/// @throws InputError not finite, zero, or without a volume (determinant 0), naming the field
void take_steps(Header&, const std::array<Vector, 3>& steps, const std::string& field);
/// The decimal number of at most six digits that a length stands for which has been through f32, or
/// the length itself where none is as near as that rounding.
double without_noise(double length) noexcept;
/// @throws InputError not finite or not positive, naming the field
void check_spacing(const Header&, const std::string& field);
/// Flips the first two coordinates of directions and origin: RAS to LPS and back.
void flip_xy(Header&) noexcept;
bool is_identity(const std::array<Vector, 3>& direction) noexcept;

/// Letters of where x, y, z point to the nearest axis ("LPS" for the identity).
std::string letters_of(const std::array<Vector, 3>& direction);
/// The inverse: unit columns. Nothing for text that is not three letters of three axes.
std::optional<std::array<Vector, 3>> direction_of(const std::string& letters);

/// Where a file has one plane (row, column) along an axis, it may say nothing of the step to the
/// next: that becomes perpendicular to the others, 1 long.
/// @return whether something was missing
bool complete_steps(std::array<Vector, 3>& steps, const Extent& extent) noexcept;

/// Millimetres in a unit's name ("mm", "micron", "nm" ...), 0 for one that is not known.
double millimetres(std::string_view unit);
/// Spacing and origin from that many millimetres a unit to millimetres, which is the one unit of
/// length in the program: files in micrometres and in metres mix without a thought.
void to_millimetres(Header&, double factor) noexcept;
/// What a user says of spacing and unit where the file is silent or wrong. The origin follows the
/// unit, not the spacing.
/// @throws RequestError a number of entries that is neither 1 nor that of the axes, an entry that
/// is not positive, an unknown unit
void override_spacing(Header&, const Selection&);

}  // namespace edgewise::store
