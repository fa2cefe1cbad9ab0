#include "transitions/warp/phase_lines.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <fmt/format.h>
#include <memory>
#include <numbers>
#include <tbb/parallel_for.h>

#include "graph/spread.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/scalar_load.hpp"
#include "transitions/kernels/shear.hpp"
#include "transitions/warp/equiareal.hpp"
#include "transitions/warp/outside.hpp"

namespace edgewise {
namespace {

std::size_t frequencies(std::int64_t n) noexcept { return static_cast<std::size_t>(n / 2 + 1); }

/// More output samples of an axis are a mistake.
constexpr double kMostPlaces = 1 << 24;

using PhaseArray = kernels::Block<float>;

Extent made_along(const Extent& n, int axis, std::int64_t m) noexcept {
    Extent to = n;
    to[axis] = m;
    return to;
}

/// The array behind each axis that moves.
std::array<Extent, 4> phase_stages(const std::array<PhaseAxis, 3>& axes, const Extent& n) noexcept {
    std::array<Extent, 4> all{n, n, n, n};
    for (int axis = 0; axis < 3; ++axis)
        all[static_cast<std::size_t>(axis) + 1] =
            made_along(all[static_cast<std::size_t>(axis)], axis, axes[axis].to);
    return all;
}

double floats_of(const Extent& n) noexcept { return static_cast<double>(n.samples()); }

Work work_along_axes(const Offer& offer, const Ask& ask, int view) {
    std::string refused;
    const std::array<PhaseAxis, 3> axes = phase_axes(offer.from, ask.want, view, refused);
    const std::array<Extent, 4> stages = phase_stages(axes, offer.from.extent);
    constexpr double kFloat = sizeof(float);
    double largest = floats_of(stages[0]);
    Work work{.streamed = offer.from.bytes() + 2 * offer.to.bytes()};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (!axes[axis].moves()) continue;
        const PhaseAxis& along = axes[axis];
        const double lines = floats_of(stages[axis]) / static_cast<double>(along.from);
        work.operations += lines * PhaseLines::operations(along.from, along.to);
        work.streamed += kFloat * (floats_of(stages[axis]) + floats_of(stages[axis + 1]));
        work.scratch = std::max(work.scratch, PhaseLines::Line::bytes(along.from, along.to));
        largest = std::max(largest, floats_of(stages[axis + 1]));
    }
    work.workspace = 2 * largest * kFloat;
    return work;
}

std::int64_t modulo(std::int64_t i, std::int64_t n) noexcept {
    const std::int64_t rest = i % n;
    return rest < 0 ? rest + n : rest;
}

void run_along_axes(const Offer& offer, const Ask& ask, const Data& in, Data& out,
                    Context& context) {
    std::string refused;
    const std::array<PhaseAxis, 3> axes = phase_axes(offer.from, ask.want, context.view, refused);
    const std::array<Extent, 4> stages = phase_stages(axes, in.what.extent);
    const auto array_of = [&](const Extent& n) {
        return std::make_unique<PhaseArray>(static_cast<std::size_t>(n.samples()), context.memory);
    };
    std::unique_ptr<PhaseArray> now = array_of(stages[0]);
    read_as_f32(in, now->data(), context);
    for (int axis = 0; axis < 3; ++axis) {
        const PhaseAxis& along = axes[static_cast<std::size_t>(axis)];
        if (!along.moves()) continue;
        const Extent& n = stages[static_cast<std::size_t>(axis)];
        std::unique_ptr<PhaseArray> next = array_of(stages[static_cast<std::size_t>(axis) + 1]);
        read_lines_at(
            now->data(), n, axis, along.to, [&](std::int64_t, std::int64_t) { return along.first; },
            next->data(), context);
        now = std::move(next);
    }
    const Extent held = stages[3], n = out.what.extent;
    const kernels::Affine to_input = inverse_map(offer.from, ask.want, context.view);
    tbb::parallel_for(std::int64_t{0}, n.y * n.z, [&](std::int64_t row) {
        if (context.stopped()) return;
        const std::int64_t y = row % n.y, z = row / n.y;
        const float* from = now->data() + held.x * (modulo(y, held.y) + held.y * modulo(z, held.z));
        float* to = out.at<float>(0, y, z);
        for (std::int64_t x = 0; x < n.x; ++x) to[x] = from[modulo(x, held.x)];
        Region part = Region::all(n);
        part.begin[1] = y, part.end[1] = y + 1, part.begin[2] = z, part.end[2] = z + 1;
        kernels::mask_outside(to_input, in.what.extent, static_cast<float>(outside_of(ask)),
                              out.as<float>(), out.held(), part);
    });
    context.poll();
}

}  // namespace

