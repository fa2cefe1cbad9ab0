// What the front door costs: the second run of a plan beside its kernels, with what it allocates; a
// query that is copied and changed; a request that is prepared anew; a plan that is seen from
// elsewhere, or gets other samples.
//
//     build/release/bin/door_benchmark [runs]
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <edgewise/edgewise.hpp>
#include <new>
#include <tbb/global_control.h>
#include <vector>

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

}  // namespace

[[gnu::noinline]] void* operator new(std::size_t bytes) {
    allocations.fetch_add(1, std::memory_order_relaxed);
    if (void* block = std::malloc(bytes)) return block;
    throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* block) noexcept { std::free(block); }
[[gnu::noinline]] void operator delete(void* block, std::size_t) noexcept { std::free(block); }

int main(int count, char** words) {
    const int runs = count > 1 ? std::atoi(words[1]) : 2000;
    Query query;
    query.mode = Mode::mip;
    query.geometry.steps = {{GeometryStep::Kind::rotate, {20, 10, 0}}};
    query.geometry.size = OutputSize{.sides = {64, 64}};
    query.threads = 1;
    const Engine engine = default_engine();
    const Volume volume = Volume::read("phantom:gaussians:64");
    const Prepared plan = prepare(engine, query, volume);
    std::vector<float> picture(64 * 64);
    RunWith with;
    with.into = std::as_writable_bytes(std::span(picture));

    // The kernels alone: the last step of the plan, called as the runtime calls it.
    const Planned& planned = plan.planned();
    const Step& last = plan.plan().steps.back();
    const bool alone = plan.plan().steps.size() == 1;
    Data out = Data::make(last.offer.to, planned.memory.get());
    const std::atomic<bool> stop = false;
    // On one thread, as the query says.
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const auto kernels = [&] {
        Context context{planned.memory.get(), &stop, &stop, 0};
        last.by->run(last.offer, planned.ask(), *planned.input.data, out,
                     Region::all(out.what.extent), context);
    };
    const auto run = [&] { plan.run(with); };
    run();
    const long before = allocations;
    run();
    const long once = allocations - before;
    const double whole = median_of(runs, run);
    std::printf("plan: %s\n", plan.plan().texts().back().c_str());
    if (alone)
        std::printf("run: %.1f us, kernels alone %.1f us\n", 1e6 * whole,
                    1e6 * median_of(runs, kernels));
    else
        std::printf("run: %.1f us\n", 1e6 * whole);
    std::printf("allocations of a second run: %ld\n", once);
    std::printf("query copied and changed: %.2f us\n", 1e6 * median_of(runs, [&] {
                                                           Query other = query;
                                                           other.max_error = 0.01;
                                                       }));
    std::printf("prepared anew: %.2f ms\n",
                1e3 * median_of(50, [&] { prepare(engine, query, volume); }));
    GeometrySpec views = query.geometry;
    std::printf("seen from elsewhere: %.2f ms\n", 1e3 * median_of(50, [&] {
                                                      views.steps[0].numbers[1] += 1;
                                                      plan.with_views(views);
                                                  }));
    const auto samples = planned.input.data;
    std::printf("other samples: %.2f ms\n", 1e3 * median_of(50, [&] { plan.with_input(samples); }));
    return 0;
}
