#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fmt/format.h>
#include <fstream>
#include <gtest/gtest.h>
#include <memory_resource>
#include <random>

#include "graph/errors.hpp"
#include "scene/statistics.hpp"
#include "transfer/air.hpp"
#include "transfer/curves.hpp"
#include "transfer/drawn.hpp"
#include "transfer/kinds.hpp"
#include "transfer/load.hpp"
#include "transfer/presets.hpp"
#include "transfer/robust_window.hpp"
#include "transfer/suited.hpp"

namespace edgewise {
namespace {

using transfer::Curve;
using transfer::joined;

std::string written(const std::string& text, const std::string& name = "transfer.json") {
    const std::string file = testing::TempDir() + "edgewise_" + name;
    std::ofstream(file, std::ios::binary) << text;
    return file;
}

TransferSpec read_as(const std::string& text, const std::string& name = "transfer.json") {
    return load_transfer(written(text, name));
}

/// Each is refused, with words that say why.
void expect_refused(const std::string& text, const std::vector<std::string>& words) {
    try {
        read_as(text);
        FAIL() << text.substr(0, 200);
    } catch (const RequestError& error) {
        EXPECT_LT(std::string(error.what()).size(), 1000u);
        for (const std::string& word : words)
            EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
}

// --- ParaView

const char* const kParaView = R"([{
    "ColorSpace": "RGB", "Creator": "a test", "Name": "two ramps", "NanColor": [1, 0, 0],
    "RGBPoints": [-100, 0, 0, 0,  100, 1, 0.5, 0,  300, 1, 1, 1],
    "Points": [-100, 0, 0.5, 0,  0, 0, 0.5, 0,  200, 0.8, 0.5, 0]
}])";

TEST(ParaViewPresets, AreReadWithBothCurves) {
    const TransferSpec read = read_as(kParaView);
    EXPECT_TRUE(read.warnings.empty());
    EXPECT_FALSE(read.unit_given);
    EXPECT_FALSE(read.material);
    EXPECT_EQ(read.values, TransferValues::data);
    EXPECT_EQ(read.transfer.at(0)[3], 0);
    EXPECT_DOUBLE_EQ(read.transfer.at(100)[3], 0.4);
    EXPECT_DOUBLE_EQ(read.transfer.at(100)[1], 0.5);
    EXPECT_DOUBLE_EQ(read.transfer.at(200)[2], 0.5);
    EXPECT_DOUBLE_EQ(read.transfer.at(5000)[3], 0.8);
    // An object in place of an array of one is read as well.
    const std::string one(kParaView);
    EXPECT_DOUBLE_EQ(read_as(one.substr(1, one.size() - 2)).transfer.at(100)[3], 0.4);
}

TEST(ParaViewPresets, WithoutOpacityHaveARamp) {
    const Transfer ramp = read_as(R"({"RGBPoints": [10, 0, 0, 1, 20, 1, 0, 0]})").transfer;
    EXPECT_EQ(ramp.at(10)[3], 0);
    EXPECT_DOUBLE_EQ(ramp.at(15)[3], 0.025);
    EXPECT_DOUBLE_EQ(ramp.at(20)[3], 0.05);
}

TEST(ParaViewPresets, FromZeroToOneAreStretchedOverTheData) {
    const TransferSpec shares = read_as(R"([{"RGBPoints": [0, 0, 0, 1, 1, 1, 0, 0]}])");
    EXPECT_EQ(shares.values, TransferValues::range);
    const TransferSpec signs = read_as(R"([{"RGBPoints": [-1, 0, 0, 1, 1, 1, 0, 0]}])");
    EXPECT_EQ(signs.values, TransferValues::range);
    EXPECT_EQ(signs.transfer.points.front().value, 0);
    EXPECT_EQ(signs.transfer.points.back().value, 1);
}

TEST(ParaViewPresets, SayWhatIsLeftOut) {
    const TransferSpec lab = read_as(
        R"([{"ColorSpace": "Lab", "UseLogScale": 1, "RGBPoints": [2, 0, 0, 1, 9, 1, 0, 0]}])");
    ASSERT_EQ(lab.warnings.size(), 2u);
    EXPECT_NE(lab.warnings[0].text().find("\"Lab\""), std::string::npos);
}