PhaseLines::PhaseLines(std::int64_t n, std::int64_t m)
    : n_(n),
      m_(m),
      forward_(kernels::Fourier::real_row(n)),
      back_(kernels::Fourier::to_real_row(m)) {}

PhaseLines::Line::Line(const PhaseLines& of, std::pmr::memory_resource* memory)
    : in(static_cast<std::size_t>(of.n_), memory),
      out(static_cast<std::size_t>(of.m_), memory),
      before(frequencies(of.n_), memory),
      after(frequencies(of.m_), memory) {}

double PhaseLines::operations(std::int64_t n, std::int64_t m) noexcept {
    // A complex phase and its product a frequency, one by one: vectors hold eight. A sample in and
    // one out.
    constexpr double kFrequency = 14 * 8, kCopied = 4;
    const auto in = static_cast<double>(n), out = static_cast<double>(m);
    return 2.5 * in * std::log2(in + 1) + 2.5 * out * std::log2(out + 1) +
           kFrequency * 0.5 * std::min(in, out) + kCopied * (in + out);
}

double PhaseLines::Line::bytes(std::int64_t n, std::int64_t m) noexcept {
    return 2. * sizeof(float) * static_cast<double>(n + m + 2);
}

void PhaseLines::run(Line& line, double first) const {
    forward_.run(line.in.data(), line.before.data());
    const std::int64_t least = std::min(n_, m_), count = least / 2 + 1;
    // In turns, so that a phase far along the line keeps its digits.
    const double turn = (first - std::floor(first / double(n_)) * double(n_)) / double(n_);
    const std::complex<double> step = std::polar(1.0, 2 * std::numbers::pi * turn);
    std::complex<double> phase = 1 / static_cast<double>(n_);
    for (std::int64_t j = 0; j < count; ++j, phase *= step) {
        const std::complex<double> value =
            std::complex<double>(line.before[std::size_t(j)]) * phase;
        line.after[std::size_t(j)] = kernels::Complex(value);
    }
    // Both ends of an even spectrum come as one number. Where more places follow, it stands for
    // itself and its mirror, so half of it. As the last one, the transform takes its real part.
    if (least % 2 == 0 && n_ < m_) line.after[std::size_t(count - 1)] *= 0.5f;
    std::fill(line.after.data() + count, line.after.data() + frequencies(m_), kernels::Complex{});
    back_.run(line.after.data(), line.out.data());
}

void read_lines_at(const float* in, const Extent& n, int axis, std::int64_t m,
                   const std::function<double(std::int64_t, std::int64_t)>& first, float* out,
                   Context& context) {
    const PhaseLines lines(n[axis], m);
    const Extent to = made_along(n, axis, m);
    // Neighbouring lines share cache lines.
    const std::int64_t inner = axis == 0 ? n.y : n.x, outer = axis == 2 ? n.y : n.z;
    const auto start = [&](const Extent& of, std::int64_t i, std::int64_t j) {
        if (axis == 0) return of.x * (i + of.y * j);
        return axis == 1 ? i + of.x * of.y * j : i + of.x * j;
    };
    const auto stride = [&](const Extent& of) {
        return axis == 0 ? std::int64_t{1} : axis == 1 ? of.x : of.x * of.y;
    };
    constexpr std::int64_t kTogether = 16;
    const std::int64_t groups = (inner + kTogether - 1) / kTogether;
    tbb::parallel_for(std::int64_t{0}, groups * outer, [&](std::int64_t group) {
        if (context.stopped()) return;
        PhaseLines::Line line(lines, context.memory);
        const std::int64_t j = group / groups, begin = group % groups * kTogether;
        for (std::int64_t i = begin; i < std::min(inner, begin + kTogether); ++i) {
            const float* from = in + start(n, i, j);
            float* at = out + start(to, i, j);
            for (std::int64_t k = 0; k < n[axis]; ++k)
                line.in[std::size_t(k)] = from[k * stride(n)];
            // A margin of zeros stays one, and may be most of a sheared box.
            const float* samples = line.in.data();
            if (std::all_of(samples, samples + n[axis], [](float sample) { return sample == 0; }))
                std::fill_n(line.out.data(), m, 0.f);
            else
                lines.run(line, first(i, j));
            for (std::int64_t k = 0; k < m; ++k) at[k * stride(to)] = line.out[std::size_t(k)];
        }
    });
    context.poll();
}

