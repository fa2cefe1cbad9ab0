// A program's way through the library: a request in values, planned and run without a command line.
#include <cstdlib>
#include <filesystem>
#include <gtest/gtest.h>
#include <map>
#include <optional>
#include <thread>
#include <vector>

#include "engine/prepared.hpp"
#include "engine/reached.hpp"
#include "graph/errors.hpp"
#include "planner/profile.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

using Kind = GeometryStep::Kind;
using Frames = std::map<int, std::vector<float>>;

RequestSpec turned(const std::string& input, int frames = 1) {
    RequestSpec spec;
    spec.input = input;
    spec.geometry.steps = {{Kind::rotate, {20, 10, 0}}};
    if (frames > 1) spec.geometry.steps.push_back({Kind::turntable, {double(frames)}});
    spec.geometry.size = OutputSize{.native = true};
    spec.max_error = 0.05;
    return spec;
}

const Engine& engine() {
    static const Engine engine(catalogue(), default_profile());
    return engine;
}

Frames frames_of(Reached& reached) {
    Listener listener;
    reached.prepare({}, listener);
    Frames frames;
    const auto take = [&](int frame, const Data& picture) {
        const auto* begin = picture.as<float>();
        frames[frame].assign(begin, begin + picture.what.samples() * picture.what.channels);
    };
    reached.run_all({.frames = take}, listener);
    return frames;
}

Reached asked(const RequestSpec& spec, std::shared_ptr<const Data> given = nullptr) {
    return Reached(ask(engine(), spec, {.runs = true, .given = std::move(given)}));
}

Frames frames_of(const RequestSpec& spec, std::shared_ptr<const Data> given = nullptr) {
    Reached reached = asked(spec, std::move(given));
    return frames_of(reached);
}

TEST(Stages, HandsOverEachFrameOnce) {
    const Frames frames = frames_of(turned("phantom:gaussians:32", 5));
    ASSERT_EQ(frames.size(), 5u);
    for (const auto& [frame, pixels] : frames)
        EXPECT_GT(*std::max_element(pixels.begin(), pixels.end()), 0) << frame;
    EXPECT_NE(frames.at(0), frames.at(1));
}

TEST(Stages, TakesSamplesOfTheProgram) {
    MemoryBudget memory(std::size_t{64} << 20);
    auto samples = std::make_shared<const Data>(make_phantom("gaussians", 32, &memory));
    RequestSpec named = turned("phantom:gaussians:32"), unnamed = turned("");
    named.reference = Field::spline;  // of the samples, as nobody knows their formula
    EXPECT_EQ(frames_of(unnamed, samples), frames_of(named));
}

TEST(Stages, SpacingOfSamplesInMemoryIsTheSpecs) {
    MemoryBudget memory(std::size_t{64} << 20);
    auto samples = std::make_shared<const Data>(make_phantom("gaussians", 32, &memory));
    RequestSpec spec = turned("");
    spec.geometry.steps.clear();
    spec.selection.spacing = {1, 1, 2};
    spec.geometry.view = "y";
    Reached reached = asked(spec, samples);
    frames_of(reached);
    EXPECT_EQ(reached.planned()->want.screen.y, 64) << "32 slices, 2 apart, seen from the side";
    spec.selection.spacing = {1, 2};
    EXPECT_THROW(frames_of(spec, samples), RequestError);
}

TEST(Stages, RefusesSamplesThatAreNotWhatTheySay) {
    MemoryBudget memory(std::size_t{64} << 20);
    const auto phantom = [&](int side) {
        return std::make_shared<Data>(make_phantom("gaussians", side, &memory));
    };
    EXPECT_THROW(frames_of(turned("phantom:gaussians:32"), phantom(16)), RequestError);
    EXPECT_THROW(frames_of(turned("describe:16x16x16:f32"), phantom(16)), RequestError);
    EXPECT_THROW(frames_of(turned(""), std::make_shared<Data>()), RequestError);
    auto larger = phantom(16), flat = phantom(16);
    larger->what.extent.z = 64;
    EXPECT_THROW(frames_of(turned(""), larger), RequestError);
    flat->what.axes = 2;
    EXPECT_THROW(frames_of(turned(""), flat), RequestError);
    RequestSpec channel = turned("");
    channel.selection.channel = 0;
    EXPECT_THROW(frames_of(channel, phantom(16)), RequestError);
}

TEST(Stages, IsNotBlamedForWhatTheProgramOnceHeld) {
    {  // more than the budget, touched and given back
        std::vector<char> held(std::size_t{400} << 20, 1);
        EXPECT_EQ(held[held.size() / 2], 1);
    }
    RequestSpec spec = turned("phantom:gaussians:32");
    spec.max_memory = 300 << 20;
    Reached reached = asked(spec);
    frames_of(reached);
    EXPECT_LT(reached.run->measured.bytes, 300 << 20);
    EXPECT_EQ(reached.run->measured.kept, true);
}

