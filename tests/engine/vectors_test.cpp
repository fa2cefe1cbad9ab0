// Sets of instructions: those that multiply and add at once give the same bytes.
#include "tests/vectors.hpp"

#include <cstddef>
#include <cstring>
#include <gtest/gtest.h>
#include <vector>

#include "engine/prepared.hpp"
#include "planner/profile.hpp"
#include "tests/allocations/paths.hpp"

namespace edgewise {
namespace {

using Bytes = std::vector<std::byte>;

Bytes result_of(const Prepared& plan) {
    Bytes bytes(static_cast<std::size_t>(plan.result().bytes()) *
                static_cast<std::size_t>(plan.frames()));
    plan.run({.into = bytes});
    return bytes;
}

TEST(Vectors, ThatFuseGiveTheSameBytes) {
    constexpr std::int64_t kFusing[] = {HWY_AVX2, HWY_AVX3};
    for (const std::int64_t target : kFusing)
        if (!has_vectors(target)) GTEST_SKIP() << "kernels are compiled for one of them";
    const Catalogue edges = catalogue();
    const Engine engine(edges, default_profile(edges));
    int paths = 0;
    for (const CountedPath& path : counted_paths()) {
        std::vector<Bytes> results;
        for (const std::int64_t target : kFusing) {
            choose_vectors(target);
            results.push_back(result_of(prepare(engine, path.query, path.samples)));
        }
        EXPECT_EQ(results[0], results[1]) << path.name;
        ++paths;
    }
    choose_vectors(0);
    EXPECT_GT(paths, 100);
}

TEST(Vectors, ThatAProcessorLacksAreNamed) {
    EXPECT_EQ(kernels::processor_lacks(), "");
    EXPECT_EQ(kernels::processor_lacks(kernels::compiled_targets()), "");
    const bool is_x86 = HWY_ARCH_X86;
    EXPECT_EQ(kernels::processor_lacks(0).find("EDGEWISE_SIMD=all") != std::string::npos, is_x86);
}

}  // namespace
}  // namespace edgewise
