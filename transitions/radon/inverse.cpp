#include "transitions/radon/inverse.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <tbb/parallel_for.h>
#include <vector>

#include "graph/radon.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/pmr_block.hpp"
#include "transitions/kernels/scalar_load.hpp"

namespace edgewise {
namespace {

/// So many times the mean along a row results may be, where rounding is spoken of.
constexpr double kPeak = 4;

const RadonSetting* way_back(const Request& want) {
    const RadonSetting* setting = want.setting.as<RadonSetting>();
    return setting && setting->to == RadonSetting::To::image ? setting : nullptr;
}

RadonBack back_of(const Request& want) {
    return {want.input, want.spacing[0], *want.setting.as<RadonSetting>()};
}

Offer offer_of_image(const Representation& from, const Ask& ask, const Parameters& with) {
    if (!way_back(ask.want)) return Offer::no("asked for: lines; this makes an image of them");
    if (from.extent != ask.want.input || from.placed.one_a_view() ||
        from.placed.at(0).matrix() != Mat4::Identity())
        return Offer::no("the samples no longer lie where the input has them");
    if (from.layout != Layout::linear || from.place != Place::memory)
        return Offer::no("needs samples in memory, row by row");
    if (from.type == Type::c64 || from.channels != 1)
        return Offer::no("a sinogram has one channel of real samples");
    if (ask.scene.non_finite > 0)
        return Offer::no(
            fmt::format("{} values are not finite, and would spread over the whole image",
                        ask.scene.non_finite));
    Offer offer{.from = from, .to = from, .with = with};
    offer.to.space = "hough";
    offer.to.drop_facets();
    offer.to.extent = back_of(ask.want).image;
    offer.to.type = Type::f32;
    offer.to.values = {};
    return offer;
}

Work work_of_image(const Offer& offer, const Ask& ask) {
    const RadonBack back = back_of(ask.want);
    // One by one: vectors hold eight f32.
    constexpr double kAlone = 8, kRead = 14;
    const auto offsets = static_cast<double>(back.sinogram.x);
    const auto rows = static_cast<double>(back.sinogram.y * back.sinogram.z);
    const double sums = rows * offsets * offsets / 2 * 2;
    const double reads =
        static_cast<double>(back.image.samples()) * static_cast<double>(back.sinogram.y);
    Work work;
    work.operations = 2 * sums + kAlone * kRead * reads;
    work.workspace = static_cast<double>(back.sinogram.y) * (offsets + 2) * sizeof(double);
    work.scratch = (2 * offsets + static_cast<double>(back.image.x)) * sizeof(double);
    work.streamed = offer.from.bytes() + offer.to.bytes();
    return work;
}

/// The ramp filter at distances 1, 3, 5 ...
std::vector<double> odd_ramp(std::int64_t offsets) {
    std::vector<double> ramp;
    for (std::int64_t n = 1; n < offsets; n += 2) {
        const double turn = std::numbers::pi * static_cast<double>(n);
        ramp.push_back(-1 / (turn * turn));
    }
    return ramp;
}

/// @param row  of n samples; @param to  of n as well
void filter_row(const std::vector<double>& row, const std::vector<double>& ramp, double* to) {
    const auto n = static_cast<std::int64_t>(row.size());
    for (std::int64_t m = 0; m < n; ++m) to[m] = 0.25 * row[static_cast<std::size_t>(m)];
    for (std::size_t i = 0; i < ramp.size(); ++i) {
        const auto apart = static_cast<std::int64_t>(2 * i + 1);
        const double weight = ramp[i];
        for (std::int64_t m = apart; m < n; ++m)
            to[m] += weight * row[static_cast<std::size_t>(m - apart)];
        for (std::int64_t m = 0; m < n - apart; ++m)
            to[m] += weight * row[static_cast<std::size_t>(m + apart)];
    }
}

/// One slice of a sinogram, filtered: each row has a 0 before and one behind it.
class Filtered {
 public:
    Filtered(const Data& in, std::int64_t slice, const RadonBack& back, const Context& context)
        : step_(back.sinogram.x + 2),
          block_(static_cast<std::size_t>(step_ * back.sinogram.y), context.memory),
          rows_(block_.data()) {
        const kernels::Grid grid = kernels::grid_of(in);
        const kernels::ScalarLoad load = kernels::scalar_load(grid.type);
        const std::vector<double> ramp = odd_ramp(back.sinogram.x);
        tbb::parallel_for(std::int64_t{0}, back.sinogram.y, [&](std::int64_t k) {
            if (context.stopped()) return;
            std::vector<double> row(static_cast<std::size_t>(back.sinogram.x));
            const std::int64_t from = k * grid.row_step() + slice * grid.slice_step();
            for (std::size_t m = 0; m < row.size(); ++m)
                row[m] =
                    grid.values(double(load(grid.samples, from + static_cast<std::int64_t>(m))));
            double* to = rows_ + k * step_;
            to[0] = to[step_ - 1] = 0;
            filter_row(row, ramp, to + 1);
            const double weight = back.weights[static_cast<std::size_t>(k)] / back.step;
            for (std::int64_t m = 1; m + 1 < step_; ++m) to[m] *= weight;
        });
    }
    /// Number m of row k; -1 and the number of offsets may be read.
    const double* row(std::int64_t k) const noexcept { return rows_ + k * step_ + 1; }

