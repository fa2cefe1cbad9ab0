#include "graph/parameters.hpp"

#include <gtest/gtest.h>

#include "graph/errors.hpp"
#include "graph/transform_graph.hpp"

namespace edgewise {
namespace {

template <class Body>
std::string message_of(Body body) {
    try {
        body();
    } catch (const RequestError& error) {
        return error.what();
    }
    return "accepted";
}

Catalogue catalogue() {
    return {
        {.name = "warp.toy",
         .parameters = {{"filter", one_of({"zoh", "foh"})}, {"step", number(0.25, 4, {1, 0.5})}}},
        {.name = "warp.other"},
        {.name = "project.toy"},
    };
}

TEST(Parameters, TextIsInAlphabeticalOrder) {
    const Parameters with{{"step", 0.5}, {"filter", "foh"}};
    EXPECT_EQ(with.text(), "/filter=foh/step=0.5");
    EXPECT_EQ(with.word("filter"), "foh");
    EXPECT_EQ(with.number("step"), 0.5);
    EXPECT_THROW((void)with.word("width"), std::out_of_range);
    EXPECT_EQ(Parameters().text(), "");
}

TEST(Parameters, TextComesBackAsTheSameNumber) {
    for (const double value : {1.0, 0.1, 1 / 3.0, 1e-9, 12345678.9}) {
        const Domain domain = number(0, 1e9, {});
        EXPECT_EQ(std::get<double>(domain.parse("e", "k", text_of(Value(value)))), value);
    }
}

TEST(Domain, TellsWhatIsAllowed) {
    const Domain words = one_of({"zoh", "foh"}), numbers = number(0.25, 4, {1});
    EXPECT_EQ(std::get<std::string>(words.parse("e", "k", "foh")), "foh");
    EXPECT_EQ(std::get<double>(numbers.parse("e", "k", "0.25")), 0.25);
    EXPECT_EQ(std::get<double>(numbers.parse("e", "k", "4")), 4);
    EXPECT_EQ(message_of([&] { words.parse("warp.toy", "filter", "cubic"); }),
              "warp.toy/filter=cubic: expected one of zoh, foh");
    EXPECT_EQ(std::get<std::string>(words.parse("e", "k", "FOH")), "foh");
    EXPECT_EQ(message_of([&] { words.parse("warp.toy", "filter", "fho"); }),
              "warp.toy/filter=fho: did you mean foh?");
    for (const char* bad : {"0.2", "4.1", "", "one", "1x", "nan", "inf", " 1"})
        EXPECT_EQ(message_of([&] { numbers.parse("warp.toy", "step", bad); }),
                  std::string("warp.toy/step=") + bad + ": a number from 0.25 to 4");
    EXPECT_EQ(words.tried.size(), 2u);
}

TEST(Demand, ReadsEdgesFamiliesAndValues) {
    const Catalogue edges = catalogue();
    const Demand all = demand_of("warp.toy/step=2/filter=zoh", edges);
    EXPECT_EQ(all.name, "warp.toy");
    EXPECT_EQ(all.with.text(), "/filter=zoh/step=2");
    EXPECT_TRUE(all.fits(edges[0], {{"filter", "zoh"}, {"step", 2.0}, {"more", 1.0}}));
    EXPECT_FALSE(all.fits(edges[0], {{"filter", "zoh"}, {"step", 1.0}}));
    EXPECT_FALSE(all.fits(edges[0], {{"filter", "zoh"}}));
    const Demand family = demand_of("warp", edges);
    EXPECT_TRUE(family.fits(edges[0], {}) && family.fits(edges[1], {}));
    EXPECT_FALSE(family.names(edges[2]));
}

TEST(Demand, TakesNamesInAnyCaseAndByTheirEndWhereItIsOne) {
    const Catalogue edges = catalogue();
    EXPECT_EQ(demand_of("Warp.Toy/Filter=ZOH", edges).with.text(), "/filter=zoh");
    EXPECT_EQ(demand_of("other", edges).name, "warp.other");
    EXPECT_EQ(demand_of("PROJECT", edges).name, "project");
}

TEST(Demand, RejectsWhatTheCatalogueDoesNotKnow) {
    const Catalogue edges = catalogue();
    const auto why = [&](const char* text) { return message_of([&] { demand_of(text, edges); }); };
    EXPECT_EQ(why("shade.phong"), "no edge is called 'shade.phong'; `list edges` shows all");
    EXPECT_EQ(why("wrap.other"), "no edge is called 'wrap.other'; did you mean warp.other?");
    EXPECT_EQ(why("otehr"), "no edge is called 'otehr'; did you mean other?");
    EXPECT_EQ(why("toy"), "'toy' may be project.toy or warp.toy; say which");
    EXPECT_EQ(why("warp.toy/width=3"),
              "'warp.toy' has no parameter 'width'; expected one of filter, step");
    EXPECT_EQ(why("warp.toy/fitler=foh"),
              "'warp.toy' has no parameter 'fitler'; did you mean filter?");
    EXPECT_EQ(why("warp/filter=foh"),
              "'warp' is a family, and parameters are of one edge, as warp.toy/filter=foh");
    EXPECT_EQ(why("warp.toy/filter"), "'filter' in 'warp.toy/filter': expected key=value");
    EXPECT_EQ(why("warp.toy/"), "'' in 'warp.toy/': expected key=value");
    EXPECT_EQ(why("warp.toy/step=9"), "warp.toy/step=9: a number from 0.25 to 4");
    EXPECT_NE(why(""), "accepted");
}

}  // namespace
}  // namespace edgewise
