#include "engine/request/filtering.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

#include "graph/errors.hpp"
#include "graph/with_type.hpp"
#include "io/store.hpp"
#include "transitions/kernels/scalar_load.hpp"

namespace edgewise {
namespace {

constexpr double kMostPlaces = 1 << 22;

void expect_places(double side, int axes, const std::string& what) {
    if (std::pow(side, axes) > kMostPlaces)
        throw RequestError(
            fmt::format("--kernel {}: {:.4g} places along each of {} axes; expected "
                        "at most {:.0f} in all",
                        what, side, axes, kMostPlaces));
}

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

Stencil stencil_in(const std::string& file, int axes, bool of_sum) {
    const store::Header header = store::inspect(file, {});
    if (header.channels != 1 || header.times != 1 || header.type == Type::c64)
        throw RequestError(fmt::format(
            "--kernel {}: {} channels at {} times; expected one of real numbers at one time", file,
            header.channels, header.times));
    if (axes == 2 && header.extent.z > 1)
        throw RequestError(fmt::format("--kernel {}: a volume, but the input is an image", file));
    if (static_cast<double>(header.extent.samples()) > kMostPlaces)
        throw RequestError(fmt::format("--kernel {}: {} places; expected at most {:.0f}", file,
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
                throw RequestError(
                    fmt::format("--kernel {}: weights of sums must be finite", file));
        return stencil;
    }
    const bool is_set = std::all_of(stencil.weights.begin(), stencil.weights.end(),
                                    [](double w) { return w == 0 || w == 1; });
    constexpr double kHole = std::numeric_limits<double>::quiet_NaN();
    for (double& weight : stencil.weights) {
        if (is_set) weight = weight == 1 ? 0 : kHole;
        if (std::isinf(weight)) weight = kHole;
    }
    if (stencil.places(false) == 0)
        throw RequestError(fmt::format("--kernel {}: no place of it counts", file));
    return stencil;
}

}  // namespace

Filtering filtering_of(const FilterSpec& spec, int axes) {
    using Kind = KernelSpec::Kind;
    const KernelSpec& kernel = spec.kernel;
    const bool of_sum = is_linear(spec.op);
    const auto expect = [&](bool sensible, const char* name, const char* expected) {
        if (!sensible)
            throw RequestError(
                fmt::format("--kernel {}:{:g}: expected {}", name, kernel.size, expected));
    };
    Filtering made;
    made.op = spec.op;
    made.border = spec.border;
    const auto radius = [&](const char* name) {
        expect(kernel.size >= 0 && std::isfinite(kernel.size), name, "a radius of at least 0");
        expect_places(2 * std::floor(kernel.size) + 1, axes,
                      fmt::format("{}:{:g}", name, kernel.size));
        return kernel.size;
    };
    const auto only_sums = [&](const char* name) {
        if (!of_sum)
            throw RequestError(
                fmt::format("--kernel {}: of --op convolve and correlate only, not of {}", name,
                            name_of(spec.op)));
    };
    switch (kernel.kind) {
        case Kind::box:
            made.stencil = Stencil::box(radius("box"), axes, of_sum);
            break;
        case Kind::sphere:
            made.stencil = Stencil::ball(radius("sphere"), axes, of_sum);
            break;
        case Kind::cross:
            made.stencil = Stencil::cross(radius("cross"), axes, of_sum);
            break;
        case Kind::gauss:
            only_sums("gauss");
            expect(kernel.size > 0 && std::isfinite(kernel.size), "gauss",
                   "a standard deviation above 0");
            expect_places(8 * kernel.size + 2, axes, fmt::format("gauss:{:g}", kernel.size));
            made.stencil = Stencil::gauss(kernel.size, axes);
            break;
        case Kind::sobel:
            only_sums("sobel");
            if (kernel.axis < 0 || kernel.axis >= axes)
                throw RequestError(fmt::format("--kernel sobel:{}: the input has only {} axes",
                                               "xyz"[std::clamp(kernel.axis, 0, 2)], axes));
            made.stencil = Stencil::sobel(kernel.axis, axes);
            break;
        case Kind::laplace:
            only_sums("laplace");
            made.stencil = Stencil::laplace(axes);
            break;
        case Kind::file:
            made.stencil = stencil_in(kernel.file, axes, of_sum);
            break;
        case Kind::given:
            made.stencil = kernel.given;
            break;
    }
    return made;
}

}  // namespace edgewise
