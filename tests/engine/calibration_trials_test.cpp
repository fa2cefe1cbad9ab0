#include "engine/calibrate/calibration_trials.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <map>
#include <set>
#include <tuple>

#include "engine/calibrate/prepared_trial.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise::cli {
namespace {

TEST(CalibrationTrials, CopiesAreTimedInTheirTypesAtSizesFarApart) {
    std::map<std::string, std::set<std::tuple<std::string, Type, std::vector<double>>>> copies;
    for (const Trial& trial : trials(false)) {
        if (trial.edge) copies[trial.edge].emplace(trial.input, trial.type, trial.turn);
        EXPECT_EQ(trial.empty_around, trial.edge && std::string(trial.edge) == "store.crop");
    }
    EXPECT_EQ(copies["store.crop"].size(), 12u);
    EXPECT_EQ(copies["warp.axis_permutation"].size(), 6u + 9u + 3u) << "in order, rows, columns";
    EXPECT_EQ(copies["store.precision"].size(), 2u);
    for (const Trial& exam : exams())
        for (const Trial& trial : trials(false)) EXPECT_NE(exam.input, trial.input);
}

TEST(CalibrationTrials, PhantomsKeepTheirValuesInOtherTypes) {
    Phantoms phantoms;
    Trial trial{Job::warp, "phantom:noise:20", Type::f32, {1, 2, 3}, nullptr};
    const auto reals = phantoms.of(trial);
    EXPECT_EQ(phantoms.of(trial), reals);  // made once
    trial.type = Type::u8;
    const auto bytes = phantoms.of(trial);
    ASSERT_EQ(bytes->what.type, Type::u8);
    for (std::int64_t i = 0; i < reals->what.samples(); ++i)
        ASSERT_NEAR(bytes->what.values(bytes->as<std::uint8_t>()[i]), reals->as<float>()[i],
                    0.5 / 255 + 1e-6);
}

TEST(CalibrationTrials, WhatIsCroppedFillsTheMiddleAlone) {
    Phantoms phantoms;
    Trial trial{Job::render, "phantom:noise:20", Type::f32, {1, 2, 3}, "xray"};
    const auto whole = phantoms.of(trial);
    trial.empty_around = true;
    const auto framed = phantoms.of(trial);
    std::int64_t i = 0, kept = 0;
    for (int z = 0; z < 20; ++z)
        for (int y = 0; y < 20; ++y)
            for (int x = 0; x < 20; ++x, ++i) {
                const bool inside = std::min({x, y, z}) >= 5 && std::max({x, y, z}) < 15;
                ASSERT_EQ(framed->as<float>()[i], inside ? whole->as<float>()[i] : 0.f);
                kept += framed->as<float>()[i] != 0;
            }
    EXPECT_GT(kept, 900);
}

TEST(CalibrationTrials, LinesAndSurfacesAreTimed) {
    std::map<std::string, int> edges;
    std::set<RadonSetting::To> lines;
    for (const Trial& trial : trials(false)) {
        if (trial.edge) ++edges[trial.edge];
        if (trial.radon) lines.insert(trial.radon->to);
        EXPECT_EQ(trial.radon.has_value(), trial.job == radon_job());
        EXPECT_EQ(spec_of(trial).labels, trial.labels);
    }
    EXPECT_EQ(lines.size(), 2u);
    for (const char* edge :
         {"surface.flying_edges", "surface.nets", "surface.draw", "project.label_cast"})
        EXPECT_GE(edges[edge], 2) << edge;
}

TEST(CalibrationTrials, LabelsAreWholeNumbers) {
    Phantoms phantoms;
    Trial trial{Job::mesh, "phantom:shepp-logan:20", Type::u8};
    trial.labels = true;
    const auto labels = phantoms.of(trial);
    EXPECT_TRUE(labels->what.values.identity());
    std::set<int> numbers;
    for (std::int64_t i = 0; i < labels->what.samples(); ++i)
        numbers.insert(labels->as<std::uint8_t>()[i]);
    EXPECT_GT(numbers.size(), 2u);
    EXPECT_LT(numbers.size(), 20u);
}

/// Keeps what it is told beside warnings.
class Told final : public Listener {
 public:
    void notice(const Message& text) override { notices.push_back(text); }
    std::vector<Message> notices;
};

TEST(CalibrationTrials, WhoCalibratesIsNotToldOfTheirViews) {
    Phantoms phantoms;
    const Catalogue edges = catalogue();
    Told told;
    Trial trial{Job::warp, "phantom:noise:20", Type::f32, {20, -15, 10}, nullptr};
    Listener own;
    open(ask(Engine(edges, default_profile()), spec_of(trial), {.given = phantoms.of(trial)}), own);
    EXPECT_FALSE(own.warnings().empty()) << "a turned volume is cut off";
    for (const char* mode : {static_cast<const char*>(nullptr), "mip", "xray", "composite"}) {
        trial.job = mode ? Job::render : Job::warp;
        trial.mode = mode;
        trial.size = mode ? 7 : 0;
        const PreparedTrial prepared(trial, phantoms, edges, told);
        EXPECT_TRUE(told.warnings().empty()) << told.warnings().front();
        EXPECT_TRUE(told.notices.empty()) << told.notices.front();
    }
    const PreparedTrial prepared(trial, phantoms, edges, told);
    told.end();
    EXPECT_TRUE(prepared.told.stop()) << "its end reaches them";
}

}  // namespace
}  // namespace edgewise::cli
