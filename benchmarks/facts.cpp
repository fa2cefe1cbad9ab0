// What the facts of data take, beside reading them from a file that is in memory already, and
// beside copying the samples once:
//   facts_benchmark FILE... prints milliseconds, the least of 25 runs, and the share of reading.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <fmt/format.h>
#include <functional>
#include <memory_resource>
#include <nlohmann/json.hpp>
#include <string>
#include <tbb/parallel_for.h>

#include "engine/facts/facts_json.hpp"
#include "engine/facts/folder_facts.hpp"
#include "graph/hash.hpp"
#include "request/input.hpp"

namespace {

using namespace edgewise;
using Clock = std::chrono::steady_clock;

double least(const std::function<void()>& run) {
    double milliseconds = HUGE_VAL;
    for (int i = 0; i < 25; ++i) {
        const auto begin = Clock::now();
        run();
        milliseconds = std::min(
            milliseconds, std::chrono::duration<double, std::milli>(Clock::now() - begin).count());
    }
    return milliseconds;
}

void print(const std::string& what, double took, double reading) {
    fmt::print("  {:24} {:9.2f} ms {:7.2f} %\n", what, took, 100 * took / reading);
}

/// From memory to memory on all threads: what moves all samples once cannot take much less.
double copying(const Data& data, std::pmr::memory_resource* memory) {
    constexpr std::size_t kParts = 16;
    Array copy(data.samples.bytes(), memory);
    const auto* from = static_cast<const std::byte*>(data.samples.data());
    auto* to = static_cast<std::byte*>(copy.data());
    return least([&] {
        tbb::parallel_for(std::size_t{0}, kParts, [&](std::size_t part) {
            const std::size_t begin = copy.bytes() * part / kParts;
            std::memcpy(to + begin, from + begin, copy.bytes() * (part + 1) / kParts - begin);
        });
    });
}

void measure(const std::string& file) {
    auto* memory = std::pmr::new_delete_resource();
    Input input = inspected(file, {});
    const double reading = least([&] {
        input.data.reset();
        read_data(input, memory);
    });
    const Data& data = *input.data;
    fmt::print("{}\n", file);
    print("reading", reading, reading);
    print("copying", copying(data, memory), reading);
    Statistics statistics;
    print("statistics", least([&] { statistics = statistics_of(data, memory); }), reading);
    print("histogram", least([&] { histogram_of(data, statistics); }), reading);
    RadialPower power;
    print("spectrum",
          least([&] { power = measure_radial_power(data, statistics.occupied, memory); }), reading);
    FolderFacts facts("/tmp/edgewise_facts");
    const FactKey spectrum{"spectrum", file, file, "1"}, numbers{"statistics", file, file, "1"};
    const auto keep_spectrum = [&] { return facts.keep(spectrum, json_of(power).dump()); };
    const auto found = [&](const FactKey& key) {
        return nlohmann::json::parse(facts.find(key).value());
    };
    if (keep_spectrum()) {
        print("keeping a spectrum", least(keep_spectrum), reading);
        print("finding a spectrum", least([&] { read(found(spectrum), power); }), reading);
        facts.keep(numbers, json_of(statistics).dump());
        print("finding statistics", least([&] { read(found(numbers), statistics); }), reading);
    }
    volatile std::uint64_t keep = 0;
    print("hashing all samples", least([&] {
              Hash hash;
              hash.add(data.samples.data(), static_cast<std::size_t>(data.what.bytes()));
              keep = hash.value();
          }),
          reading);
    static_cast<void>(keep);
}

}  // namespace

int main(int argc, char** argv) {
    for (int i = 1; i < argc; ++i) measure(argv[i]);
    return 0;
}
