#include "engine/filter_result.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include "graph/filtering.hpp"
#include "graph/with_type.hpp"

namespace edgewise {
namespace {

/// What a sum makes of samples that are all the largest or all 0: its ends, for samples from 0 to
/// 1.
struct Reach {
    double below = 0, above = 0;
    bool whole = true;

    explicit Reach(const Stencil& stencil) {
        for (const double weight : stencil.weights) {
            if (!std::isfinite(weight)) continue;
            (weight < 0 ? below : above) += weight;
            whole = whole && weight == std::round(weight);
        }
    }
    /// Weights of both signs that add up to nothing.
    bool is_derivative() const noexcept {
        constexpr double kRounding = 1e-6;
        return below < 0 && std::abs(above + below) <= kRounding * (above - below);
    }
};

bool is_unsigned(Type type) noexcept {
    return type == Type::u8 || type == Type::u16 || type == Type::u32;
}

/// The narrowest signed type for sums of stored numbers, or f32.
Type signed_type(Type type, const Reach& reach) {
    if (!reach.whole) return Type::f32;
    const double most = limits_of(type)[1];
    for (const Type wide : {Type::i16, Type::i32}) {
        const auto [low, high] = limits_of(wide);
        if (bytes_of(wide) > bytes_of(type) && reach.below * most >= low &&
            reach.above * most <= high)
            return wide;
    }
    return Type::f32;
}

}  // namespace

bool is_derivative(const Stencil& kernel) { return Reach(kernel).is_derivative(); }

FilterResult filter_result(const Request& want, const store::Header& input, double low,
                           double high) {
    FilterResult result{.header = input, .low = low, .high = high, .notes = {}};
    const Filtering* filtering = want.setting.as<Filtering>();
    if (!filtering) return result;
    result.notes = filtering->notes;
    store::Header& header = result.header;
    if (has_weights(filtering->op)) header.labels = false;
    if (filtering->op == FilterOp::gradient) {
        if (header.type != Type::f64) header.type = Type::f32;
        header.values = {};
        return result;
    }
    if (!is_linear(filtering->op) || !is_unsigned(input.type) || input.values.slope <= 0)
        return result;
    const Reach reach(filtering->stencil);
    if (!reach.is_derivative()) return result;
    header.type = signed_type(input.type, reach);
    header.values = header.type == Type::f32 ? ValueMap{} : ValueMap{input.values.slope, 0};
    result.low = reach.below * std::max(std::abs(low), std::abs(high));
    result.high = reach.above * std::max(std::abs(low), std::abs(high));
    result.keeps_sign = true;
    return result;
}

std::optional<Message> cut_off_text(const Request& want, const Data& result, const Tail& tail) {
    if (!want.setting.as<Filtering>() || tail.view || tail.table || !is_integer(tail.type) ||
        result.what.type == Type::f16 || result.what.type == Type::c64)
        return {};
    if (result.what.type == tail.type && result.what.values == tail.values) return {};
    const auto [low, high] = limits_of(tail.type);
    const std::int64_t n = result.what.samples() * result.what.channels;
    constexpr std::int64_t kGrain = 1 << 16;
    const std::int64_t beyond = with_type(result.what.type, [&, low = low, high = high](auto type) {
        const auto* stored = result.as<decltype(type)>();
        return tbb::parallel_reduce(
            tbb::blocked_range<std::int64_t>(0, n, kGrain), std::int64_t{0},
            [&](const auto& part, std::int64_t count) {
                for (std::int64_t i = part.begin(); i < part.end(); ++i) {
                    const double value = result.what.values(static_cast<double>(stored[i]));
                    const double number =
                        std::nearbyint((value - tail.values.offset) / tail.values.slope);
                    count += number < low || number > high;
                }
                return count;
            },
            [](std::int64_t a, std::int64_t b) { return a + b; });
    });
    if (beyond == 0) return {};
    return message(
        "{} of {} values ({:.3g} %) are beyond {} and were cut off; @bits(32) and a format that "
        "holds f32 (.nrrd, .nii.gz, .tif) keep them",
        beyond, n, 100 * double(beyond) / double(n), name_of(tail.type));
}

}  // namespace edgewise
