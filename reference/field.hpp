#pragma once

#include <optional>
#include <span>
#include <variant>

#include "graph/request.hpp"
#include "reference/phantoms.hpp"
#include "reference/spline_block.hpp"

namespace edgewise {

/// The field that samples stand for, in f64: what every error is measured against.
///
/// Positions are input indices. A volume fills its voxels, to half a sample beyond the outermost
/// centres; there the nearest sample (of the spline: its value at the face) continues. Values are
/// mapped.
///
/// Where the nearest sample is not finite the field is absent, as it is outside. Elsewhere such
/// samples are passed over, the weights of the others adding up to 1: a constant stays constant.
/// Near them (where a filter of 4 samples along each axis would read one) the spline's field is the
/// linear one, whose weights are positive.
class ReferenceField {
 public:
    /// @param samples  in memory, linear layout; must stay alive
    /// @param formula  of Field::formula, else ignored; must stay alive
    ReferenceField(const Data& samples, Field kind, const Phantom* formula = nullptr);

    Field kind() const noexcept { return kind_; }
    int axes() const noexcept { return samples_.what.axes; }
    int channels() const noexcept { return kind_ == Field::formula ? 1 : samples_.what.channels; }
    const Extent& extent() const noexcept { return samples_.what.extent; }
    const Data& samples() const noexcept { return samples_; }
    const Phantom* formula() const noexcept { return formula_; }
    /// Whether its samples are of a type that holds numbers that are not finite.
    bool may_have_gaps() const noexcept { return floating_ && kind_ != Field::formula; }

    /// Whether a position lies in the box that the samples fill. For images z is ignored.
    bool inside(const Vec3& p) const noexcept;
    /// The nearest position at which samples lie on all sides.
    Vec3 clamped(const Vec3& p) const noexcept;
    /// Whether a sample that is not finite lies within the footprint of any filter here (4 samples
    /// along each axis), so that a result at p need not be finite either.
    bool near_non_finite(const Vec3& p) const noexcept;

    /// Whether no sample is the nearest one: p lies on a face between voxels of different values,
    /// but for rounding. Either value is right there.
    bool has_no_nearest(const Vec3& p) const noexcept;

    /// Channel 0 at p as the trilinear field has it, or a formula, or of labels the nearest; false
    /// where it is absent.
    bool simple_at(const Vec3& p, double& value) const;

    /// All channels at p; false where the field is absent. Of the spline by its cardinal function,
    /// 48 samples along each axis: exact to 2e-14 of the data's range, no memory, 0.1 ms in a
    /// volume.
    bool at(const Vec3& p, std::span<double> values) const;

 private:
    friend class FieldPiece;
    bool nearest_is_finite(const Vec3& p) const noexcept;
    void nearest(const Vec3& p, double* values) const noexcept;
    void linear(const Vec3& p, double* values) const noexcept;
    void spline(const Vec3& p, double* values) const;
    bool is_linear(const Vec3& p) const noexcept {
        return kind_ == Field::linear || (kind_ == Field::spline && near_non_finite(p));
    }

    const Data& samples_;
    Field kind_;
    const Phantom* formula_;
    bool floating_;  // samples may be not finite
};

/// The field within a box, prepared so that many positions are cheap. Of the spline it holds
/// prefiltered samples with a margin of 24 (2e-14 of the difference between neighbours).
class FieldPiece {
 public:
    static constexpr int kMargin = 24;

    /// @param cells  floor of the clamped positions that will be asked for
    FieldPiece(const ReferenceField& field, const Region& cells, std::pmr::memory_resource* memory);
    /// As ReferenceField::at.
    bool at(const Vec3& p, double* values) const;
    /// The gradient of channel 0 at p [value per sample], where the field is present. Of linear and
    /// nearest fields, which have none at their samples' faces, by central differences of one
    /// sample on either side (EQ 57); of splines and formulas by such close ones that they are
    /// exact to 1e-5. Beyond the outermost samples it is that of the outermost; where a neighbour
    /// is absent the field goes on as it is. By Sobel's operator: of all fields alike.
    Vec3 gradient(const Vec3& p, GradientScheme scheme = GradientScheme::central) const;

 private:
    const ReferenceField& field_;
    std::optional<SplineBlock<double>> spline_;
};

}  // namespace edgewise
