#pragma once

#include <atomic>
#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <set>
#include <tbb/parallel_for.h>
#include <thread>
#include <vector>

#include "planner/planner.hpp"
#include "runtime/runtime.hpp"

namespace edgewise::toys {

/// Ends the process where a test hangs: a lost node would otherwise wait for ever.
class Watchdog {
 public:
    explicit Watchdog(int seconds)
        : thread_([this, seconds] {
              std::unique_lock lock(mutex_);
              if (!wake_.wait_for(lock, std::chrono::seconds(seconds), [&] { return done_; })) {
                  std::fprintf(stderr, "hangs: nothing for %d s\n", seconds);
                  std::abort();
              }
          }) {}
    ~Watchdog() {
        {
            const std::lock_guard lock(mutex_);
            done_ = true;
        }
        wake_.notify_all();
        thread_.join();
    }

 private:
    std::mutex mutex_;
    std::condition_variable wake_;
    bool done_ = false;
    std::thread thread_;
};

/// Waits for tasks of its own, as a kernel does.
inline void busy_in_parallel() {
    std::atomic<int> done = 0;
    tbb::parallel_for(0, 1000, [&](int) { ++done; });
}

using Frames = std::map<int, std::vector<float>>;

/// A job of three steps over many frames: prepared once, turned for each of a few variants, summed
/// along z for every frame. Each step has a second edge that does the same and costs more, so that
/// a failed one can be replaced.
class ToyJob {
 public:
    Extent extent{16, 8, 12};
    int frames = 12, variants = 4;
    double wrong_scratch = 0;  // bytes that toy.sum takes and does not declare
    double scratch = 0;        // bytes that toy.sum takes and declares
    Request want;
    Scene scene;
    Catalogue catalogue;
    MemoryBudget memory{std::size_t{1} << 30};
    std::shared_ptr<Data> source;

    ToyJob(int frame_count, int variant_count) : frames(frame_count), variants(variant_count) {
        want.job = Job::warp;
        want.frames = frames;
        want.input = extent;
        want.screen = {extent.x, extent.y, 1};
        want.views = moved(frames);
        for (const char* suffix : {"", "_again"}) {
            catalogue.push_back(prepare(std::string("toy.prepare") + suffix));
            catalogue.push_back(turn(std::string("toy.turn") + suffix));
            catalogue.push_back(sum(std::string("toy.sum") + suffix));
        }
    }

    Ask ask() const { return {want, scene}; }

    void load() {
        Representation what;
        what.extent = extent;
        source = std::make_shared<Data>(Data::make(what, &memory));
        for (std::int64_t i = 0; i < what.samples(); ++i) source->as<float>()[i] = value(i);
    }

    /// Magnitudes from 1e-4 to 1e4: the order of a float sum shows in its last bits.
    static float value(std::int64_t i) {
        const std::int64_t mixed = (i * 7919 + 13) % 1009;
        return static_cast<float>((mixed % 2 ? 1 : -1) * std::pow(10.0, mixed % 9 - 4) *
                                  (1 + mixed / 1009.0));
    }

    Plan plan(const Demands& demands = {}) const {
        PlanOptions options;
        options.demands = demands;
        const Answer answer =
            edgewise::plan(catalogue, ask(), {{source->what}}, Profile{}, options);
        if (!answer.plan) throw std::logic_error(answer.problem);
        return *answer.plan;
    }

    /// Runs it; what was delivered stays in `delivered` whatever happens.
    Outcome run(const Plan& planned, RunOptions options) {
        delivered.clear();
        options.memory = &memory;
        return edgewise::run(
            planned, ask(), source,
            [&](int frame, std::shared_ptr<const Data> result) {
                const float* samples = result->as<float>();
                const bool fresh =
                    delivered.try_emplace(frame, samples, samples + result->what.samples()).second;
                if (!fresh) throw std::logic_error("a frame was delivered twice");
            },
            options);
    }
    Outcome run(const Plan& planned, int threads) {
        RunOptions options;
        options.threads = threads;
        return run(planned, options);
    }
    Frames delivered;

    /// Asks the planner for what is left without the edges that failed so far.
    auto replanner() {
        return [this, without = std::vector<Demand>()](
                   const std::string& failed, const std::string&,
                   const std::vector<Representation>& held) mutable -> std::optional<Plan> {
            without.push_back(demand_of(failed, catalogue));
            PlanOptions options;
            options.demands.without = without;
            std::vector<Source> sources;
            for (const Representation& what : held) sources.push_back({what});
            return edgewise::plan(catalogue, ask(), sources, Profile{}, options).plan;
        };
    }

