#include "transitions/kernels/kspace.hpp"

#include <algorithm>
#include <cmath>
#include <tbb/parallel_for.h>

#include "transitions/kernels/pmr_block.hpp"

namespace edgewise::kernels {
namespace {

constexpr std::int64_t kTogether = 16;  // lines of a tile

/// Transforms all lines along an axis in place. The origin is the middle of a line: sample
/// n / 2 comes first in the transform, and so does voxel n / 2 of its result.
void transform_axis(Complex* samples, const Extent& n, int axis, std::pmr::memory_resource* memory,
                    const Stop& stop) {
    const std::int64_t length = n[axis];
    if (length == 1) return;
    const std::int64_t steps[] = {1, n.x, n.x * n.y};
    const int a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;  // the other two
    const std::int64_t lines = n[a] * n[b], middle = length / 2;
    const Fourier back = Fourier::along_lines(length, kTogether, true);
    const auto scale = static_cast<float>(1 / static_cast<double>(length));
    tbb::parallel_for(std::int64_t{0}, (lines + kTogether - 1) / kTogether, [&](std::int64_t t) {
        if (stopped(stop)) return;
        Block<Complex> tile(static_cast<std::size_t>(kTogether * length), memory);
        std::fill_n(tile.data(), kTogether * length, Complex{});
        const std::int64_t first = t * kTogether, count = std::min(kTogether, lines - first);
        const auto start = [&](std::int64_t l) {
            const std::int64_t line = first + l;
            return samples + line % n[a] * steps[a] + line / n[a] * steps[b];
        };
        for (std::int64_t i = 0; i < length; ++i)
            for (std::int64_t l = 0; l < count; ++l)
                tile.data()[l * length + (i - middle + length) % length] =
                    start(l)[i * steps[axis]];
        back.run(tile.data());
        for (std::int64_t i = 0; i < length; ++i)
            for (std::int64_t l = 0; l < count; ++l)
                start(l)[i * steps[axis]] =
                    scale * tile.data()[l * length + (i - middle + length) % length];
    });
}

}  // namespace

void volume_of_kspace(const Complex* kspace, const Extent& n, bool magnitude, float* out,
                      std::pmr::memory_resource* memory, const Stop& stop) {
    Block<Complex> samples(static_cast<std::size_t>(n.samples()), memory);
    std::copy_n(kspace, n.samples(), samples.data());
    for (int axis = 0; axis < 3 && !stopped(stop); ++axis)
        transform_axis(samples.data(), n, axis, memory, stop);
    tbb::parallel_for(std::int64_t{0}, n.y * n.z, [&](std::int64_t row) {
        const Complex* from = samples.data() + row * n.x;
        float* to = out + row * n.x;
        for (std::int64_t x = 0; x < n.x; ++x)
            to[x] = magnitude ? std::hypot(from[x].real(), from[x].imag()) : from[x].real();
    });
}

double kspace_operations(const Extent& n) noexcept {
    const double samples = static_cast<double>(n.samples());
    double operations = 10 * samples;
    for (int axis = 0; axis < 3; ++axis)
        operations += samples / static_cast<double>(n[axis]) * fourier_operations(n[axis]);
    return operations;
}

double kspace_scratch(const Extent& n) noexcept {
    const std::int64_t longest = std::max({n.x, n.y, n.z, std::int64_t{1}});
    return static_cast<double>(kTogether * longest) * sizeof(Complex);
}

}  // namespace edgewise::kernels
