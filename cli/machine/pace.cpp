#include "cli/machine/pace.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <mutex>
#include <tbb/parallel_for.h>

#include "cli/machine/machine.hpp"
#include "runtime/kept_arena.hpp"

namespace edgewise::cli {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr std::chrono::microseconds kPatience{300};
constexpr int kHops = 400;  // 10 us where processors are near

/// Of one thread and of many: siblings of one core slow each other down as well.
class BestPaces {
 public:
    void see(int threads, const Pace& pace) {
        const std::lock_guard lock(mutex_);
        Pace& best = best_.try_emplace(threads, Pace{kNever, kNever}).first->second;
        // Lines go fastest between siblings of one core, which do not count.
        if (kCalmLoop * pace.loop < best.loop) best.hop = pace.hop;
        best.loop = std::min(best.loop, pace.loop);
        if (pace.loop <= kCalmLoop * best.loop) best.hop = std::min(best.hop, pace.hop);
    }
    Pace of(int threads) {
        const std::lock_guard lock(mutex_);
        const auto found = best_.find(threads);
        return found == best_.end() ? Pace{kNever, kNever} : found->second;
    }

 private:
    std::mutex mutex_;
    std::map<int, Pace> best_;
};
BestPaces best_paces;

/// More never meet.
int at_once(int threads) { return std::min(threads, usable_cores()); }

/// Numbers at places that no vector instruction reads at once: loads and sums, several a cycle.
class Loop {
 public:
    Loop() {
        std::uint32_t bits = 1;
        for (std::uint16_t& place : places_) {
            bits = bits * 1664525 + 1013904223;  // Knuth, the Art of Computer Programming 2, 3.3.4
            place = static_cast<std::uint16_t>(bits >> 16) % kNumbers;
        }
    }

    std::uint32_t run() const {
        std::uint32_t a = 0, b = 0, c = 0, d = 0;
        for (int pass = 0; pass < kPasses; ++pass)
            for (std::size_t i = 0; i < kPlaces; i += 4) {
                a += numbers_[places_[i]];
                b += numbers_[places_[i + 1]];
                c += numbers_[places_[i + 2]];
                d += numbers_[places_[i + 3]];
            }
        return a + b + c + d;
    }

 private:
    static constexpr std::size_t kPlaces = 4096, kNumbers = 4096;  // 8 and 16 KiB
    static constexpr int kPasses = 8;
    std::array<std::uint16_t, kPlaces> places_{};
    std::array<std::uint32_t, kNumbers> numbers_{};
};

/// All are there at once. @return false where they did not come
bool meet(std::atomic<int>& missing) {
    const Clock::time_point came = Clock::now();
    --missing;
    while (missing > 0)
        if (Clock::now() - came > kPatience) return false;
    return true;
}

/// One thread's part of a number that goes round, once all are there. @return [s] a hop
double own_hops(std::atomic<int>& hops, int thread, int threads) {
    constexpr int kPatient = 100'000;
    if (threads < 2) return 0;
    const Clock::time_point begin = Clock::now();
    for (int hop = thread; hop < kHops; hop += threads) {
        for (int wait = 0; hops.load(std::memory_order_acquire) < hop; ++wait)
            if (wait == kPatient) return kNever;
        hops.store(hop + 1, std::memory_order_release);
    }
    return std::chrono::duration<double>(Clock::now() - begin).count() / kHops;
}

/// One thread's part, once all are there.
double own_loop() {
    static const Loop loop;
    volatile std::uint32_t used = loop.run();  // its data come into the cache
    const Clock::time_point begin = Clock::now();
    used = loop.run();
    static_cast<void>(used);
    return std::chrono::duration<double>(Clock::now() - begin).count();
}

}  // namespace

Pace pace_now(int threads) {
    threads = at_once(threads);
    KeptArena arena(threads);  // that of the runs beside it: workers are there
    std::atomic<int> missing{threads};
    alignas(128) std::atomic<int> hops{0};  // alone in its line
    std::vector<Pace> paces(static_cast<std::size_t>(threads), Pace{kNever, kNever});
    arena.execute([&] {
        tbb::parallel_for(
            0, threads,
            [&](int i) {
                if (!meet(missing)) return;
                Pace& own = paces[static_cast<std::size_t>(i)];
                own.hop = own_hops(hops, i, threads);
                own.loop = own_loop();
            },
            tbb::static_partitioner());
    });
    Pace pace{0, 0};
    for (const Pace& each : paces) {
        pace.loop += 1 / (each.loop * threads);
        pace.hop = std::max(pace.hop, each.hop);
    }
    pace.loop = 1 / pace.loop;
    if (!std::isfinite(pace.hop)) return {kNever, kNever};
    best_paces.see(threads, pace);
    return pace;
}

void know_pace(int threads, const Pace& pace) { best_paces.see(at_once(threads), pace); }

Pace best_pace(int threads) { return best_paces.of(at_once(threads)); }

Pace await_calm(int threads, double patience) {
    const Clock::time_point begin = Clock::now();
    Pace pace = pace_now(threads);
    while (!is_calm(pace, best_pace(threads)) &&
           std::chrono::duration<double>(Clock::now() - begin).count() < patience)
        pace = pace_now(threads);
    return pace;
}

Pace calm_pace(int threads) {
    // Phases that outlast one wait last for seconds: then only looks are taken.
    constexpr double kPatient = 0.004, kInVain = 0.0004;  // [s]
    static std::atomic<bool> in_vain{false};
    const Pace pace = await_calm(threads, in_vain ? kInVain : kPatient);
    in_vain = !is_calm(pace, best_pace(threads));
    return pace;
}

bool is_far(const Pace& pace, const Pace& best) noexcept {
    constexpr double kNear = 2;
    return pace.hop > kNear * best.hop;
}

bool is_calm(const Pace& pace, const Pace& best) noexcept {
    return pace.loop <= kCalmLoop * best.loop && !is_far(pace, best);
}

}  // namespace edgewise::cli
