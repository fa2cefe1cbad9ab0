#include "graph/fingerprint.hpp"

#include <array>
#include <cstring>
#include <fmt/format.h>

namespace edgewise {

void Fingerprint::bytes(const void* first, std::size_t count) noexcept {
    // Of many bytes, in lanes that do not wait for each other: a processor multiplies in several.
    constexpr std::size_t kLanes = 4, kWord = sizeof(std::uint64_t), kStride = kLanes * kWord;
    const auto* at = static_cast<const unsigned char*>(first);
    if (count >= 4 * kStride) {
        std::array<Hash, kLanes> one{Hash(11), Hash(12), Hash(13), Hash(14)};
        std::array<Hash, kLanes> two{Hash(21), Hash(22), Hash(23), Hash(24)};
        first_.word(count), second_.word(count);
        for (; count >= kStride; at += kStride, count -= kStride)
            for (std::size_t lane = 0; lane < kLanes; ++lane) {
                std::uint64_t word;
                std::memcpy(&word, at + lane * kWord, kWord);
                one[lane].word(word), two[lane].word(word);
            }
        for (std::size_t lane = 0; lane < kLanes; ++lane)
            first_.word(one[lane].value()), second_.word(two[lane].value());
    }
    first_.add(at, count), second_.add(at, count);
}

std::string Fingerprint::text() const {
    return fmt::format("{:016x}{:016x}", first_.value(), second_.value());
}

}  // namespace edgewise
