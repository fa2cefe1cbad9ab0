#include "measure/machine_probe.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <ctime>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <memory>
#include <mutex>
#include <numbers>
#include <optional>
#include <thread>
#include <utility>

#include "graph/errors.hpp"
#include "measure/machine.hpp"
#include "measure/probe_fit.hpp"
#include "measure/quantiles.hpp"
#include "runtime/runtime.hpp"
#include "transitions/kernels/backward.hpp"
#include "transitions/kernels/probe.hpp"

namespace edgewise {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::int64_t kFloat = sizeof(float);
constexpr std::int64_t kMostSet = std::int64_t{256} << 20;       // [byte]
constexpr std::int64_t kStreamedAtOnce = std::int64_t{4} << 20;  // [byte] of a larger set, a part
constexpr std::int64_t kReadAtOnce = std::int64_t{1} << 19;      // samples, likewise
constexpr std::int64_t kLinesAtOnce = std::int64_t{1} << 17;     // read one a line, likewise
/// Voxels from sample to sample of a grid so sparse that each is in a line of its own.
constexpr int kSparse = 3;
constexpr std::int64_t kOperationsAtOnce = 4'000'000;
constexpr std::size_t kLeastRounds = 5;  // where a process stands still

template <class Body>
double seconds_of(Body&& body) {
    const Clock::time_point begin = Clock::now();
    body();
    return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// Powers of two from half of the first cache to four times the last one, or what memory allows.
std::vector<std::int64_t> set_sizes() {
    std::int64_t least = std::int64_t{16} << 10, most = kMostSet;
    if (const auto first = cache_bytes(1)) least = std::clamp(*first / 2, least / 4, 4 * least);
    if (const auto last = cache_bytes(3)) most = std::min(most, 4 * *last);
    most = std::min(most, static_cast<std::int64_t>(free_memory() / 4));
    std::vector<std::int64_t> sizes;
    std::int64_t size = 1;
    while (2 * size <= least) size *= 2;
    do sizes.push_back(size);
    while ((size *= 2) <= most);
    return sizes;
}

/// Samples of a grid that is turned in a volume, tile by tile as warps go.
class TurnedGrid {
 public:
    /// @param bytes  of the volume
    /// @param apart  voxels from sample to sample
    TurnedGrid(std::int64_t bytes, int apart) : last_(static_cast<std::int32_t>(bytes - kFloat)) {
        const auto side = std::lround(std::cbrt(static_cast<double>(bytes / kFloat))) | 1;
        const std::int64_t samples = (side + apart - 1) / apart;
        const Extent tile = kernels::preferred_tile({samples, samples, samples});
        length_ = std::min<std::int64_t>((samples + 31) / 32 * 32, tile.x);
        const auto lines = static_cast<std::size_t>(
            std::max<std::int64_t>(1, samples * samples * samples / length_));
        const auto at = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
            return offset(side, {double(apart * x), double(apart * y), double(apart * z)});
        };
        for (std::int64_t i = 0; i < length_; ++i) steps_.push_back(at(i, 0, 0));
        for (std::int64_t z = 0; z < samples; z += tile.z)
            for (std::int64_t y = 0; y < samples; y += tile.y)
                for (std::int64_t x = 0; x < samples && begins_.size() < lines; x += length_)
                    for (std::int64_t k = 0; k < tile.z * tile.y; ++k)
                        begins_.push_back(at(x, y + k % tile.y, z + k / tile.y));
        begins_.resize(std::min(begins_.size(), lines));
    }

    /// Reads so many samples of it, the next ones each time.
    /// @param sum  what was read goes there, so that it is
    /// @return [s] a sample
    double read(const float* block, std::int64_t at_once, float& sum) {
        const auto all = static_cast<std::int64_t>(begins_.size());
        const std::int64_t lines = std::min(all, at_once / length_);
        const std::int64_t passes = std::max<std::int64_t>(1, at_once / length_ / lines);
        if (line_ + lines > all) line_ = 0;
        const kernels::ProbeLines part{steps_.data(), length_, begins_.data() + line_, lines,
                                       last_};
        if (lines == all) sum += kernels::probe_gather(block, part);  // warm
        const double seconds = seconds_of([&] {
            for (std::int64_t pass = 0; pass < passes; ++pass)
                sum += kernels::probe_gather(block, part);
        });
        line_ += lines;
        return seconds / static_cast<double>(passes * lines * length_);
    }

 private:
    /// Where a sample of the turned grid lies in a volume of so many samples a side, an odd number:
    /// powers of two as strides would put neighbours into the same lines of a cache.
    static std::int32_t offset(std::int64_t side, const std::array<double, 3>& at) {
        // Turned by 30 degrees about each axis.
        constexpr double s = 0.5, c = std::numbers::sqrt3 / 2;
        constexpr double turn[3][3] = {{c * c, c * s * s - s * c, s * c * c + s * s},
                                       {s * c, s * s * s + c * c, s * s * c - c * s},
                                       {-s, c * s, c * c}};
        std::int64_t sample = 0;
        for (int axis = 2; axis >= 0; --axis)
            sample = sample * side + std::lround(turn[axis][0] * at[0] + turn[axis][1] * at[1] +
                                                 turn[axis][2] * at[2]);
        return static_cast<std::int32_t>(sample * kFloat);
    }

    std::int32_t last_;
    std::int64_t length_ = 0, line_ = 0;        // the next one
    std::vector<std::int32_t> steps_, begins_;  // of ProbeLines
};

/// A set of bytes, read and written in order and read at computed addresses; a large one part by
/// part, each time another one.
class Set {
 public:
    explicit Set(std::int64_t bytes) : bytes_(bytes), dense_(bytes, 1), sparse_(bytes, kSparse) {
        times_.bytes = static_cast<double>(bytes);
    }

