// Facts that several edges read are there whichever of them a catalogue has.
#include <algorithm>
#include <gtest/gtest.h>
#include <memory>
#include <set>
#include <tuple>

#include "graph/picture_facts.hpp"
#include "planner/cost.hpp"
#include "planner/profile.hpp"
#include "scene/scene.hpp"
#include "tests/properties/run_request.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

/// An edge, what leads to it, and nothing else that makes pictures.
Catalogue alone(const Transition& edge) {
    Catalogue edges;
    for (const Transition& each : catalogue()) {
        const bool pictures =
            std::any_of(each.joins.begin(), each.joins.end(),
                        [](const auto& join) { return join.second == "screen/picture"; });
        if (!pictures || each.name == edge.name) edges.push_back(each);
    }
    return edges;
}

Scene counted(const Catalogue& edges, const Data& data, const Request& want, MemoryBudget& memory) {
    Scene scene = unseen_scene(statistics_of(data, &memory));
    count_scene(edges, data, want, scene, &memory);
    return scene;
}

/// The same samples in u8.
Data bytes_of(const Data& from, MemoryBudget& memory) {
    Representation what = from.what;
    what.type = Type::u8;
    what.values = {1 / 255.0, 0};
    Data data = Data::make(what, &memory);
    for (std::int64_t i = 0; i < what.samples(); ++i)
        data.as<std::uint8_t>()[i] =
            static_cast<std::uint8_t>(std::clamp(255 * from.as<float>()[i], 0.f, 255.f));
    return data;
}

void expect_equal(const Work& a, const Work& b, const std::string& of) {
    EXPECT_EQ(a.operations, b.operations) << of;
    EXPECT_EQ(a.gathers, b.gathers) << of;
    EXPECT_EQ(a.streamed, b.streamed) << of;
    EXPECT_EQ(a.lines.count, b.lines.count) << of;
    EXPECT_EQ(a.workspace, b.workspace) << of;
}

class SharedFacts : public testing::TestWithParam<std::tuple<const char*, Mode, Type>> {
 protected:
    /// A body that is empty around and hides what is behind it.
    Request want_of(const Data& data) const {
        Request want = request_of(Job::render, std::get<Mode>(GetParam()), data.what,
                                  {rotation(20, 30, 10), rotation(0, 80, 0)});
        want.transfer.points = {{0.1, 0, {0, 0, 0}}, {0.5, 0.6, {1, 0.5, 0}}, {1, 1, {1, 1, 1}}};
        want.transfer.unit = 1.5;
        return want;
    }
    MemoryBudget memory_{std::size_t{1} << 30};
};

TEST_P(SharedFacts, AnEdgeAloneIsPredictedAsAmongAll) {
    const auto& [name, mode, type] = GetParam();
    Data data = make_phantom(name, 40, &memory_);
    if (type == Type::u8) data = bytes_of(data, memory_);
    const Request want = want_of(data);
    const Catalogue all = catalogue();
    const Profile profile = default_profile(all);
    const Scene scene = counted(all, data, want, memory_);
    ASSERT_FALSE(scene.facts.empty());
    std::set<std::string> read;
    for (const Transition& edge : all) {
        if (edge.shared_counts.empty()) continue;
        const Scene own = counted(alone(edge), data, want, memory_);
        for (const auto& [fact, value] : own.facts) EXPECT_EQ(scene.facts.at(fact), value) << fact;
        const Demands via{.via = {{.name = edge.name}}};
        const TransformGraph spanned = expand(all, {want, scene}, {{data.what}}, via);
        for (const auto arc : boost::make_iterator_range(boost::edges(spanned.graph))) {
            const Arc& step = spanned.graph[arc];
            if (all[static_cast<std::size_t>(step.edge)].name != edge.name) continue;
            const std::string of = edge.name + step.offer.with.text();
            for (const int view : {0, 1})
                expect_equal(edge.work(step.offer, {want, own}, view),
                             edge.work(step.offer, {want, scene}, view), of);
            EXPECT_EQ(cost_of(edge, step.offer, {want, own}, profile, 1).seconds,
                      cost_of(edge, step.offer, {want, scene}, profile, 1).seconds)
                << of;
            read.insert(edge.name);
        }
    }
    EXPECT_GE(read.size(), 3u) << "edges that read such facts";
}

