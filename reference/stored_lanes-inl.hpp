// Stored values as vectors; compiled once a target (Highway's foreach_target). No pragma once: the
// guard toggles, so that every target sees the text once.
#if defined(EDGEWISE_STORED_LANES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef EDGEWISE_STORED_LANES_INL
#undef EDGEWISE_STORED_LANES_INL
#else
#define EDGEWISE_STORED_LANES_INL
#endif

#include <cstdint>
#include <type_traits>

#include "hwy/highway.h"
#include "reference/stored.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::stored_lanes {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// The numbers that vectors are made of: halves are widened.
template <class T>
using Lane = std::conditional_t<std::is_same_v<T, StoredHalf>, float, T>;

template <class D, class T>
HWY_INLINE hn::Vec<D> load(D d, const T* from) {
    if constexpr (std::is_same_v<T, StoredHalf>) {
        const hn::Rebind<hwy::float16_t, D> halves;
        const hn::Rebind<std::uint16_t, D> bits;
        return hn::PromoteTo(d, hn::BitCast(halves, hn::LoadU(bits, &from->bits)));
    } else {
        return hn::LoadU(d, from);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace edgewise::stored_lanes
HWY_AFTER_NAMESPACE();

#endif
