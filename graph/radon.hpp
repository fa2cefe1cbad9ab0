#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "graph/fingerprint.hpp"
#include "graph/job.hpp"
#include "graph/representation.hpp"

namespace edgewise {

/// What a radon job makes of an image, or of each slice of a volume: numbers for lines, one row an
/// angle, one column an offset.
struct RadonSetting {
    enum class To {
        sinogram,  // integrals of the field along lines [value x file unit]
        hough,     // how many samples that are at least `threshold` lie nearest to each line
        image      // the way back: the input is a sinogram, the result the image of it
    };
    static constexpr int kMostAngles = 65536;

    int angles = 180;
    To to = To::sinogram;
    double threshold = 0;  // of hough
    /// Of each row [degree], in place of even ones; as many as `angles`.
    std::vector<double> degrees = {};
    /// Of an image: columns and rows; 0: the square that has so many offsets, of two the even one.
    std::array<std::int64_t, 2> size{0, 0};

    /// Cosine and sine of row k.
    std::array<double, 2> direction(int k) const noexcept;

    friend bool operator==(const RadonSetting&, const RadonSetting&) = default;
};

template <Either<RadonSetting> T, class F>
void visit_fields(T& setting, F&& f) {
    auto& [angles, to, threshold, degrees, size] = setting;
    f("angles", angles), f("to", to), f("threshold", threshold), f("degrees", degrees);
    f("size", size);
}

/// Integrals along lines, or votes for them. Its target is Hough space: lines by angle and offset.
const Job& radon_job() noexcept;

/// Cosine and sine of pi k / angles. Exact along the axes, and equal at 45 degrees.
std::array<double, 2> radon_direction(int k, int angles) noexcept;
/// The same of an angle [degree].
std::array<double, 2> radon_direction_at(double degrees) noexcept;

/// The lines of a radon job, counted in steps of the offset.
///
/// Frames: x right, y down, origin at the centre of the image (n - 1) / 2 [file unit]. Line m of
/// angle k holds the points with x cos - y sin = (m - middle) step, angle pi k / angles. So
/// angles turn counter-clockwise, as one sees the image.
struct RadonLines {
    Extent input;  // one slice counts
    std::array<double, 2> spacing{1, 1};
    int angles = 180;
    std::vector<double> degrees = {};  // see RadonSetting
    double step = 1;           // from one offset to the next: the smaller spacing [file unit]
    std::int64_t offsets = 1;  // odd, so many that no line beyond them meets the field
    double diagonal = 1;       // of the field, which ends one sample beyond the outermost centres

    RadonLines(const Extent& input, const std::array<double, 2>& spacing, int angles);
    RadonLines(const Extent& input, const std::array<double, 2>& spacing,
               const RadonSetting& setting);

    std::int64_t middle() const noexcept { return (offsets - 1) / 2; }
    /// What one sample to the right, and one row down, add to an offset [step].
    std::array<double, 2> slopes(int k) const noexcept;
    /// One row an angle; volumes have one such image a slice.
    Extent extent() const noexcept { return {offsets, angles, input.z}; }
};

/// The way back from a sinogram: frames as above.
struct RadonBack {
    Extent sinogram;  // offsets, angles, slices
    double step = 1;  // from one offset to the next, and of the image [file unit]
    Extent image;
    std::vector<std::array<double, 2>> directions;
    /// Of each row, half of the gap to the angles on both sides of it, round a half turn [radian].
    std::vector<double> weights;

    RadonBack(const Extent& sinogram, double step, const RadonSetting& setting);
};

}  // namespace edgewise