INSTANTIATE_TEST_SUITE_P(Casts, SharedFacts,
                         testing::Values(std::tuple("shepp-logan", Mode::composite, Type::f32),
                                         std::tuple("shepp-logan", Mode::composite, Type::u8),
                                         std::tuple("gaussians", Mode::composite, Type::f32),
                                         std::tuple("shepp-logan", Mode::mip, Type::u8),
                                         std::tuple("sphere", Mode::mip, Type::f32)));

/// Moves nothing, and is no matrix all the same.
class Bent final : public Deformation {
 public:
    std::string name() const override { return "bent"; }
    Vec3 apply(const Vec3& at) const override { return at; }
    Vec3 invert(const Vec3& at) const override { return at; }
    Mat3 jacobian(const Vec3&) const override { return Mat3::Identity(); }
};

TEST(SharedCounts, AreCalledOnceAndOnlyForViewsThatAreMatrices) {
    static int calls = 0;
    calls = 0;
    const CountFacts count = [](const Data&, const Request&, std::map<std::string, double>& facts,
                                std::pmr::memory_resource*) { facts["toy/calls"] = ++calls; };
    Catalogue edges;
    for (const char* name : {"toy.first", "toy.second", "toy.third"}) {
        Transition edge{.name = name};
        edge.shared_counts = {count};
        edges.push_back(edge);
    }
    MemoryBudget memory(std::size_t{1} << 24);
    const Data data = make_phantom("sphere", 8, &memory);
    Scene scene;
    Request want = request_of(Job::render, Mode::mip, data.what, {Mat4::Identity()});
    count_scene(edges, data, want, scene, &memory);
    EXPECT_EQ(calls, 1);
    EXPECT_EQ(scene.facts.at("toy/calls"), 1);
    want.views = Placement(Transform(std::make_shared<Bent>()));
    count_scene(edges, data, want, scene, &memory);
    EXPECT_EQ(calls, 1);
    // Edges that only attach something are asked about such views too; rays need a matrix.
    count_scene(catalogue(), data, want, scene, &memory);
    EXPECT_FALSE(scene.fact(kCastAll));
}

TEST(Counts, OfWhatNoPathTakesUnaskedAreMadeWhereSomebodyAsks) {
    static int calls = 0;
    calls = 0;
    const auto counted_edge = [](std::string name, std::vector<double> tried) {
        Transition edge{.name = std::move(name)};
        edge.parameters["share"] = number(0, 1, std::move(tried));
        edge.count = [](const Data&, const Request&, std::map<std::string, double>&,
                        std::pmr::memory_resource*) { ++calls; };
        return edge;
    };
    const Catalogue edges = {counted_edge("toy.tried", {0.5}), counted_edge("toy.named", {})};
    MemoryBudget memory(std::size_t{1} << 24);
    const Data data = make_phantom("sphere", 8, &memory);
    Scene scene;
    const Request want = request_of(Job::render, Mode::mip, data.what, {Mat4::Identity()});
    const auto counts_of = [&](const std::vector<const char*>& named) {
        Demands demands;
        for (const char* text : named) demands.via.push_back(demand_of(text, edges));
        const Demands asked = untried(demands, edges);
        calls = 0;
        count_scene(edges, data, want, scene, &memory, &asked);
        return calls;
    };
    EXPECT_EQ(counts_of({}), 1);
    EXPECT_EQ(counts_of({"toy.tried"}), 1);
    EXPECT_EQ(counts_of({"toy.named/share=0.1"}), 2);
    calls = 0;
    count_scene(edges, data, want, scene, &memory);
    EXPECT_EQ(calls, 2);
}

}  // namespace
}  // namespace edgewise
