#include "transitions/store/octree.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <memory_resource>
#include <oneapi/tbb/global_control.h>
#include <random>
#include <string>

namespace edgewise {
namespace {

using kernels::Octree;
using kernels::OctreeNode;
using Place = std::array<std::int64_t, 3>;

constexpr double kNone = std::numeric_limits<double>::infinity();

double value_at(const Data& data, const Place& at) {
    switch (data.what.type) {
        case Type::u8:
            return *data.at<std::uint8_t>(at[0], at[1], at[2]);
        case Type::i16:
            return *data.at<std::int16_t>(at[0], at[1], at[2]);
        default:
            return double(*data.at<float>(at[0], at[1], at[2]));
    }
}

/// A smooth hill, noise, and a flat rest.
template <class T>
Data hill(Type type, const Extent& n, double scale, double offset = 0) {
    Representation what;
    what.extent = n;
    what.type = type;
    Data data = Data::make(what, std::pmr::new_delete_resource());
    std::mt19937 bits(3);
    for (std::int64_t z = 0; z < n.z; ++z)
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x) {
                double value = 0;
                if (x > n.x / 3) value = std::exp(-0.01 * double((x - 20) * (x - 20) + y * y));
                if (z > n.z / 2 && x < n.x / 2) value += 1e-3 * double(bits() % 100);
                *data.at<T>(x, y, z) = static_cast<T>(scale * value + offset);
            }
    return data;
}

Request pictures_of(const Extent& n) {
    Request want;
    want.job = Job::render;
    want.mode = Mode::mean;
    want.input = n;
    want.screen = {20, 20, 20};
    return want;
}

Data with_octree(const Data& in, double tolerance) {
    const Request want = pictures_of(in.what.extent);
    const Scene scene;
    const Ask ask{want, scene};
    const Transition edge = octree();
    const Offer offer = edge.offer(in.what, ask, {{"tolerance", tolerance}});
    EXPECT_EQ(offer.refused, "");
    Data out = Data::sharing(in, offer.to);
    Context context{.memory = std::pmr::new_delete_resource()};
    edge.run(offer, ask, in, out, Region::all(in.what.extent), context);
    const double bytes = double(octree_of(out)->tree.nodes.size()) * sizeof(OctreeNode);
    EXPECT_LE(bytes, offer.to.facet_bytes);
    return out;
}

/// What the samples that places of a node read are, by looking at each.
struct Looked {
    double places = 0, sum = 0, squares = 0, low = kNone, high = -kNone, magnitude = 0;
    double origin = 0;  // squares of what samples differ from it do not cancel
    std::int64_t absent = 0;

    Looked(const Data& data, const Place& begin, std::int64_t side) {
        const Extent& n = data.what.extent;
        Place at;
        for (at[2] = begin[2]; at[2] <= std::min(begin[2] + side, n.z - 1); ++at[2])
            for (at[1] = begin[1]; at[1] <= std::min(begin[1] + side, n.y - 1); ++at[1])
                for (at[0] = begin[0]; at[0] <= std::min(begin[0] + side, n.x - 1); ++at[0])
                    add(value_at(data, at), at, begin, side);
    }
    double mean() const { return origin + sum / places; }
    double variance() const {
        return std::max(0.0, squares / places - sum / places * (sum / places));
    }
    double farthest() const { return std::max(high - mean(), mean() - low); }
    bool empty() const { return low > high; }

 private:
    void add(double value, const Place& at, const Place& begin, std::int64_t side) {
        // What lies nearest to the sample, within the node.
        double part = 1;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double first = begin[axis] == 0 ? -0.5 : double(begin[axis]);
            part *= std::min(double(at[axis]) + 0.5, double(begin[axis] + side)) -
                    std::max(double(at[axis]) - 0.5, first);
        }
        places += part;
        if (!std::isfinite(value)) {
            ++absent;
            return;
        }
        if (empty()) origin = value;
        sum += part * (value - origin);
        squares += part * (value - origin) * (value - origin);
        low = std::min(low, value);
        high = std::max(high, value);
        magnitude = std::max(magnitude, std::abs(value));
    }
};