    /// Half of the bytes are read, half written.
    void stream(float* block) {
        const std::int64_t half = bytes_ / kFloat / 2;
        const std::int64_t part = std::min(half, kStreamedAtOnce / kFloat / 2);
        const std::int64_t passes = kStreamedAtOnce / (2 * part * kFloat);
        if (part == half) kernels::probe_stream(block, block + half, half);  // warm
        const double seconds = seconds_of([&] {
            for (std::int64_t pass = 0; pass < passes; ++pass)
                kernels::probe_stream(block + streamed_, block + half + streamed_, part);
        });
        times_.streamed.push_back(seconds / static_cast<double>(passes * 2 * part * kFloat));
        streamed_ = (streamed_ + part) % half;
    }

    /// @return a number that depends on what was read
    float gather(const float* block) {
        float sum = 0;
        times_.gather.push_back(dense_.read(block, kReadAtOnce, sum));
        times_.line.push_back(sparse_.read(block, kLinesAtOnce, sum));
        return sum;
    }

    const SetTimes& times() const { return times_; }

 private:
    std::int64_t bytes_;
    std::int64_t streamed_ = 0;  // where the next part begins
    TurnedGrid dense_, sparse_;
    SetTimes times_;
};

/// A thread that answers when it is woken.
class Echo {
 public:
    Echo() : thread_([this] { answer(); }) {}
    ~Echo() {
        pass(kEnd);
        thread_.join();
    }

    /// Seconds from a word to the thread that waits for it, the mean of both directions.
    double wake_seconds() {
        constexpr int kTrips = 4;
        return seconds_of([&] {
                   for (int i = 0; i < kTrips; ++i) {
                       pass(kThere);
                       wait_for(kHere);
                   }
               }) /
               (2 * kTrips);
    }

 private:
    enum Ball { kHere, kThere, kEnd };

    void pass(Ball to) {
        {
            const std::lock_guard lock(mutex_);
            ball_ = to;
        }
        moved_.notify_one();
    }
    void wait_for(Ball where) {
        std::unique_lock lock(mutex_);
        moved_.wait(lock, [&] { return ball_ == where; });
    }
    void answer() {
        for (;;) {
            {
                std::unique_lock lock(mutex_);
                moved_.wait(lock, [&] { return ball_ != kHere; });
                if (ball_ == kEnd) return;
            }
            pass(kHere);
        }
    }

    std::mutex mutex_;
    std::condition_variable moved_;
    Ball ball_ = kHere;
    std::thread thread_;  // after what it uses
};

/// Plans of steps that do nothing, in one region a processor.
class EmptySteps {
 public:
    EmptySteps(int processors, const std::atomic<bool>& stop) : threads_(processors), stop_(stop) {
        what_.axes = 2;
        what_.type = Type::u8;
        what_.extent = {16, processors, 1};
        want_.axes = 2;
        want_.job = Job::warp;
        want_.input = want_.screen = what_.extent;
        Transition nothing;
        nothing.name = "probe.nothing";
        nothing.parts = [](const Offer&, const Ask&) {
            return Partition{.kind = Partition::output, .leaf = {16, 1, 1}};
        };
        nothing.run = [](const Offer&, const Ask&, const Data&, Data&, const Region&, Context&) {};
        nothing_ = std::make_shared<const Transition>(std::move(nothing));
        source_ = std::make_shared<Data>(Data::make(what_, &memory_));
    }

    /// What one step adds to a run.
    double step_seconds() const {
        constexpr int kSteps = 8;
        // One run of either may be held up by something else.
        return std::max(1e-8, (run_seconds(1 + kSteps) - run_seconds(1)) / kSteps);
    }

 private:
    double run_seconds(int steps) const {
        Step step;
        step.by = nothing_;
        step.offer = {.from = what_, .to = what_};
        Plan plan;
        plan.source = what_;
        plan.steps.assign(static_cast<std::size_t>(steps), step);
        return run(plan, {want_, scene_}, source_, [](int, const std::shared_ptr<const Data>&) {},
                   {.threads = threads_, .memory = &memory_, .stop = &stop_})
            .seconds;
    }

