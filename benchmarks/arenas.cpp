// What a kept arena brings to brief runs on two threads: a loop in a new arena, as runs had it
// before, and in the one that the last run left, in turns.
//   arenas_benchmark [GAPS [WORKS]], each a list of microseconds: 0,100,1000,5000 50,200,1000
#include <algorithm>
#include <array>
#include <chrono>
#include <fmt/format.h>
#include <string>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <vector>

#include "numbers_of.hpp"
#include "runtime/kept_arena.hpp"

namespace {

using Clock = std::chrono::steady_clock;

constexpr int kThreads = 2, kParts = 16, kBlocks = 15, kRunsABlock = 20;

double microseconds(Clock::time_point begin) {
    return std::chrono::duration<double, std::micro>(Clock::now() - begin).count();
}

/// Keeps this thread at work.
void work_for(double time) {
    const auto begin = Clock::now();
    while (microseconds(begin) < time) {
    }
}

void parts(double work) {
    tbb::parallel_for(0, kParts, [&](int) { work_for(work / kParts); });
}

double in_new(double work) {
    const auto begin = Clock::now();
    tbb::task_arena arena(kThreads);
    const edgewise::OneThreadACore cores(arena, kThreads);
    const edgewise::OneThreadACore::AtWork at_work(cores);
    arena.execute([&] { parts(work); });
    return microseconds(begin);
}

double in_kept(double work) {
    static edgewise::Arenas arenas;
    const auto begin = Clock::now();
    edgewise::KeptArena arena(arenas, kThreads);
    arena.execute([&] { parts(work); });
    return microseconds(begin);
}

double median(std::vector<double>& times) {
    std::nth_element(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2),
                     times.end());
    return times[times.size() / 2];
}

}  // namespace

int main(int argc, char** argv) {
    const std::vector<double> gaps = numbers_of(argc > 1 ? argv[1] : "0,100,1000,5000");
    const std::vector<double> works = numbers_of(argc > 2 ? argv[2] : "50,200,1000");
    fmt::print("{:>10} {:>10} {:>10} {:>10} {:>8}\n", "gap [us]", "work [us]", "new [us]",
               "kept [us]", "ratio");
    for (const double gap : gaps)
        for (const double work : works) {
            std::array<std::vector<double>, 2> times;
            for (int block = 0; block < 2 * kBlocks; ++block)
                for (int run = 0; run < kRunsABlock; ++run) {
                    work_for(gap);
                    const double time = block % 2 ? in_kept(work) : in_new(work);
                    times[static_cast<std::size_t>(block % 2)].push_back(time);
                }
            const double fresh = median(times[0]), kept = median(times[1]);
            fmt::print("{:>10} {:>10} {:>10.0f} {:>10.0f} {:>8.2f}\n", gap, work, fresh, kept,
                       kept / fresh);
        }
    return 0;
}
