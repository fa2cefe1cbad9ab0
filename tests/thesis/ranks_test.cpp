// What edges count where samples are spread over ranks: TABLE 6 a sample, and nothing at one rank.
#include <gtest/gtest.h>
#include <set>

#include "tests/thesis/machine_request.hpp"
#include "transitions/warp/counts.hpp"

namespace edgewise {
namespace {

using thesis::planned;
using thesis::turned;

/// The work of the warp, a sample of the output. The view is the identity, so all of it is seen.
Work counted(const std::string& edge, const char* turn, int side) {
    Request want = turned(Job::warp, side, turn, 0);
    want.ranks = 64;
    const Answer answer =
        planned(want, Scene{}, default_profile(catalogue()), {"net.spread/layout=columns", edge});
    EXPECT_TRUE(answer.plan) << answer.problem;
    Work work = answer.plan->steps.at(1).work;
    const auto samples = static_cast<double>(want.screen.samples());
    for (double* count :
         {&work.operations, &work.traffic.local, &work.traffic.global, &work.traffic.congested})
        *count /= samples;
    return work;
}

TEST(OverRanks, EdgesCountTable6) {
    for (const int axes : {2, 3})
        for (const int order : {0, 1}) {
            const std::string filter = order ? "/filter=foh" : "/filter=zoh";
            const char* turn = axes == 2 ? "2d" : "xyz";
            const WarpCounts forward = forward_counts(order, axes);
            const Work sent = counted("warp.permutation" + filter, turn, 32);
            EXPECT_DOUBLE_EQ(sent.operations + sent.traffic.local, forward.printed());
            EXPECT_DOUBLE_EQ(sent.traffic.global, 1);
            EXPECT_DOUBLE_EQ(sent.traffic.congested, 0);
            const WarpCounts backward = backward_counts(order, axes);
            const Work read = counted("warp.backward" + filter, turn, 32);
            EXPECT_DOUBLE_EQ(read.operations, backward.printed());
            EXPECT_DOUBLE_EQ(read.traffic.congested, points(order, axes));
            EXPECT_DOUBLE_EQ(read.traffic.global, 0);
        }
}

TEST(OverRanks, PicturesAreJoinedInLogarithmicallyManyMessages) {
    for (const int ranks : {8, 64, 512}) {
        Request want = turned(Job::render, 64, "xyz", 20);
        want.ranks = ranks;
        const Answer answer =
            planned(want, Scene{}, default_profile(catalogue()),
                    {"net.spread/layout=slice-and-dice", "warp.permutation", "project.combine"});
        ASSERT_TRUE(answer.plan) << answer.problem;
        // 2, 4, 8 boxes along a ray.
        EXPECT_EQ(answer.plan->steps.back().work.traffic.messages, ranks == 8    ? 1
                                                                   : ranks == 64 ? 2
                                                                                 : 3);
    }
}

TEST(OverRanks, OnlyEdgesThatCountWhatRanksExchangeTakeThem) {
    const Catalogue edges = catalogue();
    const std::set<std::string> known = {"warp.backward", "warp.permutation", "warp.shear",
                                         "project.combine", "project.ray_cast"};
    for (const Job job : {Job::warp, Job::render})
        for (const Mode mode : {Mode::mip, Mode::xray, Mode::composite}) {
            Request want = turned(job, 64, "x", 90);
            want.ranks = 16;
            want.mode = mode;
            want.transfer.points = {{}, {1, 1, {1, 1, 1}}};
            const Scene scene;
            const TransformGraph spanned = expand(edges, {want, scene}, {thesis::samples_of(want)});
            EXPECT_GT(boost::num_edges(spanned.graph), 0u);
            for (const auto arc : boost::make_iterator_range(boost::edges(spanned.graph))) {
                const Arc& what = spanned.graph[arc];
                const std::string& name = edges[static_cast<std::size_t>(what.edge)].name;
                if (what.offer.from.place == Place::ranks) {
                    EXPECT_TRUE(known.contains(name)) << name;
                }
            }
        }
}

TEST(OverRanks, OneRankHasNone) {
    const Catalogue edges = catalogue();
    const Request want = turned(Job::render, 64, "xyz", 20);
    const Scene scene;
    const TransformGraph spanned = expand(edges, {want, scene}, {thesis::samples_of(want)});
    for (const auto at : boost::make_iterator_range(boost::vertices(spanned.graph)))
        EXPECT_NE(spanned.graph[at].what.place, Place::ranks);
}

}  // namespace
}  // namespace edgewise
