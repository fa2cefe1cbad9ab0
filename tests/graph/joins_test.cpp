#include "graph/joins.hpp"

#include <gtest/gtest.h>

#include "graph/transition.hpp"

namespace edgewise {
namespace {

Transition joining(std::string name, std::string from, std::string to) {
    return {.name = std::move(name), .joins = {{std::move(from), std::move(to)}}};
}

TEST(Joins, LeadTowardsAKindByAnyNumberOfEdges) {
    const Catalogue edges = {
        joining("a.ab", "object/a", "object/b"), joining("a.bc", "object/b+facet", "screen/c"),
        joining("a.cd", "screen/c", "screen/d"), joining("a.xd", "object/x", "screen/d")};
    EXPECT_EQ(edges.joins().towards("screen/c"), (std::set<std::string>{"a.ab", "a.bc"}));
    EXPECT_EQ(edges.joins().towards("screen/d"),
              (std::set<std::string>{"a.ab", "a.bc", "a.cd", "a.xd"}));
    EXPECT_TRUE(edges.joins().towards("screen/none").empty());
    EXPECT_TRUE(edges.joins().leads_to("screen/d", 3));
    EXPECT_FALSE(edges.joins().leads_to("screen/c", 3));
}

TEST(Joins, LeadRoundAndRound) {
    const Catalogue edges = {
        joining("a.cd", "object/c", "screen/d"), joining("a.ba", "object/b", "object/a"),
        joining("a.ab", "object/a", "object/b"), joining("a.bc", "object/b", "object/c"),
        joining("a.dd", "screen/d", "screen/d")};
    EXPECT_EQ(edges.joins().towards("screen/d"),
              (std::set<std::string>{"a.ab", "a.ba", "a.bc", "a.cd", "a.dd"}));
    EXPECT_EQ(edges.joins().towards("object/b"), (std::set<std::string>{"a.ab", "a.ba"}));
}

TEST(Joins, OfAContentAreTheEdgesThatReadItInOrder) {
    Transition both = joining("a.both", "object/a", "object/b");
    both.joins.push_back({"object/a+facet", "screen/c"});
    const Catalogue edges = {both, joining("a.other", "object/b", "object/b"),
                             joining("a.last", "object/a", "screen/c")};
    const std::vector<Leaving>& leaving = edges.joins().leaving("object/a");
    ASSERT_EQ(leaving.size(), 3u);
    EXPECT_EQ(leaving[0].edge, 0);
    EXPECT_TRUE(leaving[0].prepares_only);
    EXPECT_EQ(leaving[1].needs, (std::set<std::string>{"facet"}));
    EXPECT_FALSE(leaving[1].prepares_only);
    EXPECT_EQ(leaving[2].edge, 2);
    EXPECT_TRUE(edges.joins().leaving("object/none").empty());
}

TEST(Joins, FollowTheCatalogueAsItChanges) {
    Catalogue edges = {joining("a.ab", "object/a", "object/b")};
    EXPECT_TRUE(edges.joins().towards("screen/c").empty());
    const Catalogue before = edges;
    edges.push_back(joining("a.bc", "object/b", "screen/c"));
    EXPECT_EQ(edges.joins().towards("screen/c").size(), 2u);
    edges[1].joins = {{"object/z", "screen/c"}};
    EXPECT_EQ(edges.joins().towards("screen/c"), (std::set<std::string>{"a.bc"}));
    EXPECT_TRUE(before.joins().towards("screen/c").empty());
}

}  // namespace
}  // namespace edgewise
