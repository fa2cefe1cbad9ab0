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
#include <tbb/task_arena.h>

#include "cli/machine/machine.hpp"
#include "cli/machine/quantiles.hpp"
#include "runtime/one_thread_a_core.hpp"

namespace edgewise::cli {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr std::chrono::microseconds kPatience{300};
constexpr double kCalm = 1.1;  // times the best; a sibling busy before or after makes 1.13
/// Siblings make up to 1.8 of it; beyond this the loop itself was interrupted, not the run.
constexpr double kSlowest = 2.5;

/// Of one thread and of many: siblings of one core slow each other down as well.
class BestPaces {
 public:
    void see(int threads, double pace) {
        const std::lock_guard lock(mutex_);
        double& best = best_.try_emplace(threads, kNever).first->second;
        best = std::min(best, pace);
    }
    double of(int threads) {
        const std::lock_guard lock(mutex_);
        const auto found = best_.find(threads);
        return found == best_.end() ? kNever : found->second;
    }

 private:
    std::mutex mutex_;
    std::map<int, double> best_;
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

/// One thread's part, once all are there.
double own_pace(std::atomic<int>& missing) {
    static const Loop loop;
    const Clock::time_point came = Clock::now();
    --missing;
    while (missing > 0)
        if (Clock::now() - came > kPatience) return kNever;
    volatile std::uint32_t used = loop.run();  // its data come into the cache
    const Clock::time_point begin = Clock::now();
    used = loop.run();
    static_cast<void>(used);
    return std::chrono::duration<double>(Clock::now() - begin).count();
}

}  // namespace

double pace_now(int threads) {
    threads = at_once(threads);
    tbb::task_arena arena(threads);
    const OneThreadACore spread(arena, threads);
    std::atomic<int> missing{threads};
    std::vector<double> paces(static_cast<std::size_t>(threads));
    arena.execute([&] {
        tbb::parallel_for(
            0, threads, [&](int i) { paces[static_cast<std::size_t>(i)] = own_pace(missing); },
            tbb::static_partitioner());
    });
    double speed = 0;
    for (const double each : paces) speed += 1 / (each * threads);
    if (std::any_of(paces.begin(), paces.end(), [](double each) { return each == kNever; }))
        return kNever;
    const double pace = 1 / speed;
    best_paces.see(threads, pace);
    return pace;
}

double best_pace(int threads) { return best_paces.of(at_once(threads)); }

int warming_runs(double seconds) noexcept {
    constexpr double kEnough = 0.004;  // [s]
    constexpr int kMost = 4;
    return seconds * kMost > kEnough ? static_cast<int>(std::ceil(kEnough / seconds)) : kMost;
}

bool is_calm(double pace, double best) noexcept { return pace <= kCalm * best; }

void PacedRuns::join(const PacedRuns& others) {
    runs_.insert(runs_.end(), others.runs_.begin(), others.runs_.end());
}

void PacedRuns::disturbed_from(std::size_t first) {
    for (std::size_t i = first; i < runs_.size(); ++i) runs_[i].before = runs_[i].after = kNever;
}

std::size_t PacedRuns::calm(double best) const {
    return static_cast<std::size_t>(std::count_if(
        runs_.begin(), runs_.end(), [&](const Run& run) { return is_calm(run.pace(), best); }));
}

std::vector<double> PacedRuns::seconds(double best, std::size_t least) const {
    std::vector<Run> runs = runs_;
    std::stable_sort(runs.begin(), runs.end(),
                     [](const Run& a, const Run& b) { return a.pace() < b.pace(); });
    // Where nothing is known of any, none is better than the others.
    if (!runs.empty() && std::isfinite(runs.front().pace()))
        runs.resize(std::min(runs.size(), std::max(least, calm(best))));
    std::vector<double> seconds;
    for (const Run& run : runs) seconds.push_back(run.seconds);
    return seconds;
}

double PacedRuns::undisturbed(double best) const {
    constexpr std::size_t kEnough = 3;
    std::vector<double> all, calmed;
    for (const Run& run : runs_) {
        all.push_back(run.seconds);
        const double slower = std::min(run.before, run.after) / best;
        if (slower <= kSlowest) calmed.push_back(run.seconds / std::max(1.0, slower / kCalm));
    }
    return quantile(calmed.size() >= kEnough ? calmed : all, 0.2);
}

}  // namespace edgewise::cli
