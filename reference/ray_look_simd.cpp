#include <algorithm>
#include <cmath>
#include <limits>

#include "reference/answer.hpp"
#include "reference/ray_cells.hpp"
#include "reference/ray_look.hpp"
#include "reference/stored.hpp"
#include "reference/written.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "reference/ray_look_simd.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway demands.
#include <hwy/highway.h>

#include "reference/stored_lanes-inl.hpp"

// Most are plain loops over places, which compilers turn into vectors of each target.

HWY_BEFORE_NAMESPACE();
namespace edgewise {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using namespace stored_lanes::HWY_NAMESPACE;  // NOLINT: how values are loaded

// Of cubic convolution: the slope at the neighbours. The spline's is 0.80.
constexpr float kSlope = -0.75f;
// An extreme is looked for where linear samples come so close to theirs, of their range.
constexpr double kNear = 0.25;

using Numbers = std::array<float, Places::kMost>;
using Values = std::array<double, Places::kMost>;
using Offsets = std::array<std::int64_t, Places::kMost>;

/// A few stored numbers.
template <class D, class T>
HWY_INLINE hn::Vec<D> load_as_float(D d, const T* from) {
    const hn::RebindToSigned<D> whole;
    if constexpr (std::is_integral_v<T> && sizeof(T) <= 2) {
        const hn::Rebind<T, D> narrow;
        return hn::ConvertTo(d, hn::PromoteTo(whole, hn::LoadU(narrow, from)));
    } else if constexpr (std::is_same_v<T, float> || std::is_same_v<T, StoredHalf>) {
        return load(d, from);
    } else {
        std::array<float, hn::MaxLanes(d)> some;
        for (std::size_t i = 0; i < some.size(); ++i) some[i] = static_cast<float>(from[i]);
        return hn::LoadU(d, some.data());
    }
}

/// Channel 0 of stored numbers, mapped; beyond the outermost samples these.
template <class T>
class Stored {
 public:
    explicit Stored(const Data& data)
        : map_(data.what.values), stored_(data.as<T>()), dense_(data.what.channels == 1) {
        std::int64_t stride = data.what.channels;
        for (int axis = 0; axis < data.what.axes; ++axis) {
            last_[axis] = static_cast<double>(data.what.extent[axis] - 1);
            stride_[axis] = stride;
            stride *= data.what.extent[axis];
        }
    }

    void nearest(const Places& places, Values& values) const {
        Offsets offset{};
        for (int axis = 0; axis < 3; ++axis)
            for (std::size_t i = 0; i < places.count; ++i)
                offset[i] +=
                    static_cast<std::int32_t>(clamped(places, axis, i) + 0.5) * stride_[axis];
        for (std::size_t i = 0; i < places.count; ++i)
            values[i] = map_(as_double(stored_[offset[i]]));
    }

    void linear(const Places& places, Values& values) const {
        Offsets offset{};
        std::array<Values, 3> f;
        for (int axis = 0; axis < 3; ++axis)
            for (std::size_t i = 0; i < places.count; ++i) {
                const double q = clamped(places, axis, i);
                const auto cell = static_cast<std::int32_t>(q);  // the floor: not negative
                f[axis][i] = q - static_cast<double>(cell);
                offset[i] += cell * stride_[axis];
            }
        for (std::size_t i = 0; i < places.count; ++i) {
            const double fx = f[0][i], fy = f[1][i], fz = f[2][i];
            // On a sample the next one weighs nothing and may not be there.
            const std::int64_t right = fx > 0 ? stride_[0] : 0;
            const std::int64_t below = fy > 0 ? stride_[1] : 0;
            const T* near = stored_ + offset[i];
            const T* far = near + (fz > 0 ? stride_[2] : 0);
            const auto along = [fx, right](const T* at) {
                const double a = as_double(at[0]);
                return a + fx * (as_double(at[right]) - a);
            };
            const double a = along(near), b = along(near + below);
            const double c = along(far), d = along(far + below);
            const double front = a + fy * (b - a), back = c + fy * (d - c);
            values[i] = map_(front + fz * (back - front));
        }
    }

