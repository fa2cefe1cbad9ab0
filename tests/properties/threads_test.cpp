// The same bytes for any number of threads, whatever the path.
#include <cstring>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include "tests/properties/run_request.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

void expect_same_bytes(Job job, Mode mode, const std::vector<std::string>& via = {}) {
    MemoryBudget memory(std::size_t{1} << 30);
    const auto input = std::make_shared<const Data>(make_phantom("gaussians", 24, &memory));
    const Request want =
        request_of(job, mode, input->what, {rotation(25, -40, 10), rotation(0, 30, 0)});
    const Scene scene = scene_of(*input, want, memory);
    const Ask ask{want, scene};
    const Catalogue edges = catalogue();
    Demands demands;
    for (const std::string& word : via) demands.via.push_back(demand_of(word, edges));
    const std::vector<Plan> paths = paths_of(edges, ask, input->what, 100, demands);
    EXPECT_FALSE(paths.empty());
    for (const Plan& path : paths) {
        const auto first = results_of(path, ask, input, 1, memory);
        for (int threads : {2, 7}) {
            const auto other = results_of(path, ask, input, threads, memory);
            for (std::size_t frame = 0; frame < first.size(); ++frame)
                EXPECT_EQ(0, std::memcmp(first[frame]->samples.data(), other[frame]->samples.data(),
                                         static_cast<std::size_t>(first[frame]->what.bytes())))
                    << fmt::format("{} threads, frame {}: {}", threads, frame,
                                   fmt::join(path.texts(), " "));
        }
    }
}

TEST(Threads, DoNotChangeAByteOfAWarp) { expect_same_bytes(Job::warp, Mode::mip); }
TEST(Threads, DoNotChangeAByteOfAPicture) {
    for (const Mode mode : modes()) {
        SCOPED_TRACE(name_of(mode));
        expect_same_bytes(Job::render, mode);
    }
}

TEST(Threads, DoNotChangeAByteOfACompositeInAnyOrder) {
    expect_same_bytes(Job::render, Mode::composite, {"composite", "composite"});
}

}  // namespace
}  // namespace edgewise
