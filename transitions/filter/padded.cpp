#include "transitions/filter/padded.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <tbb/parallel_for.h>
#include <type_traits>
#include <vector>

#include "graph/with_type.hpp"
#include "transitions/kernels/neighbourhood.hpp"
#include "transitions/kernels/pmr_block.hpp"
#include "transitions/kernels/scalar_load.hpp"

namespace edgewise {
namespace {

constexpr std::int64_t rounded(std::int64_t n) {
    return (n + kernels::kRowStep - 1) / kernels::kRowStep * kernels::kRowStep;
}

/// Samples of a row that follow one another in memory.
struct Span {
    std::int64_t at;    // in the padded row
    std::int64_t from;  // where the first is read; -1: nowhere, they are 0
    std::int64_t count;
};

/// Where n samples of a padded row come from. Most follow one another: only those beyond the
/// samples jump.
std::vector<Span> spans_of(const std::vector<std::int64_t>& places) {
    std::vector<Span> spans;
    for (std::size_t i = 0; i < places.size(); ++i) {
        const std::int64_t at = places[i];
        if (!spans.empty()) {
            Span& last = spans.back();
            if (at == (last.from < 0 ? -1 : last.from + last.count)) {
                ++last.count;
                continue;
            }
        }
        spans.push_back({static_cast<std::int64_t>(i), at, 1});
    }
    return spans;
}

/// What a row of the padded tile is read by.
template <class T>
class Reader {
 public:
    Reader(const kernels::Grid& grid, int channel) : grid_(grid), channel_(channel) {}

    void row(std::int64_t y, std::int64_t z, const std::vector<Span>& spans, T* to) const {
        if (y < 0 || z < 0) {
            for (const Span& span : spans) std::fill_n(to + span.at, span.count, T{});
            return;
        }
        const std::int64_t first =
            (y * grid_.row_step() + z * grid_.slice_step()) * grid_.channels + channel_;
        if (grid_.type == Type::f16) {
            const auto* from = grid_.as<std::uint16_t>() + first;
            read(
                from, [](std::uint16_t half) { return kernels::float_of_half(half); }, spans, to);
            return;
        }
        with_type(grid_.type, [&](auto type) {
            using Stored = decltype(type);
            read(
                grid_.as<Stored>() + first, [](Stored stored) { return stored; }, spans, to);
        });
    }

 private:
    template <class Stored, class Read>
    void read(const Stored* row, const Read& value_of, const std::vector<Span>& spans,
              T* out) const {
        const int channels = grid_.channels;
        for (const Span& span : spans) {
            T* __restrict to = out + span.at;
            if (span.from < 0) {
                std::fill_n(to, span.count, T{});
                continue;
            }
            const Stored* __restrict from = row + span.from * channels;
            if (channels > 1 || !plain_) {
                for (std::int64_t i = 0; i < span.count; ++i) {
                    const auto stored = value_of(from[i * channels]);
                    if constexpr (std::is_floating_point_v<T>) {
                        to[i] = plain_ ? static_cast<T>(stored)
                                       : static_cast<T>(grid_.values(static_cast<double>(stored)));
                    } else {
                        to[i] = static_cast<T>(stored);
                    }
                }
            } else if constexpr (std::is_same_v<T, Stored>) {
                std::memcpy(to, from, static_cast<std::size_t>(span.count) * sizeof(T));
            } else {
                for (std::int64_t i = 0; i < span.count; ++i)
                    to[i] = static_cast<T>(value_of(from[i]));
            }
        }
    }

