#include "transitions/project/preintegrated_quadratic_cast.hpp"

#include "transitions/kernels/ray_cast_quadratures.hpp"
#include "transitions/project/cast_by.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/ray_cast.hpp"

namespace edgewise {
namespace {

Work work_quadratic(const Offer& offer, const Ask& ask, int view) {
    // Each piece reaches for four numbers, and has six chords and two exponentials. Some chords are
    // as short as two cells of the table: of these the function is worked out, by a logarithm.
    constexpr double kPiece = 500, kShort = 100, kGathers = 40;
    constexpr double kTable = 8 * 60.0 * kernels::TransferSums::kCells;
    Work work = ray_cast().work(offer, ask, view);
    const double samples = samples_taken(offer, ask, view);
    // Middles are samples like others; lines that were read are near.
    work.operations = 2 * work.operations + kTable + (kPiece + kShort) * samples;
    work.gathers = 2 * work.gathers + kGathers * samples;
    work.workspace += 32.0 * kernels::TransferSums::kCells;
    work.variant = "quadratic";
    return work;
}

void run_quadratic(const Offer& offer, const Ask& ask, const Data& in, Data& out,
                   const Region& region, Context& context) {
    const kernels::TransferSums sums =
        kernels::transfer_sums_of(optics_of(ask.want, in.what.values));
    const auto tile = [&sums](const kernels::RayCast& cast, std::int64_t x, std::int64_t y,
                              std::int64_t width, std::int64_t height, float* first,
                              std::ptrdiff_t row) {
        kernels::ray_cast_quadratic(cast, sums, x, y, width, height, first, row);
    };
    cast_by({.tile = tile, .beyond = kernels::beyond_quadratic}, offer, ask, in, out, region,
            context);
}

}  // namespace

Transition preintegrated_quadratic_cast() {
    Transition edge = preintegrated_cast();
    edge.name = "project.preintegrated_quadratic_cast";
    edge.trials = {};
    edge.factors.clear();
    edge.source = "El Hajjar and others 2008; Wittenbrink 1993, EQ 62 and 63";
    edge.on_demand = true;  // its error is measured by runs
    edge.work = work_quadratic;
    edge.error = {};
    edge.model = {};
    edge.run = run_quadratic;
    return edge;
}

}  // namespace edgewise
