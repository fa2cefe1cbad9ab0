#include "transitions/store/crop.hpp"

#include <Eigen/Geometry>
#include <cstdint>
#include <gtest/gtest.h>

namespace edgewise {
namespace {

/// A volume of 5 with a box of larger numbers in it, and the request and scene that belong to it.
struct Case {
    Case() {
        Representation what;
        what.extent = {64, 50, 40};
        what.type = Type::u16;
        data = Data::make(what, std::pmr::get_default_resource());
        for (std::int64_t i = 0; i < what.samples(); ++i) data.as<std::uint16_t>()[i] = 5;
        for (std::int64_t z = 20; z < 24; ++z)
            for (std::int64_t y = 3; y < 9; ++y)
                for (std::int64_t x = 30; x < 40; ++x)
                    at(x, y, z) = static_cast<std::uint16_t>(100 + x + 64 * y + z);
        want.input = what.extent;
        want.mode = Mode::mip;
        want.miss = 5;
        scene.low = scene.commonest = 5;
        scene.high = 1000;
        scene.occupied = {{30, 3, 20}, {40, 9, 24}};
    }
    std::uint16_t& at(std::int64_t x, std::int64_t y, std::int64_t z) {
        return data.as<std::uint16_t>()[x + 64 * (y + 50 * z)];
    }
    Ask ask() const { return {want, scene}; }
    Offer offer() const { return crop().offer(data.what, ask(), {}); }

    Data data;
    Request want;
    Scene scene;
};

TEST(Crop, KeepsTheBoxAndItsMarginWhereTheyWere) {
    Case c;
    const Offer offer = c.offer();
    ASSERT_EQ(offer.refused, "");
    EXPECT_EQ(offer.to.extent, (Extent{34, 21, 28}));
    EXPECT_EQ(Vec3((offer.to.placed.at(0).matrix() * Vec3(30, 3, 20).homogeneous()).head<3>()),
              Vec3(12, 3, 12));
    Data out = Data::make(offer.to, std::pmr::get_default_resource());
    Context context{.memory = std::pmr::get_default_resource()};
    const Transition edge = crop();
    const Partition parts = edge.parts(offer, c.ask());
    ASSERT_EQ(parts.kind, Partition::output);
    // In two regions, as the runtime may cut it.
    const Region first{{0, 0, 0}, {34, 21, 10}}, second{{0, 0, 10}, {34, 21, 28}};
    EXPECT_EQ(parts.reads(first, 0), (Region{{18, 0, 8}, {52, 21, 18}}));
    edge.run(offer, c.ask(), c.data, out, first, context);
    edge.run(offer, c.ask(), c.data, out, second, context);
    for (std::int64_t z = 0; z < 28; ++z)
        for (std::int64_t y = 0; y < 21; ++y)
            for (std::int64_t x = 0; x < 34; ++x)
                ASSERT_EQ(out.as<std::uint16_t>()[x + 34 * (y + 21 * z)], c.at(x + 18, y, z + 8));
}

TEST(Crop, KeepsWhatClippedRaysSee) {
    Case c;
    c.want.mode = Mode::mean;  // which counts every sample that it sees
    const std::vector<HalfSpace> planes{{Vec3::UnitX(), -40.5}, {Vec3(0, -0.6, -0.8), 7.9}};
    c.want.clips = {clip_of(c.want.input, planes)};
    const Offer offer = c.offer();
    ASSERT_EQ(offer.refused, "");
    // y to 8.3 / 0.6 = 13.8, z to 8.2 / 0.8 = 10.25, and 12 samples more.
    EXPECT_EQ(offer.to.extent, (Extent{64 - 28, 14 + 12 + 1, 11 + 12 + 1}));
    EXPECT_EQ(offer.to.placed.at(0).matrix()(0, 3), -28);
    // What is empty is left out as well where that adds nothing.
    c.want.mode = Mode::mip;
    c.want.clips = {clip_of(c.want.input, std::span(planes).first(1))};
    c.scene.occupied = {{30, 3, 20}, {44, 9, 24}};
    EXPECT_EQ(c.offer().to.extent, (Extent{28, 21, 28}));
    // A part without any of it stays.
    c.scene.occupied = {{3, 3, 20}, {4, 9, 24}};
    EXPECT_EQ(c.offer().to.extent, (Extent{36, 50, 40}));
}

TEST(Crop, StopsWhenAsked) {
    Case c;
    const Offer offer = c.offer();
    Data out = Data::make(offer.to, std::pmr::get_default_resource());
    const std::atomic<bool> stop = true;
    Context context{.memory = std::pmr::get_default_resource(), .stop = &stop};
    EXPECT_THROW(crop().run(offer, c.ask(), c.data, out, Region::all(offer.to.extent), context),
                 Cancelled);
}

TEST(Crop, RefusesWhatWouldChangeTheAnswer) {
    Case c;
    c.want.mode = Mode::mean;
    EXPECT_NE(c.offer().refused, "");
    c.want.mode = Mode::xray;
    EXPECT_NE(c.offer().refused, "");  // 5 adds up
    c.want.zero = 5;
    EXPECT_EQ(c.offer().refused, "");
    c.want.mode = Mode::composite;
    c.want.transfer.points = {{0, 0, {}}, {10, 1, {}}};
    EXPECT_NE(c.offer().refused, "");
    c.want.transfer.points = {{5, 0, {}}, {10, 1, {}}};
    EXPECT_EQ(c.offer().refused, "");
    c.want.mode = Mode::mip;
    c.scene.low = 4;
    EXPECT_NE(c.offer().refused, "");
    c.want.job = Job::warp;
    EXPECT_NE(c.offer().refused, "");  // outside is 0
    c.want.outside = 5;
    EXPECT_EQ(c.offer().refused, "");
}

TEST(Crop, RefusesWhatCannotPayOrIsNotTheInput) {
    Case c;
    c.scene.occupied = {{0, 0, 0}, {64, 50, 30}};
    EXPECT_NE(c.offer().refused, "");
    c.scene.occupied = {};
    EXPECT_NE(c.offer().refused, "");
    c = Case();
    Representation moved = c.data.what;
    Mat4 map = Mat4::Identity();
    map(0, 3) = 1;
    moved.placed = map;
    EXPECT_NE(crop().offer(moved, c.ask(), {}).refused, "");
}

}  // namespace
}  // namespace edgewise
