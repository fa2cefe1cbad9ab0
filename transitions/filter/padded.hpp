#pragma once

#include <array>
#include <concepts>
#include <cstdint>

#include "graph/data.hpp"
#include "graph/transition.hpp"
#include "transitions/filter/neighbourhood.hpp"
#include "transitions/kernels/grid.hpp"

namespace edgewise {

/// How tiles of a pass lie in memory: so many samples, with those that the pass reads around them.
struct TileShape {
    Extent tile;              // of the largest
    Extent padded;            // with the samples around it
    std::int64_t row, slice;  // values from one row and slice of the padded tile to the next

    TileShape(const Neighbourhood& of, const Extent& largest);
    /// Tiles that are read where the input has them.
    TileShape(const Neighbourhood& of, const Extent& largest, const kernels::Grid& in);
    std::int64_t values() const noexcept { return slice * padded.z; }
    /// From a sample of the tile to the one that place k of the neighbourhood reads.
    std::ptrdiff_t place(std::int64_t kx, std::int64_t ky, std::int64_t kz) const noexcept {
        return kx + ky * row + kz * slice;
    }
};

/// A function of the caller's, which lives longer than the call that it is handed to: unlike
/// std::function it keeps nothing, and allocates nothing.
template <class... Args>
class Borrowed {
 public:
    template <class F>
    requires(!std::same_as<F, Borrowed>)
        Borrowed(const F& function)  // NOLINT: lambdas are handed over as they are
        : function_(&function),
          call_([](const void* of, Args... args) { (*static_cast<const F*>(of))(args...); }) {}
    void operator()(Args... args) const { call_(function_, args...); }

 private:
    const void* function_;
    void (*call_)(const void*, Args...);
};

/// Row y of slice z of a padded tile, from 0 on.
template <class T>
using ReadRow = Borrowed<std::int64_t, std::int64_t, T*>;

/// One tile of one channel: what a pass reads and writes.
template <class T>
struct Tile {
    const TileShape& shape;  // one of two, see TileReads
    Extent extent;           // of this one, at most shape.tile
    const T* in;  // sample (0, 0, 0) of the tile; samples around it are at places below and above
    T* out;       // likewise; no more than the extent is written
    std::int64_t row, slice;  // of out
    std::pmr::memory_resource* memory;
    /// With TileReads::rows, in place of `in`.
    const ReadRow<T>* read = nullptr;

    const T* in_row(std::int64_t y, std::int64_t z) const noexcept {
        return in + y * shape.row + z * shape.slice;
    }
    T* out_row(std::int64_t y, std::int64_t z) const noexcept { return out + y * row + z * slice; }
    /// The first value of the padded tile.
    const T* first(const Neighbourhood& of) const noexcept {
        return in + shape.place(of.low[0], of.low[1], of.low[2]);
    }
};

/// A pass over samples.
struct PassRun {
    const Neighbourhood& of;
    kernels::Grid in;  // its value map is applied when samples are read
    Data& out;         // of in's extent and channels
    const Parameters& with;
    Context& context;
    bool finite = false;  // no sample is NaN or infinite, as far as is known
};

template <class T>
using TilePass = Borrowed<const Tile<T>&>;

/// Where the samples of a tile are read.
enum class TileReads {
    copies,  // from a copy of it, with samples around it: all tiles are of one shape
    /// In the input, and out to the result, without a copy, where types allow it and all samples
    /// around the tile are there. Tiles are then of one of two shapes.
    in_place,
    /// The same, and of inputs with long rows what is too near to an end makes tiles of its own.
    /// For passes whose work is in proportion to a tile.
    in_place_but_frames,
    /// Row by row when the pass asks for them, out to the result as above.
    rows
};

/// Works off all tiles of all channels, in parallel, and scales and stores what comes of them.
/// T: the type in which samples are read; that of `out`, or a floating type
template <class T>
void run_tiles(const PassRun& run, const TileShape& shape, const TilePass<T>& pass,
               TileReads reads = TileReads::copies);

/// Whether tiles in the middle of the input are read there, of samples of type T.
template <class T>
bool reads_in_place(const PassRun& run, TileReads reads) noexcept;

/// A tile that suits caches: `bytes` a value.
Extent tile_for(const Neighbourhood& of, const Extent& whole, std::size_t bytes);

}  // namespace edgewise
