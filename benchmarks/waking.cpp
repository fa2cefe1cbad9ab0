// What OneThreadACore brings to a loop of some milliseconds on two threads, one of which has slept:
// times with threads left to the system and with one a core, in turns.
//   waking_benchmark [SLEEPS [WORKS]], each a list of milliseconds: 5,20 0.5,1,2,4,8,16
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <fmt/format.h>
#include <optional>
#include <string>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <thread>
#include <vector>

#include "numbers_of.hpp"
#include "runtime/one_thread_a_core.hpp"

namespace {

using Clock = std::chrono::steady_clock;

constexpr int kThreads = 2, kPartsAMillisecond = 20, kRuns = 60;

double milliseconds(Clock::time_point begin) {
    return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

double turns(int count) {
    double sums[8] = {1, 2, 3, 4, 5, 6, 7, 8};
    for (int i = 0; i < count; ++i)
        for (double& sum : sums) sum = sum * 1.0000001 + 0.1;
    return sums[0] + sums[7];
}

/// How many turns take one thread as long as one part should.
int turns_a_part() {
    constexpr int kTried = 100'000;
    double least = 1e9;
    volatile double result = 0;
    for (int run = 0; run < 100; ++run) {
        const auto begin = Clock::now();
        result = turns(kTried);
        least = std::min(least, milliseconds(begin));
    }
    static_cast<void>(result);
    return static_cast<int>(kTried / least / kPartsAMillisecond);
}

double time_of(tbb::task_arena& arena, int parts, int count) {
    std::vector<double> results(static_cast<std::size_t>(parts));
    const auto begin = Clock::now();
    arena.execute([&] {
        tbb::parallel_for(0, parts,
                          [&](int i) { results[static_cast<std::size_t>(i)] = turns(count); });
    });
    return milliseconds(begin);
}

std::string quartiles(std::vector<double>& times) {
    std::sort(times.begin(), times.end());
    return fmt::format("{:>10.2f} {:>8.2f} {:>8.2f}", times[kRuns / 4], times[kRuns / 2],
                       times[kRuns * 3 / 4]);
}

}  // namespace

int main(int argc, char** argv) {
    const std::vector<double> gaps = numbers_of(argc > 1 ? argv[1] : "5,20");
    const std::vector<double> works = numbers_of(argc > 2 ? argv[2] : "0.5,1,2,4,8,16");
    const int count = turns_a_part();
    tbb::task_arena arena(kThreads);
    fmt::print("{:>11} {:>10} {:>28} {:>28} {:>8}\n", "asleep [ms]", "work [ms]",
               "by the system: quartiles", "one a core: quartiles", "medians");
    for (const double gap : gaps)
        for (const double work : works) {
            std::array<std::vector<double>, 2> times;
            for (int run = 0; run < 2 * kRuns; ++run) {
                std::this_thread::sleep_for(std::chrono::duration<double, std::milli>(gap));
                // by the system, one a core, one a core, by the system
                const auto which = static_cast<std::size_t>((run + 1) / 2 % 2);
                std::optional<edgewise::OneThreadACore> cores;
                std::optional<edgewise::OneThreadACore::AtWork> at_work;
                if (which == 1) at_work.emplace(cores.emplace(arena, kThreads));
                const int parts = static_cast<int>(std::lround(work * kPartsAMillisecond));
                times[which].push_back(time_of(arena, parts, count));
            }
            const std::string left = quartiles(times[0]), spread = quartiles(times[1]);
            fmt::print("{:>11} {:>10} {:>28} {:>28} {:>8.2f}\n", gap, work, left, spread,
                       times[1][kRuns / 2] / times[0][kRuns / 2]);
        }
    return 0;
}