/// Walks all nodes of a tree and holds each against its samples.
struct Walk {
    const Data& data;
    const Octree& tree;
    double tolerance;  // [stored number]
    double places = 0, in_leaves = 0, variance = 0;
    std::int64_t leaves = 0, sampled = 0, absent = 0, visited = 0;

    /// @return whether all of it is leaves
    bool node(std::size_t at, const Place& begin, int level) {
        ++visited;
        const OctreeNode& node = tree.nodes[at];
        for (std::size_t axis = 0; axis < 3; ++axis)
            if (begin[axis] >= data.what.extent[int(axis)]) {
                EXPECT_GT(node.low, node.high);
                EXPECT_EQ(node.child, OctreeNode::kLeaf);
                return true;
            }
        const std::int64_t side = std::int64_t{4} << level;
        const Looked looked(data, begin, side);
        EXPECT_EQ(double(node.low), looked.low);
        EXPECT_EQ(double(node.high), looked.high);
        if (node.child <= 0) places += looked.places;
        if (node.child == OctreeNode::kLeaf) return expect_leaf(node, looked);
        if (node.child == OctreeNode::kSamples) {
            EXPECT_EQ(level, 0);
            EXPECT_FALSE(tolerable(looked, 1 - 1e-6)) << begin[0] << ' ' << begin[1];
            ++sampled;
            return false;
        }
        bool all = true;
        for (std::int64_t c = 0; c < 8; ++c) {
            const std::int64_t half = side / 2;
            const Place first{begin[0] + (c & 1) * half, begin[1] + (c >> 1 & 1) * half,
                              begin[2] + (c >> 2) * half};
            all = node_below(node, c, first, level - 1) && all;
        }
        // Else it would have been a leaf.
        EXPECT_FALSE(all && tolerable(looked, 1 - 1e-6)) << level;
        return false;
    }

 private:
    bool node_below(const OctreeNode& above, std::int64_t child, const Place& begin, int level) {
        const auto at = std::size_t(above.child + child);
        EXPECT_LT(at, tree.nodes.size());
        return at < tree.nodes.size() && node(at, begin, level);
    }
    bool tolerable(const Looked& looked, double share) const {
        if (looked.empty()) return true;
        if (looked.absent > 0) return false;
        return looked.low == looked.high || (std::sqrt(looked.variance()) <= share * tolerance &&
                                             looked.farthest() <= share * 4 * tolerance);
    }
    bool expect_leaf(const OctreeNode& node, const Looked& looked) {
        if (looked.empty()) {
            ++absent;
            return true;
        }
        EXPECT_EQ(looked.absent, 0);
        EXPECT_LE(looked.variance(), tolerance * tolerance * (1 + 1e-9));
        EXPECT_LE(looked.farthest(), 4 * tolerance * (1 + 1e-9) + looked.magnitude * 0x1p-48);
        EXPECT_NEAR(double(node.mean), looked.mean(), looked.magnitude * 0x1p-23);
        in_leaves += looked.places;
        variance += looked.places * looked.variance();
        ++leaves;
        return true;
    }
};

Walk expect_right(const Data& in, double tolerance) {
    SCOPED_TRACE(std::string(name_of(in.what.type)) + " " + std::to_string(tolerance));
    const Data beside = with_octree(in, tolerance);
    const Octree& tree = octree_of(beside)->tree;
    Walk walk{in, tree, tolerance * double(tree.range)};
    walk.node(0, {0, 0, 0}, tree.depth);
    // Every node once, and every place of the volume once.
    EXPECT_EQ(std::size_t(walk.visited), tree.nodes.size());
    const double all = double(in.what.samples());
    EXPECT_NEAR(walk.places, all, 1e-9 * all);
    EXPECT_NEAR(tree.leaves, walk.in_leaves / all, 1e-9);
    const double range = double(tree.range);
    EXPECT_NEAR(tree.variance, walk.variance / all, 1e-9 * range * range);
    EXPECT_LE(tree.variance, std::pow(tolerance * range, 2) * (1 + 1e-9));
    return walk;
}