TEST(ParaViewPresets, RefuseWithTheField) {
    expect_refused(R"([{"ColorSpace": "RGB"}])", {"transfer.json", "RGBPoints"});
    expect_refused(R"([{"IndexedColors": [1, 0, 0]}])", {"categories"});
    expect_refused(R"([{"RGBPoints": [0, 1, 1]}])", {"RGBPoints", "3 numbers", "fours"});
    expect_refused(R"([{"RGBPoints": []}])", {"RGBPoints"});
    expect_refused(R"([{"RGBPoints": [0, 0, 0, 2]}])", {"RGBPoints[3] is 2", "0 to 1"});
    expect_refused(R"([{"RGBPoints": [0, 0, 0, "a"]}])", {"RGBPoints[3]", "number"});
    expect_refused(R"([{"RGBPoints": [1, 0, 0, 0, 0, 0, 0, 0]}])", {"RGBPoints[4]", "ascend"});
    expect_refused(R"([{"RGBPoints": [1, 0, 0, 0], "Points": [1, 2, 0.5, 0]}])",
                   {"Points[1] is 2"});
    expect_refused(R"([{"RGBPoints": [1, 0, 0, 0]}, {"RGBPoints": [1, 0, 0, 0]}])", {"2 presets"});
    expect_refused("[1]", {"RGBPoints"});
    std::string many = "[{\"RGBPoints\": [0,0,0,0";
    for (int i = 0; i < 5000; ++i) many += fmt::format(",{},0,0,0", i);
    expect_refused(many + "]}]", {"5001 points", "at most"});
}

// --- Slicer

const char* const kVp =
    "1\n1\n0.8\n0.15\n0.25\n12\n6 -100 0 200 0.2 800 0.9\n4 0 1 255 1\n"
    "12 -100 0 0 0 200 1 0.5 0 800 1 1 1\n";

TEST(SlicerProperties, OfTextAreRead) {
    const TransferSpec read = read_as(kVp, "bone.vp");
    EXPECT_TRUE(read.warnings.empty());
    EXPECT_TRUE(read.unit_given);
    EXPECT_EQ(read.transfer.unit, 1);
    ASSERT_TRUE(read.material);
    EXPECT_EQ(read.material->diffuse, 0.8);
    EXPECT_EQ(read.material->ambient, 0.15);
    EXPECT_EQ(read.material->specular, 0.25);
    EXPECT_EQ(read.material->exponent, 12);
    EXPECT_DOUBLE_EQ(read.transfer.at(50)[3], 0.1);
    EXPECT_DOUBLE_EQ(read.transfer.at(500)[3], 0.55);
    EXPECT_DOUBLE_EQ(read.transfer.at(500)[1], 0.75);
}

TEST(SlicerProperties, OfTextMayEndLinesAsWindowsDoes) {
    std::string text(kVp);
    for (std::size_t at = 0; (at = text.find('\n', at)) != text.npos; at += 2)
        text.replace(at, 1, "\r\n");
    EXPECT_DOUBLE_EQ(read_as(text).transfer.at(50)[3], 0.1);
}

TEST(SlicerProperties, HaveAnOpacityByGradient) {
    std::string text(kVp);
    text.replace(text.find("4 0 1 255 1"), 11, "4 0 0 255 1");
    const TransferSpec read = read_as(text);
    EXPECT_TRUE(read.warnings.empty());
    EXPECT_DOUBLE_EQ(read.transfer.edge_at(0), 0);
    EXPECT_DOUBLE_EQ(read.transfer.edge_at(51), 0.2);
    EXPECT_DOUBLE_EQ(read.transfer.edge_at(1000), 1);
}

