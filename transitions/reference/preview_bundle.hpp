#pragma once

#include <array>
#include <optional>
#include <vector>

#include "transitions/reference/preview_paths.hpp"
#include "transitions/reference/preview_short.hpp"
#include "transitions/reference/preview_spectrum.hpp"
#include "transitions/reference/ray_look.hpp"

namespace edgewise {

/// Steps that a preview casts rays with.
inline constexpr std::array<double, 4> kPreviewSteps = {1, 0.5, 0.25, 2};

/// One ray with all pictures that it is part of.
struct Traced {
    RaySpan ray;
    OutputSample at;
    RayLook look;
    Stretch reference;
    std::array<Stretch, 2> noisy;  // zoh, foh with noise in the samples, step 1
    std::array<std::array<Stretch, kPreviewSteps.size()>, 3> cast;  // by hold and step
    std::optional<ScreenPicture> screen;
    std::optional<ShearedPicture> sheared;         // of parallel rays
    std::vector<SpectrumPicture::Named> spectrum;  // squared errors; none: another ray's stand
    double stands_for = 1;                         // rays of the bundle, as far as spectra go
    std::array<std::int64_t, 1 + kPreviewSteps.size()>
        next{};                // cell, of the fine step and the others
    double low = 0, high = 0;  // part of the ray that any of the pictures needs [t]
};

/// Neighbouring pixels, so that their rays share blocks of the input.
struct Bundle {
    std::vector<Traced> rays;
    std::array<double, 4> field{};    // squared errors of zoh, foh, bspline3, me
    std::array<double, 2> sheared{};  // of a pass of shears: foh, bspline3
    double points = 0, sheared_points = 0;
};

/// What a stretch of a bundle is measured with.
struct Setting {
    const Request& want;
    const ReferenceField& field;
    double noise;             // RMS [value]
    std::vector<Vec3> lines;  // of a warp by shears; may be none
};

/// Whether a ray is of one of the classes of ShortRays.
bool is_short(const RaySpan& ray, const Request& want);

/// @param side   pixels along x and y
/// @param whole  with the short rays too, where they are drawn by themselves
Bundle bundle_at(const Request& want, const ViewGeometry& geometry, const OutputSample& corner,
                 int side, bool whole);

/// @param whole  of all the input, or null: one is prepared for each stretch
void measure(Bundle& bundle, const Setting& setting, const PreviewBlock* whole,
             std::pmr::memory_resource* memory);

}  // namespace edgewise
