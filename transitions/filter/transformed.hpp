#pragma once

#include <algorithm>
#include <complex>
#include <cstdint>
#include <memory_resource>

#include "graph/cost.hpp"
#include "transitions/filter/neighbourhood.hpp"
#include "transitions/filter/padded.hpp"
#include "transitions/kernels/fourier.hpp"
#include "transitions/kernels/pmr_block.hpp"

namespace edgewise {

using kernels::Complex;

/// Tiles of a transform: several times as wide as the margin that the kernel reads around them.
struct Blocks {
    Extent tile, transform;

    Blocks(const Neighbourhood& of, const Extent& whole);
    double values() const { return static_cast<double>(transform.samples()); }
    /// Bytes that a thread needs: samples before and after, as they are padded and as f32, and
    /// their spectrum.
    double scratch() const { return (4 + 4 + 2 * 8) * values(); }
};

/// Lines of a tile's transforms, for each sample: each axis there and back reads and writes them.
Lines transform_lines(const Blocks& blocks);
/// Operations of two transforms, 2.5 n log2 n each, and of a complex product, for each sample.
double transform_operations(const Blocks& blocks);

/// A kernel as products with spectra of tiles.
class Transformed {
 public:
    /// @param flat    every place that counts has the weight 1
    /// @param memory  for the kernel's spectrum
    Transformed(const Neighbourhood& of, const Extent& transform, bool flat,
                std::pmr::memory_resource* memory);

    std::size_t values() const { return static_cast<std::size_t>(n_.samples()); }
    std::size_t frequencies() const { return frequencies_; }
    /// Correlates a padded tile with the kernel, in place: sample (0, 0, 0) of the tile comes
    /// first.
    /// @param real      values() of them, x fastest, aligned
    /// @param spectrum  room for frequencies() of them, aligned
    void apply(float* real, Complex* spectrum) const;

 private:
    kernels::Fourier forward_, inverse_;
    Extent n_;
    std::size_t frequencies_;
    mutable kernels::Block<Complex> spectrum_;
};

/// What a tile's transform reads: value(sample) of all samples of the padded tile, 0 behind them.
template <class T, class Value>
void fill_transform(const Tile<T>& tile, const Neighbourhood& of, const Extent& size,
                    const Value& value, float* real) {
    const Extent reach = of.extent(), n = tile.extent;
    const T* first = tile.first(of);
    const std::int64_t wide = n.x + reach.x - 1;
    for (std::int64_t z = 0; z < size.z; ++z)
        for (std::int64_t y = 0; y < size.y; ++y) {
            float* to = real + size.x * (y + size.y * z);
            std::int64_t used = 0;
            if (y < n.y + reach.y - 1 && z < n.z + reach.z - 1) {
                const T* from = first + y * tile.shape.row + z * tile.shape.slice;
                for (; used < wide; ++used) to[used] = value(from[used]);
            }
            std::fill(to + used, to + size.x, 0.0f);
        }
}

}  // namespace edgewise
