#include "transitions/spectrum/projection.hpp"

#include <atomic>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/transitions/spectrum/spectrum_scene.hpp"

namespace edgewise {
namespace {

struct Case {
    Extent extent{20, 18, 16};
    Counting memory;
    Data data = blobs(extent, 0, &memory);
    Request want = request_of(extent, Vec3(1, 1, 1), Mode::xray, 1);
    Scene scene = scene_of(data);

    Ask ask() const { return {want, scene}; }
    std::string refusal(const Chosen& chosen = {}) const {
        return Path(data.what, ask(), chosen).made.refused;
    }
};

TEST(SpectrumForward, RefusesWhatIsNoProjection) {
    Case c;
    EXPECT_EQ(c.refusal(), "");
    c.want.mode = Mode::mip;
    EXPECT_EQ(c.refusal(), "mip does not commute with the Fourier slice theorem");
    c.want.mode = Mode::composite;
    EXPECT_EQ(c.refusal(), "composite does not commute with the Fourier slice theorem");
    c.want.mode = Mode::mean;
    EXPECT_EQ(c.refusal(), "");
    c.scene.non_finite = 3;
    EXPECT_EQ(c.refusal(), "3 samples are not finite, a transform would spread them everywhere");
    c.scene.non_finite = 0;
    c.want.eye = Eye{};
    EXPECT_EQ(c.refusal(),
              "the Fourier slice theorem needs parallel rays, the view is perspective");
    c.want.eye.reset();
    c.want.field = Field::nearest;
    EXPECT_EQ(c.refusal(), "labels have edges everywhere: their field is far from band-limited");
    c.want.field = Field::spline;
    c.want.job = Job::warp;
    EXPECT_EQ(c.refusal(), "samples are asked for; a slice of a spectrum is a projection");
}

TEST(SpectrumForward, RefusesUnknownWindowsAndSeveralChannels) {
    Case c;
    EXPECT_EQ(
        c.refusal({9, 1.25, "volume"}),
        "no window of width 9 for padding 1.25: widths are 2 to 8, paddings 1.25, 1.5 and 2, and 1 "
        "for width 2");
    EXPECT_NE(c.refusal({4, 1, "volume"}), "");
    EXPECT_NE(c.refusal({4.5, 2, "volume"}), "");
    EXPECT_NE(c.refusal({4, 1.3, "volume"}), "");
    c.data.what.channels = 3;
    EXPECT_EQ(c.refusal(), "a spectrum is made of a volume of one channel, whole in memory");
}

TEST(SpectrumForward, VerticesTellTheirWindow) {
    const Case c;
    const Path narrow(c.data.what, c.ask(), {4}), wide(c.data.what, c.ask(), {6});
    EXPECT_EQ(narrow.made.to.kind(), "object/spectrum+window4x1.25");
    EXPECT_EQ(wide.made.to.kind(), "object/spectrum+window6x1.25");
    EXPECT_NE(narrow.made.to.key(), wide.made.to.key());
    EXPECT_EQ(window_of(wide.made.to).width(), 6);
    EXPECT_EQ(narrow.cut.to.kind(), "slice/spectrum");
    EXPECT_TRUE(is_target(narrow.seen.to, c.want));
    EXPECT_EQ(narrow.made.to.runs(), 1);
    EXPECT_EQ(narrow.cut.to.runs(), 3);
    // Every kind that an offer can lead to is declared.
    for (const kernels::KaiserBessel& window : windows()) {
        const auto& joins = narrow.forward.joins;
        EXPECT_EQ(
            std::count(joins.begin(), joins.end(),
                       std::pair<std::string, std::string>("object/scalar", spectrum_kind(window))),
            1);
    }
}

TEST(SpectrumEdges, BytesDoNotDependOnThreads) {
    Case c;
    std::vector<std::vector<float>> pictures;
    for (const std::size_t threads : {1, 3}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        const Path path(c.data.what, c.ask(), {});
        const Data spectrum = path.spectrum(c.data, c.ask(), &c.memory);
        const Data picture = path.picture(spectrum, c.ask(), 2, &c.memory);
        pictures.emplace_back(picture.as<float>(),
                              picture.as<float>() + picture.what.extent.samples());
    }
    EXPECT_EQ(pictures[0], pictures[1]);
}

TEST(SpectrumEdges, StayWithinTheirCountedBytes) {
    Case c;
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 2);
    const Path path(c.data.what, c.ask(), {6, 1.25, "volume"});
    const auto allowed = [&](const Transition& edge, const Offer& offer) {
        const Work work = edge.work(offer, c.ask(), 1);
        return static_cast<double>(c.memory.now()) + 2 * work.scratch + work.workspace;
    };
    Data spectrum = Data::make(path.made.to, &c.memory), plane = Data::make(path.cut.to, &c.memory),
         picture = Data::make(path.seen.to, &c.memory);
    Context context{.memory = &c.memory, .view = 1};
    double most = allowed(path.forward, path.made);
    c.memory.restart();
    path.forward.run(path.made, c.ask(), c.data, spectrum, {}, context);
    EXPECT_LE(static_cast<double>(c.memory.peak()), most);
    most = allowed(path.slice, path.cut);
    c.memory.restart();
    path.slice.run(path.cut, c.ask(), spectrum, plane, {}, context);
    EXPECT_LE(static_cast<double>(c.memory.peak()), most);
    most = allowed(path.inverse, path.seen);
    c.memory.restart();
    path.inverse.run(path.seen, c.ask(), plane, picture, {}, context);
    EXPECT_LE(static_cast<double>(c.memory.peak()), most);
}

TEST(SpectrumEdges, StopWhenAsked) {
    Case c;
    const Path path(c.data.what, c.ask(), {});
    Data spectrum = Data::make(path.made.to, &c.memory), plane = Data::make(path.cut.to, &c.memory);
    const std::atomic<bool> stop{true};
    Context context{.memory = &c.memory, .stop = &stop};
    EXPECT_THROW(path.forward.run(path.made, c.ask(), c.data, spectrum, {}, context), Cancelled);
    EXPECT_THROW(path.slice.run(path.cut, c.ask(), spectrum, plane, {}, context), Cancelled);
}

TEST(SpectrumEdges, ACroppedVolumeGivesTheSamePicture) {
    Case c;
    const Path whole(c.data.what, c.ask(), {6, 2, "volume"});
    Representation what = c.data.what;
    const std::array<std::int64_t, 3> from{1, 1, 0};
    what.extent = {18, 16, 15};
    Mat4 shift = Mat4::Identity();
    shift(0, 3) = -1, shift(1, 3) = -1;
    what.placed = Placement(shift);
    Data part = Data::make(what, &c.memory);
    for (std::int64_t z = 0; z < what.extent.z; ++z)
        for (std::int64_t y = 0; y < what.extent.y; ++y)
            std::copy_n(c.data.as<float>() +
                            ((z + from[2]) * c.extent.y + y + from[1]) * c.extent.x + from[0],
                        what.extent.x, part.as<float>() + (z * what.extent.y + y) * what.extent.x);
    for (int axis = 0; axis < 3; ++axis) {  // what is cut off is empty
        ASSERT_GE(c.scene.occupied.begin[axis], from[axis]);
        ASSERT_LE(c.scene.occupied.end[axis], from[axis] + what.extent[axis]);
    }
    const Path cropped(what, c.ask(), {6, 2, "volume"});
    const Data a = whole.picture(whole.spectrum(c.data, c.ask(), &c.memory), c.ask(), 2, &c.memory);
    const Data b =
        cropped.picture(cropped.spectrum(part, c.ask(), &c.memory), c.ask(), 2, &c.memory);
    for (std::int64_t i = 0; i < a.what.extent.samples(); ++i)
        ASSERT_NEAR(a.as<float>()[i], b.as<float>()[i], 1e-5 * 20 * 200);  // two windows' ghosts
}

TEST(PicturePeriod, IsEvenAndHoldsEveryView) {
    const Case c;
    const Extent period = picture_period_of(c.want);
    EXPECT_EQ(period.x % 2, 0);
    EXPECT_GE(period.x, c.want.screen.x);
    EXPECT_GE(period.y, c.want.screen.y);
}

}  // namespace
}  // namespace edgewise
