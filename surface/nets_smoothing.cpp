#include "surface/nets_smoothing.hpp"

#include <algorithm>
#include <numeric>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace edgewise::surface {
namespace {

constexpr std::size_t kLeaf = 1 << 13;  // vertices

/// The neighbours of each vertex. A quad passes each of its sides one way, and the quad at its
/// other side the other way, so that each neighbour is met once as a side's end.
class Neighbours {
 public:
    Neighbours(std::span<const Quad> quads, std::size_t vertices, std::pmr::memory_resource* memory)
        : starts_((vertices + 1) * sizeof(std::uint64_t), memory),
          ends_(quads.size() * 4 * sizeof(std::uint32_t), memory),
          rim_(vertices, memory) {
        auto* start = static_cast<std::uint64_t*>(starts_.data());
        auto* end = static_cast<std::uint32_t*>(ends_.data());
        // On a rim the neighbours that sides lead to are not those that they come from.
        Array sums(vertices * sizeof(std::uint64_t), memory);
        auto* sum = static_cast<std::uint64_t*>(sums.data());
        std::fill_n(start, vertices + 1, 0);
        std::fill_n(sum, vertices, 0);
        const auto for_each_side = [&](auto body) {
            for (const Quad& quad : quads)
                for (std::size_t i = 0; i < 4; ++i) body(quad[i], quad[(i + 1) % 4]);
        };
        for_each_side([&](std::uint32_t a, std::uint32_t b) {
            ++start[a];
            sum[a] += mixed(b);
            sum[b] -= mixed(a);
        });
        std::partial_sum(start, start + vertices + 1, start);
        for_each_side([&](std::uint32_t a, std::uint32_t b) { end[--start[a]] = b; });
        auto* rim = static_cast<std::uint8_t*>(rim_.data());
        for (std::size_t v = 0; v < vertices; ++v) rim[v] = sum[v] != 0;
    }

    bool on_rim(std::size_t vertex) const noexcept {
        return static_cast<const std::uint8_t*>(rim_.data())[vertex] != 0;
    }
    std::span<const std::uint32_t> of(std::size_t vertex) const noexcept {
        const auto* start = static_cast<const std::uint64_t*>(starts_.data());
        const auto* end = static_cast<const std::uint32_t*>(ends_.data());
        return {end + start[vertex], end + start[vertex + 1]};
    }

 private:
    /// Spread over 64 bits, so that different sets have different sums (Knuth's multiplier).
    static std::uint64_t mixed(std::uint64_t vertex) noexcept {
        vertex = (vertex + 1) * 0x9e3779b97f4a7c15;
        return vertex ^ vertex >> 29;
    }

    Array starts_, ends_, rim_;
};

}  // namespace

void smooth_net(std::span<const Quad> quads, std::span<const std::array<std::int32_t, 3>> cells,
                std::span<Eigen::Vector3f> places, int steps, std::pmr::memory_resource* memory,
                const std::function<void()>& poll) {
    if (steps == 0 || places.empty()) return;
    const Neighbours neighbours(quads, places.size(), memory);
    Array others(places.size() * sizeof(Eigen::Vector3f), memory);
    std::span<Eigen::Vector3f> from = places,
                               to{static_cast<Eigen::Vector3f*>(others.data()), places.size()};
    for (int step = 0; step < steps; ++step, std::swap(from, to)) {
        if (poll) poll();
        tbb::parallel_for(
            tbb::blocked_range<std::size_t>(0, places.size(), kLeaf), [&](const auto& part) {
                for (std::size_t v = part.begin(); v != part.end(); ++v) {
                    to[v] = from[v];
                    const auto all = neighbours.of(v);
                    if (neighbours.on_rim(v) || all.empty()) continue;
                    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
                    for (const std::uint32_t other : all)
                        for (int axis = 0; axis < 3; ++axis)
                            sum[axis] += from[other][axis] +
                                         static_cast<float>(cells[other][axis] - cells[v][axis]);
                    const Eigen::Vector3f mean = sum / static_cast<float>(all.size());
                    to[v] = ((from[v] + mean) / 2).cwiseMax(0.0f).cwiseMin(1.0f);
                }
            });
    }
    if (steps % 2 == 1) std::copy(from.begin(), from.end(), places.begin());
}

}  // namespace edgewise::surface
