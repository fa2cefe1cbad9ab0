#include "transitions/spectrum/weighed_slices.hpp"

#include <algorithm>
#include <tbb/parallel_for.h>

#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/pmr_block.hpp"
#include "transitions/kernels/spectrum_slice.hpp"
#include "transitions/spectrum/projection.hpp"
#include "transitions/spectrum/slice.hpp"
#include "transitions/spectrum/slice_view.hpp"

namespace edgewise {

Offer weighed_offer(const std::string& content, const Representation& from, const Ask& ask,
                    const Parameters& with) {
    const Extent period = picture_period_of(ask.want);
    Offer offer{.from = from, .to = from, .with = with};
    offer.to.space = "slice";
    offer.to.content = content;
    offer.to.drop_facets();
    offer.to.axes = 2;
    offer.to.extent = {period.x / 2 + 1, period.y, 1};
    offer.to.placed = ask.want.views;
    return offer;
}

Work weighed_work(const Extent& one, const std::vector<SliceWeight>& weights, const Offer& offer,
                  const Ask& ask, int view) {
    const auto counting = static_cast<double>(std::count_if(
        weights.begin(), weights.end(), [](const SliceWeight& w) { return w.counts(); }));
    Offer through_one = offer;
    through_one.from.extent = one;
    Work work = spectrum_slice().work(through_one, ask, view);
    const double samples = static_cast<double>(offer.to.samples());
    work.operations = counting * (work.operations + 2 * samples);
    work.streamed = counting * (work.streamed + 2 * offer.to.bytes());
    work.gathers *= counting;
    work.lines.count *= counting;
    work.workspace += offer.to.bytes();
    return work;
}

void weighed_slices(const Extent& one, const std::vector<SliceWeight>& weights, const Offer& offer,
                    const Ask& ask, const Data& in, Data& out, const Region& region,
                    Context& context) {
    using kernels::Complex;
    const Extent slice = out.what.extent;
    const kernels::SliceView view = slice_view(residual(offer.from, ask.want, context.view), slice,
                                               ask.want, offer.with.word("band"));
    kernels::Block<Complex> more(static_cast<std::size_t>(slice.samples()), context.memory);
    auto* sum = out.as<Complex>();
    std::fill_n(sum, slice.samples(), Complex{});
    for (std::size_t which = 0; which < weights.size(); ++which) {
        if (!weights[which].counts()) continue;
        kernels::Grid spectrum = kernels::grid_of(in);
        spectrum.samples = in.as<Complex>() + static_cast<std::int64_t>(which) * one.samples();
        spectrum.extent = one;
        kernels::SliceView weighed = view;
        weighed.value = weights[which].value;
        weighed.derivative = weights[which].derivative;
        kernels::slice_of_spectrum(spectrum, kernels::SpectrumShape::period_of(one),
                                   window_of(in.what), weighed, more.data(), out.held(), region,
                                   context.memory, [&] { return context.stopped(); });
        context.poll();
        tbb::parallel_for(std::int64_t{0}, slice.y, [&](std::int64_t y) {
            for (std::int64_t i = y * slice.x; i < (y + 1) * slice.x; ++i)
                sum[i] += more[static_cast<std::size_t>(i)];
        });
    }
}

}  // namespace edgewise
