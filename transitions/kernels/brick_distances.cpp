#include "transitions/kernels/brick_distances.hpp"

#include <algorithm>

namespace edgewise::kernels {
namespace {

/// A row of bricks learns what one beside it knows: each of its bricks is at most one farther.
void learn(std::uint8_t* row, const std::uint8_t* beside, std::int64_t n) {
    const auto farther = [](std::uint8_t a, std::uint8_t b, std::uint8_t c) {
        return static_cast<std::uint8_t>(std::min(a, std::min(b, c)) + 1);
    };
    const std::int64_t last = n - 1;
    row[0] =
        std::min(row[0], farther(beside[0], beside[0], beside[std::min<std::int64_t>(1, last)]));
    for (std::int64_t i = 1; i < last; ++i)
        row[i] = std::min(row[i], farther(beside[i - 1], beside[i], beside[i + 1]));
    if (last > 0)
        row[last] = std::min(row[last], farther(beside[last - 1], beside[last], beside[last]));
}

void learn_along(std::uint8_t* row, std::int64_t n) {
    for (std::int64_t i = 1; i < n; ++i)
        row[i] = std::min(row[i], static_cast<std::uint8_t>(row[i - 1] + 1));
    for (std::int64_t i = n - 1; i-- > 0;)
        row[i] = std::min(row[i], static_cast<std::uint8_t>(row[i + 1] + 1));
}

/// Each row learns from those before it: of its layer one, of the layer before it three.
/// @param step  1: rows and layers upwards; -1: downwards
void sweep(std::uint8_t* distance, const Extent& n, std::int64_t step) {
    const std::int64_t first_z = step > 0 ? 0 : n.z - 1, first_y = step > 0 ? 0 : n.y - 1;
    for (std::int64_t k = first_z; k >= 0 && k < n.z; k += step)
        for (std::int64_t j = first_y; j >= 0 && j < n.y; j += step) {
            std::uint8_t* const row = distance + (k * n.y + j) * n.x;
            if (k != first_z)
                for (std::int64_t b = std::max<std::int64_t>(0, j - 1);
                     b <= std::min(j + 1, n.y - 1); ++b)
                    learn(row, distance + ((k - step) * n.y + b) * n.x, n.x);
            if (j != first_y) learn(row, row - step * n.x, n.x);
            learn_along(row, n.x);
        }
}

}  // namespace

BrickDistances::BrickDistances(const Bricks& of, float least, int most,
                               std::pmr::memory_resource* memory)
    : bricks(&of), distance(of.level.size(), memory), floor(least) {
    for (std::size_t i = 0; i < distance.size(); ++i)
        distance[i] = of.level[i] > floor ? 0 : static_cast<std::uint8_t>(most);
    // Two sweeps are enough: all 26 neighbours are a step of one away (Rosenfeld and Pfaltz 1966).
    sweep(distance.data(), of.extent, 1);
    sweep(distance.data(), of.extent, -1);
}

}  // namespace edgewise::kernels
