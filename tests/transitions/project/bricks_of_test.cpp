#include "transitions/project/bricks_of.hpp"

#include <gtest/gtest.h>
#include <random>

#include "transitions/kernels/grid_of.hpp"

namespace edgewise {
namespace {

Data noise(const Extent& extent) {
    Representation what;
    what.type = Type::u8;
    what.axes = 3;
    what.extent = extent;
    what.space = "object";
    what.content = "scalar";
    Data data = Data::make(what, std::pmr::get_default_resource());
    std::mt19937 bits(5);
    for (std::int64_t i = 0; i < what.samples(); ++i)
        data.as<std::uint8_t>()[i] = static_cast<std::uint8_t>(bits());
    return data;
}

std::shared_ptr<WorkedOut> kept() {
    return std::make_shared<WorkedOut>(std::make_shared<std::pmr::synchronized_pool_resource>());
}

std::shared_ptr<const kernels::Bricks> beside(const Data& data, const kernels::LevelsOf& of) {
    return bricks_beside(data, kernels::grid_of(data), of, std::pmr::get_default_resource(),
                         nullptr);
}

TEST(BricksBeside, AreMadeOnceForSamplesThatKeepThem) {
    Data data = noise({21, 18, 13});
    EXPECT_NE(beside(data, {}), beside(data, {}));  // nothing keeps them
    data.worked_out = kept();
    const auto first = beside(data, {});
    EXPECT_EQ(beside(data, {}), first);
    // Data that shares the samples shares them too.
    EXPECT_EQ(beside(Data::sharing(data, data.what), {}), first);
    EXPECT_EQ(
        first->level,
        bricks_of(kernels::grid_of(data), {}, std::pmr::get_default_resource(), nullptr)->level);
}

TEST(BricksBeside, OfOtherLevelsAreOthers) {
    Data data = noise({21, 18, 13});
    data.worked_out = kept();
    kernels::Optics faint, dense;
    faint.ramps.push_back({.start = 10, .inverse_width = 0.01f, .color = {}, .opacity = 0.2f});
    dense.ramps.push_back({.start = 10, .inverse_width = 0.01f, .color = {}, .opacity = 0.9f});
    const kernels::LevelsOf levels[] = {
        {}, {.optics = &faint}, {.optics = &dense}, {.overshoot = {.range = 0.1}}};
    std::vector<std::shared_ptr<const kernels::Bricks>> all;
    for (const kernels::LevelsOf& of : levels) all.push_back(beside(data, of));
    for (std::size_t i = 0; i < all.size(); ++i) {
        EXPECT_EQ(beside(data, levels[i]), all[i]);
        for (std::size_t j = 0; j < i; ++j) EXPECT_NE(all[i], all[j]);
        EXPECT_EQ(all[i]->level, bricks_of(kernels::grid_of(data), levels[i],
                                           std::pmr::get_default_resource(), nullptr)
                                     ->level);
    }
}

TEST(BricksBeside, OfAnotherValueMapOrOtherSamplesAreOthers) {
    Data data = noise({21, 18, 13});
    data.worked_out = kept();
    const auto first = beside(data, {});
    Representation negated = data.what;
    negated.values.slope = -1;
    EXPECT_NE(beside(Data::sharing(data, negated), {}), first);
    Data other = noise({21, 18, 13});
    other.worked_out = data.worked_out;
    EXPECT_NE(beside(other, {}), first);
}

TEST(BricksBeside, ThatStayedUnfinishedAreNotKept) {
    Data data = noise({21, 18, 13});
    data.worked_out = kept();
    bricks_beside(data, kernels::grid_of(data), {}, std::pmr::get_default_resource(),
                  [] { return true; });
    EXPECT_EQ(
        beside(data, {})->level,
        bricks_of(kernels::grid_of(data), {}, std::pmr::get_default_resource(), nullptr)->level);
}

}  // namespace
}  // namespace edgewise
