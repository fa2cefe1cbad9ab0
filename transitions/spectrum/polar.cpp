#include "transitions/spectrum/polar.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <tbb/parallel_for.h>

#include "transitions/kernels/fourier.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/pmr_block.hpp"
#include "transitions/kernels/spectrum_slice.hpp"
#include "transitions/spectrum/projection.hpp"
#include "transitions/spectrum/slice.hpp"
#include "transitions/spectrum/slice_view.hpp"
#include "transitions/spectrum/turntable.hpp"

namespace edgewise {
namespace {

using kernels::Complex;

constexpr const char* kLinear = "linear";
constexpr const char* kWindow = "window";
constexpr std::int64_t kMostPlanes = 16384;
constexpr std::int64_t kTile = 16;  // lines along the angle that are transformed together
std::string angle_facet(const std::string& angle) { return "angle-" + angle; }
bool is_windowed(const Representation& polar) {
    return polar.facets.contains(angle_facet(kWindow));
}

/// Planes in a whole turn that sampling needs.
std::int64_t needed_of(const Turntable& table) {
    return table.needed(kernels::cutoff(kernels::Between::spline), angle_window().padding());
}

/// spectrum.slice, of the same band.
Offer as_slice(const Representation& from, const Ask& ask, const Parameters& with) {
    return spectrum_slice().offer(from, ask, {{"band", with.word("band")}});
}

Offer polar_offer(const Representation& from, const Ask& ask, const Parameters& with) {
    Offer offer = as_slice(from, ask, with);
    if (!offer.refused.empty()) return offer;
    const Turntable table(ask.want);
    if (!table.refused.empty()) return Offer::no(table.refused);
    const double number = with.number("planes");
    const std::string& angle = with.word("angle");
    if (number != std::floor(number) || number == 1)
        return Offer::no(fmt::format("{} planes given; expected a whole number from 2 on", number));
    auto planes = static_cast<std::int64_t>(number);
    if (planes == 0) {
        planes = (angle == kLinear ? table.parts(2 * kMostPlanes) : needed_of(table)) / 2;
        if (planes == 0)
            return Offer::no(fmt::format(
                "no {} planes hold all views, and none is interpolated where `planes` is 0",
                kMostPlanes));
        if (planes > kMostPlanes)
            return Offer::no(
                fmt::format("{} planes are needed, {} is the most", planes, kMostPlanes));
    }
    // The least fan that a window does not meet itself in.
    if (angle == kWindow && planes < angle_window().width())
        return Offer::no(
            fmt::format("a window of {0} planes needs {0} in half a turn", angle_window().width()));
    const Extent slice = offer.to.extent;
    offer.with = with;
    offer.to = from;
    offer.to.drop_facets();
    offer.to.content = "polar";
    offer.to.facets = {angle_facet(angle)};
    offer.to.extent = {slice.x, slice.y, planes};
    return offer;
}

/// The request of one view in place of the turntable's.
Request at_angle(const Request& want, const Turntable& table, double turns) {
    Request one = want;
    one.views = Placement(table.view_at(turns));
    one.frames = 1;
    return one;
}

Work polar_work(const Offer& offer, const Ask& ask, int /*view*/) {
    const Turntable table(ask.want);
    const Extent& fan = offer.to.extent;
    const double planes = static_cast<double>(fan.z);
    Offer one{.from = offer.from, .to = offer.to, .with = {{"band", offer.with.word("band")}}};
    one.to.extent.z = 1;
    // A few planes stand for all: what a plane cuts of the field's frequencies varies little.
    constexpr int kLooked = 4;
    Work work;
    for (int i = 0; i < kLooked; ++i) {
        const Request plane = at_angle(ask.want, table, 0.5 * i / kLooked);
        const Work slice = spectrum_slice().work(one, {plane, ask.scene}, 0);
        work.operations += slice.operations / kLooked;
        work.gathers += slice.gathers / kLooked;
        work.lines.count += slice.lines.count / kLooked;
        work.streamed += slice.streamed / kLooked;
        work.scratch = std::max(work.scratch, slice.scratch);
        work.workspace = std::max(work.workspace, slice.workspace);
    }
    work.operations *= planes;
    work.gathers *= planes;
    work.lines.count *= planes;
    work.streamed *= planes;
    // Rows of planes between those that are looked at are longer by less than half.
    work.workspace *= 1.5;
    work.scratch *= 1.5;
    if (offer.with.word("angle") == kWindow) {
        const std::int64_t turn = 2 * fan.z;
        const double lines = static_cast<double>(fan.x * (fan.y / 2 + 1));
        work.operations +=
            lines * (2 * kernels::fourier_operations(turn) + 4 * static_cast<double>(turn));
        work.streamed += 2 * offer.to.bytes();
        work.scratch = std::max(work.scratch, static_cast<double>(kTile * turn) * sizeof(Complex));
        work.workspace += static_cast<double>(turn) * sizeof(float);
    }
    return work;
}

Error polar_error(const Offer& offer, const Ask& ask) {
    Error error = spectrum_slice().error(
        {.from = offer.from, .with = {{"band", offer.with.word("band")}}}, ask);
    const Turntable table(ask.want);
    const std::int64_t turn = 2 * offer.to.extent.z;
    if (offer.with.word("angle") == kWindow) {
        if (turn < needed_of(table)) return Error::unknown();
        // As spectrum.forward has it: rays that meet little divide ghosts by a short length.
        constexpr double kShortLengths = 12;
        error.bias += angle_window().mean_ghost() * ask.scene.range *
                      (ask.want.mode->divides ? kShortLengths : 1);
    } else if (const std::int64_t parts = table.parts(turn); parts == 0 || turn % parts != 0) {
        return Error::unknown();
    }
    return error;
}

/// exp(-2 pi i kx 2 axis / width): what mirroring about the axis turns a column by.
std::vector<Complex> turns_of_mirror(const Turntable& table, const Extent& slice) {
    std::vector<Complex> turns(static_cast<std::size_t>(slice.x));
    const std::int64_t width = 2 * (slice.x - 1), twice = std::llround(2 * table.axis) % width;
    for (std::int64_t kx = 0; kx < slice.x; ++kx) {
        const double angle = 2 * std::numbers::pi * static_cast<double>(kx * twice % width) /
                             static_cast<double>(width);
        turns[static_cast<std::size_t>(kx)] = {static_cast<float>(std::cos(angle)),
                                               static_cast<float>(-std::sin(angle))};
    }
    return turns;
}

/// The row of -ky.
std::int64_t opposite(std::int64_t row, const Extent& slice) { return (slice.y - row) % slice.y; }

/// Divides the planes, wave by wave of a turn, by the transform of the window.
class Division {
 public:
    Division(const Turntable& table, const Extent& fan, Complex* samples)
        : fan_(fan),
          turn_(2 * fan.z),
          samples_(samples),
          mirror_(turns_of_mirror(table, fan)),
          there_(kernels::Fourier::along_lines(turn_, kTile, false)),
          back_(kernels::Fourier::along_lines(turn_, kTile, true)) {
        for (std::int64_t wave = 0; wave < turn_; ++wave) {
            const double m = static_cast<double>(std::min(wave, turn_ - wave));
            const double n = static_cast<double>(turn_);
            weights_.push_back(static_cast<float>(1 / (n * angle_window().transform(m / n))));
        }
    }
    /// Of a row and its opposite, which are mirror images half a turn apart.
    void run(std::int64_t row, Context& context) const {
        kernels::Block<Complex> tile(static_cast<std::size_t>(kTile * turn_), context.memory);
        std::fill_n(tile.data(), kTile * turn_, Complex{});
        const std::int64_t other = opposite(row, fan_);
        for (std::int64_t first = 0; first < fan_.x; first += kTile) {
            const std::int64_t lines = std::min(kTile, fan_.x - first);
            for (std::int64_t plane = 0; plane < fan_.z; ++plane)
                for (std::int64_t l = 0; l < lines; ++l) {
                    Complex* line = tile.data() + l * turn_;
                    line[plane] = *at(plane, row, first + l);
                    line[plane + fan_.z] = mirrored(*at(plane, other, first + l), first + l);
                }
            there_.run(tile.data());
            for (std::int64_t l = 0; l < lines; ++l)
                for (std::int64_t wave = 0; wave < turn_; ++wave)
                    tile[static_cast<std::size_t>(l * turn_ + wave)] *=
                        weights_[static_cast<std::size_t>(wave)];
            back_.run(tile.data());
            for (std::int64_t plane = 0; plane < fan_.z; ++plane)
                for (std::int64_t l = 0; l < lines; ++l) {
                    const Complex* line = tile.data() + l * turn_;
                    *at(plane, row, first + l) = line[plane];
                    if (other != row)
                        *at(plane, other, first + l) = mirrored(line[plane + fan_.z], first + l);
                }
        }
    }

