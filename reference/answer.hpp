#pragma once

#include <memory>
#include <span>
#include <vector>

#include "reference/arriving_light.hpp"
#include "reference/field.hpp"
#include "reference/job_reference.hpp"
#include "reference/view_geometry.hpp"

namespace edgewise {

/// The answer without shortcuts, in f64, one output sample at a time.
///
/// Warp: the field at the sample's place. Render: cells of RaySpan::step of each ray, cut at the
/// faces of the input, each sampled at the middle of its part inside and weighed by its
/// length; no early end; where the field is absent, nothing. Other jobs: their own (JobReference).
/// Result values are those that edges deliver: for composite premultiplied red, green, blue and
/// opacity, before the background.
/// Written without the kernels that it judges.
class Reference {
 public:
    /// All must stay alive.
    Reference(const Request& want, const ReferenceField& field, std::pmr::memory_resource* memory);

    /// Values of one output sample.
    int channels() const noexcept;
    /// Whether an output sample counts: a warp's comes from inside the input, a pixel's ray meets
    /// it.
    bool sees_input(const OutputSample& at) const;
    /// [samples][channels]; NaN where a sample does not see the input, or sees no finite value.
    /// Runs in threads; the bytes do not depend on their number.
    std::vector<double> values(std::span<const OutputSample> samples) const;
    /// Bytes that values() takes at most beside what it returns.
    double bytes(double samples, int threads) const noexcept;
    /// @throws RequestError where so many samples would take hours
    void expect_affordable(double samples) const;

    /// What counts as an error of 1, where the reference lies between two values.
    double range(double low, double high) const;
    /// Whether the field at an output sample's place, or along its ray, is a guess of its value.
    bool is_near_field() const noexcept { return !own_ || own_->is_near_field(); }

    const ReferenceField& field() const noexcept { return field_; }
    const ViewGeometry& geometry() const noexcept { return geometry_; }

 private:
    std::vector<double> warped(std::span<const OutputSample> samples) const;
    void render(std::span<const OutputSample> samples, double* values) const;
    std::int64_t tile_side() const noexcept { return field_.axes() == 2 ? 384 : 48; }
    std::int64_t tile_of(const Vec3& p) const;
    Region cells_of(std::int64_t tile) const;

    const Request& want_;
    const ReferenceField& field_;
    ViewGeometry geometry_;
    ArrivingLight arriving_;
    std::shared_ptr<const JobReference> own_;  // of jobs that have one, else null
    std::pmr::memory_resource* memory_;
};

}  // namespace edgewise
