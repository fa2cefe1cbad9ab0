#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory_resource>
#include <vector>

#include "graph/mode.hpp"
#include "graph/small_objects.hpp"
#include "transitions/kernels/gradient.hpp"
#include "transitions/kernels/grid.hpp"
#include "transitions/kernels/optics.hpp"
#include "transitions/kernels/ray_light.hpp"
#include "transitions/kernels/tap_polynomials.hpp"

namespace edgewise::kernels {

using edgewise::Combine;

/// The stored number that is taken from every sample before it is summed: the one that adds
/// nothing, for else detail on a large offset is rounded away (2^20 + 1/8 in sums of f32). 0 of a
/// mean, whose result has the offset itself.
inline float origin_of_sums(Combine rule, const ValueMap& values, double zero) noexcept {
    if (rule != Combine::sum || values.slope == 0) return 0;
    return static_cast<float>((zero - values.offset) / values.slope);
}

/// Pixel (px, py) -> a ray of input indices: origin + t / length * direction, where every vector is
/// base + px * x + py * y. t is a length in units; `length` is the Euclidean norm of `measure`.
/// Parallel rays: direction and measure do not depend on the pixel. Perspective: origin is the eye
/// for every pixel, direction leads from it to the pixel, measure is the same vector in units.
struct Rays {
    struct Field {
        std::array<double, 3> base{0, 0, 0}, x{0, 0, 0}, y{0, 0, 0};

        std::array<double, 3> at(double px, double py) const noexcept {
            return {base[0] + px * x[0] + py * y[0], base[1] + px * x[1] + py * y[1],
                    base[2] + px * x[2] + py * y[2]};
        }
    };
    Field origin, direction, measure{.base = {0, 0, 1}, .x = {}, .y = {}};
    double start = -std::numeric_limits<double>::infinity();  // nothing before this t (0: the eye)
    double end = std::numeric_limits<double>::infinity();     // nothing from this t on
};

/// The largest sample (of max) or the largest opacity (of over) around each brick of 4^3 samples,
/// so that stretches of rays that cannot matter are left out. The bytes of a picture do not change.
struct Bricks {
    static constexpr int kShift = 2;
    Extent extent;                  // bricks along each axis
    std::pmr::vector<float> level;  // of a brick and its 26 neighbours; stored numbers, negated
                                    // where the slope is negative: the largest always matters

    /// Room for the bricks of a volume; scratch while they are made comes from there as well.
    Bricks(const Extent& volume, std::pmr::memory_resource* memory);

    /// While they are made, where a level is that of a range: the smallest sample, negated; its
    /// largest is in `level`.
    std::pmr::vector<float> least;
};

/// The part of a volume that rays see: what a box, half spaces and balls have in common [input
/// index].
struct Kept {
    struct Plane {
        std::array<double, 3> normal;
        double offset;  // normal . p + offset >= 0 is inside
    };
    struct Ball {
        std::array<double, 3> centre;
        std::array<double, 9> to_unit;  // row by row: makes a ball of radius 1 of it

        std::array<double, 3> turned(const std::array<double, 3>& d) const noexcept {
            const auto& m = to_unit;
            return {m[0] * d[0] + m[1] * d[1] + m[2] * d[2],
                    m[3] * d[0] + m[4] * d[1] + m[5] * d[2],
                    m[6] * d[0] + m[7] * d[1] + m[8] * d[2]};
        }
        std::array<double, 3> from_centre(const std::array<double, 3>& p) const noexcept {
            return turned({p[0] - centre[0], p[1] - centre[1], p[2] - centre[2]});
        }
    };
    std::array<double, 3> low, high;  // faces of the box, within those of the volume
    SmallVector<Plane> planes;
    SmallVector<Ball> balls = {};
};

struct RayTable;

/// What levels of bricks are of.
struct LevelsOf {
    const Optics* optics = nullptr;   // of over, else null
    Overshoot overshoot = {};         // of the filter that reads
    const RayTable* table = nullptr;  // of over, in place of optics

