// Whole footprints added to a picture.
#include "transitions/kernels/splat.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/splat_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/splat-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

constexpr int kCellBits = 5;
static_assert(Footprints::Shape{}.cells == 1 << kCellBits);

/// The footprints of rows of voxels.
template <class Read, bool kShort>
class RowsOfVoxels {
 public:
    RowsOfVoxels(const Splat& splat, const SplatSums& sums)
        : splat_(splat), sums_(sums), lookup_(splat) {}

    void add(const Splatted* list, std::int64_t count, std::int64_t y, std::int64_t z) const {
        const Extent& n = splat_.volume.extent;
        const float* inner = nullptr;
        for (std::int64_t k = 0; k < count; ++k) {
            const auto [x, value] = list[k];
            const Patch patch(splat_, double(x), double(y), double(z));
            if (!patch.meets(splat_, sums_)) continue;
            const bool inside = x > 0 && x < n.x - 1;
            if (inside && !inner) inner = table_of(splat_, x, y, z);
            const float* table = inside ? inner : table_of(splat_, x, y, z);
            const auto left = static_cast<std::int32_t>(patch.left);
            const auto top = static_cast<std::int32_t>(patch.top);
            std::array<std::uint32_t, 2> at;
            for (std::size_t i = 0; i < 2; ++i)
                at[i] = splat_.across[i].of(x, y, z) + splat_.across[i].right(left) +
                        splat_.across[i].down(top);
            add_patch(table, value, at,
                      sums_.first + (top - sums_.begin[1]) * sums_.pitch + left - sums_.begin[0]);
        }
    }

 private:
    HWY_INLINE void add_patch(const float* table, float value,
                              const std::array<std::uint32_t, 2>& at, float* first) const {
        using To = Vectors<kShort>;
        const auto* bytes = reinterpret_cast<const std::uint8_t*>(table);
        const VF scale = hn::Set(Floats(), value);
        const auto& [a, b] = splat_.across;
        for (int j = 0; j < splat_.patch[1]; j += To::kRows)
            for (int i = 0; i < splat_.patch[0]; i += To::kColumns) {
                const VW place =
                    lookup_.places(at[0] + a.right(i) + a.down(j), at[1] + b.right(i) + b.down(j));
                const VF footprint =
                    gather_one<Read>(bytes, hn::BitCast(Ints(), hn::ShiftLeft<2>(place)));
                To::add(hn::Mul(footprint, scale), first + j * sums_.pitch + i, sums_.pitch);
            }
    }

    const Splat& splat_;
    const SplatSums& sums_;
    Lookup<kShort, kCellBits> lookup_;
};

struct Slices {
    const Splat& splat;
    std::int64_t begin, end;
    const SplatSums& sums;
    Splatted* row;

    template <class Read, bool kShort>
    void run() const {
        const RowsOfVoxels<Read, kShort> voxels(splat, sums);
        each_row(splat, begin, end, sums, row,
                 [&](const Splatted* list, std::int64_t count, std::int64_t y, std::int64_t z) {
                     voxels.add(list, count, y, z);
                 });
    }
    template <class Read>
    void run_by() const {
        if constexpr (kMost >= kNarrow)
            if (splat.patch[0] <= kNarrow) return run<Read, true>();
        run<Read, false>();
    }
};

void splat_on(const Splat& splat, std::int64_t begin, std::int64_t end, const SplatSums& sums,
              Splatted* row) {
    const Slices slices{splat, begin, end, sums, row};
#if EDGEWISE_LOADS
    if (gathers_are_slow()) return slices.run_by<Reads<float, true>>();
#endif
    slices.run_by<Reads<float, false>>();
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(splat_on);

void splat(const Splat& splat, std::int64_t begin, std::int64_t end, const SplatSums& sums,
           Splatted* row) {
    HWY_DYNAMIC_DISPATCH(splat_on)(splat, begin, end, sums, row);
}

}  // namespace edgewise::kernels
#endif
