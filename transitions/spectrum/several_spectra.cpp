#include "transitions/spectrum/several_spectra.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <utility>

#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/pmr_block.hpp"
#include "transitions/kernels/spectrum_slice.hpp"
#include "transitions/spectrum/forward.hpp"
#include "transitions/spectrum/projection.hpp"
#include "transitions/spectrum/slice.hpp"
#include "transitions/spectrum/slice_view.hpp"

namespace edgewise {
namespace {

std::vector<kernels::KaiserBessel> few_windows() {
    std::vector<kernels::KaiserBessel> few;
    for (const kernels::KaiserBessel& window : windows())
        if ((window.width() == 4 || window.width() == 6) && window.padding() >= kTriedPadding)
            few.push_back(window);
    return few;
}

std::string degree_facet(int degree) { return fmt::format("degree{}", degree); }
int degree_in(const Parameters& with) { return static_cast<int>(with.number("degree")); }

Parameters forward_parameters(const Parameters& with) {
    return {{"width", with.number("width")}, {"padding", with.number("padding")}};
}

Offer slice_offer(const std::string& content, const Representation& from, const Ask& ask,
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

Work slice_work(const Extent& one, const std::vector<SliceWeight>& weights, const Offer& offer,
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

void slice_run(const Extent& one, const std::vector<SliceWeight>& weights, const Offer& offer,
               const Ask& ask, const Data& in, Data& out, const Region& region, Context& context) {
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

}  // namespace

std::vector<std::string> SeveralSpectra::kinds() const {
    std::vector<std::string> kinds;
    for (int degree = 1; degree <= most_degree; ++degree)
        for (const kernels::KaiserBessel& window : few_windows())
            kinds.push_back(fmt::format("object/{}+{}+{}", content, degree_facet(degree),
                                        window_facet(window)));
    return kinds;
}

std::map<std::string, Domain> SeveralSpectra::parameters(const std::string& degree) const {
    std::vector<double> degrees;
    for (int i = 1; i <= most_degree; ++i) degrees.push_back(i);
    return {{"degree", number(1, most_degree, degrees, degree)},
            {"width", number(4, 6, {4, 6}, "taps of the window along each axis: 4 or 6")},
            {"padding", number(1.25, 2, {kTriedPadding}, "period over extent: 1.25, 1.5 or 2")}};
}

Offer SeveralSpectra::offer(const Representation& from, const Ask& ask,
                            const Parameters& with) const {
    const double width = with.number("width"), padding = with.number("padding");
    const std::vector<kernels::KaiserBessel> known = few_windows();
    if (std::none_of(known.begin(), known.end(), [&](const kernels::KaiserBessel& window) {
            return window.width() == width && window.padding() == padding;
        }))
        return Offer::no(fmt::format(
            "no window of width {} for padding {}: {} take 4 and 6, with 1.25, 1.5 and 2", width,
            padding, content));
    Offer offer = spectrum_forward().offer(from, ask, forward_parameters(with));
    if (!offer.refused.empty()) return offer;
    const int degree = degree_in(with);
    offer.with = with;
    offer.to.content = std::string(content);
    offer.to.facets.insert(degree_facet(degree));
    offer.to.extent.z *= count(degree);
    return offer;
}

Work SeveralSpectra::work(const Offer& offer, const Ask& ask, int view) const {
    const double all = count(degree_in(offer.with));
    Offer one = offer;
    one.with = forward_parameters(offer.with);
    one.to.extent = shape_of(offer).stored();
    Work work = spectrum_forward().work(one, ask, view);
    work.operations *= all;
    work.streamed *= all;
    return work;
}

int SeveralSpectra::degree_of(const Representation& spectra) const {
    for (int degree = 1; degree <= most_degree; ++degree)
        if (spectra.facets.contains(degree_facet(degree))) return degree;
    throw RunError(fmt::format("{} do not say of which degree they are", content));
}

Extent SeveralSpectra::one_of(const Representation& spectra) const {
    Extent one = spectra.extent;
    one.z /= count(degree_of(spectra));
    return one;
}

kernels::SpectrumShape SeveralSpectra::shape_of(const Offer& offer) {
    return {offer.from.extent,
            {static_cast<int>(offer.with.number("width")), offer.with.number("padding")}};
}

void SeveralSpectra::name_facets(const Offer& offer, Data& out) {
    const kernels::KaiserBessel window = shape_of(offer).window;
    const int degree = degree_in(offer.with);
    out.facets[window_facet(window)] = window;
    out.facets[degree_facet(degree)] = degree;
}

Transition slice_of_several(
    const SeveralSpectra& spectra, const std::string& content,
    std::function<std::string(const Ask&)> refused,
    std::function<std::vector<SliceWeight>(const Representation& spectra, const Request&, int view)>
        weights) {
    Transition edge;
    for (const std::string& kind : spectra.kinds())
        edge.joins.emplace_back(kind, "slice/" + content);
    edge.parameters = spectrum_slice().parameters;
    edge.offer = [content, refused = std::move(refused)](const Representation& from, const Ask& ask,
                                                         const Parameters& with) {
        if (std::string reason = refused(ask); !reason.empty()) return Offer::no(std::move(reason));
        return slice_offer(content, from, ask, with);
    };
    edge.work = [spectra, weights](const Offer& offer, const Ask& ask, int view) {
        return slice_work(spectra.one_of(offer.from), weights(offer.from, ask.want, view), offer,
                          ask, view);
    };
    edge.error = spectrum_slice().error;
    edge.run = [spectra, weights](const Offer& offer, const Ask& ask, const Data& in, Data& out,
                                  const Region& region, Context& context) {
        slice_run(spectra.one_of(in.what), weights(offer.from, ask.want, context.view), offer, ask,
                  in, out, region, context);
    };
    return edge;
}

}  // namespace edgewise
