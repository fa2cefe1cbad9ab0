// Gathers against loads, timed on the processor at hand.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <optional>

#include "transitions/kernels/slow_gathers.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/slow_gathers_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/gathers-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

using namespace gathers::HWY_NAMESPACE;  // NOLINT: the vectors and gathers

constexpr int kBytes = 4096, kVectors = 256;

/// Reads vectors of words all over `bytes`, as a sampler does: four a place, then some arithmetic.
template <class Read>
std::int32_t read(const std::uint8_t* bytes) {
    const Ints d;
    const VI step = hn::Set(d, 37), wrap = hn::Set(d, kBytes / 2 - 1);
    VI at = hn::Mul(hn::Iota(d, 0), hn::Set(d, 101)), sum = hn::Zero(d);
    const std::uint8_t* const rows[4] = {bytes, bytes + kBytes / 8, bytes + kBytes / 4,
                                         bytes + 3 * kBytes / 8};
    for (int i = 0; i < kVectors; i += 4) {
        VI words[4];
        gather_words<Read, 4>(rows, at, words);
        for (const VI word : words) sum = hn::Add(sum, hn::Xor(word, at));
        at = hn::And(hn::Add(at, step), wrap);
    }
    return hn::GetLane(hn::SumOfLanes(d, sum));
}

bool loads_are_faster() {
#if EDGEWISE_LOADS
    using Clock = std::chrono::steady_clock;
    alignas(64) std::array<std::uint8_t, kBytes> bytes{};
    [[maybe_unused]] volatile std::int32_t used = 0;
    const auto time = [&](auto reads) {
        const auto begin = Clock::now();
        used = read<decltype(reads)>(bytes.data());
        return Clock::now() - begin;
    };
    // The best of some pairs: whatever disturbs a pair makes it slower.
    constexpr int kPairs = 16;
    auto gathered = Clock::duration::max(), loaded = gathered;
    for (int pair = 0; pair < kPairs; ++pair) {
        gathered = std::min(gathered, Clock::duration(time(Reads<std::uint8_t, false>())));
        loaded = std::min(loaded, Clock::duration(time(Reads<std::uint8_t, true>())));
    }
    return loaded < gathered;
#else
    return false;
#endif
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(loads_are_faster);

namespace {

constexpr int kUnknown = -1;
std::atomic<int> known = kUnknown;

}  // namespace

bool gathers_are_slow() noexcept {
    int slow = known.load(std::memory_order_relaxed);
    if (slow == kUnknown) {
        // Threads that come here at once measure each; the first of them decides.
        const int measured = HWY_DYNAMIC_DISPATCH(loads_are_faster)();
        if (known.compare_exchange_strong(slow, measured)) slow = measured;
    }
    return slow != 0;
}

void set_gathers_slow(std::optional<bool> slow) noexcept {
    known = slow ? static_cast<int>(*slow) : kUnknown;
}

}  // namespace edgewise::kernels
#endif
