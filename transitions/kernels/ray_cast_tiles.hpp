#pragma once

#include "transitions/kernels/ray_cast.hpp"

namespace edgewise::kernels {

// ray_cast() by rule, each compiled in a unit of its own: together they take minutes.
void ray_cast_max(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                  std::int64_t height, float* out, std::ptrdiff_t row_floats);
void ray_cast_line(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                   std::int64_t height, float* out, std::ptrdiff_t row_floats);
void ray_cast_other(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                    std::int64_t height, float* out, std::ptrdiff_t row_floats);
void ray_cast_over_grey(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                        std::int64_t height, float* out, std::ptrdiff_t row_floats);
void ray_cast_over_color(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                         std::int64_t height, float* out, std::ptrdiff_t row_floats);
/// Over, of pieces between samples.
void ray_cast_integrated(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                         std::int64_t height, float* out, std::ptrdiff_t row_floats);
void ray_cast_hit(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                  std::int64_t height, float* out, std::ptrdiff_t row_floats);
/// Sums and means, where light falls on samples or falls off.
void ray_cast_lit_line(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                       std::int64_t height, float* out, std::ptrdiff_t row_floats);
/// Over, where light falls on samples or falls off.
void ray_cast_lit(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                  std::int64_t height, float* out, std::ptrdiff_t row_floats);

}  // namespace edgewise::kernels
