// Elliptical Gaussian footprints of classified voxels added to sheets.
#include "transitions/kernels/splat_ewa_sheets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/splat_ewa_sheets_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/classified_rows-inl.hpp"
#include "transitions/kernels/splat_ewa-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

void add_to_ewa_sheet_on(const EwaSheets& of, std::int64_t slice, const SplatSums& sheet,
                         std::ptrdiff_t plane) {
    const Floats d;
    const OnScreen on_screen(of.splat);
    const SplatSpan row{0, static_cast<std::int32_t>(of.rows.count(0))};
    each_classified(
        of.rows, slice,
        [&](const VoxelPlace& at, std::size_t axis) {
            return on_screen.meeting(row, sheet, at, axis);
        },
        [&](const ClassifiedVoxel& voxel, const VoxelPlace& at) {
            const auto x = double(at[0]), y = double(at[1]), z = double(at[2]);
            if (!(of.splat.depth.of(x, y, z) > 0)) return;
            const Footprint seen = on_screen.of(x, y, z, voxel.depth);
            each_height(seen, sheet, [&](VF depths, float* to) {
                hn::StoreU(hn::Add(hn::LoadU(d, to), depths), d, to);
                for (std::size_t c = 0; c < 3; ++c) {
                    float* color = to + static_cast<std::ptrdiff_t>(c + 1) * plane;
                    const VF light = hn::Mul(depths, hn::Set(d, voxel.color[c]));
                    hn::StoreU(hn::Add(hn::LoadU(d, color), light), d, color);
                }
            });
        });
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(add_to_ewa_sheet_on);

void add_to_ewa_sheet(const EwaSheets& of, std::int64_t slice, const SplatSums& sheet,
                      std::ptrdiff_t plane) {
    HWY_DYNAMIC_DISPATCH(add_to_ewa_sheet_on)(of, slice, sheet, plane);
}

}  // namespace edgewise::kernels
#endif
