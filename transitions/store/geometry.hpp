#pragma once

#include <string>

#include "transitions/store/store.hpp"

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

/// Millimetres in a unit's name ("mm", "um", "m" ...), 0 for one that is not known.
double millimetres(std::string_view unit) noexcept;
/// Spacing and origin from that many millimetres a unit to millimetres.
void to_millimetres(Header&, double factor) noexcept;

}  // namespace edgewise::store
