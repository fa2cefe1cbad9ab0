#include "request/tail.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <type_traits>

#include "graph/with_type.hpp"
#include "graph/written.hpp"

namespace edgewise {
namespace {

constexpr std::size_t kLeaf = 1 << 16;  // samples

/// Calls body with a value of the C++ type that samples of a type are written as.
template <class Body>
void with_written_type(Type type, Body&& body) {
    if (type == Type::f16)
        body(Half{});
    else
        with_type(type, body);
}

/// Whether f32 may not hold the values of these samples: those of few bits have wide ones where
/// wider samples were rounded to them.
bool is_wide(const Data& result, const Tail& tail) {
    const auto more_than_f32 = [](Type type) {
        return type == Type::i32 || type == Type::u32 || type == Type::f64;
    };
    return tail.table || more_than_f32(result.what.type) || more_than_f32(tail.type);
}

/// Whether the samples are written as they lie in memory.
bool is_copied(const Data& result, const Tail& tail) {
    return !tail.view && !tail.table && !tail.over_background &&
           tail.alpha != store::Alpha::straight && result.what.type == tail.type &&
           result.what.values == tail.values && result.what.channels == tail.channels;
}

/// Premultiplied colour over the background; the alpha channel goes.
template <class F>
std::array<double, 4> over(const F* in, const std::array<double, 3>& background) noexcept {
    const double through = 1 - in[3];
    return {in[0] + through * background[0], in[1] + through * background[1],
            in[2] + through * background[2], 1};
}

/// Colours of one sample as they are written, before window and rounding.
struct Colours {
    const Tail& tail;
    int in_channels;

    template <class F>
    std::array<double, 4> operator()(const F* in) const noexcept {
        if (tail.over_background) return over(in, tail.background);
        std::array<double, 4> out{};
        for (int c = 0; c < std::min(in_channels, 4); ++c) out[c] = in[c];
        if (tail.alpha == store::Alpha::straight) {
            const int last = in_channels - 1;
            const double alpha = in[last];
            for (int c = 0; c < last; ++c) out[c] = alpha > 0 ? out[c] / alpha : 0;
        }
        return out;
    }
    bool is_alpha(int channel) const noexcept {
        return tail.alpha != store::Alpha::none && channel == in_channels - 1;
    }
};

/// Stored numbers of a result as values, part by part: f32 where they lie, others converted.
/// @tparam F  double where f32 may not hold them
template <class F>
class Values {
 public:
    Values(const Data& result, const Tail& tail) : result_(result), table_(tail.table.get()) {}

    /// The values from `begin` to `end`, counted over channels; good until the next call.
    const F* between(std::size_t begin, std::size_t end) {
        const ValueMap& map = result_.what.values;
        if constexpr (std::is_same_v<F, float>)
            if (result_.what.type == Type::f32 && map.identity())
                return result_.as<float>() + begin;
        converted_.resize(end - begin);
        with_type(result_.what.type, [&](auto zero) {
            const auto* stored = result_.as<decltype(zero)>() + begin;
            for (std::size_t i = 0; i < converted_.size(); ++i)
                converted_[i] = static_cast<F>(value_of(map(static_cast<double>(stored[i]))));
        });
        return converted_.data();
    }

 private:
    double value_of(double number) const noexcept {
        return table_ && number >= 0 ? table_->values[static_cast<std::size_t>(number)] : number;
    }

    const Data& result_;
    const LabelTable* table_;
    std::vector<F> converted_;
};

template <class F, class T>
void convert(const Data& result, const Tail& tail, const Shades& levels, T* out) {
    const auto channels = static_cast<std::size_t>(result.what.channels);
    const Colours colours{tail, result.what.channels};
    const bool view = tail.view;
    double full = 1;
    if constexpr (!std::is_same_v<T, Half>)
        if (view) full = static_cast<double>(std::numeric_limits<T>::max());
    const bool by_logarithm = view && levels.logarithmic;
    const auto scaled = [by_logarithm](double value) {
        constexpr double kLeast = std::numeric_limits<float>::min();
        return by_logarithm ? std::log(std::max(value, kLeast)) : value;
    };
    const double zero = view ? scaled(levels.black) : tail.values.offset;
    const double unit = view ? scaled(levels.white) - zero : tail.values.slope;
    const double opaque = view ? full : tail.alpha_unit;
    const bool as_they_are = !view && tail.values.slope == 1 && !tail.over_background &&
                             tail.alpha == store::Alpha::none &&
                             tail.channels == result.what.channels;
    const auto samples = static_cast<std::size_t>(result.what.samples());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, samples, kLeaf), [&](const auto& part) {
        Values<F> values(result, tail);
        const F* in = values.between(part.begin() * channels, part.end() * channels);
        if (as_they_are) {
            T* to = out + part.begin() * channels;
            for (std::size_t i = 0; i != part.size() * channels; ++i)
                to[i] = stored_as<T>(in[i] - zero);
            return;
        }
        for (std::size_t i = part.begin(); i != part.end(); ++i, in += channels) {
            const auto colour = colours(in);
            for (int c = 0; c < tail.channels; ++c) {
                double value = (scaled(colour[c]) - zero) * full / unit;
                if (view) value = std::clamp(value, 0.0, full);
                if (colours.is_alpha(c)) value = std::clamp(colour[c], 0.0, 1.0) * opaque;
                out[i * static_cast<std::size_t>(tail.channels) + static_cast<std::size_t>(c)] =
                    stored_as<T>(value);
            }
        }
    });
}

