#include "io/zarr_reader.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <fmt/format.h>
#include <mutex>
#include <tbb/parallel_for.h>
#include <utility>

#include "graph/errors.hpp"
#include "io/text.hpp"
#include "io/zarr_codecs.hpp"

namespace edgewise::store {

std::int64_t ZarrReader::only(std::size_t axis, const Selection& pick) const {
    if (axes_[axis].kind == Axis::time) return pick.time.value_or(array_.shape[axis] > 1 ? -1 : 0);
    if (axes_[axis].kind == Axis::channel && pick.channel) return *pick.channel;
    return -1;
}

ZarrReader::Place ZarrReader::file_counts(const Selection& pick) const {
    Place counts;
    for (std::size_t i = 0; i < axes_.size(); ++i) {
        const std::int64_t side = array_.file_sides()[i];
        counts.push_back(only(i, pick) >= 0 ? 1 : (array_.shape[i] + side - 1) / side);
    }
    return counts;
}

ZarrReader::Place ZarrReader::file_at(std::int64_t number, const Place& counts,
                                      const Selection& pick) const {
    Place file(counts.size());
    for (std::size_t i = counts.size(); i-- > 0; number /= counts[i]) {
        const std::int64_t index = only(i, pick);
        file[i] = index >= 0 ? index / array_.file_sides()[i] : number % counts[i];
    }
    return file;
}

bool ZarrReader::is_read(const Place& low, const Selection& pick) const {
    for (std::size_t i = 0; i < axes_.size(); ++i) {
        if (low[i] >= array_.shape[i]) return false;
        const std::int64_t index = only(i, pick);
        if (index >= 0 && (index < low[i] || index >= low[i] + array_.chunks[i])) return false;
    }
    return true;
}

Bytes ZarrReader::fill_chunk() const {
    Bytes bytes(array_.chunk_bytes());
    for (std::size_t at = 0; at < bytes.size(); at += array_.fill.size())
        std::memcpy(bytes.data() + at, array_.fill.data(), array_.fill.size());
    return bytes;
}

Bytes ZarrReader::unpacked(const std::string& name, Bytes packed) const {
    const std::size_t count = array_.chunk_numbers(), width = array_.stored.bytes;
    const std::size_t bytes =
        array_.filters.empty() ? count * width : filtered_bytes(array_.filters.front(), count);
    Bytes numbers = decoded(name, std::move(packed), array_.codecs, bytes);
    if (array_.stored.big_endian && width > 1)
        swap_bytes(numbers.data(), width, static_cast<std::int64_t>(numbers.size() / width));
    return unfiltered(name, std::move(numbers), array_.filters, count);
}

std::vector<ZarrReader::Part> ZarrReader::index_of(const ZarrFile& shard,
                                                   const std::string& name) const {
    const ZarrShards& shards = *array_.shards;
    const std::size_t count = array_.chunks_in_file();
    const std::vector<ZarrCodec> sum(shards.index_summed ? 1 : 0, {ZarrCodec::Kind::crc32c});
    const std::uint64_t size = 16 * count + (shards.index_summed ? 4 : 0);
    if (shard.size() < size)
        refuse(name, fmt::format("a shard of {} bytes, too short for its index of {}", shard.size(),
                                 size));
    Bytes packed(static_cast<std::size_t>(size));
    shard.read(shards.index_first ? 0 : shard.size() - size, packed);
    Bytes bytes = decoded(name + ", its index", std::move(packed), sum, 16 * count);
    if (shards.index_big_endian != (std::endian::native == std::endian::big))
        swap_bytes(bytes.data(), 8, static_cast<std::int64_t>(2 * count));
    std::vector<Part> parts(count);
    for (std::size_t i = 0; i < count; ++i) {
        std::memcpy(&parts[i].offset, bytes.data() + 16 * i, 8);
        std::memcpy(&parts[i].bytes, bytes.data() + 16 * i + 8, 8);
        if (!parts[i].missing() &&
            (parts[i].offset > shard.size() || parts[i].bytes > shard.size() - parts[i].offset))
            refuse(name,
                   fmt::format("chunk {} of the shard lies beyond its {} bytes", i, shard.size()));
    }
    return parts;
}

template <class Use>
void ZarrReader::each_chunk(const Place& file, const Selection& pick, Use use) const {
    const std::string key =
        zarr_key(array_.key, fmt::format("{}{}", array_.prefix, fmt::join(file, array_.separator)));
    const std::string name = array_.store->name_of(key);
    const std::uint64_t most_of_chunk =
        std::min<std::uint64_t>(most_packed(array_.chunk_bytes()), UINT32_MAX);
    const std::size_t count = array_.chunks_in_file();
    // What a whole file may hold, where it has to be unpacked before it can be read.
    const std::uint64_t most = most_of_chunk > UINT64_MAX / (count + 1)
                                   ? UINT64_MAX
                                   : most_of_chunk * count + 16 * count + 4;
    const std::unique_ptr<ZarrFile> from = array_.store->open(key, most);
    const auto packed = [&](std::uint64_t offset, std::uint64_t bytes) {
        if (bytes > most_of_chunk)
            refuse(name, fmt::format("holds {} bytes, expected {}", bytes, array_.chunk_bytes()));
        Bytes all(static_cast<std::size_t>(bytes));
        from->read(offset, all);
        return all;
    };
    Place low;
    for (std::size_t i = 0; i < file.size(); ++i) low.push_back(file[i] * array_.file_sides()[i]);
    if (!array_.shards) {
        use(low, from ? unpacked(name, packed(0, from->size())) : fill_chunk());
        return;
    }
    const ZarrShards& shards = *array_.shards;
    const std::vector<Part> parts = from ? index_of(*from, name) : std::vector<Part>{};
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t number) {
        Place at = low;
        std::size_t left = number;
        for (std::size_t k = shards.order.size(); k-- > 0;) {
            const std::size_t axis = shards.order[k];
            const auto side = static_cast<std::size_t>(shards.sides[axis] / array_.chunks[axis]);
            at[axis] += static_cast<std::int64_t>(left % side) * array_.chunks[axis];
            left /= side;
        }
        if (!is_read(at, pick)) return;
        const bool there = from && !parts[number].missing();
        use(at, there ? unpacked(fmt::format("{}, chunk {}", name, number),
                                 packed(parts[number].offset, parts[number].bytes))
                      : fill_chunk());
    });
}

