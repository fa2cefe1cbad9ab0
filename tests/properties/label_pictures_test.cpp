// Surfaces of labels as pictures: the triangles against the voxels.
#include <gtest/gtest.h>

#include "graph/label_surface.hpp"
#include "scene/statistics.hpp"
#include "surface/mesh.hpp"
#include "surface/mesh_measures.hpp"
#include "tests/properties/run_request.hpp"
#include "transitions/catalogue.hpp"
#include "transitions/project/label_cast.hpp"
#include "transitions/surface/draw.hpp"
#include "transitions/surface/nets.hpp"

namespace edgewise {
namespace {

class LabelPictures : public testing::Test {
 protected:
    /// All of it is labels: two halves.
    Data halves(const Extent& n, Type type = Type::u8) {
        Representation what;
        what.type = type;
        what.extent = n;
        Data data = Data::make(what, &memory_);
        for (std::int64_t i = 0; i < n.samples(); ++i)
            data.as<std::uint8_t>()[i] = i % n.x < n.x / 2 ? 3 : 7;
        return data;
    }
    Request want_of(const Data& data, const Mat4& turn) {
        Request want = request_of(Job::render, mode_named("surface"), data.what, {turn});
        want.surface = SurfaceOf{};
        want.field = Field::nearest;
        want.transfer.points = {{4.5, 1, {1, 0, 0}}, {4.5, 1, {0, 0, 1}}};
        want.budget = {};
        return want;
    }
    std::vector<Plan> paths(const Data& data, const Request& want) {
        return paths_of(catalogue(), {want, scene_}, data.what, 100);
    }

    MemoryBudget memory_{std::size_t{1} << 28};
    Scene scene_;
};

TEST_F(LabelPictures, HaveTwoPaths) {
    const Data data = halves({12, 10, 9});
    const Request want = want_of(data, rotation(20, 30, 0));
    std::vector<std::string> texts;
    for (const Plan& path : paths(data, want))
        texts.push_back(path.steps.front().by->name + " " + path.steps.back().by->name);
    std::sort(texts.begin(), texts.end());
    const std::string cast = label_cast().name, nets = surface_nets_edge().name;
    EXPECT_EQ(texts, (std::vector<std::string>{cast + " " + cast, nets + " " + draw_edge().name}));
}

TEST_F(LabelPictures, AreClosedAtTheVolumesFaces) {
    for (const Extent& n : {Extent{12, 10, 9}, Extent{12, 10, 1}, Extent{2, 2, 2}}) {
        auto data = std::make_shared<Data>(halves(n));
        Request want = want_of(*data, rotation(0, 0, 0));
        const Transition nets = surface_nets_edge();
        const Ask ask{want, scene_};
        Offer offer = nets.offer(data->what, ask, {{"smooth", 0.0}});
        ASSERT_EQ(offer.refused, "");
        Data out = Data::make(offer.to, &memory_);
        Context context{.memory = &memory_};
        nets.run(offer, ask, *data, out, Region::all(offer.to.extent), context);
        const surface::Measures measures = surface::measures_of(*surface::mesh_in(out), &memory_);
        EXPECT_TRUE(measures.closed);
        // Sheets lie half way between samples: on the faces of voxels.
        EXPECT_NEAR(measures.volume.value(), static_cast<double>(n.samples()), 1e-6);
        for (const surface::Float3& p : surface::mesh_in(out)->positions())
            for (int axis = 0; axis < 3; ++axis) {
                EXPECT_GE(p[static_cast<std::size_t>(axis)], -0.5F);
                EXPECT_LE(p[static_cast<std::size_t>(axis)], static_cast<float>(n[axis]) - 0.5F);
            }
    }
}

TEST_F(LabelPictures, OfTrianglesAndOfVoxelsDifferByLessThanAVoxel) {
    const auto data = std::make_shared<const Data>(halves({16, 12, 11}));
    for (const Mat4& turn : {rotation(0, 0, 0), rotation(20, -35, 10)}) {
        const Request want = want_of(*data, turn);
        std::vector<std::vector<float>> pictures;
        for (const Plan& path : paths(*data, want)) {
            std::vector<float> first;
            for (const int threads : {1, 2, 7}) {
                const auto results = results_of(path, {want, scene_}, data, threads, memory_);
                const std::vector<float> picture = values_of(*results[0]);
                if (first.empty()) first = picture;
                EXPECT_EQ(picture, first) << path.texts()[0] << ' ' << threads;
            }
            pictures.push_back(first);
        }
        ASSERT_EQ(pictures.size(), 2u);
        const Extent n = want.output();
        const auto at = [&](const std::vector<float>& picture, std::int64_t x, std::int64_t y) {
            return picture[static_cast<std::size_t>(4 * (y * n.x + x) + 3)] > 0;
        };
        int hits = 0, same = 0;
        for (std::int64_t y = 1; y < n.y - 1; ++y)
            for (std::int64_t x = 1; x < n.x - 1; ++x)
                for (int which = 0; which < 2; ++which) {
                    const auto &one = pictures[static_cast<std::size_t>(which)],
                               &other = pictures[static_cast<std::size_t>(1 - which)];
                    if (!at(one, x, y)) continue;
                    bool near = false;  // a pixel is a sample
                    for (int j = -1; j <= 1; ++j)
                        for (int i = -1; i <= 1; ++i) near = near || at(other, x + i, y + j);
                    EXPECT_TRUE(near) << x << ' ' << y;
                    ++hits;
                    const auto pixel = static_cast<std::size_t>(4 * (y * n.x + x));
                    same += std::equal(one.begin() + static_cast<std::ptrdiff_t>(pixel),
                                       one.begin() + static_cast<std::ptrdiff_t>(pixel) + 4,
                                       other.begin() + static_cast<std::ptrdiff_t>(pixel));
                }
        EXPECT_GT(hits, 200);
        EXPECT_GT(same, 0.75 * hits);
    }
}

TEST_F(LabelPictures, NeedNoBackgroundThatSamplesCanMean) {
    Data data = halves({4, 4, 4});
    data.what.values = {1, 1000};
    const Request want = want_of(data, rotation(0, 0, 0));
    EXPECT_EQ(surface_nets_edge().offer(data.what, {want, scene_}, {{"smooth", 0.0}}).refused, "");
    EXPECT_EQ(label_cast().offer(data.what, {want, scene_}, {}).refused, "");
}

}  // namespace
}  // namespace edgewise