/// The labels of 64-bit integers that samples are places of.
void put_integers(const Data& places, const LabelTable& table, std::uint64_t* out) {
    const auto count = static_cast<std::size_t>(places.what.samples() * places.what.channels);
    with_type(places.what.type, [&](auto zero) {
        const auto* place = places.as<decltype(zero)>();
        for (std::size_t i = 0; i < count; ++i)
            out[i] = table.bits[static_cast<std::size_t>(place[i])];
    });
}

/// Calls body(value) for every finite colour that is written, alpha left out.
template <class Body>
void for_each_value(std::span<const std::shared_ptr<const Data>> frames, const Tail& tail,
                    Body body) {
    for (const auto& frame : frames) {
        const Colours colours{tail, frame->what.channels};
        Values<double> values(*frame, tail);
        const auto samples = static_cast<std::size_t>(frame->what.samples());
        const auto channels = static_cast<std::size_t>(frame->what.channels);
        for (std::size_t begin = 0; begin < samples; begin += kLeaf) {
            const std::size_t end = std::min(samples, begin + kLeaf);
            const double* in = values.between(begin * channels, end * channels);
            for (std::size_t i = begin; i < end; ++i, in += channels) {
                const auto colour = colours(in);
                for (int c = 0; c < tail.channels; ++c)
                    if (!colours.is_alpha(c) && std::isfinite(colour[c])) body(colour[c]);
            }
        }
    }
}

/// The value of a rank among all values within [low, high], by counting in ever finer bins: frames
/// need not be copied to be sorted.
double value_of_rank(std::span<const std::shared_ptr<const Data>> frames, const Tail& tail,
                     double low, double high, double rank) {
    constexpr int kClasses = 4096;
    for (int pass = 0; pass < 2 && low < high; ++pass) {
        std::vector<std::int64_t> bins(kClasses);
        const double width = (high - low) / kClasses;
        if (!(width > 0)) break;
        std::int64_t below = 0;
        for_each_value(frames, tail, [&](double v) {
            if (v < low)
                ++below;
            else if (v <= high)
                ++bins[std::min(kClasses - 1, static_cast<int>((v - low) / width))];
        });
        int bin = 0;
        double counted = static_cast<double>(below);
        while (bin < kClasses - 1 && counted + static_cast<double>(bins[bin]) <= rank)
            counted += static_cast<double>(bins[bin++]);
        low += bin * width;
        high = low + width;
    }
    return low;
}

}  // namespace

Shades shades_of(std::span<const std::shared_ptr<const Data>> frames,
                 const std::optional<Window>& window, const Tail& tail) {
    const double exposure = tail.exposure.value_or(1);
    Shades levels{0, 1};
    if (!window && tail.exposure) {
        levels.white /= exposure;
    } else if (window && window->values()) {
        levels = {window->low.at / exposure, window->high.at / exposure};
    } else {
        double low = INFINITY, high = -INFINITY, count = 0;
        for_each_value(frames, tail, [&](double v) {
            low = std::min(low, v), high = std::max(high, v), ++count;
        });
        if (count > 0) levels = {low, high};
        const auto end_of = [&](const WindowEnd& end) {
            if (!end.percentile || count == 0) return end.at;
            if (end.at == 0) return low;
            if (end.at == 100) return high;
            return value_of_rank(frames, tail, low, high, end.at / 100 * (count - 1));
        };
        if (window) levels = {end_of(window->low), end_of(window->high)};
        levels.logarithmic = tail.radiograph;
    }
    // All of one value: it is black.
    if (levels.black == levels.white)
        levels.white = levels.black + std::max(1.0, std::abs(levels.black));
    return levels;
}

bool are_known(const std::optional<Window>& window, const Tail& tail) noexcept {
    return window ? window->values() : tail.exposure.has_value();
}

Array finished(const Data& result, const Tail& tail, const Shades& levels,
               std::pmr::memory_resource* memory) {
    Array out(static_cast<std::size_t>(result.what.samples()) *
                  static_cast<std::size_t>(tail.channels) * bytes_of(tail.type),
              memory);
    if (is_copied(result, tail)) {
        std::memcpy(out.data(), result.samples.data(), out.bytes());
        return out;
    }
    if (tail.integers != store::Wide::no) {
        put_integers(result, *tail.table, static_cast<std::uint64_t*>(out.data()));
        return out;
    }
    with_written_type(tail.type, [&](auto zero) {
        auto* to = static_cast<decltype(zero)*>(out.data());
        if (is_wide(result, tail))
            convert<double>(result, tail, levels, to);
        else
            convert<float>(result, tail, levels, to);
    });
    return out;
}

}  // namespace edgewise
