// What a second thread brings to a loop of some milliseconds after the workers have slept, with
// threads left to the system and with OneThreadACore.
//   waking_benchmark
#include <algorithm>
#include <chrono>
#include <fmt/format.h>
#include <optional>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <thread>
#include <vector>

#include "runtime/one_thread_a_core.hpp"

namespace {

using Clock = std::chrono::steady_clock;

constexpr int kThreads = 2, kParts = 40, kRuns = 41;

/// About a tenth of a millisecond.
double part() {
    double sums[8] = {1, 2, 3, 4, 5, 6, 7, 8};
    for (int i = 0; i < 25'000; ++i)
        for (double& sum : sums) sum = sum * 1.0000001 + 0.1;
    return sums[0] + sums[7];
}

double milliseconds(Clock::time_point begin) {
    return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

std::vector<double> times(int gap, bool spread) {
    tbb::task_arena arena(kThreads);
    std::optional<edgewise::OneThreadACore> cores;
    if (spread) cores.emplace(arena, kThreads);
    std::vector<double> all;
    std::vector<double> results(kParts);
    for (int run = 0; run < kRuns; ++run) {
        std::this_thread::sleep_for(std::chrono::milliseconds(gap));
        const auto begin = Clock::now();
        arena.execute([&] {
            tbb::parallel_for(0, kParts,
                              [&](int i) { results[static_cast<std::size_t>(i)] = part(); });
        });
        all.push_back(milliseconds(begin));
    }
    std::sort(all.begin(), all.end());
    return all;
}

}  // namespace

int main() {
    fmt::print("{:>12} {:>10} {:>26} {:>26}\n", "asleep [ms]", "", "by the system: median, p75",
               "one a core: median, p75");
    for (const int gap : {0, 1, 20, 200}) {
        const std::vector<double> left = times(gap, false), spread = times(gap, true);
        fmt::print("{:>12} {:>10} {:>18.2f} {:>7.2f} {:>18.2f} {:>7.2f}\n", gap, "ms",
                   left[kRuns / 2], left[kRuns * 3 / 4], spread[kRuns / 2], spread[kRuns * 3 / 4]);
    }
    return 0;
}
