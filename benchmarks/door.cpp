// What the front door costs: the second run of a plan beside its kernels, with what it allocates; a
// query that is copied and changed; a request that is prepared anew; a plan that is seen from
// elsewhere, or gets other samples. Then what second runs of other paths allocate, on one thread
// and on two.
//
//     build/release/bin/door_benchmark [runs]
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <edgewise/edgewise.hpp>
#include <new>
#include <optional>
#include <tbb/global_control.h>
#include <vector>

#include "../tests/allocations/paths.hpp"

using namespace edgewise;

namespace {

std::atomic<long> allocations{0};

double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

template <class Work>
double median_of(int runs, const Work& work) {
    std::vector<double> seconds;
    for (int i = 0; i < runs; ++i) {
        const double begin = now();
        work();
        seconds.push_back(now() - begin);
    }
    std::nth_element(seconds.begin(), seconds.begin() + runs / 2, seconds.end());
    return seconds[static_cast<std::size_t>(runs) / 2];
}

void* counted(std::size_t bytes, std::size_t alignment) noexcept {
    allocations.fetch_add(1, std::memory_order_relaxed);
    return std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
}

void* counted_or_thrown(std::size_t bytes, std::size_t alignment) {
    if (void* block = counted(bytes, alignment)) return block;
    throw std::bad_alloc();
}

constexpr std::size_t kLeast = alignof(std::max_align_t);

Query seen(Mode mode, const char* via = nullptr) {
    Query query;
    query.mode = mode;
    query.geometry.steps = {{GeometryStep::Kind::rotate, {20, 10, 0}}};
    query.geometry.size = OutputSize{.sides = {64, 64}};
    if (via) query.demands.via = {{.name = via}};
    return query;
}

/// What a run allocates when three like it have been.
long allocated(const Prepared& plan, int threads) {
    std::vector<std::byte> result(static_cast<std::size_t>(plan.result().bytes()) *
                                  static_cast<std::size_t>(plan.frames()));
    RunWith with;
    with.threads = threads;
    with.into = result;
    for (int i = 0; i < 3; ++i) plan.run(with);
    const long before = allocations;
    plan.run(with);
    return allocations - before;
}

void count_paths(const Engine& engine) {
    std::printf("\nallocations of a run like one before it, on one thread and on two:\n");
    for (const CountedPath& path : counted_paths()) {
        const Prepared plan = prepare(engine, path.query, path.samples);
        const long one = allocated(plan, 1), two = allocated(plan, 2);
        std::printf("%-32s %6ld %6ld ", path.name.c_str(), one, two);
        for (const std::string& step : plan.plan().texts()) std::printf(" %s", step.c_str());
        std::printf("\n");
    }
}

}  // namespace

// All of them allocate alike, so that each may free what any other made.
[[gnu::noinline]] void* operator new(std::size_t bytes) { return counted_or_thrown(bytes, kLeast); }
[[gnu::noinline]] void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
    return counted(bytes, kLeast);
}
[[gnu::noinline]] void* operator new(std::size_t bytes, std::align_val_t alignment) {
    return counted_or_thrown(bytes, static_cast<std::size_t>(alignment));
}
[[gnu::noinline]] void* operator new(std::size_t bytes, std::align_val_t alignment,
                                     const std::nothrow_t&) noexcept {
    return counted(bytes, static_cast<std::size_t>(alignment));
}
[[gnu::noinline]] void operator delete(void* block) noexcept { std::free(block); }
[[gnu::noinline]] void operator delete(void* block, std::size_t) noexcept { std::free(block); }
[[gnu::noinline]] void operator delete(void* block, std::align_val_t) noexcept { std::free(block); }
[[gnu::noinline]] void operator delete(void* block, std::size_t, std::align_val_t) noexcept {
    std::free(block);
}

namespace {

/// The second run of a picture beside its kernels: the plan's one step, called as the runtime calls
/// it. Both in turn, so that they meet the same machine.
void run_beside_kernels(const Prepared& plan, int runs) {
    std::vector<std::byte> picture(static_cast<std::size_t>(plan.result().bytes()));
    RunWith with;
    with.into = picture;
    const Planned& planned = plan.planned();
    const Step& last = plan.plan().steps.back();
    Data out = Data::make(last.offer.to, planned.memory.get());
    const std::atomic<bool> stop = false;
    const auto kernels = [&] {
        Context context{planned.memory.get(), &stop, &stop, 0};
        last.by->run(last.offer, planned.ask(), *planned.input.data, out,
                     Region::all(out.what.extent), context);
    };
    plan.run(with);
    const long before = allocations;
    plan.run(with);
    const long once = allocations - before;
    std::printf("plan: %s, %s\n", last.text().c_str(),
                text_of(out.what.extent, out.what.axes).c_str());
    std::vector<double> whole, alone, beside;
    for (int i = 0; i < runs; ++i) {
        whole.push_back(median_of(1, [&] { plan.run(with); }));
        alone.push_back(median_of(1, kernels));
        beside.push_back(whole.back() - alone.back());
    }
    const auto middle = [](std::vector<double>& all) {
        std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2),
                         all.end());
        return 1e6 * all[all.size() / 2];
    };
    std::printf("run: %.1f us, kernels alone %.1f us, beside them %.1f us\n", middle(whole),
                middle(alone), middle(beside));
    std::printf("allocations of a second run: %ld\n", once);
}

}  // namespace

int main(int count, char** words) {
    const int runs = count > 1 ? std::atoi(words[1]) : 2000;
    Query query = seen(Mode::mip, "project.ray_cast");
    query.threads = 1;
    const Engine engine = default_engine();
    const Volume volume = Volume::read("phantom:gaussians:64");
    const Prepared plan = prepare(engine, query, volume);
    Query small = query;
    small.geometry.size = OutputSize{.sides = {4, 4}};
    // On one thread, as the query says.
    std::optional<tbb::global_control> one(std::in_place,
                                           tbb::global_control::max_allowed_parallelism, 1);
    run_beside_kernels(plan, runs);
    run_beside_kernels(prepare(engine, small, Volume::read("phantom:gaussians:16")), runs);
    std::printf("query copied and changed: %.2f us\n", 1e6 * median_of(runs, [&] {
                                                           Query other = query;
                                                           other.max_error = 0.01;
                                                       }));
    // Of samples in memory, whose facts are kept; with a limit of the error a preview is one.
    const auto samples = plan.planned().input.data;
    const Volume held = Volume::around(samples->samples.data(), samples->what.extent, 3, 1,
                                       samples->what.type, samples);
    Query limited = query;
    limited.max_error = 0.02;
    prepare(engine, limited, held);
    std::printf("prepared anew: %.2f ms, with a limit of the error %.2f ms\n",
                1e3 * median_of(50, [&] { prepare(engine, query, held); }),
                1e3 * median_of(50, [&] { prepare(engine, limited, held); }));
    GeometrySpec views = query.geometry;
    std::printf("seen from elsewhere: %.2f ms\n", 1e3 * median_of(50, [&] {
                                                      views.steps[0].numbers[1] += 1;
                                                      plan.with_views(views);
                                                  }));
    std::printf("other samples: %.2f ms\n", 1e3 * median_of(50, [&] { plan.with_input(samples); }));
    one.reset();
    count_paths(engine);
    return 0;
}
