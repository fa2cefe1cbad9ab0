#pragma once

#include <array>
#include <optional>

#include "reference/field.hpp"
#include "reference/preview_holds.hpp"
#include "transitions/filters/filter.hpp"

namespace edgewise {

/// The holds that a preview compares.
enum PreviewHold { kZoh, kFoh, kSpline };
/// The filter that a hold is, whose name it has in Scene::facts.
const Filter& filter_of(PreviewHold hold);

/// A repeatable number in [0, 1) for each n.
double hashed(std::uint64_t n) noexcept;

/// A small part of the input in f32, where all reconstructions are cheap: enough precision to
/// measure errors of 1e-4 of the range and more. Values are mapped.
class PreviewBlock {
 public:
    static constexpr int kSquare = 6;  // places along an axis of linear_square

    /// @param cells  floor of the clamped positions that will be asked for
    PreviewBlock(const ReferenceField& field, const Region& cells,
                 std::pmr::memory_resource* memory);
    /// Makes reference() read the spline in f64, as --verify does: where samples ring about a
    /// plateau at the level of a threshold, f32 decides otherwise. For blocks of all samples,
    /// whose spline has no margin that is cut.
    void read_exactly(std::pmr::memory_resource* memory);

    const ReferenceField& field() const noexcept { return field_; }
    /// Channel values at p; p is clamped here. Not finite where the nearest sample is not.
    void hold(PreviewHold hold, const Vec3& p, double* values) const;
    /// Of one channel, at many places at once.
    void hold(PreviewHold hold, const Places& places, double* values, int channel = 0) const;
    /// By any filter, of one channel.
    void read(const Filter& filter, const Places& places, double* values, int channel = 0) const;
    /// First-order hold at p + (i, j), i fastest, in the plane of two axes; p is a whole number
    /// along the third. One channel. Calls each(i, j, value) where both coordinates are inside the
    /// input.
    template <class Each>
    void linear_square(const Vec3& p, const std::array<int, 2>& plane, Each&& each) const {
        std::array<Line, 2> lines;
        for (std::size_t axis = 0; axis < 2; ++axis) lines[axis] = line(p, plane[axis]);
        const auto& [across, down] = lines;
        const int along = 3 - plane[0] - plane[1];
        const float* first =
            samples_ + (static_cast<std::int64_t>(p[along]) - held_.begin[along]) * stride(along);
        for (int j = down.begin; j < down.end; ++j)
            for (int i = across.begin; i < across.end; ++i) {
                const float* at = first + across.offset[i] + down.offset[j];
                const float* below = at + down.step[j];
                const float a = at[0] + across.f[i] * (at[across.step[i]] - at[0]);
                const float b = below[0] + across.f[i] * (below[across.step[i]] - below[0]);
                each(i, j, a + down.f[j] * (b - a));
            }
    }
    /// What the samples stand for; false where that is absent.
    bool reference(const Vec3& p, double* values) const;
    /// Of channel 0, at many places at once: NaN where the field is absent.
    void reference(const Places& places, double* values) const;
    /// Whether any filter, and the differences of its neighbours, have all samples at p.
    bool reaches(const Vec3& p) const noexcept;
    /// What zoh or foh makes of independent noise of RMS 1 in the samples.
    double noise(PreviewHold hold, const Vec3& p) const;

 private:
    void load();
    void weighted_at(const Filter& filter, const Places& places, double* values, int channel) const;
    void spline_at(const Places& places, double* values, int channel) const;
    HeldBox<float> box(int channel) const;
    /// That of the field, which is no formula.
    PreviewHold own_hold() const;
    /// Places along one axis of a square, of which begin to end are inside.
    struct Line {
        int begin = 0, end = 0;
        std::array<std::int64_t, kSquare> offset, step;  // of the lower sample; to the upper one
        std::array<float, kSquare> f;
    };
    Line line(const Vec3& p, int axis) const;
    std::int64_t stride(int axis) const;

    const ReferenceField& field_;
    int channels_;
    Region held_;
    Array copy_;  // [z][y][x][channel]
    const float* samples_ = nullptr;
    std::optional<SplineBlock<float>> spline_;
    std::optional<SplineBlock<double>> exact_;  // what the reference reads instead
    bool constant_ = false, all_finite_ = true;
};

}  // namespace edgewise