 private:
    Complex* at(std::int64_t plane, std::int64_t row, std::int64_t x) const {
        return samples_ + (plane * fan_.y + row) * fan_.x + x;
    }
    Complex mirrored(Complex sample, std::int64_t x) const {
        return std::conj(sample) * mirror_[static_cast<std::size_t>(x)];
    }

    Extent fan_;
    std::int64_t turn_;
    Complex* samples_;
    std::vector<Complex> mirror_;
    kernels::Fourier there_, back_;
    std::vector<float> weights_;
};

void polar_run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region&,
               Context& context) {
    const Turntable table(ask.want);
    const Extent& fan = out.what.extent;
    const Extent plane{fan.x, fan.y, 1};
    auto* samples = out.as<Complex>();
    for (std::int64_t i = 0; i < fan.z; ++i) {
        const Mat4 view = table.view_at(0.5 * static_cast<double>(i) / static_cast<double>(fan.z));
        kernels::slice_of_spectrum(
            kernels::grid_of(in), kernels::SpectrumShape::period_of(in.what.extent),
            window_of(in.what),
            slice_view(view * offer.from.placed.at(0).matrix().inverse(), plane, ask.want,
                       offer.with.word("band")),
            samples + i * plane.samples(), Region::all(plane), Region::all(plane), context.memory,
            [&] { return context.stopped(); });
        context.poll();
    }
    if (offer.with.word("angle") == kWindow) {
        const Division division(table, fan, samples);
        tbb::parallel_for(std::int64_t{0}, fan.y / 2 + 1, [&](std::int64_t row) {
            if (!context.stopped()) division.run(row, context);
        });
        context.poll();
    }
    for (const std::string& facet : out.what.facets) out.facets[facet] = facet;
}

/// Planes of a turn and what each counts for.
struct AngleTaps {
    int count = 0;
    std::array<std::int64_t, kernels::KaiserBessel::kWidest> plane{};
    std::array<float, kernels::KaiserBessel::kWidest> weight{};