template <class Run>
void ZarrReader::each_run(const Place& origin, const Selection& pick, Run run) const {
    const std::size_t axes = axes_.size();
    // The axis along which numbers of a chunk are neighbours.
    const std::size_t fastest = array_.order.back();
    Place low(axes), high(axes), stride(axes);
    std::int64_t step = 1;
    for (std::size_t k = axes; k-- > 0;) {
        const std::size_t i = array_.order[k];
        stride[i] = step;
        step *= array_.chunks[i];
        low[i] = origin[i];
        high[i] = std::min(low[i] + array_.chunks[i], array_.shape[i]);
        if (const std::int64_t index = only(i, pick); index >= 0)
            low[i] = index, high[i] = index + 1;
    }
    Place at = low;
    for (;;) {
        std::int64_t from = 0;
        for (std::size_t i = 0; i < axes; ++i) from += (at[i] - origin[i]) * stride[i];
        run(at.data(), static_cast<std::size_t>(from), high[fastest] - low[fastest]);
        std::size_t i = 0;
        for (; i < axes; ++i) {
            if (i == fastest) continue;
            if (++at[i] < high[i]) break;
            at[i] = low[i];
        }
        if (i == axes) return;
    }
}

void ZarrReader::put_chunk(const Place& low, const Bytes& numbers, const Target& target,
                           Rounding& rounding, std::int64_t& wide_rounded) const {
    Bytes doubles;
    if (array_.wide != Wide::no) {
        doubles.resize(numbers.size());
        wide_rounded += wide_numbers(numbers.data(), numbers.size() / 8,
                                     as_read(array_.wide, target.pick), doubles.data());
    }
    const Bytes& bytes = array_.wide != Wide::no ? doubles : numbers;
    const Extent& extent = target.header.extent;
    const std::int64_t strides[] = {target.channels, target.channels * extent.x,
                                    target.channels * extent.x * extent.y};
    const Type out = loaded_type(array_.type, target.pick.as_stored);
    const std::size_t width = bytes_of(array_.type), out_width = bytes_of(out);
    const std::size_t fastest = array_.order.back();
    const auto stride_of = [&](std::size_t i) -> std::int64_t {
        const Axis::Kind kind = axes_[i].kind;
        if (kind <= Axis::z) return strides[kind];
        return kind == Axis::channel && !target.pick.channel ? 1 : 0;
    };
    each_run(low, target.pick, [&](const std::int64_t* at, std::size_t from, std::int64_t n) {
        std::int64_t to = 0;
        for (std::size_t i = 0; i < axes_.size(); ++i) to += at[i] * stride_of(i);
        const std::int64_t stride = stride_of(fastest);
        std::byte* place = target.into.data() + static_cast<std::size_t>(to) * out_width;
        const std::byte* first = bytes.data() + from * width;
        if (out != array_.type) {
            rounding.convert(array_.type, first, n, place, stride);
        } else if (stride == 1) {
            std::memcpy(place, first, static_cast<std::size_t>(n) * width);
        } else {
            for (std::int64_t k = 0; k < n; ++k)
                std::memcpy(place + static_cast<std::size_t>(k * stride) * width,
                            first + static_cast<std::size_t>(k) * width, width);
        }
    });
}

void ZarrReader::read(const Header& header, const Selection& pick, std::span<std::byte> into,
                      std::vector<Message>& warnings) const {
    const Target target{header, pick, into, loaded_channels(header, pick)};
    const Place counts = file_counts(pick);
    std::int64_t all = 1;
    for (const std::int64_t count : counts) all *= count;
    Rounding rounding;
    std::int64_t wide_rounded = 0;
    std::mutex telling;
    try {
        tbb::parallel_for(std::int64_t{0}, all, [&](std::int64_t number) {
            each_chunk(file_at(number, counts, pick), pick,
                       [&](const Place& low, const Bytes& numbers) {
                           Rounding here;
                           std::int64_t wide_here = 0;
                           put_chunk(low, numbers, target, here, wide_here);
                           const std::lock_guard lock(telling);
                           rounding.rounded += here.rounded;
                           rounding.beyond += here.beyond;
                           wide_rounded += wide_here;
                       });
        });
    } catch (const InputError& error) {
        refuse(header.file, error.message().marked());
    }
    rounding.tell(header.file, array_.type, warnings);
    tell_wide(header, wide_rounded, warnings);
}

}  // namespace edgewise::store
