#pragma once

#include <array>
#include <optional>

#include "transitions/reference/field.hpp"

namespace edgewise {

/// The holds that a preview compares, and their names in Scene::facts.
inline constexpr std::array<const char*, 3> kPreviewHolds = {"zoh", "foh", "bspline3"};
enum PreviewHold { kZoh, kFoh, kSpline };

/// A repeatable number in [0, 1) for each n.
double hashed(std::uint64_t n) noexcept;

/// A small part of the input in f32, where all reconstructions are cheap: enough precision to
/// measure errors of 1e-4 of the range and more. Values are mapped.
class PreviewBlock {
 public:
    /// @param cells  floor of the clamped positions that will be asked for
    PreviewBlock(const ReferenceField& field, const Region& cells,
                 std::pmr::memory_resource* memory);

    /// Channel values at p; p is clamped here. Not finite where a sample is not that counts.
    void hold(PreviewHold hold, const Vec3& p, double* values) const;
    /// By the rule of an assignment of samples to places: the nearest sample of a place that
    /// `seed` moves by one rounding more, so that two have an effect on each axis.
    void assigned(const Vec3& p, std::uint64_t seed, double* values) const;
    /// What the samples stand for; false where that is absent.
    bool reference(const Vec3& p, double* values) const;
    /// What one pass of shears gets wrong at p: the field along a slanted line, at whole places of
    /// one axis, interpolated linearly and by a spline (`seed` picks axis and slant). Channel 0.
    std::array<double, 2> sheared(const Vec3& p, std::uint64_t seed) const;
    /// What zoh or foh makes of independent noise of RMS 1 in the samples.
    double noise(PreviewHold hold, const Vec3& p) const;

 private:
    void load();
    void zoh(const Vec3& p, double* values) const;
    void foh(const Vec3& p, double* values) const;

    const ReferenceField& field_;
    int channels_;
    Region held_;
    Array copy_;  // [z][y][x][channel]
    const float* samples_ = nullptr;
    std::optional<SplineBlock<float>> spline_;
    bool constant_ = false, all_finite_ = true;
};

}  // namespace edgewise