TEST(Stages, RemembersNothingWhereItIsToldSo) {
    const std::string home = testing::TempDir() + "edgewise_remembers";
    std::filesystem::remove_all(home);
    const char* const before = std::getenv("XDG_CACHE_HOME");
    const std::optional<std::string> kept =
        before ? std::optional<std::string>(before) : std::nullopt;
    setenv("XDG_CACHE_HOME", home.c_str(), 1);
    RequestSpec spec = turned("phantom:gaussians:24");
    spec.planner = Planner::pilot;
    spec.planning_time = 0.2;
    spec.remembers = false;
    frames_of(spec);
    EXPECT_FALSE(std::filesystem::exists(home));
    spec.remembers = true;
    frames_of(spec);
    EXPECT_TRUE(std::filesystem::exists(home));
    if (kept)
        setenv("XDG_CACHE_HOME", kept->c_str(), 1);
    else
        unsetenv("XDG_CACHE_HOME");
}

TEST(Stages, RunsAPlanOnly) {
    Listener listener;
    Reached described(ask(engine(), turned("describe:16x16x16:f32")));
    described.prepare({}, listener);
    EXPECT_THROW(described.run_all({}, listener), RequestError);
    // Written results take the place of the samples: a second run says so.
    RequestSpec spec = turned("phantom:gaussians:16");
    spec.out = testing::TempDir() + "edgewise_stages.png";
    Reached written = asked(spec);
    frames_of(written);
    EXPECT_THROW(written.run_all({}, listener), RequestError);
}

TEST(Stages, SaysWhatWouldMakeAPlan) {
    RequestSpec spec = turned("phantom:shepp-logan:32");
    spec.max_error = 1e-9;
    Reached reached = asked(spec);
    EXPECT_THROW(frames_of(reached), Infeasible);
    ASSERT_TRUE(reached.way_out);
    ASSERT_FALSE(reached.way_out->budgets.empty());
    spec.max_error = std::stod(reached.way_out->budgets[0][0].value.value());
    EXPECT_FALSE(frames_of(spec).empty()) << "what it says works";
}

TEST(Stages, RefusesValuesThatNoCommandLineLetsThrough) {
    const auto refused = [](auto change) {
        RequestSpec spec = turned("phantom:cube:16");
        change(spec);
        EXPECT_THROW(frames_of(spec), RequestError);
    };
    refused([](RequestSpec& spec) { spec.range = 0; });
    refused([](RequestSpec& spec) { spec.geometry.steps[0].numbers = {1, 2}; });
    refused([](RequestSpec& spec) { spec.geometry.steps[0].numbers = {1, NAN, 2}; });
    refused([](RequestSpec& spec) { spec.geometry.steps.push_back({Kind::shear, {0, 0, 1}}); });
    refused([](RequestSpec& spec) { spec.geometry.steps.push_back({Kind::shear, {0, 1}}); });
    refused([](RequestSpec& spec) { spec.geometry.steps.push_back({Kind::turntable, {2.5}}); });
    refused([](RequestSpec& spec) { spec.geometry.size = OutputSize{.fit = false, .sides = {0}}; });
    refused([](RequestSpec& spec) { spec.geometry.zoom = -1; });
    refused([](RequestSpec& spec) { spec.geometry.perspective = 180; });
    refused([](RequestSpec& spec) { spec.geometry.view = "behind"; });
    refused([](RequestSpec& spec) { spec.zero = 1; });  // of X-rays
    refused([](RequestSpec& spec) { spec.planning_time = 1; });
    refused([](RequestSpec& spec) { spec.max_error = NAN; });
    refused([](RequestSpec& spec) { spec.max_memory = -1; });
    refused([](RequestSpec& spec) { spec.threads = 0; });
    refused([](RequestSpec& spec) { spec.repeat = 0; });
    refused([](RequestSpec& spec) { spec.bits = 7; });
    refused([](RequestSpec& spec) { spec.window = Window{{.at = 2}, {.at = 2}}; });
    refused([](RequestSpec& spec) { spec.window = Window{{.at = NAN}, {.at = 1}}; });
    refused([](RequestSpec& spec) { spec.range = INFINITY; });
    refused([](RequestSpec& spec) { spec.geometry.spacing = {{INFINITY, 1}}; });
    refused([](RequestSpec& spec) { spec.demands.without = {{.name = "project.ray_kast"}}; });
    refused([](RequestSpec& spec) {
        spec.mode = mode_named("composite");
        spec.transfer.emplace();  // without points
    });
    refused([](RequestSpec& spec) { spec.input = "phantom:none:16"; });
}

TEST(Stages, EndsWhenItsListenerSaysSo) {
    Listener listener;
    Reached reached = asked(turned("phantom:gaussians:32", 50));
    reached.prepare({}, listener);
    int frames = 0;
    const auto take = [&](int, const Data&) {
        ++frames;
        listener.end();
    };
    EXPECT_THROW(reached.run_all({.frames = take}, listener), Cancelled);
    EXPECT_LT(frames, 50);
}

TEST(Stages, TwoThreadsServeTwoRequestsAtOnce) {
    const RequestSpec mip = turned("phantom:gaussians:48", 3);
    RequestSpec warp = turned("phantom:gaussians:40");
    warp.job = Job::warp;
    warp.geometry.size.reset();
    const Frames mip_alone = frames_of(mip), warp_alone = frames_of(warp);
    for (int round = 0; round < 3; ++round) {
        Frames a, b;
        std::thread one([&] { a = frames_of(mip); }), other([&] { b = frames_of(warp); });
        one.join();
        other.join();
        EXPECT_EQ(a, mip_alone);
        EXPECT_EQ(b, warp_alone);
    }
}

}  // namespace
}  // namespace edgewise
