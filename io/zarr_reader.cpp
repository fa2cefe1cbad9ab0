#include "io/zarr_reader.hpp"

#include <algorithm>
#include <cstring>
#include <filesystem>
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

std::vector<std::int64_t> ZarrReader::chunk_counts(const Selection& pick) const {
    std::vector<std::int64_t> counts;
    for (std::size_t i = 0; i < axes_.size(); ++i)
        counts.push_back(
            only(i, pick) >= 0 ? 1 : (array_.shape[i] + array_.chunks[i] - 1) / array_.chunks[i]);
    return counts;
}

std::vector<std::int64_t> ZarrReader::chunk_at(std::int64_t number,
                                               const std::vector<std::int64_t>& counts,
                                               const Selection& pick) const {
    std::vector<std::int64_t> chunk(counts.size());
    for (std::size_t i = counts.size(); i-- > 0; number /= counts[i]) {
        const std::int64_t index = only(i, pick);
        chunk[i] = index >= 0 ? index / array_.chunks[i] : number % counts[i];
    }
    return chunk;
}

Bytes ZarrReader::chunk_bytes(const std::vector<std::int64_t>& chunk,
                              const std::string& file) const {
    const std::string path =
        fmt::format("{}/{}{}", array_.folder, array_.prefix, fmt::join(chunk, array_.separator));
    Bytes bytes;
    if (std::filesystem::exists(path)) {
        try {
            bytes = decoded(path, array_.codecs, array_.chunk_bytes());
        } catch (const InputError& error) {
            refuse(file, error.what());
        }
    } else {
        bytes.resize(array_.chunk_bytes());
        for (std::size_t at = 0; at < bytes.size(); at += array_.fill.size())
            std::memcpy(bytes.data() + at, array_.fill.data(), array_.fill.size());
    }
    if (array_.big_endian && array_.width() > 1)
        swap_bytes(bytes.data(), array_.width(),
                   static_cast<std::int64_t>(bytes.size() / array_.width()));
    return bytes;
}

template <class Run>
void ZarrReader::each_run(const std::vector<std::int64_t>& chunk, const Selection& pick,
                          Run run) const {
    const std::size_t axes = axes_.size();
    // The axis along which numbers of a chunk are neighbours.
    const std::size_t fastest = array_.first_is_fastest ? 0 : axes - 1;
    std::vector<std::int64_t> low(axes), high(axes), stride(axes);
    std::int64_t step = 1;
    for (std::size_t k = 0; k < axes; ++k) {
        const std::size_t i = array_.first_is_fastest ? k : axes - 1 - k;
        stride[i] = step;
        step *= array_.chunks[i];
        low[i] = chunk[i] * array_.chunks[i];
        high[i] = std::min(low[i] + array_.chunks[i], array_.shape[i]);
        if (const std::int64_t index = only(i, pick); index >= 0)
            low[i] = index, high[i] = index + 1;
    }
    std::vector<std::int64_t> at = low;
    for (;;) {
        std::int64_t from = 0;
        for (std::size_t i = 0; i < axes; ++i)
            from += (at[i] - chunk[i] * array_.chunks[i]) * stride[i];
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

void ZarrReader::put_chunk(const std::vector<std::int64_t>& chunk, const Target& target,
                           Rounding& rounding) const {
    Bytes bytes = chunk_bytes(chunk, target.header.file);
    if (array_.wide != Wide::no) {
        Bytes narrowed(bytes.size() / 8 * bytes_of(array_.type));
        narrow_numbers(bytes.data(), bytes.size() / 8, array_.wide, array_.type, narrowed.data());
        bytes = std::move(narrowed);
    }
    const Extent& extent = target.header.extent;
    const std::int64_t strides[] = {target.channels, target.channels * extent.x,
                                    target.channels * extent.x * extent.y};
    const Type out = loaded_type(array_.type, target.pick.as_stored);
    const std::size_t width = bytes_of(array_.type), out_width = bytes_of(out);
    const std::size_t fastest = array_.first_is_fastest ? 0 : axes_.size() - 1;
    const auto stride_of = [&](std::size_t i) -> std::int64_t {
        const Axis::Kind kind = axes_[i].kind;
        if (kind <= Axis::z) return strides[kind];
        return kind == Axis::channel && !target.pick.channel ? 1 : 0;
    };
    each_run(chunk, target.pick, [&](const std::int64_t* at, std::size_t from, std::int64_t n) {
        std::int64_t to = 0;
        for (std::size_t i = 0; i < axes_.size(); ++i) to += at[i] * stride_of(i);
        const std::int64_t stride = stride_of(fastest);
        std::byte* place = target.into.data() + static_cast<std::size_t>(to) * out_width;
        const std::byte* numbers = bytes.data() + from * width;
        if (out != array_.type) {
            rounding.convert(array_.type, numbers, n, place, stride);
        } else if (stride == 1) {
            std::memcpy(place, numbers, static_cast<std::size_t>(n) * width);
        } else {
            for (std::int64_t k = 0; k < n; ++k)
                std::memcpy(place + static_cast<std::size_t>(k * stride) * width,
                            numbers + static_cast<std::size_t>(k) * width, width);
        }
    });
}

void ZarrReader::read(const Header& header, const Selection& pick, std::span<std::byte> into,
                      std::vector<std::string>& warnings) const {
    const Target target{header, pick, into, loaded_channels(header, pick)};
    const std::vector<std::int64_t> counts = chunk_counts(pick);
    std::int64_t all = 1;
    for (const std::int64_t count : counts) all *= count;
    Rounding rounding;
    std::mutex telling;
    tbb::parallel_for(std::int64_t{0}, all, [&](std::int64_t number) {
        Rounding here;
        put_chunk(chunk_at(number, counts, pick), target, here);
        const std::lock_guard lock(telling);
        rounding.rounded += here.rounded;
        rounding.beyond += here.beyond;
    });
    rounding.tell(header.file, array_.type, warnings);
}

void ZarrReader::narrow(Header& header) {
    if (array_.wide == Wide::no) return;
    WideRange range(array_.wide);
    const std::vector<std::int64_t> counts = chunk_counts({});
    std::int64_t all = 1;
    for (const std::int64_t count : counts) all *= count;
    for (std::int64_t number = 0; number < all; ++number) {
        const std::vector<std::int64_t> chunk = chunk_at(number, counts, {});
        const Bytes bytes = chunk_bytes(chunk, header.file);
        each_run(chunk, {}, [&](const std::int64_t* /*at*/, std::size_t from, std::int64_t n) {
            range.take(bytes.data() + 8 * from, static_cast<std::size_t>(n));
        });
    }
    take_narrowed(header, range.narrowed());
    array_.type = header.type;
}

}  // namespace edgewise::store
