#include "transitions/filter/backward.hpp"

#include <cmath>
#include <type_traits>
#include <vector>

#include "graph/with_type.hpp"
#include "transitions/filter/filtering_edge.hpp"
#include "transitions/kernels/neighbourhood.hpp"

namespace edgewise {
namespace {

/// The places that count and their weights.
template <class T>
struct Taps {
    std::vector<std::ptrdiff_t> places;
    std::vector<T> weights;

    Taps(const Neighbourhood& of, const TileShape& shape) {
        std::size_t at = 0;
        for (std::int64_t z = of.low[2]; z <= of.high[2]; ++z)
            for (std::int64_t y = of.low[1]; y <= of.high[1]; ++y)
                for (std::int64_t x = of.low[0]; x <= of.high[0]; ++x, ++at) {
                    if (!of.counts(of.weights[at])) continue;
                    places.push_back(shape.place(x, y, z));
                    weights.push_back(static_cast<T>(of.weights[at]));
                }
    }
};

template <class T>
void run_backward(const PassRun& run) {
    const TileShape shape(run.of, tile_for(run.of, run.in.extent, sizeof(T)));
    const Taps<T> taps(run.of, shape);
    const bool least = run.of.rule == Neighbourhood::Rule::least;
    run_tiles<T>(run, shape, [&](const Tile<T>& tile) {
        for (std::int64_t z = 0; z < tile.extent.z; ++z)
            for (std::int64_t y = 0; y < tile.extent.y; ++y) {
                const T* in = tile.in_row(y, z);
                T* out = tile.out_row(y, z);
                const std::int64_t n = tile.extent.x;
                const std::size_t count = taps.places.size();
                if constexpr (std::is_floating_point_v<T>) {
                    if (run.of.of_sum())
                        kernels::sum_row(in, taps.places.data(), taps.weights.data(), count, false,
                                         out, n);
                    else
                        kernels::grey_row(in, taps.places.data(), taps.weights.data(), count, least,
                                          out, n);
                } else {
                    kernels::extreme_row(in, taps.places.data(), count, least, out, n);
                }
            }
    });
}

}  // namespace

Transition filter_backward() {
    return filtering_edge({
        .name = "filter.backward",
        .source = "[W93] FIGURE 10, EQ 6-9",
        .refused = [](const PassAsk& ask) -> std::string {
            if (ask.of.rule == Neighbourhood::Rule::median)
                return "a median is neither a sum nor an extreme";
            if (ask.of.places() == 0 && !ask.of.of_sum()) return "no place of the kernel counts";
            return {};
        },
        .operations = [](const PassAsk& ask) { return 2.0 * double(ask.of.places()); },
        .run =
            [](const PassRun& run, Type type) {
                with_type(type, [&](auto sample) { run_backward<decltype(sample)>(run); });
            },
    });
}

}  // namespace edgewise