    int threads_;
    const std::atomic<bool>& stop_;
    mutable MemoryBudget memory_{std::size_t{1} << 24};
    Representation what_;
    Request want_;
    Scene scene_;
    std::shared_ptr<const Transition> nothing_;
    std::shared_ptr<const Data> source_;
};

/// All measurements, a round of each after the other.
class Probe {
 public:
    Probe(int processors, const std::atomic<bool>& stop)
        : sizes_(set_sizes()),
          memory_(static_cast<std::size_t>(2 * sizes_.back())),
          block_(static_cast<std::size_t>(sizes_.back()), &memory_),
          steps_(processors, stop),
          stop_(stop) {
        std::memset(block_.data(), 0, block_.bytes());
        for (const std::int64_t bytes : sizes_) sets_.emplace_back(bytes);
    }

    /// @param limit  [s] since it was made
    void measure(double limit) {
        while (operation_.size() < kLeastRounds ||
               std::chrono::duration<double>(Clock::now() - begin_).count() < limit) {
            if (stop_) throw Cancelled();
            round();
        }
    }

    void write(Profile& profile) const {
        std::vector<SetTimes> times;
        for (const Set& set : sets_) times.push_back(set.times());
        profile.levels = levels_from(times);
        const Level& last = profile.levels.back();
        profile.streamed = last.streamed;
        profile.gather = last.gather;
        for (const char* name : {"levels", "streamed", "gather"})
            profile.spreads[name] = last.spread;
        set(profile, "operation", profile.operation, operation_);
        set(profile, "latency", profile.latency, wake_);
        set(profile, "byte", profile.byte, copy_);
        set(profile, "start", profile.start, start_);
        note(profile.provenance);
    }

 private:
    void round() {
        auto* const block = static_cast<float*>(block_.data());
        const double operations = seconds_of([&] {
            std::int64_t done = 0;
            used_ = kernels::probe_operations(kOperationsAtOnce, done);
            operations_done_ = static_cast<double>(done);
        });
        operation_.push_back(operations / operations_done_);
        for (Set& set : sets_) set.stream(block);
        for (Set& set : sets_) used_ = set.gather(block);
        const std::size_t half = block_.bytes() / 2;
        const std::size_t part = std::min<std::size_t>(half, kStreamedAtOnce / 2);
        auto* const bytes = static_cast<char*>(block_.data());
        copied_ = copied_ + part > half ? 0 : copied_;
        copy_.push_back(
            seconds_of([&] { std::memcpy(bytes + half + copied_, bytes + copied_, part); }) /
            static_cast<double>(part));
        copied_ += part;
        wake_.push_back(echo_.wake_seconds());
        start_.push_back(steps_.step_seconds());
    }

    static void set(Profile& profile, const char* name, double& number,
                    const std::vector<double>& rounds) {
        const Settled found = settled(rounds);
        number = found.value;
        profile.spreads[name] = found.spread;
    }

    void note(std::map<std::string, std::string>& provenance) const {
        const std::string rounds = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}, median of {} rounds",
                                               fmt::gmtime(std::time(nullptr)), operation_.size());
        const std::string sets = fmt::format("one thread, sets of {} KiB to {} MiB",
                                             sizes_.front() >> 10, sizes_.back() >> 20);
        provenance["operation"] =
            fmt::format("measured {}; one thread, arithmetic of samples in vectors", rounds);
        provenance["levels"] = fmt::format(
            "measured {}; {}; read and written in order; samples of a turned grid, dense and one a "
            "line, whose reads do not wait for each other",
            rounds, sets);
        provenance["streamed"] = provenance["gather"] =
            fmt::format("measured {}; {}: the largest level's", rounds, sets);
        provenance["start"] =
            fmt::format("measured {}; steps that do nothing, on all processors", rounds);
        provenance["latency"] =
            fmt::format("derived: a thread wakes another, measured {}; no network was", rounds);
        provenance["byte"] =
            fmt::format("derived: a copy in memory, measured {}, of {} MiB; no network was", rounds,
                        kStreamedAtOnce >> 21);
        for (const char* name : {"local", "global", "congestion"})
            provenance[name] = "guessed: of no machine; where samples are spread over ranks";
    }

    const Clock::time_point begin_ = Clock::now();
    std::vector<std::int64_t> sizes_;
    MemoryBudget memory_;
    Array block_;  // sets are its begin
    std::vector<Set> sets_;
    Echo echo_;
    EmptySteps steps_;
    const std::atomic<bool>& stop_;
    std::vector<double> operation_, copy_, wake_, start_;  // one a round
    std::size_t copied_ = 0;
    double operations_done_ = 0;
    volatile float used_ = 0;  // so that no loop is dropped
};

}  // namespace

void probe_machine(Profile& profile, bool quick, const std::atomic<bool>& stop) {
    Probe probe(profile.processors, stop);
    probe.measure(quick ? 0.4 : 1.5);
    probe.write(profile);
}

void rebase_factors(Profile& profile) {
    std::vector<double> logs;
    for (const auto& [name, curve] : profile.rates.measured())
        for (const Rate& rate : curve) {
            const double loops = rate.counted - rate.apart;
            if (loops > 0)
                logs.push_back(std::log(seconds_of_loops(rate) / loops / profile.factor(name)));
        }
    if (logs.empty()) return;
    const double scale = std::exp(median(logs));
    for (auto& [edge, factor] : profile.factors) factor *= scale;
    profile.factors.try_emplace("*", scale);
}

}  // namespace edgewise
