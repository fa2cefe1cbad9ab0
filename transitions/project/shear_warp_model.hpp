#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "scene/model.hpp"

namespace edgewise {

/// The error of a picture by shear-warp, by filter.
inline constexpr FactFamily kShearWarpError{"picture/shear_warp"};

/// Slices sheared onto an intermediate image with a pixel a voxel, which is then read at the ray:
/// four neighbours by a bilinear picture, the nearest by one without interpolation; only those
/// count that meet the input. What the neighbours' rays have less or more of the input than this
/// one is made up for. A MIP of first-order hold is read by the spline through its pixels instead
/// (project.shear_warp), of which six along either axis are known here: those beyond weigh a
/// hundredth. The slices are those across the axis along which the ray advances fastest; pixels lie
/// at whole positions in the slice that is nearest to the eye. Parallel rays only.
///
/// Where rays run nearly along a face, a neighbouring pixel stays inside for many slices that the
/// ray itself does not meet: begin() and end() tell how far a block must reach.
class ShearedPicture {
 public:
    ShearedPicture(const RaySpan& ray, const Extent& input, Mode mode);
    /// Slices with t < end. The block must reach one sample farther than the ray across it.
    void trace(const PreviewBlock& block, double end, const Request& want);
    /// Of the slices that any of the pixels meets [t]; begin > end: none.
    double begin() const noexcept { return first_ + static_cast<double>(next_) * step_; }
    double end() const noexcept { return first_ + static_cast<double>(last_) * step_; }
    /// One value, or premultiplied red, green, blue and opacity.
    void result(PreviewHold hold, const Request& want, std::span<double, 4> values) const;
    /// What the nearest pixel of the intermediate image has.
    const Stretch& nearest() const noexcept { return nearest_.stretch; }

 private:
    /// A pixel of the intermediate image: where it crosses the first slice, its span in slices. A
    /// span between two slices is moved to end in the nearest one.
    struct Pixel {
        double low = 0, high = -1, weight = 0;
        std::array<double, 2> at{};
        Stretch stretch;
    };
    /// Largest samples of the pixels that a spline is read from; -inf: the pixel meets nothing.
    struct Smooth {
        static constexpr int kBefore = 2, kTaps = PreviewBlock::kSquare;
        std::array<double, 2> first{};  // pixel
        std::array<double, 2> place{};  // of the ray, beyond the pixel below it: in [0, 1)
        std::array<float, kTaps * kTaps> largest;
        std::array<std::int32_t, kTaps * kTaps> only;  // slice of pixels that see one alone; or -1

        double result(double miss) const;
        std::optional<float> continued(int i, int j) const;
    };
    /// Makes a picture's value that of a ray `share` times as long.
    static void give_length(double share, Mode mode, std::span<double, 4> values) noexcept;
    Pixel pixel_at(double u, double v, double weight, Mode mode) const;
    Vec3 place_of(const std::array<double, 2>& at, std::int64_t slice) const;
    std::optional<Smooth> smooth_at(const std::array<double, 2>& at, Mode mode) const;
    void add_smooth(std::int64_t slice, const PreviewBlock& block);
    /// Slices from `first` to before next_.
    void add(Pixel& pixel, PreviewHold hold, std::int64_t first, const PreviewBlock& block,
             const Request& want) const;

    RaySpan ray_;
    Extent input_;
    int axis_ = 2;
    std::array<int, 2> across_{};
    std::array<double, 2> shear_{};      // from slice to slice
    double step_ = 1;                    // from slice to slice [t]
    double first_ = 0;                   // t of the first slice
    std::int64_t next_ = 0, last_ = -1;  // slices, counted from the eye
    std::array<Pixel, 4> corners_;
    Pixel nearest_;                 // among pixels that meet the input
    bool farther_ = false;          // it is not the nearest of all
    std::optional<Smooth> smooth_;  // of a MIP, in place of the corners
};

/// Pictures by shear-warp: facts kShearWarpError(FILTER). Null where
/// rays are not parallel.
std::shared_ptr<const Model> shear_warp_model(const ModelSetting& setting);

}  // namespace edgewise
