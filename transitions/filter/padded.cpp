#include "transitions/filter/padded.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <tbb/parallel_for.h>
#include <type_traits>

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

/// Where samples `begin` ... of a padded row come from, of an axis of n. Most follow one another:
/// only those beyond the axis jump.
SmallVector<Span> spans_of(Border border, std::int64_t begin, std::int64_t count, std::int64_t n) {
    SmallVector<Span> spans;
    const auto beyond = [&](std::int64_t from, std::int64_t to) {
        for (std::int64_t i = from; i < to; ++i) {
            const std::int64_t at = bordered(border, begin + i, n);
            if (!spans.empty()) {
                Span& last = spans.back();
                if (at == (last.from < 0 ? -1 : last.from + last.count)) {
                    ++last.count;
                    continue;
                }
            }
            spans.push_back({i, at, 1});
        }
    };
    const std::int64_t first = std::clamp<std::int64_t>(-begin, 0, count);
    const std::int64_t last = std::clamp<std::int64_t>(n - begin, first, count);
    beyond(0, first);
    if (last > first) spans.push_back({first, begin + first, last - first});
    beyond(last, count);
    return spans;
}

/// What a row of the padded tile is read by.
template <class T>
class Reader {
 public:
    Reader(const kernels::Grid& grid, int channel) : grid_(grid), channel_(channel) {}