TEST(SlicerProperties, OfTextRefuseWithTheLine) {
    const auto changed = [](const std::string& from, const std::string& to) {
        std::string text(kVp);
        text.replace(text.find(from), from.size(), to);
        return text;
    };
    expect_refused("1\n1\n0.8\n", {"line 3", "scalar opacity"});
    expect_refused(changed("0.15", "1.5"), {"line 4 (ambient)", "1.5"});
    expect_refused(changed("0.15", "x"), {"line 4 (ambient)", "'x'"});
    expect_refused(changed("\n12\n", "\n0\n"), {"line 6 (power)", "1 to 1024"});
    expect_refused(changed("6 -100", "8 -100"), {"line 7 (scalar opacity)", "8 given, then 6"});
    expect_refused(changed("200 0.2", "200 nan"), {"line 7", "nan"});
    expect_refused(changed("200 0.2", "200 2"), {"line 7", "2 at 200"});
    expect_refused(changed("200 0.2", "900 0.2"), {"line 7", "ascend"});
    expect_refused(changed("12 -100 0 0 0", "11 -100 0 0"), {"line 9 (color transfer)"});
    expect_refused("1\n1\n0.8\n0.15\n0.25\n12\n1e9 " + std::string(100000, '1') + "\n\n\n",
                   {"line 7"});
}

std::string property(const std::string& component) {
    return "{\"@schema\": \"volume-property-schema-v1.0.0.json#\", \"volumeProperties\": "
           "[{\"effectiveRange\": [0, 1], \"components\": [" +
           component + "]}]}";
}

const char* const kOpacityAndColor = R"(
    "scalarOpacity": {"type": "piecewiseLinearFunction", "points": [
        {"x": 0, "y": 0, "midpoint": 0.25, "sharpness": 0},
        {"x": 100, "y": 0.8, "midpoint": 0.5, "sharpness": 0}]},
    "rgbTransferFunction": {"type": "colorTransferFunction", "points": [
        {"x": 0, "color": [0, 0, 0], "midpoint": 0.5, "sharpness": 1},
        {"x": 100, "color": [1, 1, 1], "midpoint": 0.5, "sharpness": 0}]})";

TEST(SlicerProperties, OfJsonAreRead) {
    const TransferSpec read = read_as(property(fmt::format(
        R"({{"shade": true, "scalarOpacityUnitDistance": 2.5,
            "lighting": {{"ambient": 0.3, "diffuse": 0.6, "specular": 0.5, "specularPower": 40}}, {}}})",
        kOpacityAndColor)));
    EXPECT_EQ(read.transfer.unit, 2.5);
    ASSERT_TRUE(read.material);
    EXPECT_EQ(read.material->ambient, 0.3);
    EXPECT_EQ(read.material->exponent, 40);
    // Half of the way at the midpoint, and a step where the sharpness is 1.
    EXPECT_DOUBLE_EQ(read.transfer.at(25)[3], 0.4);
    EXPECT_DOUBLE_EQ(read.transfer.at(62.5)[3], 0.6);
    EXPECT_EQ(read.transfer.at(49)[0], 0);
    EXPECT_EQ(read.transfer.at(51)[0], 1);
}

TEST(SlicerProperties, OfJsonRefuseWithTheField) {
    expect_refused(R"({"volumeProperties": []})", {"volumeProperties", "expected one"});
    expect_refused(R"({"volumeProperties": [{"components": [{}, {}]}]})",
                   {"components", "2 given"});
    expect_refused(property("{}"), {"components[0]", "scalarOpacity"});
    expect_refused(property(R"({"scalarOpacity": {"points": []}})"), {"scalarOpacity", "points"});
    expect_refused(property(R"({"scalarOpacity": {"points": [{"x": 0, "y": 2}]}})"),
                   {"components[0].scalarOpacity.points[0].y is 2"});
    expect_refused(property(R"({"scalarOpacity": {"points": [{"y": 1}]}})"), {"'x'"});
    expect_refused(property(R"({"scalarOpacity": {"points": [{"x": 0, "y": 1}]},
                                "rgbTransferFunction": {"points": [{"x": 0, "color": [1]}]}})"),
                   {"rgbTransferFunction.points[0].color", "three numbers"});
    expect_refused(
        property(fmt::format(R"({{"lighting": {{"ambient": 3}}, {}}})", kOpacityAndColor)),
        {"components[0].lighting.ambient is 3"});
}