    /// Opacities between two samples may be larger than at both, and how far values lie beyond
    /// samples hangs on their range: then it takes both ends.
    bool ranges() const noexcept { return optics || table || overshoot.range > 0; }
};

/// What rays take, counted while they are cast. Rays of a packet go together: what one of them
/// needs takes as long as if all did.
struct Taken {
    std::int64_t samples = 0;  // whole cells, of each ray that has them
    /// Of over, in cells times the rays of a packet: those at the ends, where weights are less than
    /// a step; of these and of whole cells, those whose opacity was corrected for their length.
    std::int64_t ends = 0, corrected_ends = 0, corrected = 0;
};

constexpr int kPacketSide = 4;  // pixels; rays of so many columns and rows go together, at most

struct TransferIntegrals;
struct LightGrid;
struct AmbientGrid;
/// What is left of light where it arrives, see arriving.hpp.
struct RayArriving {
    SmallVector<const LightGrid*> lights;  // one a source; none: all of their light
    const AmbientGrid* ambient = nullptr;  // null: all of it
};

/// One picture by casting rays through a volume.
///
/// Sample cells lie at k step <= t < (k + 1) step for all integers k, the same for every brick,
/// tile and rank. The volume is a box that reaches half a spacing beyond the outermost centres;
/// there the nearest sample continues. Each cell is sampled at the middle of what of it lies inside
/// the box and weighs that length: whole cells at (k + 1/2) step (the midpoint rule), the two end
/// cells less. Constants and linear functions of t are thus integrated exactly, and every ray that
/// meets the box has a sample, however thin the box is. Where only a part of the volume is kept,
/// its faces cut cells as those of the box do; values beside them are those of the whole volume.
/// Samples that are not finite count as outside.
struct RayCast {
    Grid volume;  // one channel; with Hold::bspline3 f32 coefficients, mirrored at the ends
    Hold hold = Hold::foh;
    const TapPolynomials* weights = nullptr;  // of Hold::weighted
    Combine rule = Combine::max;
    const RayRule* other = nullptr;  // of Combine::other
    Rays rays = {};
    const Kept* kept = nullptr;                    // null: all of the volume
    double step = 1;                               // [t]
    double unit = 1;                               // one t, in the file's unit; of sum
    double zero = 0;                               // of sum: the value that adds nothing
    double miss = 0;                               // a ray that meets no sample
    double level = 0;                              // of hit and other: Request::level
    const Optics* optics = nullptr;                // of over
    const TransferIntegrals* integrals = nullptr;  // of over without light: pieces between samples
    const RayLight* light = nullptr;        // of over, hit, sum and mean; null: all of the light
    const RayEdges* edges = nullptr;        // of over; null: opacities are by value alone
    const RayTable* table = nullptr;        // of over, in place of optics but for their unit
    const RayArriving* arriving = nullptr;  // null: all of the light
    const RayCue* cue = nullptr;  // of all but max and other; null: light does not fall off
    const Gradients* gradients = nullptr;  // of all samples; null: light takes the filter's own
    bool sobel = false;                    // or that of Sobel's operator, of what the filter reads
    double bound = 0;  // of over: a ray ends where less than this transparency is left; the result
                       // differs by at most bound x the largest emission or background
    const Bricks* bricks = nullptr;
    Taken* taken = nullptr;  // counts; of one thread
};

/// How far below a place its first tap lies, in whole samples from the one before it: all taps of
/// a place are inside where it is this far from the outermost centres.
inline double taps_below(const RayCast& cast) noexcept {
    switch (cast.hold) {
        case Hold::zoh:
            return -0.5;
        case Hold::foh:
            return 0;
        case Hold::bspline3:
            return 1;
        case Hold::weighted:
            break;
    }
    return static_cast<double>(cast.weights->taps() / 2 - 1);
}

/// Fills width x height pixels, from pixel (x, y) on. Single-threaded; no allocation; each pixel
/// depends on nothing but its ray.
/// @param out         first pixel: 1 float a pixel; of over 4: premultiplied r, g, b, opacity
/// @param row_floats  floats from one row of out to the next
void ray_cast(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
              std::int64_t height, float* out, std::ptrdiff_t row_floats);

/// Brick levels of z-layers [begin, end) of bricks, with their neighbours in the layer. Layers may
/// be made in parallel. Coefficients will do for samples: B-spline weights are positive and sum
/// to 1. Of ranges, bricks.least has to be as large as bricks.level.
void brick_layers(const Grid& volume, const LevelsOf& of, std::int64_t begin, std::int64_t end,
                  Bricks& bricks);
/// Joins all layers with their neighbours in z, lines [begin, end) of each: these may be joined in
/// parallel, once, when all layers are made.
void join_layers(const Grid& volume, const LevelsOf& of, std::int64_t begin, std::int64_t end,
                 Bricks& bricks);

}  // namespace edgewise::kernels
