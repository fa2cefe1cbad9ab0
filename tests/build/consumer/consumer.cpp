// A program outside the tree: an edge of its own, planned and run with the installed package.
#include <cstdio>
#include <memory>

#include "planner/planner.hpp"
#include "runtime/runtime.hpp"
#ifdef HAS_TRANSITIONS
#include "transitions/catalogue.hpp"
#endif

namespace ew = edgewise;

namespace {

/// out[i] = -in[i], on the screen as it lies in the object.
ew::Transition negate() {
    return {
        .name = "user.negate",
        .joins = {{"object/scalar", "screen/scalar"}},
        .offer =
            [](const ew::Representation& from, const ew::Ask& ask, const ew::Parameters&) {
                return ew::Offer{.from = from, .to = ew::screen_scalar(from, ask.want)};
            },
        .work = [](const ew::Offer& offer, const ew::Ask&,
                   int) { return ew::Work{.streamed = offer.from.bytes() + offer.to.bytes()}; },
        .run =
            [](const ew::Offer&, const ew::Ask&, const ew::Data& in, ew::Data& out,
               const ew::Region&, ew::Context&) {
                for (std::int64_t i = 0; i < out.what.samples(); ++i)
                    out.as<float>()[i] = -in.as<float>()[i];
            },
    };
}

}  // namespace

int main() {
    ew::Catalogue edges;
#ifdef HAS_TRANSITIONS
    edges = ew::catalogue();
    std::printf("%zu edges of the package\n", edges.size());
#endif
    edges.push_back(negate());

    ew::Request want;
    want.job = ew::Job::warp;
    want.axes = 2;
    want.input = want.screen = {3, 2, 1};
    const ew::Scene scene;
    const ew::Ask ask{want, scene};
    ew::MemoryBudget memory(1 << 20);
    ew::Representation what;
    what.axes = 2;
    what.extent = want.input;
    auto source = std::make_shared<ew::Data>(ew::Data::make(what, &memory));
    for (int i = 0; i < 6; ++i) source->as<float>()[i] = static_cast<float>(i);

    ew::PlanOptions options;
    options.demands.via = {ew::demand_of("user.negate", edges)};
    const ew::Answer answer = ew::plan(edges, ask, {{what}}, ew::default_profile(edges), options);
    if (!answer.plan) return std::puts(answer.problem.c_str()), 1;
    bool right = false;
    ew::run(*answer.plan, ask, source,
            [&](int, std::shared_ptr<const ew::Data> result) {
                right = result->as<float>()[5] == -5 && result->as<float>()[1] == -1;
            },
            {.memory = &memory});
    std::puts(right ? "right" : "wrong");
    return right ? 0 : 1;
}
