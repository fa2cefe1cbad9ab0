#include "engine/kept_padding.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "engine/filter_result.hpp"
#include "graph/filtering.hpp"
#include "graph/with_type.hpp"
#include "graph/written.hpp"

namespace edgewise {
namespace {

/// Whether results are values as those of the input: not of derivatives and differences.
bool gives_values(const Filtering& filtering) {
    if (!is_linear(filtering.op))
        return filtering.op == FilterOp::dilate || filtering.op == FilterOp::erode ||
               filtering.op == FilterOp::open || filtering.op == FilterOp::close ||
               filtering.op == FilterOp::median;
    return !is_derivative(filtering.stencil);
}

/// Fills runs of samples of one channel or several.
template <class T>
void fill_runs(const store::PaddingRuns& padding, T number, std::int64_t channels, Array& written) {
    T* samples = reinterpret_cast<T*>(written.data());
    const auto there = static_cast<std::int64_t>(written.bytes() / sizeof(T));
    for (const auto& run : padding.runs) {
        const std::int64_t begin = std::min(run.first * channels, there);
        const std::int64_t end = std::min((run.first + run.count) * channels, there);
        std::fill(samples + begin, samples + end, number);
    }
}

}  // namespace

std::string keep_padding(const Request& want, const Input& input, const Tail& tail,
                         Array& written) {
    const Filtering* filtering = want.setting.as<Filtering>();
    if (!filtering) return "";
    const store::PaddingRuns padding = store::padding_runs(input.header, input.selection);
    if (padding.runs.empty()) return "";
    double value = 0;
    if (!tail.view && gives_values(*filtering)) value = padding.value.value_or(want.zero);
    const double stored = tail.view ? 0 : (value - tail.values.offset) / tail.values.slope;
    if (tail.type == Type::f16)
        fill_runs(padding, stored_as<Half>(stored), tail.channels, written);
    else
        with_type(tail.type, [&](auto zero) {
            fill_runs(padding, stored_as<decltype(zero)>(stored), tail.channels, written);
        });
    return fmt::format(
        "{}: padding entered the filter as {:.6g}, which stands for nothing; in the "
        "result it is {}",
        input.name, input.selection.nothing.value_or(want.zero),
        tail.view ? "black" : fmt::format("{:.6g}", value));
}

}  // namespace edgewise
