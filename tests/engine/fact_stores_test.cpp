#include <atomic>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "engine/facts/facts_json.hpp"
#include "engine/facts/folder_facts.hpp"
#include "engine/facts/memory_facts.hpp"

namespace edgewise::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

class Known : public testing::Test {
 protected:
    Known() {
        const char* scratch = std::getenv("EDGEWISE_SCRATCH");
        std::string pattern = std::string(scratch ? scratch : "/tmp") + "/facts_XXXXXX";
        folder_ = ::mkdtemp(pattern.data());
    }
    ~Known() override { fs::remove_all(folder_); }

    /// Facts of one input at one place, as JSON.
    struct Of {
        FolderFacts store;
        std::string where, what;

        FactKey key(const std::string& kind, const std::string& on) const {
            return {kind, where, where + "|" + on, what + "|" + on};
        }
        std::optional<Json> find(const std::string& kind, const std::string& on = "") const {
            const auto text = store.find(key(kind, on));
            return text ? std::optional(Json::parse(*text)) : std::nullopt;
        }
        bool keep(const std::string& kind, const Json& fact, const std::string& on = "") {
            return store.keep(key(kind, on), fact.dump());
        }
    };
    Of of(const std::string& where, const std::string& what) const {
        return {FolderFacts(folder_), where, what};
    }
    std::vector<fs::path> files() const {
        std::vector<fs::path> all;
        for (const auto& entry : fs::directory_iterator(folder_)) all.push_back(entry.path());
        return all;
    }
    std::string folder_;
};

bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
    if (a.size() != b.size()) return false;
    for (std::size_t i = 0; i < a.size(); ++i)
        if (std::bit_cast<std::uint64_t>(a[i]) != std::bit_cast<std::uint64_t>(b[i])) return false;
    return true;
}

TEST_F(Known, NumbersComeBackToTheLastBit) {
    std::mt19937_64 bits(1);
    RadialPower power;
    using Limits = std::numeric_limits<double>;
    power.power = {0.0,           -0.0,     0.1,      1 / 3.0, Limits::denorm_min(),
                   Limits::max(), HUGE_VAL, -HUGE_VAL};
    while (power.power.size() < 300) {
        const auto number = std::bit_cast<double>(bits());
        if (std::isfinite(number)) power.power.push_back(number);
    }
    power.frequency = power.share = power.power;
    power.bricks = 3, power.empty = 5, power.samples = std::int64_t{1} << 60;
    ASSERT_TRUE(of("a", "1").keep("spectrum", json_of(power)));
    RadialPower again;
    read(of("a", "1").find("spectrum").value(), again);
    EXPECT_TRUE(same_bits(power.power, again.power));
    EXPECT_EQ(again.bricks, 3);
    EXPECT_EQ(again.empty, 5);
    EXPECT_EQ(again.samples, power.samples);

    const Seen seen{.range = 0.3,
                    .facts = {{"picture/zoh/1", 2 / 3.0}, {"cast/all", HUGE_VAL}},
                    .likely = {{"picture/zoh/1", 1 / 3.0}},
                    .draws = 500,
                    .exhausted = true};
    Seen seen_again;
    read(Json::parse(json_of(seen).dump()), seen_again);
    EXPECT_EQ(seen_again.range, seen.range);
    EXPECT_EQ(seen_again.facts, seen.facts);
    EXPECT_EQ(seen_again.likely, seen.likely);
    EXPECT_EQ(seen_again.draws, seen.draws);
    EXPECT_EQ(seen_again.exhausted, seen.exhausted);

    Statistics statistics;
    statistics.low = -1e300, statistics.high = 0.7, statistics.mean = 0.1, statistics.lowest = 7;
    statistics.occupied = {{1, 2, 3}, {4, 5, 6}};
    Statistics statistics_again;
    read(Json::parse(json_of(statistics).dump()), statistics_again);
    EXPECT_EQ(statistics_again.low, statistics.low);
    EXPECT_EQ(statistics_again.mean, statistics.mean);
    EXPECT_EQ(statistics_again.lowest, 7);
    EXPECT_EQ(statistics_again.occupied, statistics.occupied);
}

TEST_F(Known, FactsAreOfTheDataAndTheRequestThatTheyWereMeasuredOf) {
    ASSERT_TRUE(of("a", "old").keep("view", 1, "from the front"));
    ASSERT_TRUE(of("a", "old").keep("view", 2, "from the back"));
    EXPECT_EQ(of("a", "old").find("view", "from the front").value(), 1);
    EXPECT_EQ(of("a", "old").find("view", "from the back").value(), 2);
    EXPECT_FALSE(of("a", "old").find("view", "from above"));
    EXPECT_FALSE(of("a", "old").find("view"));
    EXPECT_FALSE(of("a", "new").find("view", "from the front"));
    EXPECT_FALSE(of("b", "old").find("view", "from the front"));
    // Facts of changed data take the place of the old ones.
    ASSERT_TRUE(of("a", "new").keep("view", 3, "from the front"));
    EXPECT_EQ(of("a", "new").find("view", "from the front").value(), 3);
    EXPECT_FALSE(of("a", "old").find("view", "from the front"));
    EXPECT_EQ(files().size(), 2u);
}

