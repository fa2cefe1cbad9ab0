#include "transitions/filter/transformed.hpp"

#include <cmath>

namespace edgewise {

Blocks::Blocks(const Neighbourhood& of, const Extent& whole) {
    const Extent reach = of.extent();
    // Small enough for caches of the second level, and not mostly margin.
    const std::int64_t least = whole.z == 1 ? 256 : 64;
    for (int axis = 0; axis < 3; ++axis) {
        if (whole[axis] == 1 && reach[axis] == 1) continue;
        const std::int64_t margin = reach[axis] - 1, side = std::max(least, 3 * margin);
        // Alike along the axes of a volume, which hold few tiles: a last one that is mostly empty
        // would cost as much as the others. Images hold many, and 256 is a fast length.
        const std::int64_t count = (whole[axis] + side - margin - 1) / (side - margin);
        const std::int64_t wanted = whole.z == 1 ? std::min(side, whole[axis] + margin)
                                                 : (whole[axis] + count - 1) / count + margin;
        transform[axis] = kernels::good_length(wanted, axis == 0 ? 2 : 1);
        tile[axis] = std::min(transform[axis] - reach[axis] + 1, whole[axis]);
    }
}

Lines transform_lines(const Blocks& blocks) {
    const Extent& n = blocks.transform;
    const double axes = (n.x > 1) + (n.y > 1) + (n.z > 1), bytes = blocks.values() * sizeof(float);
    return {.count = 2 * 2 * axes * bytes / kLineBytes / static_cast<double>(blocks.tile.samples()),
            .span = 2 * bytes};
}

double transform_operations(const Blocks& blocks) {
    const double n = blocks.values();
    const double all = 5 * n * std::log2(std::max(2.0, n)) + 3 * n + 2 * n;
    return all / static_cast<double>(blocks.tile.samples());
}

Transformed::Transformed(const Neighbourhood& of, const Extent& transform, bool flat,
                         std::pmr::memory_resource* memory)
    : forward_(kernels::Fourier::real_box(transform)),
      inverse_(kernels::Fourier::to_real_box(transform)),
      n_(transform),
      frequencies_(static_cast<std::size_t>((transform.x / 2 + 1) * transform.y * transform.z)),
      spectrum_(frequencies_, memory) {
    const Extent reach = of.extent();
    kernels::Block<float> weights(values(), memory);
    std::fill_n(weights.data(), values(), 0.0f);
    std::size_t at = 0;
    for (std::int64_t z = 0; z < reach.z; ++z)
        for (std::int64_t y = 0; y < reach.y; ++y)
            for (std::int64_t x = 0; x < reach.x; ++x, ++at)
                if (of.counts(of.weights[at]))
                    weights[static_cast<std::size_t>(x + n_.x * (y + n_.y * z))] =
                        flat ? 1 : static_cast<float>(of.weights[at]);
    forward_.run(weights.data(), spectrum_.data());
    const float scale = 1 / static_cast<float>(values());
    for (std::size_t i = 0; i < frequencies_; ++i) spectrum_[i] = scale * std::conj(spectrum_[i]);
}

void Transformed::apply(float* real, Complex* spectrum) const {
    forward_.run(real, spectrum);
    const Complex* by = spectrum_.data();
    for (std::size_t i = 0; i < frequencies_; ++i) {
        const float a = spectrum[i].real(), b = spectrum[i].imag();
        const float c = by[i].real(), d = by[i].imag();
        spectrum[i] = {a * c - b * d, a * d + b * c};
    }
    inverse_.run(spectrum, real);
}

}  // namespace edgewise
