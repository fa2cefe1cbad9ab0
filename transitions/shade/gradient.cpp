#include "transitions/shade/gradient.hpp"

#include <algorithm>
#include <any>
#include <array>
#include <stdexcept>
#include <tbb/parallel_for.h>

#include "graph/label_surface.hpp"
#include "graph/spread.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/trials/trials.hpp"

namespace edgewise {
namespace {

using kernels::Differences;

constexpr std::array<const char*, 3> kSchemes = {"central", "sobel", "fourth"};
/// Made before there are threads.
const std::array<std::string, kSchemes.size()> kFacets = [] {
    std::array<std::string, kSchemes.size()> all;
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = std::string("gradient-") + kSchemes[i];
    return all;
}();
constexpr double kBytes = 4 * sizeof(std::int16_t);  // of one gradient

Differences scheme_of(const Parameters& with) {
    const std::string& word = with.word("scheme");
    for (std::size_t i = 0; i < kSchemes.size(); ++i)
        if (word == kSchemes[i]) return static_cast<Differences>(i);
    throw std::logic_error("no scheme of differences");
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (!ask.want.needs_gradients())
        return Offer::no("neither light nor opacity depends on gradients");
    if (shows_labels(ask.want)) return Offer::no("labels are lit by their coverage");
    if (ask.want.smooths_gradients() && scheme_of(with) != Differences::sobel)
        return Offer::no("smoothed gradients were asked for, which scheme=sobel makes");
    if (from.axes != 3 || from.channels != 1) return Offer::no("of volumes of one channel only");
    if (!is_whole(from)) return Offer::no("needs all samples in memory, row by row");
    if (from.type == Type::c64 || from.type == Type::f16)
        return Offer::no("samples of no arithmetic type");
    Offer offer{.from = from, .to = from, .with = with};
    offer.to.facets.insert(gradient_facet_of(scheme_of(with)));
    offer.to.facet_bytes += kBytes * static_cast<double>(from.samples());
    return offer;
}

Work work(const Offer& offer, const Ask&, int) {
    const double samples = static_cast<double>(offer.from.samples());
    const Differences by = scheme_of(offer.with);
    const double each = by == Differences::central ? 6 : by == Differences::fourth ? 15 : 84;
    return {.operations = samples * (each + 12), .streamed = offer.from.bytes() + kBytes * samples};
}

/// Samples stay as they are.
Error error(const Offer&, const Ask&) { return {.copies = true}; }

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region&,
         Context& context) {
    const kernels::Grid volume = kernels::grid_of(in);
    const ValueMap& values = in.what.values;
    const double a = (ask.scene.low - values.offset) / values.slope,
                 b = (ask.scene.high - values.offset) / values.slope;
    const auto samples = static_cast<std::size_t>(volume.extent.samples());
    auto made = std::make_shared<kernels::Gradients>();
    made->samples = Array(samples * static_cast<std::size_t>(kBytes), context.memory);
    made->scale = kernels::gradient_scale(std::min(a, b), std::max(a, b));
    auto* to = static_cast<std::int16_t*>(made->samples.data());
    tbb::parallel_for(std::int64_t{0}, volume.extent.z, [&](std::int64_t z) {
        if (!context.stopped())
            kernels::gradient_slices(volume, scheme_of(offer.with), made->scale, z, z + 1, to);
    });
    context.poll();
    out.facets[gradient_facet_of(scheme_of(offer.with))] =
        std::shared_ptr<const kernels::Gradients>(made);
}

}  // namespace

const std::string& gradient_facet_of(Differences by) {
    return kFacets[static_cast<std::size_t>(by)];
}

Differences differences_of(const Representation& what) {
    for (std::size_t i = 0; i < kSchemes.size(); ++i)
        if (what.facets.contains(gradient_facet_of(static_cast<Differences>(i))))
            return static_cast<Differences>(i);
    throw std::logic_error("no gradients beside the samples");
}

std::shared_ptr<const kernels::Gradients> gradients_of(const Data& data) {
    return std::any_cast<std::shared_ptr<const kernels::Gradients>>(
        data.facets.at(gradient_facet_of(differences_of(data.what))));
}

Transition gradient_facet() {
    Transition edge;
    edge.name = "shade.gradient";
    edge.source = "Wittenbrink 1993, EQ 57 and FIGURE 57; Zucker, Hummel 1981 (3D Sobel)";
    for (const char* scheme : kSchemes)
        edge.joins.emplace_back("object/scalar", std::string("object/scalar+gradient-") + scheme);
    edge.parameters = {{"scheme", one_of({"central", "sobel", "fourth"}, {"central"},
                                         "differences that stand for derivatives")}};
    edge.attaches = true;
    edge.offer = offer;
    edge.work = work;
    edge.error = error;
    edge.run = run;
    edge.trials = lit_trials;
    edge.factors = {{"", 2.1}};
    return edge;
}

}  // namespace edgewise
