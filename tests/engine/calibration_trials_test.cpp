#include "evaluation/calibrate/calibration_trials.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <map>
#include <optional>
#include <set>
#include <tuple>

#include "evaluation/calibrate/prepared_trial.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise::cli {
namespace {

std::vector<EdgeTrial> trials(Trial::Part part = Trial::Part::full) {
    return trials_of(catalogue(), part);
}

Trial trial_of(Job job, const std::string& input, Type type, std::optional<Mode> mode = {}) {
    return {.job = job, .input = input, .type = type, .turn = {1, 2, 3}, .mode = mode};
}

TEST(CalibrationTrials, EachRunsOnceAndWhatMostRequestsResembleComesFirst) {
    const std::map<Trial::Part, std::size_t> counts{
        {Trial::Part::full, 178}, {Trial::Part::quick, 10}, {Trial::Part::exam, 6}};
    for (const auto& [part, count] : counts) {
        const std::vector<EdgeTrial> all = trials(part);
        EXPECT_EQ(all.size(), count);
        for (std::size_t i = 0; i < all.size(); ++i) {
            EXPECT_EQ(all[i].trial.part, part);
            EXPECT_EQ(all[i].edge.empty(), !all[i].trial.alone);
            EXPECT_LE(all[i > 0 ? i - 1 : 0].trial.order, all[i].trial.order);
            for (std::size_t j = 0; j < i; ++j) {
                EXPECT_FALSE(all[i] == all[j]) << all[i].trial.input;
                Trial at_another_time = all[j].trial;
                at_another_time.order = all[i].trial.order;
                EXPECT_TRUE(all[i].edge != all[j].edge || !(all[i].trial == at_another_time))
                    << all[i].trial.input << " has two orders";
            }
        }
    }
}

TEST(CalibrationTrials, AreThoseOfTheEdgesThatThereAre) {
    const auto has = [](const std::vector<EdgeTrial>& all, const EdgeTrial& one) {
        return std::find(all.begin(), all.end(), one) != all.end();
    };
    const std::vector<EdgeTrial> all = trials();
    for (const Transition& edge : catalogue()) {
        const std::vector<EdgeTrial> own = trials_of({edge}, Trial::Part::full);
        for (const EdgeTrial& one : own) EXPECT_TRUE(has(all, one)) << edge.name;
        EXPECT_EQ(own.empty(), !edge.trials) << edge.name;
        // Only a demand takes such an edge, so that no trial passes it.
        EXPECT_TRUE(own.empty() || !edge.on_demand) << edge.name;
    }
    // No trial passes the others: they take what only a demand or another job makes, complex
    // samples, several ranks, an eye, or colours beside the samples; or they never pay unasked.
    std::set<std::string> untimed;
    for (const Transition& edge : catalogue())
        if (!edge.trials && !edge.on_demand) untimed.insert(edge.name);
    EXPECT_EQ(untimed, (std::set<std::string>{
                           "composite.classify", "net.spread", "project.composite_colored",
                           "project.depth", "project.octree_cast", "project.sliced_runs",
                           "radon.inverse", "spectrum.faded_picture", "spectrum.from_kspace",
                           "spectrum.lit_slice", "spectrum.moment_slice", "spectrum.polar_slice",
                           "spectrum.wide", "warp.colored"}));
    // One of a user's own is timed beside the others, and what another edge names runs once.
    Transition mine;
    mine.name = "toy.mine";
    Trial own{.job = Job::render, .input = "phantom:sphere:20", .mode = Mode::xray};
    own.alone = true;
    mine.trials = [&] { return std::vector<Trial>{own, all.back().trial, own}; };
    Catalogue edges = catalogue();
    edges.push_back(mine);
    const std::vector<EdgeTrial> more = trials_of(edges, Trial::Part::full);
    ASSERT_EQ(more.size(), all.size() + 1);
    EXPECT_EQ(more.front(), (EdgeTrial{own, "toy.mine"})) << "of order 0";
    EXPECT_TRUE(trials_of({}, Trial::Part::full).empty());
}

TEST(CalibrationTrials, FactorsAreOfParametersThatTheirEdgesHave) {
    std::size_t factors = 0;
    for (const Transition& edge : catalogue())
        for (const auto& [with, factor] : edge.factors) {
            ++factors;
            // As far as counts of a loop can be off: what is further off is counted wrongly.
            EXPECT_GT(factor, 0.1) << edge.name << with;
            EXPECT_LT(factor, 10) << edge.name << with;
            if (with.empty()) continue;
            EXPECT_EQ(with.front(), '/') << edge.name << with;
            const std::size_t equals = with.find('=');
            // Without a value it is the variant of a kernel.
            EXPECT_TRUE(equals == std::string::npos ||
                        edge.parameters.contains(with.substr(1, equals - 1)))
                << edge.name << with;
        }
    EXPECT_EQ(default_profile(catalogue()).factors.size(), factors) << "no two have one name";
    EXPECT_GE(factors, 50u);
}

TEST(CalibrationTrials, CopiesAreTimedInTheirTypesAtSizesFarApart) {
    std::map<std::string, std::set<std::tuple<std::string, Type, std::vector<double>>>> copies;
    for (const auto& [trial, edge] : trials()) {
        if (!edge.empty()) copies[edge].emplace(trial.input, trial.type, trial.turn);
        EXPECT_EQ(trial.empty_around, edge == "store.crop");
    }
    EXPECT_EQ(copies["store.crop"].size(), 12u);
    EXPECT_EQ(copies["warp.axis_permutation"].size(), 6u + 9u + 3u) << "in order, rows, columns";
    EXPECT_EQ(copies["store.precision"].size(), 2u);
    for (const EdgeTrial& exam : trials(Trial::Part::exam))
        for (const EdgeTrial& each : trials()) EXPECT_NE(exam.trial.input, each.trial.input);
}

TEST(CalibrationTrials, PhantomsKeepTheirValuesInOtherTypes) {
    Phantoms phantoms;
    Trial trial = trial_of(Job::warp, "phantom:noise:20", Type::f32);
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
    Trial trial = trial_of(Job::render, "phantom:noise:20", Type::f32, Mode::xray);
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
    for (const auto& [trial, edge] : trials()) {
        if (!edge.empty()) ++edges[edge];
        if (trial.radon) lines.insert(trial.radon->to);
        EXPECT_EQ(trial.radon.has_value(), trial.job == radon_job());
        EXPECT_EQ(trial.filter.has_value(), trial.job == Job::filter);
        EXPECT_EQ(trial.mode.has_value(), trial.job == Job::render);
        EXPECT_EQ(spec_of(trial).labels, trial.labels);
    }
    EXPECT_EQ(lines.size(), 2u);
    for (const char* edge :
         {"surface.flying_edges", "surface.nets", "surface.draw", "project.label_cast"})
        EXPECT_GE(edges[edge], 2) << edge;
}

TEST(CalibrationTrials, LabelsAreWholeNumbers) {
    Phantoms phantoms;
    Trial trial = trial_of(Job::mesh, "phantom:shepp-logan:20", Type::u8);
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
    Trial trial = trial_of(Job::warp, "phantom:noise:20", Type::f32);
    trial.turn = {20, -15, 10};
    Listener own;
    open(ask(Engine(edges, default_profile(edges)), spec_of(trial), {.given = phantoms.of(trial)}),
         own);
    EXPECT_FALSE(own.warnings().empty()) << "a turned volume is cut off";
    for (const std::optional<Mode> mode :
         {std::optional<Mode>(), std::optional(Mode::mip), std::optional(Mode::xray),
          std::optional(Mode::composite)}) {
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
