#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "transitions/kernels/brick_rows.hpp"
#include "transitions/kernels/scalar_load.hpp"
#include "transitions/kernels/sorted_mip.hpp"

namespace edgewise::kernels {
namespace {

constexpr std::int64_t kSideOfSorted = SortedBricks::kSide;
static_assert(kSideOfSorted % kBrickSide == 0);

/// Samples [begin, end) along an axis that places of a brick read.
struct ReadAlong {
    std::int64_t begin, end;

    ReadAlong(std::int64_t brick, const Reach& reach, std::int64_t n)
        : begin(std::max<std::int64_t>(0, brick * kSideOfSorted - reach.before)),
          end(std::min(n, (brick + 1) * kSideOfSorted + reach.behind)) {}
    std::int64_t count() const { return end - begin; }
};

/// The rows that a line of bricks reads.
class RowsRead {
 public:
    RowsRead(const Grid& volume, const Reach& reach, std::pmr::memory_resource* memory)
        : volume_(volume), loads_(!in_lanes(volume.type)), rows_(memory), loaded_(memory) {
        const auto most = static_cast<std::size_t>(kSideOfSorted + reach.before + reach.behind);
        rows_.reserve(most * most);
        if (loads_) loaded_.resize(most * most * pitch());
    }
    Type type() const { return loads_ ? Type::f32 : volume_.type; }

    const std::pmr::vector<const void*>& find(const ReadAlong& along_y, const ReadAlong& along_z) {
        rows_.clear();
        for (std::int64_t z = along_z.begin; z < along_z.end; ++z)
            for (std::int64_t y = along_y.begin; y < along_y.end; ++y)
                rows_.push_back(row((z * volume_.extent.y + y) * volume_.extent.x));
        return rows_;
    }

 private:
    std::size_t pitch() const {
        return static_cast<std::size_t>(volume_.extent.x) + kSlack / sizeof(float);
    }
    const void* row(std::int64_t start) {
        if (!loads_)
            return volume_.tail.of(volume_.as<std::byte>() +
                                   start * static_cast<std::int64_t>(bytes_of(volume_.type)));
        const ScalarLoad load = scalar_load(volume_.type);
        float* const to = loaded_.data() + rows_.size() * pitch();
        for (std::int64_t x = 0; x < volume_.extent.x; ++x)
            to[x] = load(volume_.samples, start + x);
        return to;
    }

    const Grid& volume_;
    bool loads_;
    std::pmr::vector<const void*> rows_;
    std::pmr::vector<float> loaded_;
};

}  // namespace

float bound_bricks(const Grid& volume, const Reach& reach, std::int64_t begin, std::int64_t end,
                   std::span<SortedBrick> bricks, std::pmr::memory_resource* memory) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    // A sum of 64 products rounds; interpolation never leaves what it lies between.
    const float rounding = reach.before > 0 ? 0x1p-20f : 0;
    const bool falls = volume.values.slope < 0;
    const Extent n = sorted_bricks_in(volume.extent);
    const std::int64_t groups = (volume.extent.x + kBrickSide - 1) / kBrickSide;
    const std::size_t room = static_cast<std::size_t>(groups) + kSlack / sizeof(float);
    std::pmr::vector<float> lows(room, memory), highs(room, memory);
    RowsRead rows(volume, reach, memory);
    float least = kInfinity;
    for (std::int64_t k = begin; k < end; ++k)
        for (std::int64_t j = 0; j < n.y; ++j) {
            const auto& read = rows.find({j, reach, volume.extent.y}, {k, reach, volume.extent.z});
            brick_rows(rows.type(), read.data(), static_cast<int>(read.size()), volume.extent.x,
                       {lows.data(), highs.data()});
            for (std::int64_t i = 0; i < n.x; ++i) {
                const ReadAlong along_x(i, reach, volume.extent.x);
                float low = kInfinity, high = -kInfinity;
                for (std::int64_t g = along_x.begin / kBrickSide;
                     g < (along_x.end + kBrickSide - 1) / kBrickSide; ++g) {
                    low = std::min(low, lows[static_cast<std::size_t>(g)]);
                    high = std::max(high, highs[static_cast<std::size_t>(g)]);
                }
                if (low <= high) least = std::min(least, falls ? -high : low);
                const std::int64_t place = (k * n.y + j) * n.x + i;
                const float slack = rounding * std::max(std::abs(low), std::abs(high));
                bricks[static_cast<std::size_t>(place)] = {
                    low > high ? -kInfinity : (falls ? -low : high) + slack,
                    static_cast<std::int32_t>(place)};
            }
        }
    return least;
}

}  // namespace edgewise::kernels