    void cubic(const Places& places, Values& values) const {
        std::array<std::array<std::int32_t, Places::kMost>, 3> cell;
        std::array<std::array<Numbers, 4>, 3> weight;
        for (int axis = 0; axis < 3; ++axis)
            for (std::size_t i = 0; i < places.count; ++i) {
                const double q = clamped(places, axis, i);
                cell[axis][i] = static_cast<std::int32_t>(q);
                const auto f = static_cast<float>(q - static_cast<double>(cell[axis][i]));
                weight[axis][0][i] = outer(f, 1 - f);
                weight[axis][1][i] = inner(f);
                weight[axis][2][i] = inner(1 - f);
                weight[axis][3][i] = outer(1 - f, f);
            }
        for (std::size_t i = 0; i < places.count; ++i) {
            const std::array at = {cell[0][i], cell[1][i], cell[2][i]};
            std::array<float, 4> column;
            if (is_inside(at))
                sum_columns(stored_ + (at[0] - 1), at, weight, i, column);
            else
                sum_clamped(at, weight, i, column);
            values[i] = map_(
                static_cast<double>(weight[0][0][i] * column[0] + weight[0][1][i] * column[1] +
                                    weight[0][2][i] * column[2] + weight[0][3][i] * column[3]));
        }
    }

    /// As a finer hold where a maximum (sign 1) or minimum (-1) may be, else as linear.
    template <class Hold>
    void finer_near_extreme(int sign, const Places& places, Values& values,
                            Hold&& finer_hold) const {
        linear(places, values);
        double low = std::numeric_limits<double>::infinity(), high = -low;
        for (std::size_t i = 0; i < places.count; ++i) {
            low = std::min(low, values[i]);
            high = std::max(high, values[i]);
        }
        Places near;
        std::array<std::size_t, Places::kMost> from;
        near.count = 0;
        for (std::size_t i = 0; i < places.count; ++i) {
            const double from_end = sign > 0 ? high - values[i] : values[i] - low;
            if (low == high || !(from_end <= kNear * (high - low))) continue;
            from[near.count] = i;
            near.add(places[i]);
        }
        Values finer;
        finer_hold(near, finer);
        for (std::size_t i = 0; i < near.count; ++i) values[from[i]] = finer[i];
    }

 private:
    double clamped(const Places& places, int axis, std::size_t i) const {
        const double p = places.at[axis][i] < 0 ? 0 : places.at[axis][i];
        return p > last_[axis] ? last_[axis] : p;
    }

    // What taps weigh at `near` from them and `far` from the other side.
    static float outer(float near, float far) { return kSlope * near * far * far; }
    static float inner(float near) {
        return ((kSlope + 2) * near - (kSlope + 3)) * near * near + 1;
    }

    /// Whether all taps are there, four of a line side by side.
    bool is_inside(const std::array<std::int32_t, 3>& cell) const {
        bool inside = dense_;
        for (std::size_t axis = 0; axis < 3; ++axis)
            inside = inside && cell[axis] > 0 && cell[axis] + 2 <= last_[axis];
        return inside;
    }

    /// Four neighbours along x, each summed over y and z.
    void sum_columns(const T* line, const std::array<std::int32_t, 3>& cell,
                     const std::array<std::array<Numbers, 4>, 3>& weight, std::size_t i,
                     std::array<float, 4>& column) const {
        line += (cell[1] - 1) * stride_[1] + (cell[2] - 1) * stride_[2];
        const hn::CappedTag<float, 4> four;
        for (std::size_t x = 0; x < 4; x += hn::Lanes(four)) {
            auto sum = hn::Zero(four);
            for (std::size_t k = 0; k < 4; ++k)
                for (std::size_t j = 0; j < 4; ++j) {
                    const auto tap =
                        load_as_float(four, line + x + static_cast<std::int64_t>(j) * stride_[1] +
                                                static_cast<std::int64_t>(k) * stride_[2]);
                    const float across = weight[2][k][i] * weight[1][j][i];
                    sum = hn::Add(sum, hn::Mul(hn::Set(four, across), tap));
                }
            hn::StoreU(sum, four, column.data() + x);
        }
    }

