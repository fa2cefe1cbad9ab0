// Prints the best set of instructions that this processor has, of those that kernels are compiled
// for.
#include <cstdio>
#include <hwy/targets.h>

int main() {
    const auto has = hwy::SupportedTargets();
    std::fputs(has & HWY_AVX3   ? "avx3"
               : has & HWY_AVX2 ? "avx2"
               : has & HWY_SSE4 ? "sse4"
                                : "static",
               stdout);
    return 0;
}