TEST(Octree, IsWhatItsSamplesSay) {
    const Extent n{45, 38, 51};
    for (const double tolerance : {0.0, 0.003, 0.03, 1.0}) {
        const Walk bytes = expect_right(hill<std::uint8_t>(Type::u8, n, 200), tolerance);
        const Walk words = expect_right(hill<std::int16_t>(Type::i16, n, 2000, -500), tolerance);
        const Walk floats = expect_right(hill<float>(Type::f32, n, 1), tolerance);
        // Detail on an offset that squares would swallow.
        const Walk far = expect_right(hill<float>(Type::f32, n, 16, 1 << 20), tolerance);
        if (tolerance == 1) {
            for (const Walk* walk : {&bytes, &words, &floats, &far}) EXPECT_EQ(walk->leaves, 1);
        } else {
            for (const Walk* walk : {&bytes, &words, &floats, &far}) {
                EXPECT_GT(walk->leaves, 10);
                EXPECT_GT(walk->sampled, 10);
            }
        }
    }
}

TEST(Octree, OddExtents) {
    for (const Extent& n : {Extent{1, 1, 1}, Extent{5, 1, 1}, Extent{1, 9, 1}, Extent{4, 4, 4},
                            Extent{1, 1, 64}, Extent{33, 2, 17}, Extent{65, 1, 3}})
        for (const double tolerance : {0.0, 0.05}) {
            SCOPED_TRACE(std::to_string(n.x) + "x" + std::to_string(n.y) + "x" +
                         std::to_string(n.z));
            expect_right(hill<float>(Type::f32, n, 1), tolerance);
        }
}

TEST(Octree, SamplesThatAreAbsentAreNoLeavesButWhereAllAre) {
    const Extent n{40, 37, 41};
    Data in = hill<float>(Type::f32, n, 1);
    for (std::int64_t z = 0; z < 20; ++z)
        for (std::int64_t y = 0; y < 21; ++y)
            std::fill_n(in.at<float>(0, y, z), 22, std::numeric_limits<float>::quiet_NaN());
    *in.at<float>(39, 36, 40) = std::numeric_limits<float>::infinity();
    for (const double tolerance : {0.0, 0.03, 1.0}) {
        const Walk walk = expect_right(in, tolerance);
        EXPECT_GT(walk.absent, 0);
        EXPECT_GT(walk.sampled, 0);
    }
    std::fill_n(in.as<float>(), n.samples(), std::numeric_limits<float>::quiet_NaN());
    const Walk none = expect_right(in, 0.03);
    EXPECT_EQ(none.absent, 1);
}

/// A bright sample in a dark block of 64^3 has a standard deviation of 1/512 there, and 1/8 in the
/// finest node around it.
TEST(Octree, ASmallSpotIsNotLostInALargeNode) {
    const Extent n{64, 64, 64};
    Representation what;
    what.extent = n;
    what.type = Type::u8;
    Data in = Data::make(what, std::pmr::new_delete_resource());
    std::memset(in.as<std::uint8_t>(), 0, std::size_t(n.samples()));
    *in.at<std::uint8_t>(30, 41, 9) = 200;
    const Walk walk = expect_right(in, 0.03);
    EXPECT_EQ(walk.sampled, 1);
    // Beside the way down to it: 7 of 8 children at each of 4 levels.
    EXPECT_EQ(walk.leaves, 4 * 7);
}