void read_as_f32(const Data& in, float* out, Context& context) {
    const kernels::Grid grid = kernels::grid_of(in);
    const kernels::ScalarLoad load = kernels::scalar_load(grid.type);
    const Extent n = in.what.extent;
    const bool as_stored = grid.values.identity();
    tbb::parallel_for(std::int64_t{0}, n.y * n.z, [&](std::int64_t row) {
        if (context.stopped()) return;
        const std::int64_t from = row % n.y * grid.row_step() + row / n.y * grid.slice_step();
        for (std::int64_t x = 0; x < n.x; ++x) {
            const float stored = load(grid.samples, from + x);
            out[row * n.x + x] =
                as_stored ? stored : static_cast<float>(grid.values(static_cast<double>(stored)));
        }
    });
    context.poll();
}

std::string no_phases(const Representation& from, const Ask& ask) {
    if (ask.want.job->of_rays()) return "the result is a picture; phases move samples";
    if (ask.want.field == Field::nearest) return "labels: interpolation would make new values";
    if (from.channels != 1) return fmt::format("{} channels; moves one", from.channels);
    if (from.type == Type::c64) return "complex samples are no warp's";
    if (!is_whole(from)) return "needs all samples in memory, row by row";
    if (ask.want.projective()) return "a projective map is no shift of lines";
    if (ask.scene.non_finite > 0)
        return fmt::format("{} samples are not finite: a transform would spread them over lines",
                           ask.scene.non_finite);
    return {};
}

std::array<PhaseAxis, 3> phase_axes(const Representation& from, const Request& want, int view,
                                    std::string& refused) {
    constexpr double kSame = 1e-9, kWhole = 1e-6;
    std::array<PhaseAxis, 3> axes;
    const Mat4 map = residual(from, want, view);
    for (int axis = 0; axis < 3; ++axis) {
        PhaseAxis& along = axes[static_cast<std::size_t>(axis)];
        along.from = from.extent[axis];
        const double scale = map(axis, axis), places = scale * static_cast<double>(along.from);
        for (int other = 0; other < 3; ++other)
            if (other != axis && std::abs(map(axis, other)) > kSame)
                refused = fmt::format("view {}: axes are turned or sheared", view);
        if (!refused.empty()) return axes;
        if (!(scale > 0) || places > kMostPlaces)
            refused = fmt::format("view {}: an axis is scaled by {:.4g}", view, scale);
        else if (places < 0.5 || std::abs(places - std::round(places)) > kWhole)
            refused = fmt::format(
                "view {}: {} samples scaled by {:.6g} give {:.6g}, "
                "not a whole number of places",
                view, along.from, scale, places);
        if (!refused.empty()) return axes;
        along.to = std::llround(places);
        along.first =
            -map(axis, 3) * static_cast<double>(along.from) / static_cast<double>(along.to);
        // What rounding leaves of whole samples is none.
        if (std::abs(along.first - std::round(along.first)) < kSame)
            along.first = std::round(along.first);
    }
    return axes;
}

Transition phase_axes_edge(std::string name, std::string source, bool scales) {
    Transition edge;
    edge.name = std::move(name);
    edge.source = std::move(source);
    edge.joins = {{"object/scalar", "screen/scalar"}};
    edge.on_demand = true;
    edge.offer = [scales](const Representation& from, const Ask& ask, const Parameters& with) {
        if (std::string reason = no_phases(from, ask); !reason.empty())
            return Offer::no(std::move(reason));
        for (int variant = 0; variant < ask.want.views.different(); ++variant) {
            const int view = ask.want.views.first_view(variant);
            std::string refused;
            const std::array<PhaseAxis, 3> axes = phase_axes(from, ask.want, view, refused);
            if (!refused.empty()) return Offer::no(std::move(refused));
            const bool does = std::any_of(axes.begin(), axes.end(),
                                          [](const PhaseAxis& a) { return a.scales(); });
            if (does != scales)
                return Offer::no(fmt::format(
                    "view {} {}", view, scales ? "scales nothing" : "scales, which shifts do not"));
        }
        return Offer{.from = from, .to = screen_scalar(from, ask.want), .with = with};
    };
    edge.work = work_along_axes;
    edge.error = [](const Offer&, const Ask&) { return Error::unknown(); };
    edge.run = [](const Offer& offer, const Ask& ask, const Data& in, Data& out,
                  const Region& /*all*/,
                  Context& context) { run_along_axes(offer, ask, in, out, context); };
    return edge;
}

}  // namespace edgewise
