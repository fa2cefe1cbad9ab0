#pragma once

#include <cstdint>
#include <cstring>

namespace edgewise {

/// Mixes bytes into 64 bits (multiply and fold, as in wyhash): not for secrets, but fast.
class Hash {
 public:
    explicit Hash(std::uint64_t seed = 0x2d358dccaa6c78a5ull) noexcept : state_(seed) {}

    void add(const void* data, std::size_t bytes) noexcept {
        const auto* at = static_cast<const unsigned char*>(data);
        for (; bytes >= 8; at += 8, bytes -= 8) {
            std::uint64_t word;
            std::memcpy(&word, at, 8);
            mix(word);
        }
        std::uint64_t rest = bytes;
        std::memcpy(&rest, at, bytes);
        mix(rest ^ (std::uint64_t{bytes} << 56));
    }
    std::uint64_t value() const noexcept { return state_; }
    /// Eight bytes.
    void word(std::uint64_t word) noexcept { mix(word); }

 private:
    void mix(std::uint64_t word) noexcept {
        const auto product = static_cast<unsigned __int128>(state_ ^ word) * 0x9e3779b97f4a7c15ull;
        state_ = static_cast<std::uint64_t>(product) ^ static_cast<std::uint64_t>(product >> 64) ^
                 0xa0761d6478bd642full;
    }
    std::uint64_t state_;
};

}  // namespace edgewise
