#include <fstream>
#include <gtest/gtest.h>

#include "graph/errors.hpp"
#include "request/numbers.hpp"
#include "request/outputs.hpp"
#include "request/quantities.hpp"
#include "request/tail.hpp"
#include "settings/light.hpp"
#include "transfer/load.hpp"

namespace edgewise::cli {
namespace {

TEST(Budgets, AreReadInTheirUnits) {
    EXPECT_DOUBLE_EQ(error_budget("0.01"), 0.01);
    EXPECT_DOUBLE_EQ(error_budget("40dB"), 0.01);
    EXPECT_DOUBLE_EQ(error_budget("-20dB"), 10);
    EXPECT_DOUBLE_EQ(time_budget("50ms"), 0.05);
    EXPECT_DOUBLE_EQ(time_budget("2s"), 2);
    EXPECT_DOUBLE_EQ(time_budget("1min"), 60);
    EXPECT_DOUBLE_EQ(time_budget("1us"), 1e-6);
    EXPECT_DOUBLE_EQ(time_budget("0.25"), 0.25);
    EXPECT_DOUBLE_EQ(memory_budget("512MiB"), 512.0 * 1024 * 1024);
    EXPECT_DOUBLE_EQ(memory_budget("2GB"), 2e9);
    EXPECT_DOUBLE_EQ(memory_budget("1000"), 1000);
    EXPECT_DOUBLE_EQ(memory_budget("2gb"), 2e9);  // words in any case
    EXPECT_DOUBLE_EQ(error_budget("40DB"), 0.01);
    EXPECT_DOUBLE_EQ(error_budget("1%"), 0.01);
}

TEST(Budgets, RefuseWhatIsNone) {
    for (const char* text : {"", "-1", "nan", "0.01x", "dB", "inf"})
        EXPECT_THROW(error_budget(text), RequestError) << text;
    for (const char* text : {"", "ms", "5 ms", "-2s", "3weeks", "s5"})
        EXPECT_THROW(time_budget(text), RequestError) << text;
    for (const char* text : {"", "MiB", "5mx", "-1GB"})
        EXPECT_THROW(memory_budget(text), RequestError) << text;
}

TEST(Windows, AreValuesOrPercentiles) {
    const Window mixed = window_of("-1000,99.5%");
    EXPECT_FALSE(mixed.values());
    EXPECT_EQ(mixed.low.at, -1000);
    EXPECT_TRUE(mixed.high.percentile);
    EXPECT_TRUE(window_of("0,255").values());
    EXPECT_EQ(window_of("3,2").low.at, 3);  // inverted
    for (const char* text : {"1", "0%,101%", "1,2,3", "a,b", "5%,5%", "nan,1"})
        EXPECT_THROW(window_of(text), RequestError) << text;
}

TEST(Numbers, AreFiniteAndWhole) {
    EXPECT_EQ(numbers_of("--x", "1,-2.5,+3e2"), (std::vector<double>{1, -2.5, 300}));
    for (const char* text : {"", "1,", "nan", "1e999", "1 2", "0x10", "+-1"})
        EXPECT_THROW(numbers_of("--x", text), RequestError) << text;
    EXPECT_EQ(whole_of("--x", "12", 1, 100), 12);
    for (const char* text : {"", "1.5", "0", "101", "99999999999999999999"})
        EXPECT_THROW(whole_of("--x", text, 1, 100), RequestError) << text;
}

std::string transfer_file(const std::string& text) {
    const std::string file = testing::TempDir() + "edgewise_options_transfer.json";
    std::ofstream(file) << text;
    return file;
}

TEST(Transfers, AreRead) {
    const std::string points = R"("points": [{"value": 0, "opacity": 0, "color": [0, 0, 0]},
                                            {"value": 10, "opacity": 0.5, "color": [1, 0.5, 0]}])";
    EXPECT_FALSE(load_transfer(transfer_file("{" + points + "}")).unit_given);
    const TransferSpec read = load_transfer(transfer_file("{\"unit\": 0.7, " + points + "}"));
    const Transfer& transfer = read.transfer;
    EXPECT_TRUE(read.unit_given);
    EXPECT_EQ(transfer.unit, 0.7);
    EXPECT_EQ(transfer.at(5)[3], 0.25);
    EXPECT_EQ(transfer.at(5)[1], 0.25);
}

TEST(Transfers, RefuseWithTheField) {
    const auto refused = [](const char* text, const char* field) {
        try {
            load_transfer(transfer_file(text));
            FAIL() << text;
        } catch (const RequestError& error) {
            EXPECT_NE(std::string(error.what()).find(field), std::string::npos) << error.what();
        }
    };
    refused("{", "JSON");
    refused("[]", "points");
    refused(R"({"points": []})", "points");
    refused(R"({"points": [{"value": 0, "opacity": 2, "color": [0, 0, 0]}]})", "points[0].opacity");
    refused(R"({"points": [{"value": 0, "opacity": 0, "color": [0, 0]}]})", "points[0].color");
    refused(R"({"points": [{"opacity": 0, "color": [0, 0, 0]}]})", "value");
    refused(R"({"points": [{"value": 1, "opacity": 0, "color": [0, 0, 0]},
                           {"value": 0, "opacity": 0, "color": [0, 0, 0]}]})",
            "points[1].value");
    refused(std::string(100000, '[').c_str(), "deep");
}