TEST_F(Known, BrokenFilesCountAsNoneAndAreReplaced) {
    ASSERT_TRUE(of("a", "1").keep("view", 1));
    const fs::path file = files().at(0);
    std::string whole;
    std::getline(std::ifstream(file), whole, '\0');
    for (const std::string& text :
         {std::string(), std::string("{"), whole.substr(0, whole.size() / 2), std::string("[1]"),
          std::string("{\"schema\": 2}"), std::string("{\"schema\": 2, \"of\": 3, \"fact\": 1}"),
          std::string(FolderFacts::kMostBytes + 100, ' ') + whole}) {
        std::ofstream(file, std::ios::trunc) << text;
        EXPECT_FALSE(of("a", "1").find("view")) << text.substr(0, 60);
        EXPECT_TRUE(of("a", "1").keep("view", 2));
        EXPECT_EQ(of("a", "1").find("view").value(), 2);
    }
    Statistics statistics;
    EXPECT_ANY_THROW(read(Json::parse("{\"low\": \"x\"}"), statistics));
    EXPECT_ANY_THROW(read(Json(), statistics));
}

TEST_F(Known, AFolderThatCannotBeWrittenIsNoError) {
    const std::string file = folder_ + "/file";
    std::ofstream(file) << "not a folder";
    Of nowhere{FolderFacts(file + "/below"), "a", "1"};
    EXPECT_FALSE(nowhere.keep("view", 1));
    EXPECT_FALSE(nowhere.find("view"));
    EXPECT_FALSE(of("a", "1").keep("view", std::string(FolderFacts::kMostBytes, 'x')));
}

TEST_F(Known, TheOldestGoFirst) {
    for (std::size_t i = 0; i < FolderFacts::kMostFiles; ++i) {
        const std::string where = std::to_string(i);
        ASSERT_TRUE(of(where, "1").keep("view", i));
    }
    EXPECT_EQ(files().size(), FolderFacts::kMostFiles);
    // Times of writing as if a second had passed between any two.
    const auto now = fs::file_time_type::clock::now();
    for (const fs::path& file : files()) {
        const Json json = Json::parse(std::ifstream(file));
        fs::last_write_time(file, now - std::chrono::seconds(2000 - json["fact"].get<int>()));
    }
    ASSERT_TRUE(of("newest", "1").keep("view", 1));
    EXPECT_LE(files().size(), FolderFacts::kMostFiles);
    EXPECT_TRUE(of("newest", "1").find("view"));
    EXPECT_FALSE(of("0", "1").find("view"));
    EXPECT_TRUE(of(std::to_string(FolderFacts::kMostFiles - 1), "1").find("view"));
}

TEST_F(Known, WritersAndReadersAtOnceSeeWholeFactsOnly) {
    std::atomic<int> broken{0};
    const Json fact = std::vector<double>(200, 0.1);
    const auto work = [&](int thread) {
        for (int i = 0; i < 100; ++i) {
            if (!of("a", "1").keep("shared", fact)) ++broken;
            if (of("a", "1").find("shared").value_or(Json()) != fact) ++broken;
            if (!of("a", "1").keep("own", i, std::to_string(thread))) ++broken;
        }
    };
    std::thread one(work, 1), two(work, 2);
    one.join();
    two.join();
    EXPECT_EQ(broken, 0);
    EXPECT_EQ(of("a", "1").find("own", "1").value(), 99);
    EXPECT_EQ(of("a", "1").find("own", "2").value(), 99);
    EXPECT_EQ(files().size(), 3u);
}

TEST(MemoryFacts, KeepsTheNewestOfEachPlace) {
    MemoryFacts store;
    const auto key = [](const std::string& place, const std::string& of) {
        return FactKey{"view", "name", place, of};
    };
    EXPECT_FALSE(store.find(key("a", "1")));
    EXPECT_TRUE(store.keep(key("a", "1"), "[1]"));
    EXPECT_EQ(store.find(key("a", "1")), "[1]");
    EXPECT_FALSE(store.find(key("a", "2")));
    EXPECT_FALSE(store.find(key("b", "1")));
    EXPECT_FALSE(store.find({"runs", "name", "a", "1"}));
    EXPECT_TRUE(store.keep(key("a", "2"), "[2]"));
    EXPECT_FALSE(store.find(key("a", "1")));
    for (std::size_t i = 0; i < MemoryFacts::kMostFacts; ++i)
        EXPECT_TRUE(store.keep(key(std::to_string(i), "1"), "[]"));
    EXPECT_FALSE(store.find(key("a", "2"))) << "the oldest goes first";
    EXPECT_TRUE(store.find(key("0", "1")));
}

}  // namespace
}  // namespace edgewise::cli