    const kernels::Grid& grid_;
    int channel_;
    bool plain_ = grid_.values.identity();
};

std::vector<std::int64_t> places_of(Border border, std::int64_t begin, std::int64_t count,
                                    std::int64_t n) {
    std::vector<std::int64_t> places(static_cast<std::size_t>(count));
    for (std::int64_t i = 0; i < count; ++i)
        places[static_cast<std::size_t>(i)] = bordered(border, begin + i, n);
    return places;
}

/// Rows of a tile's result into the output.
template <class T, class Stored>
void store(const Tile<T>& tile, const Region& box, int channel, double scale, Data& out) {
    const int channels = out.what.channels;
    const Extent n = box.extent();
    for (std::int64_t z = 0; z < n.z; ++z)
        for (std::int64_t y = 0; y < n.y; ++y) {
            const T* from = tile.out_row(y, z);
            Stored* to = out.at<Stored>(box.begin[0], box.begin[1] + y, box.begin[2] + z) + channel;
            if constexpr (std::is_floating_point_v<T>) {
                if (scale != 1) {
                    for (std::int64_t x = 0; x < n.x; ++x)
                        to[x * channels] =
                            static_cast<Stored>(scale * static_cast<double>(from[x]));
                    continue;
                }
            }
            if (channels == 1 && std::is_same_v<T, Stored>) {
                std::memcpy(to, from, static_cast<std::size_t>(n.x) * sizeof(T));
                continue;
            }
            for (std::int64_t x = 0; x < n.x; ++x) to[x * channels] = static_cast<Stored>(from[x]);
        }
}

}  // namespace

TileShape::TileShape(const Neighbourhood& of, const Extent& largest) : tile(largest) {
    const Extent reach = of.extent();
    padded = {tile.x + reach.x - 1, tile.y + reach.y - 1, tile.z + reach.z - 1};
    // Whole vectors behind the last sample are read as well.
    row = rounded(tile.x) + rounded(reach.x - 1);
    // Rows a power of two apart would fall on the same lines of a cache.
    constexpr std::int64_t kApart = 16;
    row += kApart;
    slice = row * padded.y;
}

template <class T>
void run_tiles(const PassRun& run, const TileShape& shape, const TilePass<T>& pass) {
    const Extent whole = run.in.extent;
    const Extent tile = shape.tile;
    const auto count = [](std::int64_t n, std::int64_t of) { return (n + of - 1) / of; };
    const Extent tiles{count(whole.x, tile.x), count(whole.y, tile.y), count(whole.z, tile.z)};
    const std::int64_t out_row = rounded(tile.x), out_slice = out_row * tile.y;
    const auto work = [&](std::int64_t number) {
        run.context.poll();
        const auto channel = static_cast<int>(number % run.in.channels);
        const std::int64_t at = number / run.in.channels;
        Region box;
        const std::array<std::int64_t, 3> place = {at % tiles.x, at / tiles.x % tiles.y,
                                                   at / (tiles.x * tiles.y)};
        for (int axis = 0; axis < 3; ++axis) {
            const auto k = static_cast<std::size_t>(axis);
            box.begin[k] = place[k] * tile[axis];
            box.end[k] = std::min(box.begin[k] + tile[axis], whole[axis]);
        }
        const Extent n = box.extent(), reach = run.of.extent();
        kernels::Block<T> in(static_cast<std::size_t>(shape.values() + 2 * kernels::kRowStep),
                             run.context.memory);
        kernels::Block<T> out(static_cast<std::size_t>(out_slice * tile.z), run.context.memory);
        std::array<std::vector<std::int64_t>, 3> places;
        for (int axis = 0; axis < 3; ++axis) {
            const auto k = static_cast<std::size_t>(axis);
            places[k] = places_of(run.of.border, box.begin[k] + run.of.low[k],
                                  n[axis] + reach[axis] - 1, whole[axis]);
        }
        const Reader<T> reader(run.in, channel);
        const std::vector<Span> spans = spans_of(places[0]);
        for (std::size_t z = 0; z < places[2].size(); ++z)
            for (std::size_t y = 0; y < places[1].size(); ++y) {
                T* to = in.data() + static_cast<std::int64_t>(y) * shape.row +
                        static_cast<std::int64_t>(z) * shape.slice;
                reader.row(places[1][y], places[2][z], spans, to);
                // What vectors read behind a row is defined, so that nothing hangs on it.
                const auto used = static_cast<std::int64_t>(places[0].size());
                std::fill(to + used, to + shape.row, T{});
            }
        const Tile<T> one{shape,
                          n,
                          in.data() - shape.place(run.of.low[0], run.of.low[1], run.of.low[2]),
                          out.data(),
                          out_row,
                          out_slice,
                          run.context.memory};
        pass(one);
        with_type(run.out.what.type, [&](auto type) {
            using Stored = decltype(type);
            if constexpr (std::is_same_v<Stored, T> || std::is_floating_point_v<Stored>)
                store<T, Stored>(one, box, channel, run.of.scale, run.out);
        });
    };
    tbb::parallel_for(std::int64_t{0}, tiles.samples() * run.in.channels, work);
    run.context.poll();
}

template void run_tiles(const PassRun&, const TileShape&, const TilePass<std::uint8_t>&);
template void run_tiles(const PassRun&, const TileShape&, const TilePass<std::int8_t>&);
template void run_tiles(const PassRun&, const TileShape&, const TilePass<std::uint16_t>&);
template void run_tiles(const PassRun&, const TileShape&, const TilePass<std::int16_t>&);
template void run_tiles(const PassRun&, const TileShape&, const TilePass<std::uint32_t>&);
template void run_tiles(const PassRun&, const TileShape&, const TilePass<std::int32_t>&);
template void run_tiles(const PassRun&, const TileShape&, const TilePass<float>&);
template void run_tiles(const PassRun&, const TileShape&, const TilePass<double>&);

Extent tile_for(const Neighbourhood& of, const Extent& whole, std::size_t bytes) {
    const Extent reach = of.extent();
    const std::int64_t wide = bytes == 1 ? 512 : 256;
    Extent tile{wide, 1, 1};
    if (whole.z == 1) {
        tile.y = std::clamp<std::int64_t>(2 * reach.y, 32, 256);
    } else {
        tile.x = 128;
        tile.y = std::clamp<std::int64_t>(reach.y, 16, 64);
        tile.z = std::clamp<std::int64_t>(reach.z, 8, 64);
    }
    for (int axis = 0; axis < 3; ++axis) tile[axis] = std::min(tile[axis], whole[axis]);
    return tile;
}

}  // namespace edgewise
