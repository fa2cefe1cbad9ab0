#pragma once

#include <array>
#include <memory>
#include <memory_resource>

#include "graph/data.hpp"
#include "reference/preview_holds.hpp"
#include "reference/spline_lines.hpp"

namespace edgewise {

/// Whole-sample mirror, as often as needed: ... 2 1 | 0 1 ... n-1 | n-2 ...
std::int64_t mirrored_index(std::int64_t index, std::int64_t n) noexcept;

/// The cubic B-spline through the samples of a box, ready to be sampled anywhere in that box.
///
/// The samples in the box and a margin around it are prefiltered (Unser 1999; mirror at the ends).
/// Where the margin ends at a face of the data the coefficients are those of the whole data; where
/// it is cut they are off by |pole|^margin of the difference between neighbours: 2e-14 for 24
/// samples, 4e-4 for 6. Values that are not finite are passed over: the spline through the others
/// and zeros is divided by that through ones and zeros, so that a constant stays constant. (Near
/// such values that may come close to 0 / 0; ReferenceField says what holds there.)
template <class Real>
class SplineBlock {
 public:
    /// @param cells   the positions that will be asked for, floor(p) within it on every axis
    /// @param finite  it is known that all samples there, and in the margin, are finite
    SplineBlock(const Data& data, const Region& cells, int margin,
                std::pmr::memory_resource* memory, bool finite = false);

    /// All channels at p [input index], which is within [0, n-1] and `cells`.
    void at(const Vec3& p, double* values) const noexcept;

    /// The gradient of the first channel at p, by the derivatives of the weights. Not divided.
    Vec3 gradient(const Vec3& p) const noexcept;

    bool has_gaps() const noexcept { return shares_ != nullptr; }
    /// What the values are to be divided by, where there are gaps.
    const SplineBlock& shares() const noexcept { return *shares_; }

    /// Of one channel, as for cubic_at; n: of the data. Not divided.
    HeldBox<Real> box(const Extent& n, int channel) const noexcept;

    /// Bytes of a block at most, wherever it lies in data of extent n.
    static double bytes(const Extent& cells, const Extent& n, int margin, int channels) noexcept;

 private:
    struct Shape {};
    SplineBlock(const SplineBlock& like, Shape, std::pmr::memory_resource* memory);

    void allocate(std::pmr::memory_resource* memory);
    void load(const Data& data, bool finite, std::pmr::memory_resource* memory);
    void pass_over(const Box<Real>& to, const Box<Real>& shares, Real whole);
    void finish(const Extent& n);
    Box<Real> box_of(int channel) const;
    void mirror_pads(const Extent& n);

    Region held_;             // samples with coefficients, pads not counted
    Extent padded_;           // one sample before, two behind; not along axes of one plane or row
    std::array<int, 3> pad_;  // before
    int channels_;
    Array coefficients_;  // [channel][z][y][x], padded
    Real* first_;         // coefficients_
    std::unique_ptr<SplineBlock> shares_;
};

extern template class SplineBlock<float>;
extern template class SplineBlock<double>;

}  // namespace edgewise
