#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <type_traits>
#include <vector>

#include "transitions/kernels/ray_cast.hpp"
#include "transitions/kernels/scalar_load.hpp"

namespace edgewise::kernels {
namespace {

constexpr std::int64_t kSide = 1 << Bricks::kShift;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

struct Span {
    float low = kInfinity, high = -kInfinity;

    bool operator==(const Span&) const = default;
};

/// The largest opacity that a value between two stored numbers has.
float largest_opacity(const Optics& optics, const Span& span) {
    if (span.low > span.high) return 0;  // nothing finite
    const auto at = [&](float value) {
        float opacity = optics.opacity;
        for (const OpticsRamp& ramp : optics.ramps)
            opacity +=
                ramp.opacity * std::clamp((value - ramp.start) * ramp.inverse_width, 0.0f, 1.0f);
        return opacity;
    };
    float largest = std::max(at(span.low), at(span.high));
    for (const OpticsRamp& ramp : optics.ramps) {
        const float end = ramp.start + 1 / ramp.inverse_width;
        for (const float knot : {ramp.start, end})
            if (knot > span.low && knot < span.high) largest = std::max(largest, at(knot));
    }
    // Interpolated samples round: what is transparent by less than that is not skipped.
    return largest > 0 ? largest : 0;
}

/// The same of one brick after the other: most are like the one before where data are empty.
class LargestOpacity {
 public:
    explicit LargestOpacity(const Optics& optics) : optics_(optics) {}
    float operator()(const Span& span) {
        if (span != last_) {
            last_ = span;
            largest_ = largest_opacity(optics_, span);
        }
        return largest_;
    }

 private:
    const Optics& optics_;
    Span last_;  // nothing finite
    float largest_ = 0;
};

/// Least and greatest finite sample of every 4^3 brick of one line of bricks. First across rows,
/// element by element, then along them: the first part is most of the work, and a plain loop.
template <class T>
class LineOfBricks {
 public:
    LineOfBricks(std::int64_t n, std::pmr::memory_resource* memory)
        : low_(static_cast<std::size_t>(n), memory), high_(static_cast<std::size_t>(n), memory) {}

    void clear() {
        std::fill(low_.begin(), low_.end(), kGreatest);
        std::fill(high_.begin(), high_.end(), kLeast);
    }
    void add(const T* row) {
        const std::int64_t n = static_cast<std::int64_t>(low_.size());
        T* low = low_.data();
        T* high = high_.data();
        for (std::int64_t x = 0; x < n; ++x) {
            // Infinity counts as nothing; comparisons with NaN are false.
            const T v = row[x];
            low[x] = v < low[x] && v >= kLeast ? v : low[x];
            high[x] = v > high[x] && v <= kGreatest ? v : high[x];
        }
    }
    Span span(std::int64_t brick) const {
        const std::int64_t n = static_cast<std::int64_t>(low_.size()), begin = brick * kSide;
        T low = kGreatest, high = kLeast;
        for (std::int64_t x = begin; x < std::min(begin + kSide, n); ++x) {
            low = std::min(low, low_[x]);
            high = std::max(high, high_[x]);
        }
        if (low > high) return {};
        return {static_cast<float>(low), static_cast<float>(high)};
    }

 private:
    static constexpr T kLeast = std::numeric_limits<T>::lowest();
    static constexpr T kGreatest = std::numeric_limits<T>::max();
    std::pmr::vector<T> low_, high_;
};

/// Any other type, read through f32.
struct Loaded {};

template <class T>
void layers(const Grid& volume, const Optics* optics, std::int64_t begin, std::int64_t end,
            Bricks& bricks) {
    std::pmr::memory_resource* memory = bricks.level.get_allocator().resource();
    constexpr bool kLoaded = std::is_same_v<T, Loaded>;
    const Extent& n = volume.extent;
    LineOfBricks<std::conditional_t<kLoaded, float, T>> line(n.x, memory);
    std::pmr::vector<float> loaded(kLoaded ? static_cast<std::size_t>(n.x) : 0, memory);
    const ScalarLoad load = scalar_load(volume.type);
    std::optional<LargestOpacity> opacity;
    if (optics) opacity.emplace(*optics);
    const auto row = [&](std::int64_t start) {
        if constexpr (kLoaded) {
            for (std::int64_t x = 0; x < n.x; ++x) loaded[x] = load(volume.samples, start + x);
            return loaded.data();
        } else {
            return volume.as<T>() + start;
        }
    };
    for (std::int64_t k = begin; k < end; ++k)
        for (std::int64_t j = 0; j < bricks.extent.y; ++j) {
            line.clear();
            for (std::int64_t z = k * kSide; z < std::min((k + 1) * kSide, n.z); ++z)
                for (std::int64_t y = j * kSide; y < std::min((j + 1) * kSide, n.y); ++y)
                    line.add(row((z * n.y + y) * n.x));
            float* level = bricks.level.data() + (k * bricks.extent.y + j) * bricks.extent.x;
            for (std::int64_t i = 0; i < bricks.extent.x; ++i) {
                const Span span = line.span(i);
                level[i] = opacity                   ? (*opacity)(span)
                           : volume.values.slope < 0 ? -span.low
                                                     : span.high;
            }
        }
}

Extent bricks_in(const Extent& volume) {
    Extent bricks;
    for (int axis = 0; axis < 3; ++axis) bricks[axis] = (volume[axis] + kSide - 1) / kSide;
    return bricks;
}

}  // namespace

Bricks::Bricks(const Extent& volume, std::pmr::memory_resource* memory)
    : extent(bricks_in(volume)), level(static_cast<std::size_t>(extent.samples()), memory) {}

void brick_layers(const Grid& volume, const Optics* optics, std::int64_t begin, std::int64_t end,
                  Bricks& bricks) {
    switch (volume.type) {
        case Type::u8:
            return layers<std::uint8_t>(volume, optics, begin, end, bricks);
        case Type::i8:
            return layers<std::int8_t>(volume, optics, begin, end, bricks);
        case Type::u16:
            return layers<std::uint16_t>(volume, optics, begin, end, bricks);
        case Type::i16:
            return layers<std::int16_t>(volume, optics, begin, end, bricks);
        case Type::f32:
            return layers<float>(volume, optics, begin, end, bricks);
        default:
            return layers<Loaded>(volume, optics, begin, end, bricks);
    }
}

void spread_bricks(Bricks& bricks) {
    // Along each axis in turn, the largest of three: runs of `stride` levels move together.
    const Extent& n = bricks.extent;
    std::pmr::memory_resource* memory = bricks.level.get_allocator().resource();
    std::int64_t stride = 1;
    for (int axis = 0; axis < 3; stride *= n[axis++]) {
        const std::int64_t count = n[axis];
        std::pmr::vector<float> before(static_cast<std::size_t>(stride), memory);
        std::pmr::vector<float> old(before.size(), memory);
        for (std::int64_t start = 0; start < n.samples(); start += stride * count) {
            float* level = bricks.level.data() + start;
            std::copy_n(level, stride, before.data());
            for (std::int64_t i = 0; i < count; ++i, level += stride) {
                const float* after = i + 1 < count ? level + stride : level;
                std::copy_n(level, stride, old.data());
                for (std::int64_t r = 0; r < stride; ++r)
                    level[r] = std::max(std::max(before[r], old[r]), after[r]);
                before.swap(old);
            }
        }
    }
}

}  // namespace edgewise::kernels