    /// The same; beyond the outermost samples these.
    void sum_clamped(const std::array<std::int32_t, 3>& cell,
                     const std::array<std::array<Numbers, 4>, 3>& weight, std::size_t i,
                     std::array<float, 4>& column) const {
        column = {};
        const auto place = [&](std::size_t axis, std::size_t k) {
            const double at = static_cast<double>(cell[axis]) + static_cast<double>(k) - 1;
            return static_cast<std::int64_t>(std::clamp(at, 0.0, last_[axis])) * stride_[axis];
        };
        for (std::size_t k = 0; k < 4; ++k)
            for (std::size_t j = 0; j < 4; ++j) {
                const T* line = stored_ + place(2, k) + place(1, j);
                const float across = weight[2][k][i] * weight[1][j][i];
                for (std::size_t x = 0; x < 4; ++x)
                    column[x] += across * static_cast<float>(line[place(0, x)]);
            }
    }

    ValueMap map_;
    const T* stored_;
    bool dense_;  // a line's samples lie side by side
    std::array<double, 3> last_{};
    std::array<std::int64_t, 3> stride_{};
};

void by_formula(const Phantom& formula, const Places& places, Values& values) {
    for (std::size_t i = 0; i < places.count; ++i) values[i] = formula.at(places[i]);
}

/// Pictures of rays: one value, or red, green, blue and opacity.
class Caster {
 public:
    explicit Caster(const Request& want) : want_(want) {}

    /// @param front  where the first of the steps begins [t]
    template <class Hold>
    Stretch cast(const RaySpan& ray, double front, double step, Hold&& hold) {
        constexpr double kEnd = std::numeric_limits<double>::infinity();
        auto next = static_cast<std::int64_t>(std::floor((ray.low - front) / step));
        Stretch stretch = Stretch::empty(want_.mode);
        for (cells_.take(kEnd, front, step, ray, next); cells_.count > 0;
             cells_.take(kEnd, front, step, ray, next)) {
            places_.count = cells_.count;
            for (int axis = 0; axis < 3; ++axis)
                for (std::size_t i = 0; i < cells_.count; ++i)
                    places_.at[axis][i] = ray.origin[axis] + cells_.middle[i] * ray.direction[axis];
            hold(places_, values_);
            stretch.add({values_.data(), cells_.count}, cells_.length.data(), want_);
        }
        return stretch;
    }

    /// Slice by slice, as ShearedPicture has it, of the pixel that is nearest to a ray.
    template <class Hold>
    Stretch cast_slices(RaySpan ray, Hold&& hold) {
        int axis = 0;
        ray.direction.cwiseAbs().maxCoeff(&axis);
        const double advance = ray.direction[axis];
        const double slice = advance > 0 ? 0 : static_cast<double>(want_.input[axis] - 1);
        const double first = (slice - ray.origin[axis]) / advance, step = 1 / std::abs(advance);
        for (int across = 0; across < 3; ++across) {
            const double at = ray.origin[across] + first * ray.direction[across];
            if (across != axis) ray.origin[across] += std::floor(at + 0.5) - at;
        }
        ray.high = std::numeric_limits<double>::infinity();
        ray.low = -ray.high;
        if (!ray.clip(want_.input)) ray.low = ray.high = first;
        return cast(ray, first - 0.5 * step, step, hold);
    }