    void row(std::int64_t y, std::int64_t z, const SmallVector<Span>& spans, T* to) const {
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
    void read(const Stored* row, const Read& value_of, const SmallVector<Span>& spans,
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

/// Which rows, or slices, of an axis of n.
SmallVector<std::int64_t> places_of(Border border, std::int64_t begin, std::int64_t count,
                                    std::int64_t n) {
    SmallVector<std::int64_t> places(static_cast<std::size_t>(count));
    for (std::int64_t i = 0; i < count; ++i) {
        const std::int64_t at = begin + i;
        places[static_cast<std::size_t>(i)] = at >= 0 && at < n ? at : bordered(border, at, n);
    }
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
    // Rows begin alike to lines of a cache. A power of two apart they would fall on the same ones.
    constexpr std::int64_t kAlike = 64, kApart = 16;
    row = (padded.x + kAlike - 1) / kAlike * kAlike + kApart;
    slice = row * padded.y;
}

TileShape::TileShape(const Neighbourhood& of, const Extent& largest, const kernels::Grid& in)
    : TileShape(of, largest) {
    row = in.row_step();
    slice = in.slice_step();
}

template <class T>
constexpr Type type_of() {
    if (std::is_same_v<T, std::uint8_t>) return Type::u8;
    if (std::is_same_v<T, std::int8_t>) return Type::i8;
    if (std::is_same_v<T, std::uint16_t>) return Type::u16;
    if (std::is_same_v<T, std::int16_t>) return Type::i16;
    if (std::is_same_v<T, std::uint32_t>) return Type::u32;
    if (std::is_same_v<T, std::int32_t>) return Type::i32;
    return std::is_same_v<T, float> ? Type::f32 : Type::f64;
}

template <class T>
bool reads_in_place(const PassRun& run, TileReads reads) noexcept {
    return reads != TileReads::copies && reads != TileReads::rows && run.in.type == type_of<T>() &&
           run.in.channels == 1 && run.in.values.identity();
}

namespace {

/// A piece of an axis.
struct Piece {
    std::int64_t begin, end;
    bool is_inside;  // all samples around it are there
};

/// An axis of n samples in pieces of at most `most`.
/// @param low,high  where neighbourhoods end
/// @param apart     those that end beyond the input are pieces of their own
SmallVector<Piece> pieces_of(std::int64_t n, std::int64_t low, std::int64_t high, std::int64_t most,
                             bool apart) {
    SmallVector<Piece> pieces;
    const auto add = [&](std::int64_t begin, std::int64_t end) {
        for (; begin < end; begin += most) {
            const std::int64_t stop = std::min(begin + most, end);
            pieces.push_back({begin, stop, begin + low >= 0 && stop - 1 + high < n});
        }
    };
    const std::int64_t first = apart ? std::clamp<std::int64_t>(-low, 0, n) : 0;
    const std::int64_t last = apart ? n - std::clamp<std::int64_t>(high, 0, n) : n;
    if (first >= last) {
        add(0, n);
        return pieces;
    }
    add(0, first);
    add(first, last);
    add(last, n);
    return pieces;
}

/// All tiles of a pass.
class Tiles {
 public:
    Tiles(const PassRun& run, const Extent& tile, bool apart) {
        for (int axis = 0; axis < 3; ++axis) {
            const auto k = static_cast<std::size_t>(axis);
            pieces_[k] =
                pieces_of(run.in.extent[axis], run.of.low[k], run.of.high[k], tile[axis], apart);
        }
    }
    std::int64_t count() const noexcept {
        return static_cast<std::int64_t>(pieces_[0].size() * pieces_[1].size() * pieces_[2].size());
    }
    /// @param inside  whether all samples around the tile are there
    Region tile(std::int64_t number, bool& inside) const {
        Region box;
        inside = true;
        auto left = static_cast<std::size_t>(number);
        for (std::size_t k = 0; k < 3; ++k) {
            const Piece& piece = pieces_[k][left % pieces_[k].size()];
            left /= pieces_[k].size();
            box.begin[k] = piece.begin, box.end[k] = piece.end;
            inside = inside && piece.is_inside;
        }
        return box;
    }

 private:
    std::array<SmallVector<Piece>, 3> pieces_;
};

/// Works off one tile after another, in one thread of several.
template <class T>
class TileWork {
 public:
    TileWork(const PassRun& run, const TileShape& shape, const TilePass<T>& pass, TileReads reads)
        : run_(run),
          shape_(shape),
          inside_(run.of, shape.tile, run.in),
          pass_(pass),
          reads_(reads),
          reads_in_place_(reads_in_place<T>(run, reads)),
          writes_in_place_(reads != TileReads::copies && run.out.what.type == type_of<T>() &&
                           run.out.what.channels == 1) {}

    void work(const Region& box, int channel, bool inside) const {
        if (reads_ == TileReads::rows) {
            const RowReader rows(run_, box, channel);
            const auto read_row = [&](std::int64_t y, std::int64_t z, T* to) {
                rows.row(y, z, to);
            };
            const ReadRow<T> read = read_row;
            Tile<T> tile{shape_, box.extent(), nullptr, nullptr, 0, 0, run_.context.memory, &read};
            return pass_to(tile, box, channel);
        }
        const bool copies = !(inside && reads_in_place_);
        const TileShape& shape = copies ? shape_ : inside_;
        std::optional<kernels::Block<T>> in;
        Tile<T> tile{shape, box.extent(), nullptr, nullptr, 0, 0, run_.context.memory};
        if (copies) {
            in.emplace(static_cast<std::size_t>(shape.values() + 2 * kernels::kRowStep),
                       run_.context.memory);
            copy_in(box, channel, in->data());
            tile.in = in->data() - shape.place(run_.of.low[0], run_.of.low[1], run_.of.low[2]);
        } else {
            tile.in = run_.in.as<T>() + shape.place(box.begin[0], box.begin[1], box.begin[2]);
        }
        pass_to(tile, box, channel);
    }

 private:
    /// Rows of a padded tile, as they are read.
    class RowReader {
     public:
        RowReader(const PassRun& run, const Region& box, int channel) : reader_(run.in, channel) {
            const Extent n = box.extent(), reach = run.of.extent();
            for (int axis = 0; axis < 3; ++axis) {
                const auto k = static_cast<std::size_t>(axis);
                size_[k] = n[axis] + reach[axis] - 1;
                const std::int64_t begin = box.begin[k] + run.of.low[k];
                const std::int64_t all = run.in.extent[axis];
                if (axis == 0)
                    spans_ = spans_of(run.of.border, begin, size_[k], all);
                else
                    places_[k] = places_of(run.of.border, begin, size_[k], all);
            }
        }
        std::int64_t size(std::size_t axis) const noexcept { return size_[axis]; }
        void row(std::int64_t y, std::int64_t z, T* to) const {
            reader_.row(places_[1][static_cast<std::size_t>(y)],
                        places_[2][static_cast<std::size_t>(z)], spans_, to);
        }

     private:
        Reader<T> reader_;
        std::array<std::int64_t, 3> size_{};
        std::array<SmallVector<std::int64_t>, 3> places_;  // rows and slices
        SmallVector<Span> spans_;
    };

    /// Works a tile off, into the result or to it.
    void pass_to(Tile<T>& tile, const Region& box, int channel) const {
        const Extent n = tile.extent;
        if (writes_in_place_) {
            tile.out = run_.out.at<T>(box.begin[0], box.begin[1], box.begin[2]);
            tile.row = run_.out.what.extent.x;
            tile.slice = tile.row * run_.out.what.extent.y;
            pass_(tile);
            scale(tile);
            return;
        }
        tile.row = rounded(n.x);
        tile.slice = tile.row * n.y;
        kernels::Block<T> out(static_cast<std::size_t>(tile.slice * n.z), run_.context.memory);
        tile.out = out.data();
        pass_(tile);
        with_type(run_.out.what.type, [&](auto type) {
            using Stored = decltype(type);
            if constexpr (std::is_same_v<Stored, T> || std::is_floating_point_v<Stored>)
                store<T, Stored>(tile, box, channel, run_.of.scale, run_.out);
        });
    }

    void copy_in(const Region& box, int channel, T* in) const {
        const RowReader rows(run_, box, channel);
        const std::int64_t used = rows.size(0);
        // Passes that take whole tiles as one row read all of it, others a vector.
        const auto slack = static_cast<std::int64_t>(kernels::kSlack / sizeof(T));
        const std::int64_t behind =
            reads_ == TileReads::copies ? shape_.row : std::min(used + slack, shape_.row);
        for (std::int64_t z = 0; z < rows.size(2); ++z)
            for (std::int64_t y = 0; y < rows.size(1); ++y) {
                T* to = in + y * shape_.row + z * shape_.slice;
                rows.row(y, z, to);
                // What vectors read behind a row is defined, so that nothing hangs on it.
                std::fill(to + used, to + behind, T{});
            }
    }

    void scale(const Tile<T>& tile) const {
        if constexpr (std::is_floating_point_v<T>) {
            const double by = run_.of.scale;
            if (by == 1) return;
            for (std::int64_t z = 0; z < tile.extent.z; ++z)
                for (std::int64_t y = 0; y < tile.extent.y; ++y) {
                    T* row = tile.out_row(y, z);
                    for (std::int64_t x = 0; x < tile.extent.x; ++x)
                        row[x] = static_cast<T>(by * static_cast<double>(row[x]));
                }
        }
    }

    const PassRun& run_;
    const TileShape& shape_;
    const TileShape inside_;
    const TilePass<T>& pass_;
    const TileReads reads_;
    const bool reads_in_place_, writes_in_place_;
};

/// Short rows take as long as longer ones: a frame of them must be little beside the rest.
bool has_long_rows(const Extent& whole) noexcept { return whole.x >= 8 * kernels::kRowStep; }

template <class T>
void work_all(const PassRun& run, const Tiles& tiles, const TileWork<T>& work) {
    tbb::parallel_for(std::int64_t{0}, tiles.count() * run.in.channels, [&](std::int64_t number) {
        run.context.poll();
        bool inside = false;
        const Region box = tiles.tile(number / run.in.channels, inside);
        work.work(box, static_cast<int>(number % run.in.channels), inside);
    });
    run.context.poll();
}

}  // namespace

template <class T>
void run_tiles(const PassRun& run, const TileShape& shape, const TilePass<T>& pass,
               TileReads reads) {
    const TileWork<T> work(run, shape, pass, reads);
    const bool apart = reads == TileReads::in_place_but_frames && reads_in_place<T>(run, reads) &&
                       has_long_rows(run.in.extent);
    const Tiles tiles(run, shape.tile, apart);
    work_all(run, tiles, work);
}

template void run_tiles(const PassRun&, const TileShape&, const TilePass<std::uint8_t>&, TileReads);
template bool reads_in_place<std::uint8_t>(const PassRun&, TileReads) noexcept;
template void run_tiles(const PassRun&, const TileShape&, const TilePass<std::int8_t>&, TileReads);
template bool reads_in_place<std::int8_t>(const PassRun&, TileReads) noexcept;
template void run_tiles(const PassRun&, const TileShape&, const TilePass<std::uint16_t>&,
                        TileReads);
template bool reads_in_place<std::uint16_t>(const PassRun&, TileReads) noexcept;
template void run_tiles(const PassRun&, const TileShape&, const TilePass<std::int16_t>&, TileReads);
template bool reads_in_place<std::int16_t>(const PassRun&, TileReads) noexcept;
template void run_tiles(const PassRun&, const TileShape&, const TilePass<std::uint32_t>&,
                        TileReads);
template bool reads_in_place<std::uint32_t>(const PassRun&, TileReads) noexcept;
template void run_tiles(const PassRun&, const TileShape&, const TilePass<std::int32_t>&, TileReads);
template bool reads_in_place<std::int32_t>(const PassRun&, TileReads) noexcept;
template void run_tiles(const PassRun&, const TileShape&, const TilePass<float>&, TileReads);
template bool reads_in_place<float>(const PassRun&, TileReads) noexcept;
template void run_tiles(const PassRun&, const TileShape&, const TilePass<double>&, TileReads);
template bool reads_in_place<double>(const PassRun&, TileReads) noexcept;

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
