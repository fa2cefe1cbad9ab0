#include "presentation/coloured.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <vector>

namespace edgewise {

Array coloured(const Data& result, const Tail& tail, const Shades& levels, const Colormap& map,
               std::pmr::memory_resource* memory) {
    // 65536 levels between black and white are far more than eyes, or 8 bits, tell apart.
    constexpr std::size_t kLevels = 1 << 16;
    Tail fine = tail;
    fine.type = Type::u16;
    fine.view = true;
    const Array grey = finished(result, fine, levels, memory);
    std::vector<std::array<std::uint8_t, 3>> colours(kLevels);
    for (std::size_t i = 0; i < kLevels; ++i)
        colours[i] = map.bytes_at(static_cast<double>(i) / (kLevels - 1));
    const auto samples = static_cast<std::size_t>(result.what.samples());
    Array out(3 * samples, memory);
    const auto* from = static_cast<const std::uint16_t*>(grey.data());
    auto* to = static_cast<std::uint8_t*>(out.data());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, samples, kLevels), [&](const auto& part) {
        for (std::size_t i = part.begin(); i != part.end(); ++i)
            std::memcpy(to + 3 * i, colours[from[i]].data(), 3);
    });
    return out;
}

}  // namespace edgewise
