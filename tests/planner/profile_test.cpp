#include "planner/profile.hpp"

#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "graph/errors.hpp"
#include "graph/transition.hpp"

namespace edgewise {
namespace {

/// A file that goes with its test.
class TemporaryFile {
 public:
    explicit TemporaryFile(const std::string& text)
        : path_(std::filesystem::temp_directory_path() /
                ("edgewise_profile_" + std::to_string(getpid()) + ".json")) {
        std::ofstream(path_) << text;
    }
    ~TemporaryFile() { std::filesystem::remove(path_); }
    std::string path() const { return path_.string(); }

 private:
    std::filesystem::path path_;
};

std::string rejection(const std::string& text) {
    const TemporaryFile file(text);
    try {
        load_profile(file.path());
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find(file.path()), std::string::npos) << error.what();
        return error.what();
    }
    return "accepted";
}

TEST(Profile, BuiltInIsCalledDefault) {
    EXPECT_EQ(default_profile({}).name, "default");
    EXPECT_TRUE(default_profile({}).cpu.empty());
}

TEST(Profile, BuiltInHasTheFactorsThatEdgesHaveThere) {
    Transition first{.name = "toy.first"}, second{.name = "toy.second"};
    first.factors = {{"", 2}, {"/filter=foh", 0.5}};
    const Profile profile = default_profile({first, second});
    EXPECT_EQ(profile.factors,
              (std::map<std::string, double>{{"toy.first", 2}, {"toy.first/filter=foh", 0.5}}));
    EXPECT_EQ(profile.factor("toy.first/filter=foh/step=1 xray u8"), 0.5);
    EXPECT_EQ(profile.factor("toy.first/filter=zoh 2d f32"), 2);
    EXPECT_EQ(profile.factor("toy.second/filter=foh 2d f32"), 1);
}

TEST(Profile, SavesAndLoads) {
    Profile profile;
    profile.name = "toy";
    profile.cpu = "a \"quoted\" one";
    profile.processors = 12;
    profile.operation = 1.0 / 3e9;  // not a round number: must come back to the last bit
    profile.streamed = 1e-10;
    profile.gather = 2e-10;
    profile.local = 3e-10;
    profile.global = 4e-9;
    profile.start = 1e-5;
    profile.serial = 0.07;
    profile.factors = {{"warp.backward", 1.25}, {"warp.backward/filter=foh", 0.1}};
    profile.levels = {{.bytes = 1e5, .streamed = 1e-11, .gather = 1.0 / 3e9, .spread = 0.07},
                      {.streamed = 1e-10, .gather = 2e-9}};
    profile.provenance = {{"gather", "measured, here"}};
    profile.spreads = {{"gather", 0.03}};
    const TemporaryFile file(to_json(profile).dump());
    const Profile back = load_profile(file.path());
    EXPECT_EQ(to_json(back), to_json(profile));
    EXPECT_EQ(back.operation, profile.operation);
    EXPECT_EQ(back.factors, profile.factors);
    ASSERT_EQ(back.levels.size(), 2u);
    EXPECT_EQ(back.levels[0].gather, profile.levels[0].gather);
}

TEST(Profile, FieldsThatAreMissingKeepTheirDefaults) {
    const TemporaryFile file(R"({"schema": 1, "gather": 1e-9})");
    const Profile profile = load_profile(file.path());
    EXPECT_EQ(profile.gather, 1e-9);
    EXPECT_EQ(profile.streamed, Profile{}.streamed);
}

TEST(Profile, BadFilesAreRejectedWithTheField) {
    const std::pair<std::string, std::string> bad[] = {
        {"", "JSON"},
        {"[1]", "JSON"},
        {R"({"schema": 1)", "JSON"},
        {R"({"operation": 1e-9})", "schema"},
        {R"({"schema": 2})", "schema"},
        {R"({"schema": 1, "operation": "fast"})", "operation"},
        {R"({"schema": 1, "gather": -1e-9})", "gather"},
        {R"({"schema": 1, "streamed": 2})", "streamed"},
        {R"({"schema": 1, "serial": 1.5})", "serial"},
        {R"({"schema": 1, "processors": 0})", "processors"},
        {R"({"schema": 1, "processors": null})", "processors"},
        {R"({"schema": 1, "name": 5})", "name"},
        {R"({"schema": 1, "factors": [1]})", "factors"},
        {R"({"schema": 1, "factors": {"warp.x": 0}})", "factors.warp.x"},
        {R"({"schema": 1, "factors": {"warp.x": "2"}})", "factors.warp.x"},
        {R"({"schema": 1, "spreads": {"gather": -1}})", "spreads.gather"},
    };
    for (const auto& [text, field] : bad) {
        const std::string why = rejection(text);
        EXPECT_NE(why.find(field), std::string::npos) << text << ": " << why;
    }
    EXPECT_THROW(load_profile("/nowhere/at/all.json"), InputError);
}

TEST(Profile, SecondsAreLinearInCountsAndShareThreads) {
    Profile profile;
    profile.operation = 1;
    profile.streamed = 10;
    profile.gather = 100;
    profile.local = 1000;
    profile.global = 10000;
    profile.start = 0.5;
    profile.serial = 0.25;
    Work work;
    work.operations = 1;
    work.streamed = 2;
    work.gathers = 3;
    work.traffic.local = 4;
    work.traffic.global = 5;
    EXPECT_EQ(profile.counted(work).seconds, 54321);
    EXPECT_EQ(profile.seconds("a.b", work, 1).seconds, 54321.5);
    EXPECT_EQ(profile.seconds("a.b", work, 3).seconds, 0.5 + 54321 * (0.25 + 0.75 / 3));
    EXPECT_EQ(profile.seconds("a.b", work, 0).seconds, 54321.5);  // no threads are one
}

TEST(Profile, LongestNameThatFitsGivesTheFactor) {
    Profile profile;
    profile.factors = {{"a.b", 2}, {"a.b/f=x", 3}, {"a.b/f=x/s=1", 5}};
    EXPECT_EQ(profile.factor("a.b/f=x/s=1"), 5);
    EXPECT_EQ(profile.factor("a.b/f=x/s=2"), 3);
    EXPECT_EQ(profile.factor("a.b/f=y"), 2);
    EXPECT_EQ(profile.factor("a.bb"), 1);
    EXPECT_EQ(profile.factor("a"), 1);
    profile.factors["*"] = 7;
    EXPECT_EQ(profile.factor("a"), 7);
    EXPECT_EQ(profile.factor("a.b/f=y"), 2);
}

}  // namespace
}  // namespace edgewise
