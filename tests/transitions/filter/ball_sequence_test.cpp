// What a sequence of small elements makes of a ball, beside sets and extremes written out.
#include "transitions/filter/ball_sequence.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <memory_resource>
#include <random>
#include <set>
#include <tuple>
#include <vector>

#include "graph/filtering.hpp"

namespace edgewise {
namespace {

using Place = std::tuple<std::int64_t, std::int64_t, std::int64_t>;

std::set<Place> sum_of(const std::set<Place>& a, const std::vector<Place>& b) {
    std::set<Place> sum;
    for (const auto& [x, y, z] : a)
        for (const auto& [u, v, w] : b) sum.insert({x + u, y + v, z + w});
    return sum;
}

/// The Minkowski sum of all elements, straight from what they are.
std::set<Place> made_by(const BallSequence& of) {
    std::set<Place> made = {{0, 0, 0}};
    const std::int64_t deep = of.axes == 2 ? 0 : 1;
    for (std::int64_t z = -deep; z <= deep; ++z)
        for (std::int64_t y = -1; y <= 1; ++y)
            for (std::int64_t x = -1; x <= 1; ++x) {
                if (Place(x, y, z) <= Place(0, 0, 0)) continue;  // one of two opposite ways
                const std::int64_t length = std::abs(x) + std::abs(y) + std::abs(z);
                const std::int64_t n = length == 1 ? of.box : length == 2 ? of.face : of.body;
                std::vector<Place> line;
                for (std::int64_t i = -n; i <= n; ++i) line.emplace_back(i * x, i * y, i * z);
                made = sum_of(made, line);
            }
    std::vector<Place> cross = {{0, 0, 0}, {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}};
    if (of.axes == 3) cross.insert(cross.end(), {{0, 0, 1}, {0, 0, -1}});
    for (std::int64_t i = 0; i < of.crosses; ++i) made = sum_of(made, cross);
    return made;
}

TEST(BallSequence, PlacesAreCounted) {
    for (const int axes : {2, 3})
        for (const double radius : {1.0, 1.5, 2.0, 3.2, 5.0, 7.0, 9.0}) {
            const BallSequence of = ball_sequence(radius, axes);
            const auto r = static_cast<std::int64_t>(radius);
            EXPECT_EQ(of.radius(), r);
            const std::set<Place> made = made_by(of);
            std::int64_t differing = 0;
            const std::int64_t deep = axes == 2 ? 0 : r;
            for (std::int64_t z = -deep; z <= deep; ++z)
                for (std::int64_t y = -r; y <= r; ++y)
                    for (std::int64_t x = -r; x <= r; ++x)
                        differing += made.contains({x, y, z}) !=
                                     (double(x * x + y * y + z * z) <= radius * radius);
            EXPECT_EQ(differing_places(of, radius), differing) << radius << ' ' << axes;
        }
    // Crosses of radius 1 are balls; so is, in a plane, that of radius 2.
    for (const int axes : {2, 3}) EXPECT_EQ(differing_places(ball_sequence(1, axes), 1), 0) << axes;
    EXPECT_EQ(differing_places(ball_sequence(2, 2), 2), 0);
}

/// A job of the edge, with data.
struct Opened {
    Request want;
    Scene scene;
    Data in;
    Transition edge = filter_ball_sequence();