    AngleTaps(double turns, std::int64_t turn, bool windowed) {
        constexpr double kOnPlane = 1e-6;  // of the way to the next
        const double place = turns * static_cast<double>(turn);
        auto before = static_cast<std::int64_t>(std::floor(place + kOnPlane));
        const double part = std::max(0., place - static_cast<double>(before));
        const auto add = [&](std::int64_t at, double share) {
            plane[static_cast<std::size_t>(count)] = (at % turn + turn) % turn;
            weight[static_cast<std::size_t>(count++)] = static_cast<float>(share);
        };
        if (windowed) {
            const int half = angle_window().width() / 2;
            for (int tap = 1 - half; tap <= half; ++tap)
                add(before + tap, angle_window()(part - tap));
        } else {
            add(before, part > kOnPlane ? 1 - part : 1);
            if (part > kOnPlane) add(before + 1, part);
        }
    }
};

Offer polar_slice_offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = no_projection(ask); !reason.empty())
        return Offer::no(std::move(reason));
    if (const Turntable table(ask.want); !table.refused.empty()) return Offer::no(table.refused);
    Offer offer{.from = from, .to = from, .with = with};
    offer.to.space = "slice";
    offer.to.content = "spectrum";
    offer.to.drop_facets();
    offer.to.axes = 2;
    offer.to.extent.z = 1;
    offer.to.placed = ask.want.views;
    return offer;
}

