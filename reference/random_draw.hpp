#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace edgewise {

/// The numbers 0 ... size - 1 in a random order, each once, without a list of them: a network of
/// Feistel's over the next power of four, walked until it is back within the range (Black, Rogaway,
/// "Ciphers with arbitrary finite domains", 2002).
class RandomOrder {
 public:
    RandomOrder(std::int64_t size, std::uint64_t seed) noexcept;
    /// @param place  in the order, less than size
    std::int64_t operator[](std::int64_t place) const noexcept;

 private:
    std::uint64_t once(std::uint64_t value) const noexcept;

    std::uint64_t size_, seed_;
    int half_ = 1;  // bits
};

/// Draws each of a list with its chance, none twice, and as many as the chances add up to. Of
/// neighbours in the list one that is drawn makes the next less likely, so that draws are spread
/// along it (the ordered pivotal method: Deville, Tille, "Unequal probability sampling without
/// replacement through a splitting method", Biometrika 85, 1998).
/// @param chances  0 ... 1
/// @return places in the list, ascending
std::vector<std::size_t> draw_by_chance(std::span<const double> chances, std::uint64_t seed);

}  // namespace edgewise
