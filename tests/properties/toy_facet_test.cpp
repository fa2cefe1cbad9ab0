// A facet of a test's own, from an edge that attaches it to an edge that needs it: a file, and
// nothing else in the program knows of either.
#include <algorithm>
#include <gtest/gtest.h>

#include "planner/planner.hpp"
#include "runtime/runtime.hpp"
#include "tests/properties/run_request.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

/// The largest sample of each slice: all that a picture of slices' maxima needs.
using Largest = std::vector<float>;

const void* seen_samples = nullptr;

Transition attach_largest() {
    Transition edge;
    edge.name = "toy.largest";
    edge.joins = {{"object/scalar", "object/scalar+largest"}};
    edge.attaches = true;
    edge.offer = [](const Representation& from, const Ask&, const Parameters&) {
        if (from.type != Type::f32) return Offer::no("of f32 only");
        Offer offer{.from = from, .to = from};
        offer.to.facets.insert("largest");
        offer.to.facet_bytes += static_cast<double>(from.extent.z) * sizeof(float);
        return offer;
    };
    edge.work = [](const Offer& offer, const Ask&, int) {
        return Work{.operations = static_cast<double>(offer.from.samples())};
    };
    edge.error = [](const Offer&, const Ask&) -> Error { return {.copies = true}; };
    edge.run = [](const Offer& offer, const Ask&, const Data& in, Data& out, const Region&,
                  Context&) {
        seen_samples = in.samples.data();
        EXPECT_EQ(out.samples.data(), in.samples.data()) << "nothing is copied";
        const Extent n = offer.from.extent;
        auto largest = std::make_shared<Largest>();
        for (std::int64_t z = 0; z < n.z; ++z) {
            const float* slice = in.at<float>(0, 0, z);
            largest->push_back(*std::max_element(slice, slice + n.x * n.y));
        }
        out.facets["largest"] = std::shared_ptr<const Largest>(largest);
    };
    return edge;
}

/// Every pixel gets the largest sample of all: not the picture that was asked for, but one that
/// shows which facet was read.
Transition show_largest() {
    Transition edge;
    edge.name = "toy.show";
    edge.joins = {{"object/scalar+largest", "screen/picture"}};
    edge.offer = [](const Representation& from, const Ask& ask, const Parameters&) {
        EXPECT_TRUE(from.facets.contains("largest"));
        return Offer{.from = from, .to = screen_picture(from, ask.want)};
    };
    edge.work = [](const Offer& offer, const Ask&, int) {
        return Work{.operations = static_cast<double>(offer.to.samples())};
    };
    edge.error = [](const Offer&, const Ask&) -> Error { return {.copies = true}; };
    edge.run = [](const Offer& offer, const Ask&, const Data& in, Data& out, const Region&,
                  Context&) {
        EXPECT_EQ(in.samples.data(), seen_samples);
        const auto largest = std::any_cast<std::shared_ptr<const Largest>>(in.facets.at("largest"));
        std::fill_n(out.as<float>(), offer.to.samples(),
                    *std::max_element(largest->begin(), largest->end()));
    };
    return edge;
}

struct Toys {
    MemoryBudget memory{std::size_t{1} << 28};
    std::shared_ptr<Data> input = std::make_shared<Data>(make_phantom("gaussians", 24, &memory));
    Request want = request_of(Job::render, Mode::mip, input->what, {rotation(0, 0, 0)});
    Scene scene = scene_of(*input, want, memory);
    Catalogue edges = [] {
        Catalogue all = catalogue();
        all.push_back(attach_largest());
        all.push_back(show_largest());
        return all;
    }();
};

TEST(ToyFacet, IsAttachedOnceAndSharesTheSamples) {
    Toys toys;
    const Ask ask{toys.want, toys.scene};
    const float most = *std::max_element(toys.input->as<float>(),
                                         toys.input->as<float>() + toys.input->what.samples());
    int shown = 0;
    for (const Plan& path : paths_of(toys.edges, ask, toys.input->what, 2000)) {
        const auto texts = path.texts();
        const auto uses = std::count(texts.begin(), texts.end(), "toy.largest");
        const bool shows = std::count(texts.begin(), texts.end(), "toy.show") == 1;
        EXPECT_EQ(uses, shows ? 1 : 0) << "a facet that no one needs is not made";
        if (!shows || path.steps.size() != 2) continue;
        ++shown;
        // The facet and the picture; the samples were there, and no second copy of them is made.
        const double picture = path.steps[1].offer.to.bytes();
        const std::size_t before = toys.memory.used();
        toys.memory.trim();  // what earlier paths left for reuse
        toys.memory.reset_peak();
        for (const float value : values_of(*results_of(path, ask, toys.input, 2, toys.memory)[0]))
            ASSERT_EQ(value, most);
        EXPECT_LT(static_cast<double>(toys.memory.peak() - before),
                  picture + 0.5 * toys.input->what.bytes());
        EXPECT_LT(path.steps[1].predicted.bytes - path.steps[0].predicted.bytes, 2 * picture);
    }
    EXPECT_EQ(shown, 1);
}

TEST(ToyFacet, IsPriced) {
    Toys toys;
    const Ask ask{toys.want, toys.scene};
    for (const Plan& path : paths_of(toys.edges, ask, toys.input->what, 2000)) {
        if (path.steps.size() != 2 || path.steps[1].by->name != "toy.show") continue;
        const Representation& with = path.steps[0].offer.to;
        EXPECT_EQ(with.facet_bytes, 24 * 4);
        EXPECT_EQ(with.own_bytes(), 24 * 4) << "samples are those of the input";
        EXPECT_EQ(with.kind(), "object/scalar+largest");
        EXPECT_EQ(path.steps[1].offer.to.facet_bytes, 0);
    }
}

TEST(ToyFacet, ThatIsLeftOutEndsTheRun) {
    Toys toys;
    for (std::size_t place = 0; place < toys.edges.size(); ++place)
        if (toys.edges[place].name == "toy.largest")
            toys.edges[place].run = [](const Offer&, const Ask&, const Data&, Data&, const Region&,
                                       Context&) {};
    const Ask ask{toys.want, toys.scene};
    for (const Plan& path : paths_of(toys.edges, ask, toys.input->what, 2000)) {
        if (path.steps.size() != 2 || path.steps[1].by->name != "toy.show") continue;
        EXPECT_THROW(results_of(path, ask, toys.input, 1, toys.memory), RunError);
    }
}

TEST(ToyFacet, KindsTakeAtLeastWhatTheyName) {
    EXPECT_TRUE(takes_kind("object/scalar", "object/scalar"));
    EXPECT_TRUE(takes_kind("object/scalar", "object/scalar+a+b"));
    EXPECT_TRUE(takes_kind("object/scalar+b", "object/scalar+a+b"));
    EXPECT_FALSE(takes_kind("object/scalar+c", "object/scalar+a+b"));
    EXPECT_FALSE(takes_kind("object/scalar+a", "object/scalar"));
    EXPECT_FALSE(takes_kind("object/scalar", "object/spectrum"));
}

}  // namespace
}  // namespace edgewise
