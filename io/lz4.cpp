#include "io/lz4.hpp"

#include <cstdint>
#include <cstring>

namespace edgewise::store {

bool unpack_lz4(std::span<const std::byte> packed, std::span<std::byte> out) noexcept {
    std::size_t from = 0, to = 0;
    // A nibble of 15 goes on in bytes that are added, until one is below 255.
    const auto length_of = [&](std::size_t nibble) {
        std::size_t length = nibble;
        if (nibble < 15) return length;
        while (from < packed.size()) {
            const auto more = std::to_integer<std::size_t>(packed[from++]);
            length += more;
            if (more < 255) break;
        }
        return length;
    };
    while (from < packed.size()) {
        const auto token = std::to_integer<std::size_t>(packed[from++]);
        const std::size_t literals = length_of(token >> 4);
        if (literals > packed.size() - from || literals > out.size() - to) return false;
        if (literals > 0) std::memcpy(out.data() + to, packed.data() + from, literals);
        from += literals;
        to += literals;
        // The last sequence has literals alone.
        if (from == packed.size()) break;
        if (packed.size() - from < 2) return false;
        const std::size_t back = std::to_integer<std::size_t>(packed[from]) |
                                 std::to_integer<std::size_t>(packed[from + 1]) << 8;
        from += 2;
        const std::size_t length = length_of(token & 15) + 4;
        if (back == 0 || back > to || length > out.size() - to) return false;
        // Byte by byte: what is copied may be what this copy has just written.
        for (std::size_t i = 0; i < length; ++i, ++to) out[to] = out[to - back];
    }
    return to == out.size();
}

}  // namespace edgewise::store
