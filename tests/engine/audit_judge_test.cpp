#include <cmath>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "cli/audit/audit.hpp"
#include "cli/audit/audit_fixed.hpp"
#include "measure/quantiles.hpp"

namespace edgewise::cli {
namespace {

MeasuredPath path(double seconds, double error, double bytes = 1e6) {
    MeasuredPath path;
    path.first = 2 * seconds;
    path.seconds = {seconds, seconds, 10 * seconds};
    path.error = Verified{.nrmse = error, .low = 0.9 * error, .high = 1.1 * error};
    path.bytes = bytes;
    path.predicted.error = error;
    return path;
}

/// @param chosen  place of the path that the planner took
AuditedRequest request(std::vector<MeasuredPath> paths, std::size_t chosen, double error) {
    AuditedRequest request;
    request.paths = std::move(paths);
    request.paths[chosen].chosen = true;
    request.budget.error = error;
    return request;
}

TEST(Audit, RegretIsAgainstTheFastestThatKeepsTheErrorBudget) {
    const AuditedRequest asked = request({path(1, 0.5), path(2, 0.01), path(3, 0.001)}, 2, 0.02);
    const Verdict verdict = judge(asked);
    EXPECT_EQ(verdict.best, &asked.paths[1]);
    EXPECT_DOUBLE_EQ(verdict.regret, 1.5);
    EXPECT_TRUE(verdict.error_kept);
}

TEST(Audit, AChoiceThatBreaksTheErrorBudgetIsAViolationAndMayLookFast) {
    const AuditedRequest asked = request({path(1, 0.5), path(2, 0.01)}, 0, 0.02);
    const Verdict verdict = judge(asked);
    EXPECT_FALSE(verdict.error_kept);
    EXPECT_DOUBLE_EQ(verdict.regret, 0.5);
}

TEST(Audit, ASampledErrorBreaksABudgetOnlyWithItsWholeInterval) {
    // 0.021 * 0.9 is below 0.02: the samples do not prove that it is broken.
    const AuditedRequest asked = request({path(1, 0.021), path(2, 0.01)}, 0, 0.02);
    EXPECT_TRUE(judge(asked).error_kept);
    EXPECT_DOUBLE_EQ(judge(asked).regret, 1);
    // A rival must keep it by the error itself.
    const AuditedRequest rival = request({path(1, 0.021), path(2, 0.01)}, 1, 0.02);
    EXPECT_DOUBLE_EQ(judge(rival).regret, 1);
}

TEST(Audit, WhereNothingKeepsTheBudgetTheMostAccurateIsComparedWith) {
    AuditedRequest asked = request({path(1, 0.5), path(2, 0.1), path(3, 0.099)}, 2, 0.02);
    const Verdict verdict = judge(asked);
    // 0.1 * 0.9 is within the interval of 0.099: as accurate, and faster.
    EXPECT_EQ(verdict.best, &asked.paths[1]);
    EXPECT_DOUBLE_EQ(verdict.regret, 1.5);
    EXPECT_FALSE(verdict.error_kept);
}

TEST(Audit, RivalsAreAlikeWhereALikenessIsWishedFor) {
    AuditedRequest asked = request({path(1, 0.1), path(2, 0.1), path(3, 0.1)}, 2, 0.02);
    asked.budget.error.reset();
    asked.budget.like.emplace();
    asked.paths[0].predicted.likeness = Likeness::barred;
    EXPECT_EQ(judge(asked).best, &asked.paths[1]);
    EXPECT_DOUBLE_EQ(judge(asked).regret, 1.5);
    asked.paths[2].predicted.likeness = Likeness::worse;
    EXPECT_TRUE(judge(asked).error_kept);  // no demand
}

TEST(Audit, MemoryBudgetsTakeRivalsAwayAndCanBeBroken) {
    AuditedRequest asked = request({path(1, 0.01, 9e6), path(2, 0.01, 1e6)}, 1, 0.02);
    asked.budget.bytes = 5e6;
    EXPECT_DOUBLE_EQ(judge(asked).regret, 1);
    EXPECT_TRUE(judge(asked).bytes_kept);
    asked.paths[1].resident_bytes = 6e6;  // what the system saw counts as well
    EXPECT_FALSE(judge(asked).bytes_kept);
}

TEST(Audit, RegretIsOfWhatWasMinimised) {
    AuditedRequest asked = request({path(1, 0.04), path(2, 0.01), path(9, 0.001)}, 0, 1);
    asked.budget.error.reset();
    asked.budget.seconds = 5;
    asked.minimize = Minimize::error;
    EXPECT_DOUBLE_EQ(judge(asked).regret, 4);  // the third takes longer than is allowed
    asked.minimize = Minimize::memory;
    EXPECT_DOUBLE_EQ(judge(asked).regret, 1);
}

TEST(Audit, PathsThatWereGivenUpAreNoRivals) {
    AuditedRequest asked = request({path(1, 0.01), path(2, 0.01)}, 1, 0.02);
    asked.paths[0].first.reset();
    asked.paths[0].given_up = 0.5;
    EXPECT_DOUBLE_EQ(judge(asked).regret, 1);
}

TEST(Quantiles, AreThoseOfNumpy) {
    const std::vector<double> values{4, 1, 3, 2};
    EXPECT_DOUBLE_EQ(quantile(values, 0), 1);
    EXPECT_DOUBLE_EQ(quantile(values, 1), 4);
    EXPECT_DOUBLE_EQ(median(values), 2.5);
    EXPECT_DOUBLE_EQ(quantile(values, 0.95), 3.85);  // numpy.percentile
    EXPECT_TRUE(std::isnan(median({})));
    EXPECT_DOUBLE_EQ(geometric_mean({1, 4}), 2);
}

TEST(Quantiles, KendallTauIsThatOfScipy) {
    EXPECT_DOUBLE_EQ(kendall_tau({1, 2, 3}, {10, 20, 30}), 1);
    EXPECT_DOUBLE_EQ(kendall_tau({1, 2, 3}, {3, 2, 1}), -1);
    // scipy.stats.kendalltau([12, 2, 1, 12, 2], [1, 4, 7, 1, 0])
    EXPECT_NEAR(kendall_tau({12, 2, 1, 12, 2}, {1, 4, 7, 1, 0}), -0.4714045207910316, 1e-15);
}

TEST(Audit, OtherLibrariesLoseWhatTheirPathDoesOrTheMostAccurateOne) {
    const auto warp = [](double linear, double budget) {
        std::vector<MeasuredPath> paths = {path(1, linear), path(4, 0.001), path(3, 0.002)};
        paths[0].steps = {"warp.backward/filter=foh"};
        paths[1].steps = {"filter.prefilter", "warp.backward/filter=bspline3"};
        paths[2].steps = {"store.crop", "warp.backward/filter=bspline3"};
        AuditedRequest asked = request(std::move(paths), 1, budget);
        asked.family = "warp 2D";
        return asked;
    };
    const AuditedRequest coarse = warp(0.01, 0.02);  // linear will do, and is the best
    const AuditedRequest fine = warp(0.05, 0.02);    // it will not: SciPy's is the most accurate
    AuditedRequest volume = warp(0.01, 0.02);
    volume.family = "warp 3D";
    AuditedRequest render = request({path(2, 0.01), path(1, 0.015)}, 1, 0.02);
    render.paths[0].steps = {"project.ray_cast/filter=foh/step=1"};
    render.family = "render mip";
    const nlohmann::json rules = rules_of_others({&coarse, &fine, &volume, &render});
    ASSERT_EQ(rules.size(), 3u);
    const nlohmann::json &scipy = rules[0], &opencv = rules[1], &vtk = rules[2];
    EXPECT_EQ(scipy["requests"], 3);
    EXPECT_EQ(scipy["serves"], 3);
    EXPECT_NEAR(scipy["regret_geomean"].get<double>(), std::cbrt(4 * 4 / 3. * 4), 1e-12);
    EXPECT_EQ(opencv["requests"], 2);  // images alone
    EXPECT_EQ(opencv["serves"], 1);
    EXPECT_NEAR(opencv["regret_geomean"].get<double>(), std::sqrt(1 * 4 / 3.), 1e-12);
    EXPECT_EQ(vtk["requests"], 1);
    EXPECT_DOUBLE_EQ(vtk["regret_max"].get<double>(), 2);
    EXPECT_TRUE(rules_of_others({&render})[0]["regret_geomean"].is_null());
}

/// Of a mean it is the usual one: s / sqrt(n).
TEST(JackknifeError, OfAMeanIsTheStandardError) {
    const std::vector<double> values = {1, 4, 2, 8, 5};  // mean 4, s^2 = 30 / 4
    std::vector<double> without;
    for (const double value : values) without.push_back((20 - value) / 4);
    EXPECT_NEAR(jackknife_error(without), std::sqrt(30.0 / 4 / 5), 1e-12);
    EXPECT_EQ(jackknife_error({3}), 0);
}

}  // namespace
}  // namespace edgewise::cli
