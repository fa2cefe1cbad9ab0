// Rows of a volume as sources of pixel_rules-inl.hpp. Compiled once a target: see Highway's
// foreach_target.h.
#if defined(EDGEWISE_SAMPLE_ROWS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef EDGEWISE_SAMPLE_ROWS_INL
#undef EDGEWISE_SAMPLE_ROWS_INL
#else
#define EDGEWISE_SAMPLE_ROWS_INL
#endif

#include <algorithm>

#include "hwy/highway.h"
#include "transitions/kernels/pixel_rules-inl.hpp"
#include "transitions/kernels/scalar_load.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {  // other kernels have names of their own in this namespace

/// A row of a type that vectors load.
template <class T>
struct Row {
    const T* first;

    HWY_INLINE VF at(std::int64_t i, std::int64_t) const { return load_row(first + i); }
};

/// A row of a type without vector loads.
struct LoadedRow {
    const void* samples;
    ScalarLoad load;
    std::int64_t first;

    HWY_INLINE VF at(std::int64_t i, std::int64_t n) const {
        HWY_ALIGN float values[kLanes] = {};
        const std::int64_t lanes = std::min<std::int64_t>(n, kLanes);
        for (std::int64_t lane = 0; lane < lanes; ++lane)
            values[lane] = load(samples, first + i + lane);
        return hn::Load(DF(), values);
    }
};

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
