// Pictures that are a short header and the samples, written: Netpbm (PGM, PPM of 8 and 16 bits),
// PFM, SGI. They are read by OpenImageIO, whose writers know 8 bits of Netpbm alone and leave what
// lay in memory in the headers of SGI.

#include <bit>
#include <cstring>
#include <fmt/format.h>

#include "io/reader.hpp"
#include "io/text.hpp"

namespace edgewise::store {

void write_pnm(Replacement& out, const Header& what, const void* samples) {
    const auto* from = static_cast<const std::byte*>(samples);
    const std::size_t width = bytes_of(what.type);
    const bool floats = what.type == Type::f32;
    // A file that is called PPM holds colour.
    const bool repeats = what.channels == 1 && ends_with_any(out.path(), {".ppm"});
    const bool colour = repeats || what.channels == 3;
    const char* kind = floats ? (colour ? "PF" : "Pf") : colour ? "P6" : "P5";
    const char* last = floats ? "-1.0" : width == 2 ? "65535" : "255";
    const std::string head =
        fmt::format("{}\n{} {}\n{}\n", kind, what.extent.x, what.extent.y, last);
    out.write(std::as_bytes(std::span(head)));
    // Netpbm's numbers are big-endian, its rows go down; those of PFM are little-endian and go up.
    const auto row_numbers = static_cast<std::size_t>(what.extent.x * what.channels);
    const bool swaps = width > 1 && (std::endian::native == std::endian::little) != floats;
    const std::size_t copies = repeats ? 3 : 1;
    Bytes row(row_numbers * copies * width);
    for (std::int64_t y = 0; y < what.extent.y; ++y) {
        const std::byte* line =
            from +
            static_cast<std::size_t>(floats ? what.extent.y - 1 - y : y) * row_numbers * width;
        for (std::size_t i = 0; i < row_numbers * copies; ++i)
            std::memcpy(row.data() + i * width, line + i / copies * width, width);
        if (swaps) swap_bytes(row.data(), width, static_cast<std::int64_t>(row.size() / width));
        out.write(row);
    }
}

void write_sgi(Replacement& out, const Header& what, const void* samples) {
    const auto* from = static_cast<const std::byte*>(samples);
    const std::size_t width = bytes_of(what.type);
    const auto columns = static_cast<std::size_t>(what.extent.x);
    const auto channels = static_cast<std::size_t>(what.channels);
    Bytes head(512);
    const auto put = [&](std::size_t at, std::size_t size, std::int64_t value) {
        for (std::size_t i = 0; i < size; ++i)
            head[at + size - 1 - i] = static_cast<std::byte>(value >> 8 * i);
    };
    put(0, 2, 474);
    put(3, 1, static_cast<std::int64_t>(width));
    put(4, 2, what.channels == 1 ? 2 : 3);  // axes
    put(6, 2, what.extent.x);
    put(8, 2, what.extent.y);
    put(10, 2, what.channels);
    put(16, 4, width == 1 ? 255 : 65535);  // the largest value
    out.write(head);
    // Channel by channel, rows go up, numbers are big-endian.
    Bytes row(columns * width);
    for (std::size_t c = 0; c < channels; ++c)
        for (std::int64_t y = what.extent.y - 1; y >= 0; --y) {
            const std::byte* line =
                from + (static_cast<std::size_t>(y) * columns * channels + c) * width;
            for (std::size_t x = 0; x < columns; ++x)
                std::memcpy(row.data() + x * width, line + x * channels * width, width);
            if (width > 1 && std::endian::native == std::endian::little)
                swap_bytes(row.data(), width, what.extent.x);
            out.write(row);
        }
}

}  // namespace edgewise::store