TEST(TransferFiles, AreBounded) {
    expect_refused(std::string(33 << 20, ' '), {"larger"});
    std::string many = "[";
    for (int i = 0; i < 9 << 20; ++i) many += "0,";
    expect_refused(many + "0]", {"parts"});
    expect_refused(std::string(1 << 20, '['), {"deep"});
    expect_refused("", {"JSON"});
    EXPECT_THROW(load_transfer("/dev/zero"), RequestError);
    EXPECT_THROW(load_transfer(testing::TempDir()), RequestError);
    EXPECT_THROW(load_transfer("/none/such.vp"), RequestError);
}

// --- curves

TEST(Curves, AreJoinedAtTheKnotsOfBoth) {
    const Curve opacity{{0, {0}}, {10, {0.5}}, {10, {1}}, {20, {1}}};
    const Curve color{{-5, {0, 0, 0}}, {15, {1, 0.5, 0}}};
    const Transfer both{joined(opacity, color), 1};
    for (double value = -8; value < 30; value += 0.37) {
        const double share = std::clamp((value + 5) / 20, 0.0, 1.0);
        const double opaque = value < 0 ? 0 : value < 10 ? 0.05 * value : 1;
        EXPECT_NEAR(both.at(value)[3], opaque, 1e-12) << value;
        // What is not seen may have any colour.
        if (opaque > 0) {
            EXPECT_NEAR(both.at(value)[0], share, 1e-12) << value;
        }
    }
}

/// VTK's formula, written as its documentation has it: Hermite between (0, 0) and (1, 1).
double vtk_way(double x, double midpoint, double sharpness) {
    double s = x < midpoint ? 0.5 * x / midpoint : 0.5 + 0.5 * (x - midpoint) / (1 - midpoint);
    s = s < 0.5 ? 0.5 * std::pow(s * 2, 1 + 10 * sharpness)
                : 1 - 0.5 * std::pow((1 - s) * 2, 1 + 10 * sharpness);
    const double ss = s * s, sss = ss * s, slope = 1 - sharpness;
    return (-2 * sss + 3 * ss) + (sss - 2 * ss + s) * slope + (sss - ss) * slope;
}

TEST(Curves, FollowMidpointAndSharpness) {
    for (const double midpoint : {0.2, 0.5, 0.7})
        for (const double sharpness : {0.0, 0.1, 0.3}) {
            const Curve opacity{{0, {0.2}, midpoint, sharpness}, {1, {0.8}}};
            const Transfer transfer{joined(opacity, {{0, {1, 1, 1}}}), 1};
            // Chords of a 24th of a curve that bends by at most 40 in unit height, more than 0.6 *
            // 40 / (8 * 24^2).
            for (double x = 0; x <= 1; x += 0.01)
                EXPECT_NEAR(transfer.at(x)[3], 0.2 + 0.6 * vtk_way(x, midpoint, sharpness), 0.012)
                    << midpoint << " " << sharpness << " " << x;
        }
}

TEST(Curves, OfManyPointsBecomeFew) {
    Curve opacity, color;
    for (int i = 0; i <= 1024; ++i) {
        const double x = i / 1024.0;
        opacity.push_back({x, {i < 100 ? 0 : 0.5 * (x - 100 / 1024.0)}});
        color.push_back({x, {x, x * x, 1 - x}});
    }
    const Transfer transfer{joined(opacity, color), 1};
    EXPECT_LT(transfer.points.size(), 24u);
    for (int i = 0; i <= 1024; ++i) {
        const double x = i / 1024.0;
        const auto at = transfer.at(x);
        EXPECT_NEAR(at[3], i < 100 ? 0 : 0.5 * (x - 100 / 1024.0), 1.01e-4) << x;
        if (i <= 100) {
            EXPECT_EQ(at[3], 0) << x;  // clear parts stay quite clear
            continue;
        }
        EXPECT_NEAR(at[1], x * x, 0.5 / 255 + 1e-12) << x;
    }
}

// --- values

Data volume(const std::vector<float>& values) {
    Representation what;
    what.type = Type::f32;
    what.extent = {static_cast<std::int64_t>(values.size()) / 64, 8, 8};
    Data data = Data::make(what, std::pmr::get_default_resource());
    std::copy(values.begin(), values.end(), static_cast<float*>(data.samples.data()));
    return data;
}

Statistics look_at(const Data& data) {
    return statistics_of(data, std::pmr::get_default_resource());
}

