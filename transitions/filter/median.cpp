#include "transitions/filter/median.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "graph/with_type.hpp"
#include "transitions/filter/filtering_edge.hpp"

namespace edgewise {
namespace {

std::string no_median(const PassAsk& ask) {
    if (ask.of.rule != Neighbourhood::Rule::median) return "sums and extremes are no medians";
    if (ask.of.places() == 0) return "no place of the kernel counts";
    return {};
}

/// Places of the kernel for which `chosen(x, y, z)` holds.
template <class Chosen>
std::vector<std::ptrdiff_t> places_where(const Neighbourhood& of, const TileShape& shape,
                                         const Chosen& chosen) {
    std::vector<std::ptrdiff_t> places;
    for (std::int64_t z = of.low[2]; z <= of.high[2]; ++z)
        for (std::int64_t y = of.low[1]; y <= of.high[1]; ++y)
            for (std::int64_t x = of.low[0]; x <= of.high[0]; ++x)
                if (chosen(x, y, z)) places.push_back(shape.place(x, y, z));
    return places;
}

/// Whether a place belongs to the kernel; those beyond its box do not.
struct Counts {
    const Neighbourhood& of;

    bool operator()(std::int64_t x, std::int64_t y, std::int64_t z) const {
        if (x < of.low[0] || x > of.high[0]) return false;
        const Extent n = of.extent();
        return of.counts(of.weights[static_cast<std::size_t>(
            x - of.low[0] + n.x * (y - of.low[1] + n.y * (z - of.low[2])))]);
    }
};

template <class T>
bool is_less(T a, T b) {
    if constexpr (std::is_floating_point_v<T>) return std::isnan(b) ? !std::isnan(a) : a < b;
    return a < b;
}

template <class T>
void run_selection(const PassRun& run) {
    const TileShape shape(run.of, tile_for(run.of, run.in.extent, sizeof(T)));
    const auto places = places_where(run.of, shape, Counts{run.of});
    const std::size_t middle = (places.size() - 1) / 2;
    run_tiles<T>(run, shape, [&](const Tile<T>& tile) {
        std::vector<T> values(places.size());
        for (std::int64_t z = 0; z < tile.extent.z; ++z)
            for (std::int64_t y = 0; y < tile.extent.y; ++y)
                for (std::int64_t x = 0; x < tile.extent.x; ++x) {
                    const T* in = tile.in_row(y, z) + x;
                    for (std::size_t i = 0; i < places.size(); ++i) values[i] = in[places[i]];
                    const auto at = values.begin() + static_cast<std::ptrdiff_t>(middle);
                    std::nth_element(values.begin(), at, values.end(), is_less<T>);
                    tile.out_row(y, z)[x] = *at;
                }
    });
}

/// How often each of 256 values is there, and which one so many are below.
class Histogram {
 public:
    void add(std::uint8_t value) noexcept {
        ++count_[value];
        below_ += value < at_;
    }
    void remove(std::uint8_t value) noexcept {
        --count_[value];
        below_ -= value < at_;
    }
    /// The value at a place of all, in order.
    std::uint8_t at(std::int32_t place) noexcept {
        while (below_ > place) below_ -= count_[--at_];
        while (below_ + count_[at_] <= place) below_ += count_[at_++];
        return static_cast<std::uint8_t>(at_);
    }

 private:
    std::array<std::int32_t, 257> count_{};
    std::size_t at_ = 0;
    std::int32_t below_ = 0;
};

template <class T>
void run_histogram(const PassRun& run) {
    static_assert(sizeof(T) == 1);
    const TileShape shape(run.of, tile_for(run.of, run.in.extent, sizeof(T)));
    const Counts counts{run.of};
    const auto all = places_where(run.of, shape, counts);
    // What one step to the right brings, and what it leaves behind, counted from before it.
    const auto enters = places_where(run.of, shape, [&](auto x, auto y, auto z) {
        return counts(x, y, z) && !counts(x + 1, y, z);
    });
    const auto leaves = places_where(run.of, shape, [&](auto x, auto y, auto z) {
        return counts(x, y, z) && !counts(x - 1, y, z);
    });
    const auto middle = static_cast<std::int32_t>((all.size() - 1) / 2);
    // Signed values are moved up, so that their order is that of unsigned ones.
    constexpr int kUp = std::is_signed_v<T> ? 128 : 0;
    const auto level = [](T value) { return static_cast<std::uint8_t>(int(value) + kUp); };
    run_tiles<T>(run, shape, [&](const Tile<T>& tile) {
        for (std::int64_t z = 0; z < tile.extent.z; ++z)
            for (std::int64_t y = 0; y < tile.extent.y; ++y) {
                const T* in = tile.in_row(y, z);
                T* out = tile.out_row(y, z);
                Histogram histogram;
                for (const std::ptrdiff_t place : all) histogram.add(level(in[place]));
                for (std::int64_t x = 0;;) {
                    out[x] = static_cast<T>(int(histogram.at(middle)) - kUp);
                    if (++x == tile.extent.x) break;
                    for (const std::ptrdiff_t place : leaves)
                        histogram.remove(level(in[x - 1 + place]));
                    for (const std::ptrdiff_t place : enters) histogram.add(level(in[x + place]));
                }
            }
    });
}

}  // namespace

Transition filter_median() {
    return filtering_edge({
        .name = "filter.median",
        .source = "Hoare 1961",
        .refused = no_median,
        .operations = [](const PassAsk& ask) { return 12.0 * double(ask.of.places()); },
        .run =
            [](const PassRun& run, Type type) {
                with_type(type, [&](auto sample) { run_selection<decltype(sample)>(run); });
            },
    });
}

Transition filter_median_histogram() {
    return filtering_edge({
        .name = "filter.median_histogram",
        .source = "Huang, Yang, Tang 1979",
        .refused =
            [](const PassAsk& ask) {
                std::string reason = no_median(ask);
                if (reason.empty() && bytes_of(ask.type) != 1)
                    reason = "a histogram of single values takes samples of one byte";
                return reason;
            },
        .operations =
            [](const PassAsk& ask) {
                const Extent n = ask.of.extent();
                constexpr double kMoved = 40;  // what the middle moves by
                const double ends = 2 * double(n.y) * double(n.z);
                // Narrow vectors are no help here: as many as of f32.
                return 4 * (4 * ends + kMoved + double(ask.of.places()) / 128);
            },
        .run =
            [](const PassRun& run, Type type) {
                if (type == Type::i8)
                    run_histogram<std::int8_t>(run);
                else
                    run_histogram<std::uint8_t>(run);
            },
    });
}

}  // namespace edgewise
