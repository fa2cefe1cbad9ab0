// Which pixels of an intermediate image still let light through, for kernels that add runs.
// Compiled once a target: see Highway's foreach_target.h.
#if defined(EDGEWISE_OPEN_BLOCKS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef EDGEWISE_OPEN_BLOCKS_INL
#undef EDGEWISE_OPEN_BLOCKS_INL
#else
#define EDGEWISE_OPEN_BLOCKS_INL
#endif

#include <algorithm>
#include <bit>
#include <cstdint>

#include "hwy/highway.h"
#include "transitions/kernels/pixel_rules-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {  // other kernels have names of their own in this namespace

/// Pixels that are asked together whether they let light through.
inline constexpr std::int64_t kBlock = kLanes > 8 ? static_cast<std::int64_t>(kLanes) : 8;
inline constexpr std::int64_t kOpenWidth = 31 * kBlock;  // one bit each

/// Whether pixels of a rule become opaque, and then do not change.
template <class Rule>
constexpr bool kEnds = true;
template <>
constexpr bool kEnds<OtherRule> = false;

/// The blocks of a row of the image that light reaches from behind, one bit each.
class OpenBlocks {
 public:
    explicit OpenBlocks(std::int64_t width = 0)
        : bits_((std::uint32_t{1} << (width + kBlock - 1) / kBlock) - 1) {}

    bool any() const { return bits_ != 0; }
    /// Calls use(from, to) for the stretches of pixels [from, to) that lie in open blocks.
    template <class Use>
    HWY_INLINE void each(std::int64_t from, std::int64_t to, const Use& use) const {
        while (from < to) {
            const std::int64_t block = from / kBlock;
            const std::uint32_t left = bits_ >> block;
            if (left == 0) return;
            const std::int64_t next = block + std::countr_zero(left);
            if (next > block) from = next * kBlock;
            const std::int64_t behind = next + std::countr_one(bits_ >> next);
            const std::int64_t end = std::min(to, behind * kBlock);
            if (from >= end) return;
            use(from, end);
            from = end;
        }
    }
    /// Closes blocks of pixels [from, to) that are opaque.
    HWY_INLINE void close(std::int64_t from, std::int64_t to, const float* transparency) {
        const DF d;
        for (std::int64_t block = from / kBlock; block * kBlock < to; ++block) {
            VF left = hn::LoadU(d, transparency + block * kBlock);
            for (std::int64_t i = kLanes; i < kBlock; i += kLanes)
                left = hn::Max(left, hn::LoadU(d, transparency + block * kBlock + i));
            if (hn::AllFalse(d, hn::Gt(left, hn::Zero(d)))) bits_ &= ~(std::uint32_t{1} << block);
        }
    }

 private:
    std::uint32_t bits_;
};

/// Calls body.template run<Rule>() with a rule that runs are made for.
template <bool kFinite, class Body>
HWY_INLINE void with_seen_rule(const Combining& with, const Body& body) {
    if (with.rule != Combine::over) return body.template run<OtherRule>();
    return with.optics->grey ? body.template run<OverRule<kFinite, 1>>()
                             : body.template run<OverRule<kFinite, 3>>();
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
