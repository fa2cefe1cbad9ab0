// Sections of footprints added to sheets.
#include "transitions/kernels/splat_sheets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/splat_sheets_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/splat-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

constexpr int kSheetCellBits = 4, kSectionBits = 4;
static_assert(kSheetCells == 1 << kSheetCellBits && kSections == 1 << kSectionBits);

std::int64_t voxels_on(const SheetSplat& splat, const SplatSums& sums, Splatted* row,
                       SheetVoxel* list) {
    std::int64_t all = 0;
    each_row(splat.splat, 0, splat.splat.volume.extent.z, sums, row,
             [&](const Splatted* of, std::int64_t count, std::int64_t y, std::int64_t z) {
                 for (std::int64_t k = 0; k < count; ++k) {
                     const auto [x, value] = of[k];
                     const Patch patch(splat.splat, double(x), double(y), double(z));
                     if (!patch.meets(splat.splat, sums)) continue;
                     if (list) {
                         const double front =
                             splat.depth.of(double(x), double(y), double(z)) - splat.reach;
                         list[all] = {x, static_cast<std::int32_t>(y), static_cast<std::int32_t>(z),
                                      value, static_cast<std::int32_t>(std::floor(front))};
                     }
                     ++all;
                 }
             });
    return all;
}

template <class Read, bool kShort>
class Sheets {
    using To = Vectors<kShort>;

 public:
    Sheets(const SheetSplat& sheets, const SplatSums& sums, int planes, std::ptrdiff_t plane)
        : of_(sheets),
          sums_(sums),
          planes_(planes),
          plane_(plane),
          lookup_(sheets.splat),
          along_(To::lanes_of(sheets.along)) {}

    void add(const SheetVoxel& voxel) const {
        const Splat& splat = of_.splat;
        const auto& [x, y, z, value, first] = voxel;
        const Patch patch(splat, double(x), double(y), double(z));
        const auto left = static_cast<std::int32_t>(patch.left);
        const auto top = static_cast<std::int32_t>(patch.top);
        std::array<std::uint32_t, 3> at;
        for (std::size_t i = 0; i < 3; ++i) {
            const FixedPlace& place = i < 2 ? splat.across[i] : of_.along;
            at[i] = place.of(x, y, z) + place.right(left) + place.down(top);
        }
        at[2] += static_cast<std::uint32_t>(first) * of_.sheet;
        float* pixels = sums_.first + (top - sums_.begin[1]) * sums_.pitch + left - sums_.begin[0];
        const float* table = table_of(splat, x, y, z);
        for (int j = 0; j < splat.patch[1]; j += To::kRows)
            for (int i = 0; i < splat.patch[0]; i += To::kColumns)
                add_vector(table, value, at, first, i, j, pixels + j * sums_.pitch + i);
    }

 private:
    /// What of footprints lies before sections that begin at a place along a ray.
    HWY_INLINE VF before(const float* table, VW footprint, std::uint32_t place) const {
        const Ints d;
        constexpr int kShift = kPlaceBits - kSectionBits;
        const VI section =
            hn::ShiftRight<kShift>(hn::BitCast(d, hn::Add(along_, hn::Set(Words(), place))));
        const VI begin = hn::Min(hn::Max(hn::Add(section, hn::Set(d, kSections)), hn::Zero(d)),
                                 hn::Set(d, 2 * kSections));
        const VI entry = hn::Add(hn::BitCast(d, footprint), begin);
        return gather_one<Read>(reinterpret_cast<const std::uint8_t*>(table),
                                hn::ShiftLeft<2>(entry));
    }
    HWY_INLINE void add_vector(const float* table, float value,
                               const std::array<std::uint32_t, 3>& at, std::int32_t first, int i,
                               int j, float* pixels) const {
        const Splat& splat = of_.splat;
        const auto& [a, b] = splat.across;
        const VW footprint =
            hn::Mul(lookup_.places(at[0] + a.right(i) + a.down(j), at[1] + b.right(i) + b.down(j)),
                    hn::Set(Words(), 2 * kSections + 1));
        std::uint32_t place = at[2] + of_.along.right(i) + of_.along.down(j);
        const VF scale = hn::Set(Floats(), value);
        VF front = before(table, footprint, place);
        int plane = ((first % planes_) + planes_) % planes_;
        for (int sheet = 0; sheet < of_.sheets(); ++sheet) {
            place += of_.sheet;
            const VF back = before(table, footprint, place);
            // Along the axis or against it: what lies between is the same.
            const VF section = hn::Abs(hn::Sub(back, front));
            To::add(hn::Mul(section, scale), pixels + plane * plane_, sums_.pitch);
            front = back;
            if (++plane == planes_) plane = 0;
        }
    }

    const SheetSplat& of_;
    const SplatSums& sums_;
    int planes_;
    std::ptrdiff_t plane_;
    Lookup<kShort, kSheetCellBits> lookup_;
    VW along_;
};

struct SheetsOfVoxels {
    const SheetSplat& splat;
    const SheetVoxel* list;
    std::int64_t count;
    const SplatSums& sums;
    int planes;
    std::ptrdiff_t plane;

    template <class Read, bool kShort>
    void run() const {
        const Sheets<Read, kShort> sheets(splat, sums, planes, plane);
        for (std::int64_t k = 0; k < count; ++k) sheets.add(list[k]);
    }
    template <class Read>
    void run_by() const {
        if constexpr (kMost >= kNarrow)
            if (splat.splat.patch[0] <= kNarrow) return run<Read, true>();
        run<Read, false>();
    }
};

void sheets_on(const SheetSplat& splat, const SheetVoxel* list, std::int64_t count,
               const SplatSums& sums, int planes, std::ptrdiff_t plane) {
    const SheetsOfVoxels voxels{splat, list, count, sums, planes, plane};
#if EDGEWISE_LOADS
    if (gathers_are_slow()) return voxels.run_by<Reads<float, true>>();
#endif
    voxels.run_by<Reads<float, false>>();
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(voxels_on);
HWY_EXPORT(sheets_on);

std::int64_t sheet_voxels(const SheetSplat& splat, const SplatSums& sums, Splatted* row,
                          SheetVoxel* list) {
    return HWY_DYNAMIC_DISPATCH(voxels_on)(splat, sums, row, list);
}

void splat_sheets(const SheetSplat& splat, const SheetVoxel* list, std::int64_t count,
                  const SplatSums& sums, int planes, std::ptrdiff_t plane) {
    HWY_DYNAMIC_DISPATCH(sheets_on)(splat, list, count, sums, planes, plane);
}

}  // namespace edgewise::kernels
#endif