 private:
    const Request& want_;
    RayCells cells_;
    Places places_;
    Values values_;
};

/// The reference, guessed through the stored numbers.
template <class T>
Stretch guessed(const Stored<T>& stored, Caster& caster, const RaySpan& ray, const Request& want,
                const ReferenceField& field) {
    const auto cast = [&](double step, const auto& hold) {
        return caster.cast(ray, front_of(want), step, hold);
    };
    const auto zoh = [&](auto&... at) { stored.nearest(at...); };
    const auto foh = [&](auto&... at) { stored.linear(at...); };
    // What decides at a threshold is an extreme, of a surface now one and now the other.
    const bool decides = want.mode->threshold && want.mode->threshold->flip;
    const int extreme = decides ? 1 : want.mode->extreme;
    const auto finest = [&](const Places& places, Values& values) {
        if (field.kind() == Field::formula)
            by_formula(*field.formula(), places, values);
        else
            stored.cubic(places, values);
    };
    // Values between samples move an extreme, and edges of a formula move it where a ray grazes
    // them; integrals hardly change.
    const auto near_extreme = [&](const Places& places, Values& values) {
        stored.finer_near_extreme(extreme, places, values, finest);
    };
    if (field.kind() == Field::nearest) return cast(0.25, zoh);
    if (field.kind() == Field::linear) return cast(0.25, foh);
    if (want.mode->threshold && !decides) return cast(0.5, finest);
    if (extreme == 0) return cast(1, finest);
    return cast(field.kind() == Field::formula ? 0.25 : 0.5, near_extreme);
}

template <class T>
RayLook LookThrough(const RaySpan& ray, const Request& want, const ReferenceField& field) {
    const Stored<T> stored(field.samples());
    Caster caster(want);
    const auto cast = [&](double step, const auto& hold) {
        return caster.cast(ray, front_of(want), step, hold);
    };
    const auto zoh = [&](auto&... at) { stored.nearest(at...); };
    const auto foh = [&](auto&... at) { stored.linear(at...); };
    const Stretch guess = guessed(stored, caster, ray, want, field);
    const bool sheared = !want.eye && want.clips.empty();
    const Stretch slices = sheared ? caster.cast_slices(ray, zoh) : guess;
    const std::array<Stretch, RayLook::kCasts> got = {cast(1, zoh), cast(2, zoh), cast(1, foh),
                                                      cast(2, foh), slices};
    const int channels = written_channels(want, want.mode->channels);
    const auto written = [&](const Stretch& stretch) {
        std::array<double, 4> values{};
        stretch.result(want, values.data());
        as_written(want, values.data());
        return values;
    };
    const std::array<double, 4> expected = written(guess);
    RayLook look{.low = 1, .high = 0};
    for (std::size_t i = 0; i < got.size(); ++i) {
        const double square = mean_square(written(got[i]).data(), expected.data(), channels);
        if (std::isfinite(square)) look.squares[i] = square;
    }
    if (const Threshold* const threshold = want.mode->threshold) {
        look.margin = threshold->margin(guess, want);
        for (std::size_t i = 0; i < got.size(); ++i)
            look.margins[i] = threshold->margin(got[i], want);
        Stretch flipped = guess;
        if (threshold->flip)
            threshold->flip(flipped);
        else  // white as long as nothing lights it
            flipped.state[0] = flipped.state[1] = 1 - flipped.state[0];
        look.jump = mean_square(written(flipped).data(), expected.data(), channels);
    }
    const auto [low, high] = std::minmax_element(expected.begin(), expected.begin() + channels);
    if (std::isfinite(*low) && std::isfinite(*high)) {
        look.low = *low;
        look.high = *high;
    }
    return look;
}

std::array<double, 4> GuessAt(const RaySpan& ray, const Request& want,
                              const ReferenceField& field) {
    return with_stored_type(field.samples().what.type, [&](auto zero) {
        const Stored<decltype(zero)> stored(field.samples());
        Caster caster(want);
        std::array<double, 4> result{};
        guessed(stored, caster, ray, want, field).result(want, result.data());
        return result;
    });
}

RayLook LookAt(const RaySpan& ray, const Request& want, const ReferenceField& field) {
    return with_stored_type(field.samples().what.type, [&](auto zero) {
        return LookThrough<decltype(zero)>(ray, want, field);
    });
}

void LookAtPlaces(const Places& places, const ReferenceField& field, PointLook& look) {
    with_stored_type(field.samples().what.type, [&](auto zero) {
        const Stored<decltype(zero)> stored(field.samples());
        stored.nearest(places, look.nearest);
        stored.linear(places, look.linear);
        if (field.kind() == Field::nearest)
            look.guess = look.nearest;
        else if (field.kind() == Field::linear)
            look.guess = look.linear;
        else if (field.kind() == Field::formula)
            by_formula(*field.formula(), places, look.guess);
        else
            stored.cubic(places, look.guess);
    });
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace edgewise
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise {

HWY_EXPORT(LookAt);
HWY_EXPORT(LookAtPlaces);
HWY_EXPORT(GuessAt);

RayLook look_at(const RaySpan& ray, const Request& want, const ReferenceField& field) {
    return HWY_DYNAMIC_DISPATCH(LookAt)(ray, want, field);
}

std::array<double, 4> guess_at(const RaySpan& ray, const Request& want,
                               const ReferenceField& field) {
    return HWY_DYNAMIC_DISPATCH(GuessAt)(ray, want, field);
}

void look_at(const Places& places, const ReferenceField& field, PointLook& look) {
    HWY_DYNAMIC_DISPATCH(LookAtPlaces)(places, field, look);
}

}  // namespace edgewise
#endif