Work polar_slice_work(const Offer& offer, const Ask& ask, int view) {
    const Turntable table(ask.want);
    const AngleTaps taps(table.angles[static_cast<std::size_t>(ask.want.views.variant(view))],
                         2 * offer.from.extent.z, is_windowed(offer.from));
    return {.operations = 4. * taps.count * static_cast<double>(offer.to.samples()),
            .streamed = (taps.count + 1) * offer.to.bytes(),
            .workspace = static_cast<double>(offer.to.extent.x) * sizeof(Complex)};
}

void polar_slice_run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region&,
                     Context& context) {
    const Turntable table(ask.want);
    const Extent& fan = in.what.extent;
    const AngleTaps taps(
        table.angles[static_cast<std::size_t>(ask.want.views.variant(context.view))], 2 * fan.z,
        is_windowed(offer.from));
    const std::vector<Complex> mirror = turns_of_mirror(table, fan);
    tbb::parallel_for(std::int64_t{0}, fan.y, [&](std::int64_t row) {
        if (context.stopped()) return;
        Complex* to = out.as<Complex>() + row * fan.x;
        std::fill_n(to, fan.x, Complex{});
        for (std::size_t tap = 0; tap < static_cast<std::size_t>(taps.count); ++tap) {
            const bool far = taps.plane[tap] >= fan.z;
            const std::int64_t plane = taps.plane[tap] - (far ? fan.z : 0);
            const Complex* from =
                in.as<Complex>() + (plane * fan.y + (far ? opposite(row, fan) : row)) * fan.x;
            const float weight = taps.weight[tap];
            for (std::int64_t x = 0; x < fan.x; ++x)
                to[x] += weight *
                         (far ? std::conj(from[x]) * mirror[static_cast<std::size_t>(x)] : from[x]);
        }
    });
    context.poll();
}

std::vector<std::string> polar_kinds() {
    return {"object/polar+" + angle_facet(kLinear), "object/polar+" + angle_facet(kWindow)};
}

}  // namespace

const kernels::KaiserBessel& angle_window() {
    static const kernels::KaiserBessel window(6, 1.25);
    return window;
}

Transition spectrum_polar() {
    Transition edge;
    edge.name = "spectrum.polar";
    edge.source = "Wittenbrink 1993, 5.2 and FIGURE 87; Jackson et al. 1991";
    for (const kernels::KaiserBessel& window : windows())
        for (const std::string& kind : polar_kinds())
            edge.joins.emplace_back(spectrum_kind(window), kind);
    edge.parameters = {
        {"angle", one_of({kLinear, kWindow}, "interpolation between planes")},
        {"band", one_of({"volume", "picture"},
                        "frequencies: all of the volume's, or only the picture's own")},
        {"planes", number(0, kMostPlanes, {0},
                          "in half a turn; 0: those of the views (linear), or as many as the "
                          "volume needs (window)")}};
    edge.on_demand = true;  // fewer slices are cut only of turns of very many views, or of mirrored
    edge.offer = polar_offer;
    edge.work = polar_work;
    edge.error = polar_error;
    edge.run = polar_run;
    return edge;
}

Transition spectrum_polar_slice() {
    Transition edge;
    edge.name = "spectrum.polar_slice";
    edge.source = "Wittenbrink 1993, 5.2 and FIGURE 87";
    for (const std::string& kind : polar_kinds()) edge.joins.emplace_back(kind, "slice/spectrum");
    edge.offer = polar_slice_offer;
    edge.work = polar_slice_work;
    edge.error = exact;  // counted by spectrum.polar
    edge.run = polar_slice_run;
    return edge;
}

}  // namespace edgewise
