#include "transfer/drawn.hpp"

#include <algorithm>
#include <cstdint>
#include <type_traits>
#include <utility>

#include "reference/preview_block.hpp"
#include "reference/stored.hpp"

namespace edgewise {
namespace {

constexpr std::int64_t kEnough = 1 << 15;  // samples, of runs that are drawn for what is in them

/// Where runs begin, one after another: sample, row and slice of the region.
struct Run {
    std::int64_t x, y, z, count;
};

/// The whole region, row by row, or one run of each stretch.
std::vector<Run> placed(const Extent& size, std::int64_t most, std::int64_t length) {
    std::vector<Run> runs;
    const std::int64_t samples = size.samples();
    if (samples <= most * length) {
        runs.reserve(static_cast<std::size_t>(size.y * size.z));
        for (std::int64_t row = 0; row < size.y * size.z; ++row)
            runs.push_back({0, row % size.y, row / size.y, size.x});
        return runs;
    }
    runs.reserve(static_cast<std::size_t>(most));
    const double stretch = static_cast<double>(samples) / static_cast<double>(most);
    const std::int64_t count = std::min(length, size.x);
    for (std::int64_t i = 0; i < most; ++i) {
        const double within = hashed(static_cast<std::uint64_t>(i));
        const std::int64_t at = std::min(
            samples - 1, static_cast<std::int64_t>((static_cast<double>(i) + within) * stretch));
        runs.push_back({std::min(at % size.x, size.x - count), at / size.x % size.y,
                        at / (size.x * size.y), count});
    }
    return runs;
}

}  // namespace

Drawn::Drawn(const Data& data, const Region& region, std::int64_t runs, std::int64_t length,
             const double* only_unlike) {
    if (!data.samples.data() || region.empty()) return;
    const Extent& n = data.what.extent;
    const std::int64_t channels = data.what.channels;
    const ValueMap& map = data.what.values;
    const std::vector<Run> all = placed(region.extent(), runs, length);
    if (!only_unlike) values_.reserve(static_cast<std::size_t>(runs * length));
    with_stored_type(data.what.type, [&]<class T>(T) {
        const auto* stored = data.as<T>();
        // Numbers as they are stored are compared, which takes many at a time.
        constexpr bool kCompares = std::is_arithmetic_v<T>;
        T like{};
        bool skips = false;
        if constexpr (kCompares)
            if (only_unlike) {
                like = static_cast<T>((*only_unlike - map.offset) / map.slope);
                skips = map(as_double(like)) == *only_unlike;
            }
        std::vector<std::pair<const T*, std::int64_t>> kept;
        kept.reserve(all.size());
        std::int64_t count = 0;
        for (const Run& run : all) {
            const T* from =
                stored +
                channels * (run.x + region.begin[0] +
                            n.x * (run.y + region.begin[1] + n.y * (run.z + region.begin[2])));
            if constexpr (kCompares)
                if (skips) {
                    int unlike = 0;
                    for (std::int64_t i = 0; i < run.count * channels; ++i)
                        unlike |= from[i] != like;
                    if (!unlike) continue;
                }
            kept.emplace_back(from, run.count);
            count += run.count;
        }
        // Of many that are unlike some are enough, evenly spread.
        const auto each =
            static_cast<std::size_t>(only_unlike ? (count + kEnough - 1) / kEnough : 1);
        for (std::size_t k = 0; k < kept.size(); k += std::max<std::size_t>(1, each)) {
            const auto [from, samples] = kept[k];
            starts_.push_back(values_.size());
            for (std::int64_t i = 0; i < samples; ++i)
                values_.push_back(static_cast<float>(map(as_double(from[i * channels]))));
        }
    });
    starts_.push_back(values_.size());
}

double quantile_of(std::vector<float>& values, double share) {
    const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), values.begin() + rank, values.end());
    return values[static_cast<std::size_t>(rank)];
}

}  // namespace edgewise
