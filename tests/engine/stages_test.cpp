// A program's way through the library: a request in values, planned and run without a command line.
#include <filesystem>
#include <gtest/gtest.h>
#include <map>
#include <optional>
#include <thread>
#include <vector>

#include "engine/facts/folder_facts.hpp"
#include "engine/prepared.hpp"
#include "engine/reached.hpp"
#include "graph/errors.hpp"
#include "planner/profile.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

using Frames = std::map<int, std::vector<float>>;

Query turned(const std::string& input, int frames = 1) {
    Query query;
    query.input = input;
    query.geometry.steps = {{GeometryStep::Kind::rotate, {20, 10, 0}}};
    if (frames > 1)
        query.geometry.steps.push_back({GeometryStep::Kind::turntable, {double(frames)}});
    query.geometry.size = OutputSize{.native = true};
    query.max_error = 0.05;
    return query;
}

const Engine& engine() {
    static const Engine engine(catalogue(), default_profile(catalogue()));
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

Reached asked(const Query& query, std::shared_ptr<const Data> given = nullptr) {
    return Reached(ask(engine(), query, {.runs = true, .given = std::move(given)}));
}

Frames frames_of(const Query& query, std::shared_ptr<const Data> given = nullptr) {
    Reached reached = asked(query, std::move(given));
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
    Query named = turned("phantom:gaussians:32"), unnamed = turned("");
    named.reference = Field::spline;  // of the samples, as nobody knows their formula
    EXPECT_EQ(frames_of(unnamed, samples), frames_of(named));
}

TEST(Stages, SpacingOfSamplesInMemoryIsTheSpecs) {
    MemoryBudget memory(std::size_t{64} << 20);
    auto samples = std::make_shared<const Data>(make_phantom("gaussians", 32, &memory));
    Query query = turned("");
    query.geometry.steps.clear();
    query.selection.spacing = {1, 1, 2};
    query.geometry.view = "y";
    Reached reached = asked(query, samples);
    frames_of(reached);
    EXPECT_EQ(reached.planned()->want.screen.y, 64) << "32 slices, 2 apart, seen from the side";
    query.selection.spacing = {1, 2};
    EXPECT_THROW(frames_of(query, samples), RequestError);
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
    Query channel = turned("");
    channel.selection.channel = 0;
    EXPECT_THROW(frames_of(channel, phantom(16)), RequestError);
}

TEST(Stages, IsNotBlamedForWhatTheProgramOnceHeld) {
    {  // more than the budget, touched and given back
        std::vector<char> held(std::size_t{400} << 20, 1);
        EXPECT_EQ(held[held.size() / 2], 1);
    }
    Query query = turned("phantom:gaussians:32");
    query.max_memory = 300 << 20;
    Reached reached = asked(query);
    frames_of(reached);
    EXPECT_LT(reached.run->measured.bytes, 300 << 20);
    EXPECT_EQ(reached.run->measured.kept, true);
}

TEST(Stages, RemembersNothingWhereItIsToldSo) {
    const std::string home = testing::TempDir() + "edgewise_remembers";
    std::filesystem::remove_all(home);
    const Engine remembering(catalogue(), default_profile(catalogue()),
                             std::make_shared<FolderFacts>(home + "/facts"), home + "/wisdom.json");
    Query query = turned("phantom:gaussians:24");
    query.planner = Planner::pilot;
    query.planning_time = 0.2;
    query.remembers = false;
    Reached first(ask(remembering, query, {.runs = true}));
    frames_of(first);
    EXPECT_FALSE(std::filesystem::exists(home));
    query.remembers = true;
    Reached second(ask(remembering, query, {.runs = true}));
    frames_of(second);
    EXPECT_TRUE(std::filesystem::exists(home + "/facts"));
    EXPECT_TRUE(std::filesystem::exists(home + "/wisdom.json"));
}

TEST(Stages, RunsAPlanOnly) {
    Listener listener;
    Reached described(ask(engine(), turned("describe:16x16x16:f32")));
    described.prepare({}, listener);
    EXPECT_THROW(described.run_all({}, listener), RequestError);
    // Written results take the place of the samples: a second run says so.
    Query query = turned("phantom:gaussians:16");
    query.out = testing::TempDir() + "edgewise_stages.png";
    Reached written = asked(query);
    frames_of(written);
    EXPECT_THROW(written.run_all({}, listener), RequestError);
}

TEST(Stages, SaysWhatWouldMakeAPlan) {
    Query query = turned("phantom:shepp-logan:32");
    query.max_error = 1e-9;
    Reached reached = asked(query);
    EXPECT_THROW(frames_of(reached), Infeasible);
    ASSERT_TRUE(reached.way_out);
    ASSERT_FALSE(reached.way_out->budgets.empty());
    query.max_error = std::stod(reached.way_out->budgets[0][0].value.value());
    EXPECT_FALSE(frames_of(query).empty()) << "what it says works";
}

TEST(Stages, RefusesValuesThatNoCommandLineLetsThrough) {
    const auto refused = [](auto change) {
        Query query = turned("phantom:cube:16");
        change(query);
        EXPECT_THROW(frames_of(query), RequestError);
    };
    refused([](Query& query) { query.range = 0; });
    refused([](Query& query) { query.geometry.steps[0].numbers = {1, 2}; });
    refused([](Query& query) { query.geometry.steps[0].numbers = {1, NAN, 2}; });
    refused([](Query& query) {
        query.geometry.steps.push_back({GeometryStep::Kind::shear, {0, 0, 1}});
    });
    refused([](Query& query) {
        query.geometry.steps.push_back({GeometryStep::Kind::shear, {0, 1}});
    });
    refused([](Query& query) {
        query.geometry.steps.push_back({GeometryStep::Kind::turntable, {2.5}});
    });
    refused([](Query& query) { query.geometry.size = OutputSize{.fit = false, .sides = {0}}; });
    refused([](Query& query) { query.geometry.zoom = -1; });
    refused([](Query& query) { query.geometry.perspective = 180; });
    refused([](Query& query) { query.geometry.view = "behind"; });
    refused([](Query& query) { query.zero = 1; });  // of X-rays
    refused([](Query& query) { query.planning_time = 1; });
    refused([](Query& query) { query.max_error = NAN; });
    refused([](Query& query) { query.max_memory = -1; });
    refused([](Query& query) { query.threads = 0; });
    refused([](Query& query) { query.repeat = 0; });
    refused([](Query& query) { query.bits = 7; });
    refused([](Query& query) { query.window = Window{{.at = 2}, {.at = 2}}; });
    refused([](Query& query) { query.window = Window{{.at = NAN}, {.at = 1}}; });
    refused([](Query& query) { query.range = INFINITY; });
    refused([](Query& query) { query.geometry.spacing = {{INFINITY, 1}}; });
    refused([](Query& query) { query.demands.without = {{.name = "project.ray_kast"}}; });
    refused([](Query& query) {
        query.mode = mode_named("composite");
        query.transfer.emplace();  // without points
    });
    refused([](Query& query) { query.input = "phantom:none:16"; });
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
    const Query mip = turned("phantom:gaussians:48", 3);
    Query warp = turned("phantom:gaussians:40");
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