TEST(Outputs, NumberFrames) {
    const std::string folder = testing::TempDir();
    const Outputs numbered(folder + "/mip_%03d.png");
    EXPECT_EQ(numbered.file(7), folder + "/mip_007.png");
    EXPECT_EQ(numbered.file(1234), folder + "/mip_1234.png");
    EXPECT_EQ(Outputs(folder + "/%d%%.nrrd").file(12), folder + "/12%.nrrd");
    EXPECT_NO_THROW(numbered.expect_frames(5));
    EXPECT_THROW(Outputs(folder + "/a.png").expect_frames(2), RequestError);
    EXPECT_NO_THROW(Outputs("null:").expect_frames(2));
    for (const char* name : {"/%x.png", "/%d%d.png", "/a.xyz", "/a", "/%", "/none/a.png"})
        EXPECT_THROW(Outputs(folder + name), RequestError) << name;
}

std::shared_ptr<const Data> picture(std::vector<float> values, int channels = 1) {
    Representation what;
    what.extent = {static_cast<std::int64_t>(values.size()) / channels, 1, 1};
    what.channels = channels;
    auto data = std::make_shared<Data>(Data::make(what, std::pmr::get_default_resource()));
    std::copy(values.begin(), values.end(), data->as<float>());
    return data;
}

template <class T>
std::vector<T> finished_as(const std::vector<float>& values, const Tail& tail,
                           const Shades& levels = {}, int channels = 1) {
    const Array out =
        finished(*picture(values, channels), tail, levels, std::pmr::get_default_resource());
    const T* begin = static_cast<const T*>(out.data());
    return {begin, begin + out.bytes() / sizeof(T)};
}

TEST(Tail, RoundsHalvesToEvenAndClips) {
    Tail tail;
    tail.type = Type::u8;
    EXPECT_EQ(finished_as<std::uint8_t>({0.5f, 1.5f, 2.5f, -3.f, 300.f, 254.5f, 7.49f, NAN}, tail),
              (std::vector<std::uint8_t>{0, 2, 2, 0, 255, 254, 7, 0}));
    tail.type = Type::i16;
    tail.values = {2, -1000};
    EXPECT_EQ(finished_as<std::int16_t>({-1000.f, 0.f, 1001.f, 1e9f}, tail),
              (std::vector<std::int16_t>{0, 500, 1000, 32767}));
}

TEST(Tail, WindowsInto8Bits) {
    Tail tail;
    tail.view = true;
    tail.type = Type::u8;
    EXPECT_EQ(finished_as<std::uint8_t>({-5.f, 0.f, 50.f, 100.f, 500.f}, tail, {0, 100}),
              (std::vector<std::uint8_t>{0, 0, 128, 255, 255}));
}

TEST(Tail, PutsPremultipliedColourOverTheBackground) {
    Tail tail;
    tail.over_background = true;
    tail.background = {1, 0.5, 0};
    tail.channels = 3;
    EXPECT_EQ(finished_as<float>({0.25f, 0.25f, 0.25f, 0.5f}, tail, {}, 4),
              (std::vector<float>{0.75f, 0.5f, 0.25f}));
}

TEST(Tail, DividesColourByAlphaAgain) {
    Tail tail;
    tail.type = Type::u8;
    tail.channels = 4;
    tail.alpha = store::Alpha::straight;
    tail.alpha_unit = 255;
    EXPECT_EQ(finished_as<std::uint8_t>({50.f, 100.f, 20.f, 0.5f, 0, 0, 0, 0}, tail, {}, 4),
              (std::vector<std::uint8_t>{100, 200, 40, 128, 0, 0, 0, 0}));
}

TEST(Tail, LevelsSpanAllFrames) {
    std::vector<float> ramp(1001);
    for (std::size_t i = 0; i < ramp.size(); ++i) ramp[i] = static_cast<float>(i);
    const std::shared_ptr<const Data> frames[] = {picture(ramp), picture({-500.f, NAN})};
    const Shades range = shades_of(frames, {}, {});
    EXPECT_EQ(range.black, -500);
    EXPECT_EQ(range.white, 1000);
    const std::shared_ptr<const Data> one[] = {frames[0]};
    const Shades middle = shades_of(one, window_of("10%,90%"), {});
    EXPECT_NEAR(middle.black, 100, 1e-3);  // bins are 1000 / 4096^2 wide
    EXPECT_NEAR(middle.white, 900, 1e-3);
    const std::shared_ptr<const Data> flat[] = {picture({3.f, 3.f})};
    EXPECT_EQ(shades_of(flat, {}, {}).black, 3);
}

}  // namespace
}  // namespace edgewise::cli