    /// The answer in f64, one loop, without edges.
    std::vector<double> expected(int frame) const {
        std::vector<double> all(extent.x * extent.y);
        for (std::int64_t z = 0; z < extent.z; ++z)
            for (std::size_t i = 0; i < all.size(); ++i) {
                const double prepared = 2.0 * value(z * all.size() + i);
                all[i] += prepared * (1 + frame % variants) + frame;
            }
        return all;
    }

 private:
    Placement moved(int different) const {
        std::vector<Mat4> maps(frames, Mat4::Identity());
        for (int view = 0; view < frames; ++view) maps[view](0, 3) = view % different;
        return Placement::each(maps);
    }

    static double price(const std::string& name) { return name.ends_with("_again") ? 1e6 : 1e3; }

    template <class PerSample>
    static void each_sample(const Data& in, Data& out, const Region& region, PerSample body) {
        const Extent& e = out.what.extent;
        const std::int64_t begin = region.begin[2] * e.x * e.y, end = region.end[2] * e.x * e.y;
        for (std::int64_t i = begin; i < end; ++i) out.as<float>()[i] = body(in.as<float>()[i]);
    }

    Transition pointwise(std::string name, std::string from, std::string to) const {
        Transition edge{.name = std::move(name), .joins = {{from + "/scalar", to + "/scalar"}}};
        edge.work = [cost = price(edge.name)](const Offer&, const Ask&, int) {
            return Work{.operations = cost};
        };
        edge.parts = [](const Offer&, const Ask&) {
            return Partition{.kind = Partition::output, .leaf = {16, 8, 2}};
        };
        return edge;
    }

    Transition prepare(std::string name) const {
        Transition edge = pointwise(std::move(name), "object", "prepared");
        edge.offer = [](const Representation& from, const Ask&, const Parameters&) {
            Offer offer{.from = from, .to = from};
            offer.to.space = "prepared";
            return offer;
        };
        edge.run = [](const Offer&, const Ask&, const Data& in, Data& out, const Region& region,
                      Context& context) {
            context.poll();
            each_sample(in, out, region, [](float v) { return 2 * v; });
        };
        return edge;
    }

    Transition turn(std::string name) const {
        Transition edge = pointwise(std::move(name), "prepared", "turned");
        edge.offer = [placed = moved(variants)](const Representation& from, const Ask&,
                                                const Parameters&) {
            Offer offer{.from = from, .to = from};
            offer.to.space = "turned";
            offer.to.placed = placed;
            return offer;
        };
        edge.run = [](const Offer& offer, const Ask&, const Data& in, Data& out,
                      const Region& region, Context& context) {
            const double by = 1 + offer.to.placed.at(context.view).matrix()(0, 3);
            each_sample(in, out, region, [by](float v) { return static_cast<float>(v * by); });
        };
        return edge;
    }

    /// Each region of the input gives the sum of its own slices; parts add up in floats.
    Transition sum(std::string name) const {
        Transition edge{.name = std::move(name), .joins = {{"turned/scalar", "screen/scalar"}}};
        edge.offer = [](const Representation& from, const Ask& ask, const Parameters&) {
            return Offer{.from = from, .to = screen_scalar(from, ask.want)};
        };
        edge.work = [this, cost = price(edge.name)](const Offer&, const Ask&, int) {
            return Work{.operations = cost, .scratch = scratch};
        };
        edge.parts = [](const Offer&, const Ask&) {
            return Partition{.kind = Partition::input,
                             .leaf = {16, 8, 1},
                             .merge = [](Data& into, const Data& from) {
                                 for (std::int64_t i = 0; i < into.what.samples(); ++i)
                                     into.as<float>()[i] += from.as<float>()[i];
                             }};
        };
        edge.run = [this, first = !edge.name.ends_with("_again")](
                       const Offer& offer, const Ask&, const Data& in, Data& out,
                       const Region& region, Context& context) {
            const Array taken(scratch + (first ? wrong_scratch : 0), context.memory);
            const std::int64_t plane = offer.to.samples();
            float* sums = out.as<float>();
            std::fill_n(sums, plane, 0.f);
            for (std::int64_t z = region.begin[2]; z < region.end[2]; ++z) {
                context.poll();
                for (std::int64_t i = 0; i < plane; ++i)
                    sums[i] += in.as<float>()[z * plane + i] + static_cast<float>(context.view);
            }
        };
        return edge;
    }
};

}  // namespace edgewise::toys
