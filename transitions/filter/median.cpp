#include "transitions/filter/median.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

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
SmallVector<std::ptrdiff_t> places_where(const Neighbourhood& of, const TileShape& shape,
                                         const Chosen& chosen) {
    SmallVector<std::ptrdiff_t> places;
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

/// The median of the values that are numbers, the lower of two. Reorders the values.
template <class T>
T middle_of(SmallVector<T>& values) {
    auto end = values.end();
    if constexpr (std::is_floating_point_v<T>) {
        end = std::remove_if(values.begin(), end, [](T value) { return std::isnan(value); });
        if (end == values.begin()) return std::numeric_limits<T>::quiet_NaN();
    }
    const auto at = values.begin() + (end - values.begin() - 1) / 2;
    std::nth_element(values.begin(), at, end);
    return *at;
}

template <class T>
void run_selection(const PassRun& run) {
    const TileShape shape(run.of, tile_for(run.of, run.in.extent, sizeof(T)));
    const auto of_copies = places_where(run.of, shape, Counts{run.of});
    const auto in_place = places_where(run.of, {run.of, shape.tile, run.in}, Counts{run.of});
    const auto work = [&](const Tile<T>& tile) {
        const auto& places = &tile.shape == &shape ? of_copies : in_place;
        SmallVector<T> values(places.size());
        for (std::int64_t z = 0; z < tile.extent.z; ++z)
            for (std::int64_t y = 0; y < tile.extent.y; ++y)
                for (std::int64_t x = 0; x < tile.extent.x; ++x) {
                    const T* in = tile.in_row(y, z) + x;
                    for (std::size_t i = 0; i < places.size(); ++i) values[i] = in[places[i]];
                    tile.out_row(y, z)[x] = middle_of(values);
                }
    };
    run_tiles<T>(run, shape, work, TileReads::in_place_but_frames);
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

/// Which places a histogram counts, and what one step to the right changes.
struct Moves {
    SmallVector<std::ptrdiff_t> all;
    SmallVector<std::ptrdiff_t> enters, leaves;  // what leaves is counted from before the step

    Moves(const Neighbourhood& of, const TileShape& shape) {
        const Counts counts{of};
        all = places_where(of, shape, counts);
        enters = places_where(of, shape, [&](auto x, auto y, auto z) {
            return counts(x, y, z) && !counts(x + 1, y, z);
        });
        leaves = places_where(of, shape, [&](auto x, auto y, auto z) {
            return counts(x, y, z) && !counts(x - 1, y, z);
        });
    }
};

template <class T>
void run_histogram(const PassRun& run) {
    static_assert(sizeof(T) == 1);
    const TileShape shape(run.of, tile_for(run.of, run.in.extent, sizeof(T)));
    const Moves of_copies(run.of, shape), in_place(run.of, {run.of, shape.tile, run.in});
    const auto middle = static_cast<std::int32_t>((of_copies.all.size() - 1) / 2);
    // Signed values are moved up, so that their order is that of unsigned ones.
    constexpr int kUp = std::is_signed_v<T> ? 128 : 0;
    const auto level = [](T value) { return static_cast<std::uint8_t>(int(value) + kUp); };
    const auto work = [&](const Tile<T>& tile) {
        const Moves& moves = &tile.shape == &shape ? of_copies : in_place;
        for (std::int64_t z = 0; z < tile.extent.z; ++z)
            for (std::int64_t y = 0; y < tile.extent.y; ++y) {
                const T* in = tile.in_row(y, z);
                T* out = tile.out_row(y, z);
                Histogram histogram;
                for (const std::ptrdiff_t place : moves.all) histogram.add(level(in[place]));
                for (std::int64_t x = 0;;) {
                    out[x] = static_cast<T>(int(histogram.at(middle)) - kUp);
                    if (++x == tile.extent.x) break;
                    for (const std::ptrdiff_t place : moves.leaves)
                        histogram.remove(level(in[x - 1 + place]));
                    for (const std::ptrdiff_t place : moves.enters)
                        histogram.add(level(in[x + place]));
                }
            }
    };
    run_tiles<T>(run, shape, work, TileReads::in_place_but_frames);
}

}  // namespace

Transition filter_median() {
    return filtering_edge({
        .name = "filter.median",
        .source = "Hoare 1961",
        .refused = no_median,
        // Each place is copied. Selecting the middle by medians of three compares 2.75 times as
        // many (Kirschenhofer, Prodinger, Martinez 1997): two reads, a comparison and a step, one
        // by one. A processor guesses how each turns out, half of the time wrongly, and then begins
        // anew: that takes the depth of its pipeline.
        .operations =
            [](const PassAsk& ask) {
                constexpr double kCopied = 3, kTimes = 2.75, kCompared = 4, kDepth = 15;
                return ask.alone() * (kCopied + kTimes * (kCompared + kDepth / 2)) *
                       double(ask.of.places());
            },
        .in_place = true,
        .run =
            [](const PassRun& run, Type type) {
                with_type(type, [&](auto sample) { run_selection<decltype(sample)>(run); });
            },
        .trials = median_trials,
        .factors = {{"", 1.3}},
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
                constexpr double kMoved = 40;  // by 13 levels, as of noise and few places
                // A value, its count there and back, whether it is below the middle, how many are.
                constexpr double kCounted = 5;
                const double ends = 2 * double(n.y) * double(n.z);
                const Extent tile = tile_for(ask.of, ask.from.extent, 1);
                const double first = double(ask.of.places()) / double(tile.x);
                return ask.alone() * (kCounted * (ends + first) + kMoved);
            },
        .in_place = true,
        .run =
            [](const PassRun& run, Type type) {
                if (type == Type::i8)
                    run_histogram<std::int8_t>(run);
                else
                    run_histogram<std::uint8_t>(run);
            },
        .trials = median_trials,
        .factors = {{"", 0.64}},
    });
}

}  // namespace edgewise
