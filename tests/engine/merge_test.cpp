// Several channels in one picture, beside the same channels rendered one by one and put together
// here in f64.
#include "engine/merge.hpp"

#include <cmath>
#include <filesystem>
#include <gtest/gtest.h>
#include <limits>
#include <unistd.h>

#include "graph/errors.hpp"
#include "planner/profile.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

using Step = GeometryStep::Kind;
using Picture = std::vector<float>;

const store::Colour kColours[] = {{1, 0.5, 0}, {0, 0.25, 1}, {0.5, 1, 0.75}};

/// A file of its own, which goes with the test.
class Volume {
 public:
    /// Three balls, one a channel, of other ranges.
    explicit Volume(Extent extent, double hole = 0) {
        static int count = 0;
        path_ = testing::TempDir() + "edgewise_merge_" + std::to_string(::getpid()) + "_" +
                std::to_string(count++) + ".nrrd";
        store::Header what;
        what.extent = extent;
        what.channels = 3;
        what.type = Type::f32;
        what.spacing = {1, 1.25, 2.5};
        what.unit = "mm";
        std::vector<float> samples;
        for (std::int64_t z = 0; z < extent.z; ++z)
            for (std::int64_t y = 0; y < extent.y; ++y)
                for (std::int64_t x = 0; x < extent.x; ++x)
                    for (int c = 0; c < 3; ++c) {
                        const double u = (double(x) + 0.5) / double(extent.x) - 0.35 - 0.15 * c,
                                     v = (double(y) + 0.5) / double(extent.y) - 0.5,
                                     w = (double(z) + 0.5) / double(extent.z) - 0.5;
                        const double r = u * u + v * v + 0.5 * w * w;
                        samples.push_back(static_cast<float>((c + 1) * std::exp(-20 * r) - 0.5));
                    }
        if (hole != 0) samples[samples.size() / 2] = static_cast<float>(hole);
        store::write(path_, what, samples.data());
    }
    ~Volume() { std::filesystem::remove(path_); }
    const std::string& path() const { return path_; }

 private:
    std::string path_;
};

Query turned(const Volume& volume, const char* mode, int frames = 1) {
    Query query;
    query.input = volume.path();
    query.mode = mode_named(mode);
    query.geometry.steps = {{Step::rotate, {20, 10, 0}}};
    query.geometry.size = OutputSize{false, {37, 23}};
    if (frames > 1) query.geometry.steps.push_back({Step::turntable, {double(frames)}});
    query.remembers = false;
    return query;
}

std::vector<ChannelSpec> all_three() {
    return {{0, kColours[0]}, {1, kColours[1]}, {2, kColours[2]}};
}

std::vector<Picture> merged(const Query& query, std::vector<ChannelSpec> channels) {
    Listener listener;
    Merge merge(query, std::move(channels), Engine(catalogue(), default_profile(catalogue())),
                listener);
    merge.runs = true;
    std::vector<Picture> pictures;
    perform(merge, {}, [&](int frame, const Data& picture) {
        EXPECT_EQ(frame, static_cast<int>(pictures.size()));
        EXPECT_EQ(picture.what.channels, 3);
        const float* begin = picture.as<float>();
        pictures.emplace_back(begin, begin + picture.what.samples() * 3);
    });
    return pictures;
}

/// One channel by a request of its own: a value a pixel.
std::vector<Picture> alone(Query query, int channel) {
    query.selection.channel = channel;
    Listener listener;
    Reached reached(ask(Engine(catalogue(), default_profile(catalogue())), query, {.runs = true}));
    reached.prepare({}, listener);
    std::vector<Picture> pictures(static_cast<std::size_t>(reached.planned()->want.frames));
    const auto take = [&](int frame, const Data& picture) {
        Picture& values = pictures[static_cast<std::size_t>(frame)];
        for (std::int64_t i = 0; i < picture.what.samples(); ++i)
            values.push_back(picture.as<float>()[i * picture.what.channels]);
    };
    reached.run_all({.frames = take}, listener);
    return pictures;
}

/// @param window  null: the range of each channel
std::vector<std::vector<double>> expected(const Query& query, const double* window = nullptr) {
    std::vector<std::vector<double>> sums;
    for (int c = 0; c < 3; ++c) {
        const std::vector<Picture> frames = alone(query, c);
        double low = INFINITY, high = -INFINITY;
        for (const Picture& frame : frames)
            for (const float value : frame)
                if (std::isfinite(value))
                    low = std::min(low, double(value)), high = std::max(high, double(value));
        if (window) low = window[0], high = window[1];
        if (!(low < high)) high = INFINITY;  // all of one value: it is black
        sums.resize(frames.size());
        for (std::size_t f = 0; f < frames.size(); ++f) {
            sums[f].resize(3 * frames[f].size());
            for (std::size_t i = 0; i < frames[f].size(); ++i) {
                const double value = frames[f][i];
                const double shade =
                    std::isfinite(value) ? std::clamp((value - low) / (high - low), 0.0, 1.0) : 0;
                for (std::size_t k = 0; k < 3; ++k) sums[f][3 * i + k] += shade * kColours[c][k];
            }
        }
    }
    for (auto& frame : sums)
        for (double& sum : frame) sum = std::min(sum, 1.0);
    return sums;
}

void expect_near(const std::vector<Picture>& got, const std::vector<std::vector<double>>& want) {
    ASSERT_EQ(got.size(), want.size());
    for (std::size_t f = 0; f < got.size(); ++f) {
        ASSERT_EQ(got[f].size(), want[f].size());
        // Three sums of f32, of numbers up to 1.
        for (std::size_t i = 0; i < got[f].size(); ++i)
            ASSERT_NEAR(got[f][i], want[f][i], 3 * 0x1p-24) << f << ' ' << i;
    }
}

