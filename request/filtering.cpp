#include "request/filtering.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <vector>

#include "graph/errors.hpp"
#include "graph/with_type.hpp"
#include "io/store.hpp"
#include "transitions/kernels/scalar_load.hpp"

namespace edgewise {
namespace {

constexpr double kMostPlaces = 1 << 22;

double sample_of(const store::Loaded& loaded, std::int64_t place) {
    const store::Header& header = loaded.header;
    const void* samples = loaded.samples.data();
    if (header.type == Type::f16)
        return header.values(
            double(kernels::float_of_half(static_cast<const std::uint16_t*>(samples)[place])));
    return with_type(header.type, [&](auto type) {
        using Stored = decltype(type);
        return header.values(static_cast<double>(static_cast<const Stored*>(samples)[place]));
    });
}

constexpr double kHole = std::numeric_limits<double>::quiet_NaN();

/// A mask: 0 and one other value, places where nothing is said left out.
bool is_mask(const std::vector<double>& weights) {
    double other = 0;
    for (const double weight : weights) {
        if (weight == 0 || !std::isfinite(weight)) continue;
        if (other != 0 && weight != other) return false;
        other = weight;
    }
    return other != 0;
}

/// Weights of a file become places and heights.
void take_heights(Stencil& stencil, FilterOp op, std::vector<Message>& notes) {
    const bool heights = op != FilterOp::median && !is_binary(op);
    const bool mask = is_mask(stencil.weights);
    const bool zeros = std::all_of(stencil.weights.begin(), stencil.weights.end(),
                                   [](double w) { return w == 0; });
    for (double& weight : stencil.weights) {
        if (std::isinf(weight)) weight = kHole;
        if (mask || zeros || !heights) weight = weight == 0 || std::isnan(weight) ? kHole : 0;
    }
    const bool flat = stencil.flat();
    if (heights && !mask && !flat)
        notes.push_back(
            message("@kernel({}): several values other than 0, so they are heights, which are "
                    "added (dilate) or subtracted (erode); a mask of 0 and one other value is a "
                    "flat structuring element",
                    stencil.name));
}

Stencil stencil_in(const std::string& file, int axes, FilterOp op, std::vector<Message>& notes) {
    const bool of_sum = has_weights(op);
    const store::Header header = store::inspect(file, {});
    if (header.channels != 1 || header.times != 1 || header.type == Type::c64)
        throw RequestError(message(
            "@kernel({}): {} channels at {} times; expected one of real numbers at one time", file,
            header.channels, header.times));
    if (axes == 2 && header.extent.z > 1)
        throw RequestError(
            message("@kernel({}): a volume, but {}", file,
                    message("what is filtered is an image (with @slices each slice is one)")));
    if (static_cast<double>(header.extent.samples()) > kMostPlaces)
        throw RequestError(message("@kernel({}): {} places; expected at most {:.0f}", file,
                                   text_of(header.extent, axes), kMostPlaces));
    store::Selection selection;
    selection.as_stored = true;
    const store::Loaded loaded = store::load(file, selection, std::pmr::new_delete_resource());
    Stencil stencil;
    stencil.extent = header.extent;
    stencil.weights.clear();
    for (std::int64_t i = 0; i < header.extent.samples(); ++i)
        stencil.weights.push_back(sample_of(loaded, i));
    stencil.name = file;
    if (of_sum) {
        for (const double weight : stencil.weights)
            if (!std::isfinite(weight))
                throw RequestError(message("@kernel({}): weights of sums must be finite", file));
        return stencil;
    }
    take_heights(stencil, op, notes);
    if (stencil.places(false) == 0)
        throw RequestError(message("@kernel({}): no place of it counts", file));
    return stencil;
}

/// @throws RequestError a program's own kernel that is none
void expect_stencil(const Stencil& stencil, FilterOp op) {
    const Extent& n = stencil.extent;
    if (std::min({n.x, n.y, n.z}) < 1 || static_cast<double>(n.samples()) > kMostPlaces ||
        static_cast<std::int64_t>(stencil.weights.size()) != n.samples())
        throw RequestError(
            message("@kernel: {} places and {} weights; expected as many, at least "
                    "one along each axis, at most {:.0f}",
                    text_of(n, 3), stencil.weights.size(), kMostPlaces));
    if (!std::all_of(stencil.weights.begin(), stencil.weights.end(),
                     [](double weight) { return std::isfinite(weight); }))
        throw RequestError(message("@kernel: weights must be finite"));
    if (!has_weights(op) && stencil.places(false) == 0)
        throw RequestError(message("@kernel: no place of it counts"));
}

using KernelKind = KernelSpec::Kind;

const char* word_of(KernelKind kind) {
    switch (kind) {
        case KernelKind::box:
            return "box";
        case KernelKind::sphere:
            return "sphere";
        case KernelKind::cross:
            return "cross";
        case KernelKind::gauss:
            return "gauss";
        case KernelKind::sobel:
            return "sobel";
        case KernelKind::laplace:
            return "laplace";
        default:
            return "";
    }
}

/// Sizes along the axes [sample].
Stencil::Sizes sizes_of(const KernelSpec& kernel, const FilterGrid& grid) {
    std::vector<double> given =
        kernel.sizes.empty() ? std::vector<double>{kernel.size} : kernel.sizes;
    const std::string text = fmt::format("{}:{:g}{}", word_of(kernel.kind), fmt::join(given, ","),
                                         kernel.lengths ? "mm" : "");
    if (given.size() == 1)
        given.assign(3, given[0]);
    else if (given.size() != static_cast<std::size_t>(grid.axes))
        throw RequestError(message("@kernel({}): {} sizes; expected one, or {}, one an axis", text,
                                   given.size(), grid.axes));
    given.resize(3, 0);
    if (kernel.lengths && !grid.has_unit)
        throw RequestError(
            message("@kernel({}): the input has no unit, so lengths say nothing; give the size in "
                    "samples, or say @input_spacing and @input_unit(mm)",
                    text));
    const bool gauss = kernel.kind == KernelKind::gauss;
    bool some = false;
    std::array<double, 3> sizes{};
    for (int axis = 0; axis < grid.axes; ++axis) {
        const auto k = static_cast<std::size_t>(axis);
        if (!(given[k] >= 0 && std::isfinite(given[k])))
            throw RequestError(
                message("@kernel({}): expected {}", text,
                        gauss ? "a standard deviation above 0" : "a radius of at least 0"));
        sizes[k] = kernel.lengths ? given[k] / grid.spacing[k] : given[k];
        some = some || sizes[k] > 0;
    }
    if (gauss && !some)
        throw RequestError(message("@kernel({}): expected a standard deviation above 0", text));
    if (kernel.flat && grid.axes == 3) sizes[2] = 0;
    double places = 1;
    for (const double size : sizes)
        places *= gauss ? 2 * std::floor(4 * size + 0.5) + 1 : 2 * std::floor(size) + 1;
    if (places > kMostPlaces)
        throw RequestError(
            message("@kernel({}): {:.4g} places on this grid; expected at most {:.0f}", text,
                    places, kMostPlaces));
    return Stencil::Sizes(sizes);
}

Stencil stencil_of(const FilterSpec& spec, const FilterGrid& grid, std::vector<Message>& notes) {
    const KernelSpec& kernel = spec.kernel;
    const int axes = grid.axes;
    const bool of_sum = is_linear(spec.op);
    const auto only_sums = [&] {
        if (!of_sum)
            throw RequestError(
                message("@kernel({}): of @op(convolve) and correlate only, not of {}",
                        word_of(kernel.kind), name_of(spec.op)));
    };
    switch (kernel.kind) {
        case KernelKind::box:
            return Stencil::box(sizes_of(kernel, grid), axes, of_sum);
        case KernelKind::sphere:
            return Stencil::ball(sizes_of(kernel, grid), axes, of_sum);
        case KernelKind::cross:
            return Stencil::cross(sizes_of(kernel, grid), axes, of_sum);
        case KernelKind::gauss:
            only_sums();
            return Stencil::gauss(sizes_of(kernel, grid), axes);
        case KernelKind::sobel:
            only_sums();
            if (kernel.axis < 0)
                throw RequestError(message(
                    "@kernel(sobel): along which axis? Expected sobel:x, or @op(gradient)"));
            if (kernel.axis >= axes)
                throw RequestError(message("@kernel(sobel:{}): the input has only {} axes",
                                           "xyz"[std::clamp(kernel.axis, 0, 2)], axes));
            return Stencil::sobel(kernel.axis, axes);
        case KernelKind::laplace:
            only_sums();
            return Stencil::laplace(axes);
        case KernelKind::difference:
            throw RequestError(
                message("@kernel: differences of neighbours are of @op(gradient) only"));
        case KernelKind::file:
            return stencil_in(kernel.file, axes, spec.op, notes);
        case KernelKind::given:
            expect_stencil(kernel.given, spec.op);
            break;
    }
    return kernel.given;
}

/// One along each axis, for one unit of length.
std::vector<Stencil> derivatives_of(const FilterSpec& spec, const FilterGrid& grid) {
    const KernelSpec& kernel = spec.kernel;
    std::vector<Stencil> all;
    for (int axis = 0; axis < grid.axes; ++axis) {
        Stencil one;
        if (kernel.kind == KernelKind::gauss) {
            const Stencil::Sizes sizes = sizes_of(kernel, grid);
            if (!(sizes.along[static_cast<std::size_t>(axis)] > 0))
                throw RequestError(
                    message("@kernel(gauss): a gradient needs a standard deviation above 0 along "
                            "each axis"));
            one = Stencil::gauss_derivative(sizes, axis, grid.axes);
        } else if (kernel.kind == KernelKind::sobel && kernel.axis < 0) {
            // Of a ramp its sum is twice the smoothing's, whose weights sum to 4 an axis.
            one = Stencil::sobel(axis, grid.axes).times(0.5 * std::pow(0.25, grid.axes - 1));
            one.name = "sobel";
        } else if (kernel.kind == KernelKind::difference) {
            one = Stencil::difference(axis, grid.axes);
        } else {
            throw RequestError(message(
                "@op(gradient): the length of the vector of derivatives, with @kernel(gauss:S) or "
                "sobel, or without one (differences of neighbours), not {}; the morphological "
                "gradient is the difference of @op(dilate) and @op(erode)",
                kernel.kind == KernelKind::file ? kernel.file : word_of(kernel.kind)));
        }
        all.push_back(one.times(1 / grid.spacing[static_cast<std::size_t>(axis)]));
    }
    return all;
}

template <class T>
double mask_value_of(const T* stored, std::int64_t count, const ValueMap& values) {
    double inside = 0;
    for (std::int64_t i = 0; i < count; ++i) {
        const double value = values(static_cast<double>(stored[i]));
        if (value == 0 || std::isnan(value) || value == inside) continue;
        if (inside != 0) return 1;
        inside = value;
    }
    return inside == 0 || !std::isfinite(inside) ? 1 : inside;
}

}  // namespace

Filtering filtering_of(const FilterSpec& spec, const FilterGrid& whole) {
    FilterGrid grid = whole;
    if (spec.slices) grid.axes = 2;
    Filtering made;
    made.op = spec.op;
    made.border = spec.border;
    if (spec.op == FilterOp::gradient) {
        made.derivatives = derivatives_of(spec, grid);
        made.stencil.name = made.derivatives.front().name;
        return made;
    }
    made.stencil = stencil_of(spec, grid, made.notes);
    const bool plane = made.stencil.extent.z == 1 && made.stencil.extent.samples() > 1;
    if (whole.axes == 3 && !spec.slices && spec.kernel.kind == KernelKind::file && plane)
        made.notes.push_back(message(
            "@kernel({}): has one plane, so each slice is filtered by itself, as @slices does",
            spec.kernel.file));
    return made;
}

double mask_value(const Data& data) {
    const std::int64_t count = data.what.samples() * data.what.channels;
    if (!data.samples.data() || data.what.type == Type::c64) return 1;
    if (data.what.type == Type::f16) {
        std::vector<float> values(static_cast<std::size_t>(count));
        for (std::int64_t i = 0; i < count; ++i)
            values[static_cast<std::size_t>(i)] =
                kernels::float_of_half(data.as<std::uint16_t>()[i]);
        return mask_value_of(values.data(), count, data.what.values);
    }
    return with_type(data.what.type, [&](auto type) {
        return mask_value_of(data.as<decltype(type)>(), count, data.what.values);
    });
}

}  // namespace edgewise
