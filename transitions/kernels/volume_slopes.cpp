#include "transitions/kernels/volume_slopes.hpp"

#include <algorithm>
#include <tbb/parallel_for.h>

#include "transitions/kernels/load_values.hpp"
#include "transitions/kernels/pmr_block.hpp"
#include "transitions/kernels/spline_prefilter.hpp"

namespace edgewise::kernels {
namespace {

/// Lines of n samples, side by side: sample i of line l is first[i * stride + l].
struct Lines {
    float* first;
    std::int64_t n, stride, count;
};

/// Half the difference of both neighbours, in place.
/// @param mirrored  beyond the ends; else the outermost samples continue
/// @param before    room for one sample of each line
void differences(const Lines& lines, bool mirrored, float* before) {
    const std::int64_t count = lines.count;
    if (lines.n == 1 || (mirrored && lines.n == 2)) {
        for (std::int64_t i = 0; i < lines.n; ++i)
            std::fill_n(lines.first + i * lines.stride, count, 0.0F);
        return;
    }
    const float* const second = lines.first + lines.stride;
    std::copy_n(mirrored ? second : lines.first, count, before);
    for (std::int64_t i = 0; i < lines.n; ++i) {
        float* const here = lines.first + i * lines.stride;
        const bool last = i + 1 == lines.n;
        const float* const after = last ? here : here + lines.stride;
        for (std::int64_t l = 0; l < count; ++l) {
            // Of a mirrored last sample both neighbours are the one before it.
            const float behind = last && mirrored ? before[l] : after[l];
            const float kept = here[l];
            here[l] = 0.5F * (behind - before[l]);
            before[l] = kept;
        }
    }
}

/// The lines along an axis in parts that may be worked on at once.
struct Parts {
    std::int64_t count;
    std::int64_t step;  // from the first sample of a part to that of the next
    Lines lines;        // of the first part
};

Parts parts_along(const Extent& n, int axis, float* out) {
    if (axis == 0) return {n.y * n.z, n.x, {out, n.x, 1, 1}};
    if (axis == 1) return {n.z, n.x * n.y, {out, n.y, n.x, n.x}};
    return {n.y, n.x, {out, n.z, n.x * n.y, n.x}};
}

void prefilter_along(const Extent& n, int axis, float* out) {
    if (axis == 2) return spline_prefilter(out, {1, 1, n.z}, static_cast<int>(n.x * n.y));
    const Parts parts = parts_along(n, axis, out);
    tbb::parallel_for(std::int64_t{0}, parts.count, [&](std::int64_t part) {
        float* const first = out + part * parts.step;
        if (axis == 0)
            spline_prefilter(first, {n.x, 1, 1});
        else
            spline_prefilter(first, {1, n.y, 1}, static_cast<int>(n.x));
    });
}

}  // namespace

void volume_slopes(const Grid& volume, int axis, SlopesOf by, double subtract, float* out,
                   std::pmr::memory_resource* memory, const Stop& stop) {
    const Extent& n = volume.extent;
    tbb::parallel_for(std::int64_t{0}, n.y * n.z, [&](std::int64_t row) {
        if (stopped(stop)) return;
        Block<double> values(static_cast<std::size_t>(n.x), memory);
        load_values(volume, row * n.x, n.x, subtract, values.data());
        std::copy_n(values.data(), n.x, out + row * n.x);
    });
    if (stopped(stop)) return;
    const bool spline = by == SlopesOf::spline;
    if (spline) prefilter_along(n, axis, out);
    const Parts parts = parts_along(n, axis, out);
    tbb::parallel_for(std::int64_t{0}, parts.count, [&](std::int64_t part) {
        if (stopped(stop)) return;
        Block<float> before(static_cast<std::size_t>(parts.lines.count), memory);
        Lines lines = parts.lines;
        lines.first += part * parts.step;
        differences(lines, spline, before.data());
    });
}

}  // namespace edgewise::kernels