 private:
    std::int64_t step_;
    kernels::Block<double> block_;
    double* rows_;
};

/// Adds a row of the sinogram to a row of the image, whose offsets go from `first` by `step`.
void add_row(const double* filtered, std::int64_t offsets, double first, double step, double* sums,
             std::int64_t n) {
    const auto end = static_cast<double>(offsets);
    for (std::int64_t x = 0; x < n; ++x) {
        const double at = first + static_cast<double>(x) * step;
        if (!(at > -1 && at < end)) continue;
        const auto left = static_cast<std::int64_t>(at + 1) - 1;  // rounded down, as at > -1
        const double share = at - static_cast<double>(left);
        sums[x] += (1 - share) * filtered[left] + share * filtered[left + 1];
    }
}

void run_back(const Offer&, const Ask& ask, const Data& in, Data& out, const Region& /*all*/,
              Context& context) {
    const RadonBack back = back_of(ask.want);
    const Extent n = back.image;
    const double x_centre = 0.5 * static_cast<double>(n.x - 1),
                 y_centre = 0.5 * static_cast<double>(n.y - 1),
                 middle = 0.5 * static_cast<double>(back.sinogram.x - 1);
    for (std::int64_t slice = 0; slice < n.z; ++slice) {
        const Filtered filtered(in, slice, back, context);
        context.poll();
        tbb::parallel_for(std::int64_t{0}, n.y, [&](std::int64_t y) {
            if (context.stopped()) return;
            std::vector<double> sums(static_cast<std::size_t>(n.x), 0);
            for (std::int64_t k = 0; k < back.sinogram.y; ++k) {
                const auto [c, s] = back.directions[static_cast<std::size_t>(k)];
                const double first =
                    middle - x_centre * c - (static_cast<double>(y) - y_centre) * s;
                add_row(filtered.row(k), back.sinogram.x, first, c, sums.data(), n.x);
            }
            float* to = out.as<float>() + n.x * (y + n.y * slice);
            for (std::int64_t x = 0; x < n.x; ++x)
                to[x] = static_cast<float>(sums[static_cast<std::size_t>(x)]);
        });
        context.poll();
    }
}

}  // namespace

Transition radon_inverse() {
    Transition edge;
    edge.name = "radon.inverse";
    edge.source = "Ramachandran and Lakshminarayanan 1971; Kak and Slaney 1988";
    edge.joins = {{"object/scalar", "hough/scalar"}};
    edge.offer = offer_of_image;
    edge.work = [](const Offer& offer, const Ask& ask, int /*view*/) {
        return work_of_image(offer, ask);
    };
    edge.error = [](const Offer&, const Ask& ask) -> Error {
        return {.noise =
                    0x1p-24 * kPeak * std::max(std::abs(ask.scene.low), std::abs(ask.scene.high))};
    };
    edge.run = run_back;
    return edge;
}

}  // namespace edgewise
