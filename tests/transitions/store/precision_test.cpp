#include "transitions/store/precision.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <string>
#include <vector>

namespace edgewise {
namespace {

template <class T>
Data volume_of(const std::vector<T>& values, Type type) {
    Representation what;
    what.extent = {static_cast<std::int64_t>(values.size()), 1, 1};
    what.type = type;
    Data data = Data::make(what, std::pmr::get_default_resource());
    std::copy(values.begin(), values.end(), data.as<T>());
    return data;
}

double value_of(const Data& data, std::int64_t i) {
    switch (data.what.type) {
        case Type::u8:
            return data.what.values(data.as<std::uint8_t>()[i]);
        case Type::i16:
            return data.what.values(data.as<std::int16_t>()[i]);
        case Type::u16:
            return data.what.values(data.as<std::uint16_t>()[i]);
        default:
            return data.what.values(static_cast<double>(data.as<float>()[i]));
    }
}

Data converted(const Data& data, const Offer& offer, const Ask& ask) {
    Data out = Data::make(offer.to, std::pmr::get_default_resource());
    Context context{.memory = std::pmr::get_default_resource()};
    precision().run(offer, ask, data, out, Region::all(offer.to.extent), context);
    return out;
}

class Quantised : public testing::TestWithParam<const char*> {};

TEST_P(Quantised, NoiseIsThatOfItsStepsAndTheCommonestValueIsExact) {
    std::mt19937 bits(5);
    std::uniform_real_distribution<float> uniform(-3, 7);
    std::vector<float> values(20000);
    for (float& value : values) value = uniform(bits);
    for (int i = 0; i < 5000; ++i) values[i] = 0.123F;
    values[6000] = -3;
    values[6001] = 7;
    const Data data = volume_of(values, Type::f32);
    const Request want;
    Scene scene{.low = -3, .high = 7};
    scene.commonest = static_cast<double>(0.123F);
    const Ask ask{want, scene};
    const Offer offer = precision().offer(data.what, ask, {{"type", GetParam()}});
    ASSERT_EQ(offer.refused, "");
    const Data out = converted(data, offer, ask);
    double sum = 0, worst = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
        const double d =
            value_of(out, static_cast<std::int64_t>(i)) - static_cast<double>(values[i]);
        if (i < 5000)
            ASSERT_LT(std::abs(d), 1e-12);
        else
            sum += d * d;
        worst = std::max(worst, std::abs(d));
    }
    // 15000 uniform errors: their RMS is known to 1 / sqrt(5 x 15000) = 0.4 %; four of these.
    const double noise = precision().error(offer, ask).noise;
    EXPECT_NEAR(std::sqrt(sum / 15000) / noise, 1, 0.016);
    EXPECT_LE(worst, 0.5001 * offer.to.values.slope);
    EXPECT_LE(offer.to.values.slope, 10 / (GetParam() == std::string("u8") ? 254 : 65534.0));
}
INSTANTIATE_TEST_SUITE_P(Types, Quantised, testing::Values("u8", "i16", "u16"));

TEST(Precision, KeepsIntegersThatFit) {
    const Request want;
    Data data = volume_of<std::int16_t>({-1000, -900, -745, -1000}, Type::i16);
    data.what.values = {2, 10};
    const Scene scene{.low = -1990, .high = -1480};
    const Offer offer = precision().offer(data.what, {want, scene}, {{"type", "u8"}});
    ASSERT_EQ(offer.refused, "");
    EXPECT_EQ(precision().error(offer, {want, scene}).noise, 0);
    const Data out = converted(data, offer, {want, scene});
    for (int i = 0; i < 4; ++i) EXPECT_EQ(value_of(out, i), value_of(data, i));
}

TEST(Precision, RoundsToF32) {
    const Request want;
    const Data data = volume_of<double>({1.0 / 3, 1e5 / 7, -5.5}, Type::f64);
    const Scene scene{.low = -5.5, .high = 1e5 / 7};
    const Offer offer = precision().offer(data.what, {want, scene}, {{"type", "f32"}});
    ASSERT_EQ(offer.refused, "");
    const Data out = converted(data, offer, {want, scene});
    for (int i = 0; i < 3; ++i)
        EXPECT_EQ(out.as<float>()[i], static_cast<float>(data.as<double>()[i]));
}

TEST(Precision, RefusesWhatCannotPayOrWouldLie) {
    const Request want;
    Scene scene{.low = 0, .high = 60000};
    const auto refused = [&](Type from, const char* to, const Request& request) {
        Representation what;
        what.type = from;
        return !precision().offer(what, {request, scene}, {{"type", to}}).refused.empty();
    };
    EXPECT_TRUE(refused(Type::u16, "u16", want));
    EXPECT_TRUE(refused(Type::u16, "i16", want));
    EXPECT_TRUE(refused(Type::u8, "f32", want));
    EXPECT_FALSE(refused(Type::u16, "u8", want));
    EXPECT_FALSE(refused(Type::i32, "f32", want));
    EXPECT_FALSE(refused(Type::f32, "u16", want));
    Request labels;
    labels.field = Field::nearest;
    EXPECT_TRUE(refused(Type::u16, "u8", labels));
    EXPECT_FALSE(refused(Type::i32, "u16", labels));
    scene.non_finite = 1;
    EXPECT_TRUE(refused(Type::f32, "u16", want));
}

}  // namespace
}  // namespace edgewise