TEST(Octree, SameBytesForAnyThreads) {
    const Data in = hill<float>(Type::f32, {90, 71, 83}, 1);
    const auto with = [&](std::size_t threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        return octree_of(with_octree(in, 0.01));
    };
    const auto one = with(1);
    for (const std::size_t threads : {2u, 7u}) {
        const auto more = with(threads);
        ASSERT_EQ(more->tree.nodes.size(), one->tree.nodes.size());
        EXPECT_EQ(0, std::memcmp(more->tree.nodes.data(), one->tree.nodes.data(),
                                 one->tree.nodes.size_bytes()));
        EXPECT_EQ(more->tree.variance, one->tree.variance);
    }
}

TEST(Octree, SaysHowFarLeavesAreOff) {
    const Data in = hill<float>(Type::f32, {30, 30, 30}, 1);
    const Request want = pictures_of(in.what.extent);
    Scene scene;
    scene.low = -3;
    scene.high = 5;
    const Ask ask{want, scene};
    const auto error = [&](double tolerance) {
        return octree().error(octree().offer(in.what, ask, {{"tolerance", tolerance}}), ask);
    };
    EXPECT_TRUE(error(0).copies);
    EXPECT_EQ(error(0).bias, 0);
    EXPECT_DOUBLE_EQ(error(0.02).bias, 0.16);
    // What the mode sees of 512 finest nodes: all differ, and are leaves from some tolerance on.
    std::mt19937 bits(3);
    const Data noise = [&] {
        Data data = hill<float>(Type::f32, {64, 64, 64}, 0);
        for (std::int64_t i = 0; i < data.what.samples() / 2; ++i)
            data.as<float>()[i] = float(bits() % 1000) * 8e-4f;
        return data;
    }();
    octree().count(noise, want, scene.facts, std::pmr::new_delete_resource());
    EXPECT_NEAR(*scene.fact(FactName("octree/varied")), 0.5, 0.05);
    // Even noise of 0.8 has a deviation of 0.8 / sqrt(12).
    EXPECT_NEAR(*scene.fact(FactName("octree/differs/8")), 0.8 / std::sqrt(12), 0.01);
    EXPECT_DOUBLE_EQ(error(0.01).bias, 0.08 * std::sqrt(3.0 / 512));
    EXPECT_NEAR(error(0.1).bias, 0.8 * std::sqrt(0.5), 0.03);
    Request largest = want;
    largest.mode = Mode::mip;
    EXPECT_DOUBLE_EQ(octree()
                         .error(octree().offer(in.what, {largest, scene}, {{"tolerance", 0.01}}),
                                {largest, scene})
                         .bias,
                     0.08);
    // What a transfer function leaves clear is off by nothing.
    largest.mode = Mode::composite;
    largest.transfer.points = {{0.9, 0, {1, 1, 1}}, {5, 1, {1, 1, 1}}};
    scene.facts.clear();
    octree().count(noise, largest, scene.facts, std::pmr::new_delete_resource());
    EXPECT_EQ(*scene.fact(FactName("octree/varied")), 0);
}

TEST(Octree, Refuses) {
    Representation what;
    what.extent = {30, 30, 30};
    Request want = pictures_of(what.extent);
    const Scene scene;
    const auto refused = [&] {
        return octree().offer(what, {want, scene}, {{"tolerance", 0.0}}).refused;
    };
    EXPECT_EQ(refused(), "");
    want.job = Job::warp;
    EXPECT_NE(refused().find("not a picture"), std::string::npos);
    want.job = Job::render;
    want.field = Field::nearest;
    EXPECT_NE(refused().find("labels"), std::string::npos);
    want.field = Field::spline;
    what.channels = 3;
    EXPECT_NE(refused().find("3 channels"), std::string::npos);
    what.channels = 1;
    what.extent = {8192, 8192, 8192};
    EXPECT_NE(refused().find("31 bits"), std::string::npos);
    what.extent = {30, 30, 30};
    what.type = Type::c64;
    EXPECT_NE(refused().find("complex"), std::string::npos);
}

}  // namespace
}  // namespace edgewise