    Opened(const Extent& extent, Type type, const Filtering& by) : in(random_data(extent, type)) {
        want.job = Job::filter;
        want.axes = extent.z == 1 ? 2 : 3;
        want.input = want.screen = extent;
        want.setting = JobSetting::of(by);
        scene.low = 0, scene.high = 250, scene.range = 250;
    }
    static Data random_data(const Extent& extent, Type type) {
        Representation what;
        what.extent = extent;
        what.axes = extent.z == 1 ? 2 : 3;
        what.type = type;
        Data data = Data::make(what, std::pmr::new_delete_resource());
        std::mt19937 random(3);
        for (std::int64_t i = 0; i < what.samples(); ++i) {
            if (type == Type::u8)
                data.as<std::uint8_t>()[i] = static_cast<std::uint8_t>(random() % 251);
            else
                data.as<float>()[i] = static_cast<float>(random() % 251);
        }
        return data;
    }
    Offer offer(double differs) const {
        Parameters with;
        with.set("differs", differs);
        return edge.offer(in.what, {want, scene}, with);
    }
    double at(const Data& data, std::int64_t x, std::int64_t y, std::int64_t z) const {
        const Filtering& by = *want.setting.as<Filtering>();
        const Extent n = in.what.extent;
        x = bordered(by.border, x, n.x), y = bordered(by.border, y, n.y);
        z = bordered(by.border, z, n.z);
        if (x < 0 || y < 0 || z < 0) return 0;
        const std::int64_t i = x + n.x * (y + n.y * z);
        return data.what.type == Type::u8 ? data.as<std::uint8_t>()[i] : data.as<float>()[i];
    }
};

TEST(BallSequence, IsTheExtremeOverWhatItMakes) {
    int served = 0;
    for (const Extent& extent : {Extent{300, 70, 1}, Extent{7, 1, 1}, Extent{1, 1, 1},
                                 Extent{23, 17, 12}, Extent{5, 1, 9}})
        for (const double radius : {1.0, 3.0, 6.5})
            for (const Border border :
                 {Border::zero, Border::clamp, Border::mirror, Border::wrap}) {
                const int axes = extent.z == 1 ? 2 : 3;
                const FilterOp op = served % 2 ? FilterOp::dilate : FilterOp::erode;
                const Opened job(extent, served % 3 ? Type::u8 : Type::f32,
                                 {op, Stencil::ball(radius, axes, false), border});
                const Offer offer = job.offer(2);
                ASSERT_EQ(offer.refused, "");
                ++served;
                Data out = Data::make(offer.to, std::pmr::new_delete_resource());
                Context context{.memory = std::pmr::new_delete_resource()};
                job.edge.run(offer, {job.want, job.scene}, job.in, out, Region::all(extent),
                             context);
                const std::set<Place> element = made_by(ball_sequence(radius, axes));
                for (std::int64_t z = 0; z < extent.z; ++z)
                    for (std::int64_t y = 0; y < extent.y; ++y)
                        for (std::int64_t x = 0; x < extent.x; ++x) {
                            double most = -1e9;
                            const double sign = op == FilterOp::dilate ? 1 : -1;
                            for (const auto& [u, v, w] : element)
                                most = std::max(most, sign * job.at(job.in, x + u, y + v, z + w));
                            ASSERT_EQ(job.at(out, x, y, z), sign * most)
                                << radius << ' ' << x << ' ' << y << ' ' << z;
                        }
            }
}

TEST(BallSequence, SaysWhatItIsNot) {
    const auto refused = [](const Filtering& by, double differs) {
        return Opened({20, 20, 20}, Type::u8, by).offer(differs).refused;
    };
    EXPECT_NE(refused({FilterOp::dilate, Stencil::box(3, 3, false)}, 1), "");
    EXPECT_NE(refused({FilterOp::median, Stencil::ball(3, 3, false)}, 1), "");
    EXPECT_NE(refused({FilterOp::dilate, Stencil::ball(0.5, 3, false)}, 1), "");
    EXPECT_NE(refused({FilterOp::dilate, Stencil::ball(4, 3, false)}, 0).find("places differ"),
              std::string::npos);
    const Opened coarse({20, 20, 20}, Type::u8, {FilterOp::open, Stencil::ball(4, 3, false)}),
        same({20, 20, 20}, Type::u8, {FilterOp::open, Stencil::ball(1, 3, false)});
    EXPECT_FALSE(coarse.edge.error(coarse.offer(2), {coarse.want, coarse.scene}).known);
    EXPECT_TRUE(same.edge.error(same.offer(0), {same.want, same.scene}).known);
    EXPECT_TRUE(coarse.edge.on_demand);
}

}  // namespace
}  // namespace edgewise