/// Parts of normally distributed values.
struct Part {
    double mean, deviation, share;
};
Data mixture(const std::vector<Part>& parts, double least) {
    std::mt19937 random(5);
    std::vector<float> values;
    for (const Part& part : parts) {
        std::normal_distribution<double> normal(part.mean, part.deviation);
        for (int i = 0; i < part.share * 65536; ++i)
            values.push_back(static_cast<float>(std::round(std::max(least, normal(random)))));
    }
    values.resize(65536, values.back());
    std::shuffle(values.begin(), values.end(), random);
    return volume(values);
}

TEST(RobustWindow, LeavesOutBackgroundAndOutliers) {
    // Noise, tissue, and a few samples that are far too bright.
    const Data data = mixture({{10, 6, 0.5}, {300, 60, 0.499}, {30000, 10, 0.001}}, 0);
    const ValueWindow window = glance_at(data, look_at(data)).window;
    EXPECT_GT(window.low, 15);
    EXPECT_LT(window.low, 150);
    EXPECT_GT(window.high, 380);
    EXPECT_LT(window.high, 600);
}

TEST(RobustWindow, OfSparseDataStartsAtTheCommonestValue) {
    const Data data = mixture({{0, 0, 0.98}, {120, 30, 0.02}}, 0);
    const ValueWindow window = glance_at(data, look_at(data)).window;
    EXPECT_EQ(window.low, 0);
    EXPECT_NEAR(window.high, 120 + 2.6 * 30, 15);
}

TEST(RobustWindow, OfOneValueIsItsRange) {
    const Data data = volume(std::vector<float>(512, 7));
    const ValueWindow window = glance_at(data, look_at(data)).window;
    EXPECT_EQ(window.low, 7);
    EXPECT_EQ(window.high, 7);
    const Data none = volume(std::vector<float>(512, NAN));
    glance_at(none, look_at(none));
}

TEST(HounsfieldUnits, AreRecognisedByAirAndWater) {
    const std::vector<Part> head{{-1000, 20, 0.5}, {40, 30, 0.4}, {900, 300, 0.1}};
    const Data units = mixture(head, -1024);
    EXPECT_EQ(glance_at(units, look_at(units)).hounsfield, 0);
    std::vector<Part> moved = head;
    for (Part& part : moved) part.mean += 1024;
    const Data stored = mixture(moved, 0);
    EXPECT_EQ(glance_at(stored, look_at(stored)).hounsfield, -1024);
    const Data mr = mixture({{10, 6, 0.5}, {300, 60, 0.4}, {700, 100, 0.1}}, 0);
    EXPECT_FALSE(glance_at(mr, look_at(mr)).hounsfield);
    const auto preset_for = [](const Data& data, const char* modality) {
        FileFacts facts;
        facts.modality = modality;
        const Statistics statistics = look_at(data);
        return std::string(
            kind_of(look_of(data, statistics, Vec3::Ones(), facts, glance_at(data, statistics)))
                .preset);
    };
    EXPECT_EQ(preset_for(units, ""), "ct-bone");
    EXPECT_EQ(preset_for(units, "CT"), "ct-bone");
    EXPECT_EQ(preset_for(stored, ""), "ct-bone");
    EXPECT_EQ(preset_for(units, "PT"), "general");
    EXPECT_EQ(preset_for(mr, ""), "general");
}

TEST(HounsfieldUnits, ArePeaks) {
    // Values of both signs that spread over all between, and an MR as bright as a shifted CT.
    for (const double deviation : {300.0, 700.0, 1000.0, 3000.0}) {
        const Data waves = mixture({{0, deviation, 1}}, -32768);
        EXPECT_FALSE(glance_at(waves, look_at(waves)).hounsfield) << deviation;
    }
    const Data mr = mixture(
        {{15, 8, 0.4}, {350, 80, 0.15}, {750, 90, 0.2}, {1050, 60, 0.2}, {1400, 100, 0.05}}, 0);
    EXPECT_FALSE(glance_at(mr, look_at(mr)).hounsfield);
    // Lungs lie between air and water.
    const Data chest = mixture(
        {{-1000, 15, 0.3}, {-850, 70, 0.3}, {-100, 20, 0.1}, {45, 30, 0.25}, {500, 250, 0.05}},
        -1024);
    EXPECT_EQ(glance_at(chest, look_at(chest)).hounsfield, 0);
}

