#include "transitions/spectrum/from_kspace.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "transitions/kernels/fourier.hpp"
#include "transitions/kernels/pmr_block.hpp"

namespace edgewise {
namespace {

using kernels::Complex;

constexpr std::int64_t kTogether = 16;  // lines of a tile

Offer kspace_offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (from.type != Type::c64 || from.channels != 1 || from.layout != Layout::linear ||
        from.place != Place::memory)
        return Offer::no("k-space is one channel of complex samples, whole in memory");
    if (ask.scene.non_finite > 0)
        return Offer::no(
            fmt::format("{} samples are not finite, a transform would spread them everywhere",
                        ask.scene.non_finite));
    Offer offer{.from = from, .to = from, .with = with};
    offer.to.content = "scalar";
    offer.to.drop_facets();
    offer.to.shares = false;
    offer.to.type = Type::f32;
    offer.to.values = {};
    return offer;
}

Work kspace_work(const Offer& offer, const Ask&, int /*view*/) {
    const Extent& n = offer.from.extent;
    const double samples = static_cast<double>(n.samples());
    double operations = 10 * samples;
    std::int64_t longest = 1;
    for (int axis = 0; axis < 3; ++axis) {
        operations += samples / static_cast<double>(n[axis]) * kernels::fourier_operations(n[axis]);
        longest = std::max(longest, n[axis]);
    }
    return {.operations = operations,
            .streamed = 7 * offer.from.bytes() + offer.to.bytes(),
            .scratch = static_cast<double>(kTogether * longest) * sizeof(Complex),
            .workspace = offer.from.bytes()};
}

Error kspace_error(const Offer&, const Ask& ask) {
    // Some ten roundings, of numbers as large as the volume's.
    constexpr double kRoundings = 10 * 0x1p-24;
    return {.noise = kRoundings * std::max(std::abs(ask.scene.low), std::abs(ask.scene.high))};
}

/// Transforms all lines along an axis in place. Both ends of a line are told from its middle: what
/// is sample n / 2 comes first in the transform, and so does voxel n / 2 of what it gives.
void transform_axis(Complex* samples, const Extent& n, int axis, Context& context) {
    const std::int64_t length = n[axis];
    if (length == 1) return;
    const std::int64_t steps[] = {1, n.x, n.x * n.y};
    const int a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;  // the other two
    const std::int64_t lines = n[a] * n[b], middle = length / 2;
    const kernels::Fourier back = kernels::Fourier::along_lines(length, kTogether, true);
    const auto scale = static_cast<float>(1 / static_cast<double>(length));
    tbb::parallel_for(std::int64_t{0}, (lines + kTogether - 1) / kTogether, [&](std::int64_t t) {
        if (context.stopped()) return;
        kernels::Block<Complex> tile(static_cast<std::size_t>(kTogether * length), context.memory);
        std::fill_n(tile.data(), kTogether * length, Complex{});
        const std::int64_t first = t * kTogether, count = std::min(kTogether, lines - first);
        const auto start = [&](std::int64_t l) {
            const std::int64_t line = first + l;
            return samples + line % n[a] * steps[a] + line / n[a] * steps[b];
        };
        for (std::int64_t i = 0; i < length; ++i)
            for (std::int64_t l = 0; l < count; ++l)
                tile.data()[l * length + (i - middle + length) % length] =
                    start(l)[i * steps[axis]];
        back.run(tile.data());
        for (std::int64_t i = 0; i < length; ++i)
            for (std::int64_t l = 0; l < count; ++l)
                start(l)[i * steps[axis]] =
                    scale * tile.data()[l * length + (i - middle + length) % length];
    });
    context.poll();
}

void kspace_run(const Offer& offer, const Ask&, const Data& in, Data& out, const Region&,
                Context& context) {
    const Extent& n = in.what.extent;
    kernels::Block<Complex> samples(static_cast<std::size_t>(n.samples()), context.memory);
    std::copy_n(in.as<Complex>(), n.samples(), samples.data());
    for (int axis = 0; axis < 3; ++axis) transform_axis(samples.data(), n, axis, context);
    const bool magnitude = offer.with.word("part") == "magnitude";
    tbb::parallel_for(std::int64_t{0}, n.y * n.z, [&](std::int64_t row) {
        const Complex* from = samples.data() + row * n.x;
        float* to = out.as<float>() + row * n.x;
        for (std::int64_t x = 0; x < n.x; ++x)
            to[x] = magnitude ? std::hypot(from[x].real(), from[x].imag()) : from[x].real();
    });
    context.poll();
}

}  // namespace

Transition spectrum_from_kspace() {
    Transition edge;
    edge.name = "spectrum.from_kspace";
    edge.source = "Wittenbrink 1993, 5.2; counts of FFTW's manual";
    edge.joins = {{"object/kspace", "object/scalar"}};
    edge.parameters = {{"part", one_of({"magnitude", "real"}, {std::string("magnitude")},
                                       "what a complex voxel becomes")}};
    edge.offer = kspace_offer;
    edge.work = kspace_work;
    edge.error = kspace_error;
    edge.run = kspace_run;
    return edge;
}

}  // namespace edgewise
