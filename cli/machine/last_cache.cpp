#include "cli/machine/last_cache.hpp"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <random>
#include <vector>

#include "cli/machine/machine.hpp"

namespace edgewise::cli {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::int64_t kThirds = 3;         // of the second cache
constexpr std::int64_t kMuchLarger = 2;     // than what is read: the last cache
constexpr std::int64_t kLargest = 8 << 20;  // [byte] of a second cache
constexpr std::size_t kRead = 400;          // lines again: 7 us where they are near

struct alignas(64) Line {
    std::uint32_t next = 0;
};

/// Lines of which `kRead` in the first third lead from one to the next, in no order that a
/// processor would foresee, and round.
class Lines {
 public:
    Lines() {
        const std::int64_t second = cache_bytes(2).value_or(0), last = cache_bytes(3).value_or(0);
        if (second <= 0 || second > kLargest || last < kMuchLarger * kThirds * second) return;
        const auto third = static_cast<std::size_t>(second) / sizeof(Line);
        if (third < kRead) return;
        lines_.resize(static_cast<std::size_t>(kThirds) * third);
        std::vector<std::uint32_t> order(third);
        for (std::size_t i = 0; i < third; ++i) order[i] = static_cast<std::uint32_t>(i);
        std::shuffle(order.begin(), order.end(), std::mt19937(1));
        for (std::size_t i = 0; i < kRead; ++i) lines_[order[i]].next = order[(i + 1) % kRead];
        first_ = order[0];
    }

    double look() const {
        if (lines_.empty()) return 0;
        volatile std::uint32_t used = 0;
        std::uint32_t sum = 0;
        for (const Line& line : lines_) sum += line.next;
        used = sum;
        const Clock::time_point begin = Clock::now();
        std::uint32_t at = first_;
        for (std::size_t i = 0; i < kRead; ++i) at = lines_[at].next;
        used = at;
        static_cast<void>(used);
        return std::chrono::duration<double>(Clock::now() - begin).count() / kRead;
    }

 private:
    std::vector<Line> lines_;
    std::uint32_t first_ = 0;
};

}  // namespace

double last_cache_line() {
    static std::mutex mutex;
    static const Lines lines;
    const std::lock_guard lock(mutex);
    return lines.look();
}

}  // namespace edgewise::cli