TEST(Merge, IsTheSumOfChannelsRenderedAlone) {
    const Volume volume({19, 14, 9});
    for (const Mode mode : modes()) {
        if (mode->light_left) continue;  // a negative, by the logarithm: no sum of shares
        Query query = turned(volume, std::string(mode->name).c_str());
        if (mode->takes_level) query.isovalue = 0.2;
        // Light is shown as it is.
        constexpr double kLight[] = {0, 1};
        const auto got = merged(query, all_three());
        expect_near(got, expected(query, mode->over_background ? kLight : nullptr));
        EXPECT_GT(*std::max_element(got[0].begin(), got[0].end()), 0.3) << mode->name;
    }
}

TEST(Merge, OneWindowOverAllFrames) {
    const Volume volume({19, 14, 9});
    Query query = turned(volume, "mip", 5);
    expect_near(merged(query, all_three()), expected(query));
    query.window = Window{{0, false}, {1.5, false}};
    const double ends[] = {0, 1.5};
    expect_near(merged(query, all_three()), expected(query, ends));
}

TEST(Merge, AnyNumberOfThreadsGivesTheSameBytes) {
    const Volume volume({19, 14, 9});
    Query query = turned(volume, "mean", 3);
    std::vector<std::vector<Picture>> all;
    for (const int threads : {1, 2, 7}) {
        query.threads = threads;
        all.push_back(merged(query, all_three()));
    }
    EXPECT_EQ(all[0], all[1]);
    EXPECT_EQ(all[0], all[2]);
}

TEST(Merge, OneSliceAndOneVoxel) {
    for (const Extent extent : {Extent{17, 11, 1}, Extent{1, 1, 1}}) {
        const Volume volume(extent);
        const Query query = turned(volume, "mip");
        expect_near(merged(query, all_three()), expected(query));
    }
}

TEST(Merge, WhatIsNotFiniteAddsNothing) {
    const Volume volume({19, 14, 9}, std::numeric_limits<double>::quiet_NaN());
    const Query query = turned(volume, "mip");
    const auto got = merged(query, all_three());
    for (const float value : got[0]) EXPECT_TRUE(value >= 0 && value <= 1);
    expect_near(got, expected(query));
}

TEST(Merge, ColoursByNumberWhereTheFileSaysNone) {
    const Volume volume({9, 8, 7});
    const Query query = turned(volume, "mip");
    EXPECT_EQ(merged(query, {}), merged(query, {{0, store::Colour{1, 0, 0}},
                                                {1, store::Colour{0, 1, 0}},
                                                {2, store::Colour{0, 0, 1}}}));
    EXPECT_EQ(merged(query, {{2, {}}}), merged(query, {{2, store::Colour{0, 0, 1}}}));
}

TEST(Merge, SecondsAreSharedAndAddedUp) {
    const Volume volume({19, 14, 9});
    Query query = turned(volume, "mip");
    query.max_time = 30;
    query.minimize = Minimize::time;
    Listener listener;
    Merge merge(query, all_three(), Engine(catalogue(), default_profile(catalogue())), listener);
    merge.runs = true;
    int told = 0;
    perform(merge, [&](MergedChannel& channel) {
        // A third; then half of what the first is not predicted to take; then the rest.
        const double left = 30 - (predicted_of(merge).seconds -
                                  channel.request->planned()->answer.plan->predicted.seconds);
        EXPECT_NEAR(*channel.request->planned()->query.max_time, left / (3 - told), 1e-9);
        ++told;
    });
    EXPECT_EQ(told, 3);
    double seconds = 0;
    for (const MergedChannel& channel : merge.channels)
        seconds += channel.request->run->measured.seconds.at(0);
    EXPECT_DOUBLE_EQ(merge.measured->seconds.at(0), seconds);
    EXPECT_EQ(merge.measured->kept, true);
    query.max_time = 1e-9;
    Merge none(query, all_three(), Engine(catalogue(), default_profile(catalogue())), listener);
    EXPECT_THROW(perform(none), NoPlan);
}

TEST(Merge, RefusesWhatHasNoColoursOfItsOwnToTake) {
    const Volume volume({9, 8, 7});
    const auto why = [&](Query query, std::vector<ChannelSpec> channels) -> std::string {
        try {
            merged(query, std::move(channels));
        } catch (const RequestError& error) {
            return error.what();
        }
        return "";
    };
    const Query plain = turned(volume, "mip");
    EXPECT_NE(why(plain, {{3, {}}}).find("3 channels"), std::string::npos);
    EXPECT_NE(why(plain, {{-1, {}}}).find("3 channels"), std::string::npos);
    EXPECT_NE(why(plain, {{1, {}}, {1, {}}}).find("twice"), std::string::npos);
    EXPECT_NE(why(plain, {{1, store::Colour{0, 2, 0}}}).find("0 to 1"), std::string::npos);
    Query query = plain;
    query.selection.channel = 1;
    EXPECT_NE(why(query, {}).find("channel: several"), std::string::npos);
    query = plain;
    query.job = Job::warp;
    EXPECT_NE(why(query, {}).find("warp"), std::string::npos);
    query = turned(volume, "composite");
    query.transfer.emplace();
    EXPECT_NE(why(query, {}).find("transfer: "), std::string::npos);
    query = turned(volume, "composite");
    query.background = {1, 1, 1};
    EXPECT_NE(why(query, {}).find("background: "), std::string::npos);
    query = turned(volume, "composite");
    query.keeps_alpha = true;
    EXPECT_NE(why(query, {}).find("alpha"), std::string::npos);
    query = plain;
    query.max_memory = 1 << 20;
    EXPECT_THROW(merged(query, {}), NoPlan);
}

}  // namespace
}  // namespace edgewise
