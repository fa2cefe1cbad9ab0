// The README's piece of C++, between these lines, as a program: an X-ray of the sphere phantom,
// whose centre is known.
#include <cmath>
#include <cstdio>

#include "planner/planner.hpp"
#include "reference/phantoms.hpp"
#include "runtime/runtime.hpp"
#include "scene/scene.hpp"
#include "transitions/catalogue.hpp"

namespace {

float centre = 0;
void show(int /*frame*/, const float* picture) { centre = picture[32 * 64 + 32]; }

}  // namespace

int main() {
    using namespace edgewise;
#include "snippet.inc"
    // 1 in the middle, 0 at a radius of 16: the integral through the middle is 16.
    std::printf("centre %.3f\n", centre);
    return std::abs(centre - 16) < 0.5f ? 0 : 1;
}
