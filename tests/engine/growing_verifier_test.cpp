// How a pilot's errors are measured on more and more samples.
#include "engine/growing_verifier.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

#include "reference/phantoms.hpp"

namespace edgewise::cli {
namespace {

std::pmr::memory_resource* heap() { return std::pmr::get_default_resource(); }

/// An image of 400 x 100 samples, delivered as it is but for its left half, which is off by 0.1.
struct HalfWrong {
    HalfWrong() {
        want.job = Job::warp;
        want.axes = 2;
        want.input = data.what.extent;
        want.screen = {kWidth, kHeight, 1};
        want.views = Placement::each({Mat4(Mat4::Identity())});
        Representation what = data.what;
        what.extent = want.screen;
        result = Data::make(what, heap());
        for (std::int64_t i = 0; i < kWidth * kHeight; ++i)  // rows are as long as the input's
            result.as<float>()[i] = data.as<float>()[i] + (i % kWidth < kWidth / 2 ? 0.1F : 0.0F);
    }

    static constexpr std::int64_t kWidth = 400, kHeight = 100;
    const Data data = make_phantom("zone-plate", kWidth, heap());
    Request want;
    Data result;
};

TEST(GrowingVerifier, HasMoreSamplesEachTimeUntilItHasAll) {
    const HalfWrong half;
    const ReferenceField field(half.data, Field::linear);
    GrowingVerifier errors(half.want, field, heap());
    double width = 1;
    for (const std::int64_t samples : {1024, 8192, 40'000}) {
        errors.begin();
        errors.frame(0, half.result);
        const Verified verified = errors.finish();
        EXPECT_EQ(verified.samples, samples);
        EXPECT_NEAR(verified.nrmse, 0.1 * std::sqrt(0.5) / verified.range, 0.006);
        EXPECT_LT(verified.high - verified.low, width) << "surer than before";
        EXPECT_EQ(errors.can_grow(), samples < 40'000);
        width = verified.high - verified.low;
        if (errors.can_grow()) errors.grow();
    }
    EXPECT_EQ(width, 0) << "nothing is left to chance";
    // The next result has as many, and its reference is there.
    const double early = errors.early_seconds();
    EXPECT_GT(early, 0);
    EXPECT_LT(early, errors.seconds());
    errors.begin();
    errors.frame(0, half.result);
    EXPECT_EQ(errors.finish().samples, 40'000);
    EXPECT_EQ(errors.early_seconds(), early);
}

TEST(GrowingVerifier, GoesBackWhereMemoryRunsOut) {
    const HalfWrong half;
    const ReferenceField field(half.data, Field::linear);
    GrowingVerifier errors(half.want, field, heap());
    EXPECT_FALSE(errors.shrink()) << "it has as few as there may be";
    errors.grow();
    errors.grow();
    EXPECT_EQ(errors.samples(), 4 * GrowingVerifier::kSecond);
    EXPECT_TRUE(errors.shrink());
    EXPECT_EQ(errors.samples(), GrowingVerifier::kSecond);
    EXPECT_FALSE(errors.can_grow()) << "there was no room";
    EXPECT_TRUE(errors.shrink());
    EXPECT_EQ(errors.samples(), GrowingVerifier::kFirst);
    EXPECT_FALSE(errors.can_grow());
}

TEST(GrowingVerifier, TellsWhatTheNextReferenceTakesFromTwo) {
    const HalfWrong half;
    const ReferenceField field(half.data, Field::linear);
    GrowingVerifier errors(half.want, field, heap());
    const auto verify = [&] {
        errors.begin();
        errors.frame(0, half.result);
        errors.finish();
    };
    verify();
    EXPECT_EQ(errors.seconds_to_grow(), 0) << "one alone does not tell what each sample takes";
    const double first = errors.early_seconds();
    errors.grow();
    verify();
    const double second = errors.early_seconds();
    const double each = std::max(0.0, second - first) / (8192 - 1024);
    EXPECT_NEAR(errors.seconds_to_grow(), second + each * (32'768 - 8192), 1e-12);
}

}  // namespace
}  // namespace edgewise::cli