TEST(Drawn, IsTheSameEachTimeAndOfRunsOfNeighbours) {
    Representation what;
    what.type = Type::f32;
    what.extent = {100, 90, 80};
    Data data = Data::make(what, std::pmr::get_default_resource());
    auto* samples = static_cast<float*>(data.samples.data());
    for (std::int64_t i = 0; i < what.samples(); ++i) samples[i] = static_cast<float>(i);
    const Drawn drawn(data, {{10, 20, 30}, {90, 70, 60}}, 500, 16);
    const Drawn again(data, {{10, 20, 30}, {90, 70, 60}}, 500, 16);
    EXPECT_TRUE(std::equal(drawn.values().begin(), drawn.values().end(), again.values().begin()));
    ASSERT_EQ(drawn.runs(), 500u);
    for (std::size_t i = 0; i < drawn.runs(); ++i) {
        const auto run = drawn.run(i);
        ASSERT_EQ(run.size(), 16u);
        const auto at = static_cast<std::int64_t>(run[0]);
        EXPECT_TRUE(at % 100 >= 10 && at % 100 <= 90 - 16 && at / 100 % 90 >= 20 &&
                    at / 100 % 90 < 70 && at / 9000 >= 30 && at / 9000 < 60);
        for (std::size_t k = 1; k < run.size(); ++k) EXPECT_EQ(run[k], run[0] + float(k));
    }
    // A small region is drawn whole; of runs of one value none is kept.
    EXPECT_EQ(Drawn(data, {{0, 0, 0}, {10, 5, 4}}, 500, 16).values().size(), 200u);
    std::fill(samples, samples + what.samples(), 7.f);
    samples[9000 * 40 + 100 * 50 + 33] = 8;
    const double seven = 7;
    const Drawn sparse(data, {{0, 0, 40}, {100, 90, 41}}, 1000, 100, &seven);
    ASSERT_EQ(sparse.runs(), 1u);
    EXPECT_EQ(sparse.run(0)[33], 8);
}

TEST(Air, IsTheLeastValueThatIsNoPadding) {
    const auto air = [](std::vector<float> values,
                        std::vector<store::PaddingRuns::Run> padding = {}) {
        values.resize(512, 40);
        return air_of(volume(values), padding);
    };
    EXPECT_EQ(air({-1000, -990, 900}), -1000);
    EXPECT_EQ(air({-3024, -3024, -1007, -990}), -1007);
    EXPECT_EQ(air({-3024, -2000, -1007, -990}), -1007);
    EXPECT_EQ(air({-1080, -1050, -1010}), -1080);  // the noise of air
    EXPECT_EQ(air({-900, -500, -1003}, {{2, 1}}), -900);
    EXPECT_EQ(air({-900, -500, -1003}, {{0, 1}, {2, 1}}), -500);
    EXPECT_EQ(air({NAN, -1001}), -1001);
    EXPECT_EQ(air({-5000}, {{1, 511}}), -5000);
    EXPECT_FALSE(air_of(volume(std::vector<float>(512, NAN)), {}));
}

// --- presets

TEST(Presets, AreThere) {
    const std::vector<std::string> names = preset_names();
    for (const char* name : {"ct-bone", "ct-skin", "ct-lung", "ct-vessels", "ct-soft", "mr-head",
                             "mr-angio", "microscopy", "general"})
        EXPECT_NE(std::find(names.begin(), names.end(), name), names.end()) << name;
    for (const std::string& name : names) {
        const TransferSpec spec = preset_named(name);
        EXPECT_FALSE(preset_help(name).empty()) << name;
        if (name == "labels") {
            EXPECT_EQ(spec.values, TransferValues::labels);
            continue;
        }
        EXPECT_EQ(spec.values,
                  name.starts_with("ct-") ? TransferValues::hounsfield : TransferValues::window)
            << name;
        EXPECT_EQ(spec.transfer.points.front().opacity, 0) << name << ": air would be seen";
        EXPECT_TRUE(spec.material) << name;
        if (name.starts_with("ct-")) {
            EXPECT_TRUE(spec.unit_given && spec.transfer.unit == 1) << name;
        }
    }
    EXPECT_EQ(preset_named("CT-Bone").from.text(), "preset=ct-bone");
}

