#include "transitions/kernels/gradient.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <vector>

#include "graph/with_type.hpp"

namespace edgewise::kernels {
namespace {

/// A gradient is at most 3/4 of the range of its samples, by the fourth-order difference.
constexpr double kMost = 32767;

/// The rows around one row of a volume, in f32: [dz + 2][dy + 2][x + 2], each with its end samples
/// twice more on either side.
class Rows {
 public:
    explicit Rows(std::int64_t width) : pitch_(static_cast<std::size_t>(width) + 4) {
        for (auto& row : rows_) row.resize(pitch_);
    }

    /// @param corners  with rows that lie beside the row along both axes
    template <class T>
    void load(const Grid& volume, std::int64_t y, std::int64_t z, int reach, bool corners) {
        const Extent& n = volume.extent;
        for (int dz = -reach; dz <= reach; ++dz)
            for (int dy = -reach; dy <= reach; ++dy) {
                const std::int64_t from_y = std::clamp<std::int64_t>(y + dy, 0, n.y - 1);
                const std::int64_t from_z = std::clamp<std::int64_t>(z + dz, 0, n.z - 1);
                if (!corners && dy != 0 && dz != 0) continue;
                const T* from =
                    volume.as<T>() + from_z * volume.slice_step() + from_y * volume.row_step();
                float* to = row(dy, dz);
                for (std::int64_t x = 0; x < n.x; ++x) to[x] = static_cast<float>(from[x]);
                to[-2] = to[-1] = to[0];
                to[n.x] = to[n.x + 1] = to[n.x - 1];
            }
    }
    /// Sample 0 of a neighbouring row.
    float* row(int dy, int dz) {
        return rows_[static_cast<std::size_t>(5 * (dz + 2) + dy + 2)].data() + 2;
    }

 private:
    std::size_t pitch_;
    std::array<std::vector<float>, 25> rows_;
};

template <bool kFinite>
float taken(float value, float here) {
    if constexpr (kFinite) return value;
    return std::isfinite(value) ? value : here;
}

/// Units, rounded; 0 for what is no number.
template <bool kFinite>
std::int16_t units_of(float units) {
    if constexpr (!kFinite) units = std::isfinite(units) ? units : 0;
    return static_cast<std::int16_t>(static_cast<int>(units + std::copysign(0.5f, units)));
}

/// @param value  (dx, dy, dz): a neighbour
template <class Value>
std::array<float, 3> differences(Differences by, const Value& value) {
    const auto along = [&](int axis, int far, int b, int c) {
        std::array<int, 3> at{};
        at[static_cast<std::size_t>(axis)] = far;
        at[static_cast<std::size_t>((axis + 1) % 3)] = b;
        at[static_cast<std::size_t>((axis + 2) % 3)] = c;
        return value(at[0], at[1], at[2]);
    };
    std::array<float, 3> gradient;
    for (int axis = 0; axis < 3; ++axis) {
        const auto difference = [&](int far, int b, int c) {
            return along(axis, far, b, c) - along(axis, -far, b, c);
        };
        float sum = 0;
        switch (by) {
            case Differences::central:
                sum = 0.5f * difference(1, 0, 0);
                break;
            case Differences::fourth:
                sum = (8 * difference(1, 0, 0) - difference(2, 0, 0)) / 12;
                break;
            case Differences::sobel:
                for (int b = -1; b <= 1; ++b)
                    for (int c = -1; c <= 1; ++c)
                        sum += static_cast<float>((2 - std::abs(b)) * (2 - std::abs(c))) *
                               difference(1, b, c);
                sum /= 32;
                break;
        }
        gradient[static_cast<std::size_t>(axis)] = sum;
    }
    return gradient;
}

template <Differences kBy, bool kFinite>
void fill_row(Rows& rows, std::int64_t width, float inverse, std::int16_t* to) {
    const float* const own = rows.row(0, 0);
    std::array<const float*, 25> beside;
    for (int dz = -2; dz <= 2; ++dz)
        for (int dy = -2; dy <= 2; ++dy)
            beside[static_cast<std::size_t>(5 * (dz + 2) + dy + 2)] = rows.row(dy, dz);
    for (std::int64_t x = 0; x < width; ++x) {
        const float here = own[x];
        const std::array<float, 3> gradient = differences(kBy, [&](int dx, int dy, int dz) {
            return taken<kFinite>(beside[static_cast<std::size_t>(5 * (dz + 2) + dy + 2)][x + dx],
                                  here);
        });
        for (std::size_t axis = 0; axis < 3; ++axis) {
            to[4 * x + static_cast<std::int64_t>(axis)] =
                units_of<kFinite>(gradient[axis] * inverse);
        }
        to[4 * x + 3] = 0;
    }
}

/// Central differences, in a form that compilers turn into vectors.
template <bool kFinite>
void fill_central(Rows& rows, std::int64_t width, float inverse, std::int16_t* to) {
    const float *const own = rows.row(0, 0), *const up = rows.row(-1, 0),
                       *const down = rows.row(1, 0), *const front = rows.row(0, -1),
                       *const back = rows.row(0, 1);
    const float half = 0.5f * inverse;
    const auto difference = [half](float below, float here, float above) {
        return half * (taken<kFinite>(above, here) - taken<kFinite>(below, here));
    };
    for (std::int64_t x = 0; x < width; ++x) {
        const float here = own[x];
        to[4 * x] = units_of<kFinite>(difference(own[x - 1], here, own[x + 1]));
        to[4 * x + 1] = units_of<kFinite>(difference(up[x], here, down[x]));
        to[4 * x + 2] = units_of<kFinite>(difference(front[x], here, back[x]));
        to[4 * x + 3] = 0;
    }
}

}  // namespace

float gradient_scale(double low, double high) noexcept {
    const double range = high - low;
    return range > 0 && std::isfinite(range) ? static_cast<float>(range / kMost) : 1;
}

void gradient_slices(const Grid& volume, Differences by, float scale, std::int64_t begin,
                     std::int64_t end, std::int16_t* to) {
    const Extent& n = volume.extent;
    with_type(volume.type, [&](auto zero) {
        using T = decltype(zero);
        constexpr bool kFinite = std::is_integral_v<T>;
        const auto fill = [&] {
            switch (by) {
                case Differences::central:
                    return fill_central<kFinite>;
                case Differences::sobel:
                    return fill_row<Differences::sobel, kFinite>;
                case Differences::fourth:
                    break;
            }
            return fill_row<Differences::fourth, kFinite>;
        }();
        Rows rows(n.x);
        for (std::int64_t z = begin; z < end; ++z)
            for (std::int64_t y = 0; y < n.y; ++y) {
                rows.load<T>(volume, y, z, by == Differences::fourth ? 2 : 1,
                             by == Differences::sobel);
                fill(rows, n.x, 1 / scale, to + 4 * n.x * (y + n.y * z));
            }
    });
}

}  // namespace edgewise::kernels
