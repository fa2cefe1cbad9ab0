#pragma once

#include <cstddef>
#include <span>

namespace edgewise::store {

/// Unpacks one LZ4 block (LZ4 block format description 1.6), which says neither its own size nor
/// that of its content.
/// @return whether it was sound and filled `out` to the last byte
bool unpack_lz4(std::span<const std::byte> packed, std::span<std::byte> out) noexcept;

}  // namespace edgewise::store