TEST(Presets, ShrinkWithStructuresByPowersOfTen) {
    const auto share = [](Extent extent, double x, double y, double z) {
        return size_share(extent, Vec3(x, y, z));
    };
    // Scans of patients: head, chest, whole body, temporal bone, dental; thick and few slices.
    EXPECT_EQ(share({512, 512, 200}, 0.48, 0.48, 1), 1);
    EXPECT_EQ(share({512, 512, 400}, 0.9, 0.9, 0.7), 1);
    EXPECT_EQ(share({512, 512, 1200}, 1.4, 1.4, 1.5), 1);
    EXPECT_EQ(share({400, 400, 200}, 0.2, 0.2, 0.2), 1);
    EXPECT_EQ(share({512, 512, 1}, 0.5, 0.5, 5), 1);
    EXPECT_EQ(share({8, 8, 8}, 1, 1, 1), 1);
    // A mouse, a tooth, trabeculae.
    EXPECT_EQ(share({600, 600, 1000}, 0.05, 0.05, 0.05), 0.1);
    EXPECT_DOUBLE_EQ(share({1200, 1200, 900}, 0.01, 0.01, 0.01), 0.1);
    EXPECT_DOUBLE_EQ(share({400, 400, 300}, 0.01, 0.01, 0.01), 0.01);
    // A hundredth of all lengths is a hundredth, in any order of the axes.
    for (const double spacing : {0.5, 0.7, 1.0, 1.37})
        for (const std::int64_t n : {64, 200, 512})
            for (const double part : {10.0, 100.0, 1000.0}) {
                const double fine = spacing / part;
                EXPECT_DOUBLE_EQ(share({n, n, n / 2}, fine, fine, 2 * fine), 1 / part) << n;
                EXPECT_DOUBLE_EQ(share({n / 2, n, n}, 2 * fine, fine, fine), 1 / part) << n;
            }
}

TEST(Presets, AreFittedToTheData) {
    const Data data = mixture({{0, 0, 0.98}, {120, 30, 0.02}}, 0);
    const Statistics statistics = look_at(data);
    const ValueWindow window = glance_at(data, statistics).window;
    const TransferSpec spec = preset_named("mr-angio");
    const Suited fitted = suited(spec, data, statistics, Vec3(0.4, 0.6, 2), 1);
    EXPECT_TRUE(fitted.warnings.empty());
    EXPECT_EQ(fitted.transfer.points.back().value, window.low + (window.high - window.low));
    EXPECT_EQ(fitted.transfer.unit, 1);
    EXPECT_EQ(
        suited(preset_named("microscopy"), data, statistics, Vec3(0.9, 0.4, 1), 1).transfer.unit,
        0.4);
    // A CT's on these data: they are not Hounsfield units, and nothing is seen.
    const Suited bone = suited(preset_named("ct-bone"), volume(std::vector<float>(512, 7)),
                               look_at(volume(std::vector<float>(512, 7))), Vec3::Ones(), 1);
    EXPECT_EQ(bone.warnings.size(), 2u);
    // 10 um in mm and in um: the same length.
    const Data fine = volume(std::vector<float>(512, 7));
    const auto unit_of = [&](double spacing, double millimetres) {
        return suited(preset_named("ct-bone"), fine, look_at(fine), Vec3::Constant(spacing),
                      millimetres)
            .transfer.unit;
    };
    EXPECT_DOUBLE_EQ(unit_of(0.01, 1), unit_of(10, 1e-3) * 1e-3);
    EXPECT_LT(unit_of(0.01, 1), 0.1);
    EXPECT_EQ(unit_of(1, 1), 1);
}

TEST(Presets, MistypedGetTheNearestName) {
    try {
        preset_or_file("ct-bones");
        FAIL();
    } catch (const RequestError& error) {
        EXPECT_NE(std::string(error.what()).find("ct-bone"), std::string::npos) << error.what();
    }
    EXPECT_EQ(preset_or_file(written(kVp, "bone.vp")).material->diffuse, 0.8);
}

}  // namespace
}  // namespace edgewise
