#include "scene/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <hwy/targets.h>
#include <limits>
#include <map>
#include <random>
#include <tbb/global_control.h>

#include "reference/stored.hpp"
#include "tests/vectors.hpp"

namespace edgewise {
namespace {

std::pmr::memory_resource* heap() { return std::pmr::get_default_resource(); }

constexpr Type kTypes[] = {Type::u8,  Type::i8,  Type::u16, Type::i16, Type::u32,
                           Type::i32, Type::f16, Type::f32, Type::f64};
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Whole numbers below 2048, infinities and NaN, as a half.
StoredHalf half_of(double value) {
    const auto sign = static_cast<std::uint16_t>(std::signbit(value) ? 0x8000 : 0);
    if (std::isnan(value)) return {static_cast<std::uint16_t>(sign | 0x7e00)};
    if (std::isinf(value)) return {static_cast<std::uint16_t>(sign | 0x7c00)};
    if (value == 0) return {sign};
    int exponent = 0;
    const double fraction = std::frexp(std::abs(value), &exponent);
    const auto digits = static_cast<int>(std::lround(std::ldexp(fraction, 11)));
    return {static_cast<std::uint16_t>(sign | ((exponent + 14) << 10) | (digits & 1023))};
}

/// Samples whose stored values a formula of their index gives.
Data made(Type type, const Extent& n, int channels, ValueMap map,
          const std::function<double(std::int64_t)>& stored) {
    Representation what;
    what.axes = n.z > 1 ? 3 : 2;
    what.extent = n;
    what.type = type;
    what.channels = channels;
    what.values = map;
    Data data = Data::make(what, heap());
    with_stored_type(type, [&](auto zero) {
        using T = decltype(zero);
        for (std::int64_t i = 0; i < what.samples() * channels; ++i) {
            if constexpr (std::is_same_v<T, StoredHalf>)
                data.as<T>()[i] = half_of(stored(i));
            else
                data.as<T>()[i] = static_cast<T>(stored(i));
        }
    });
    return data;
}

/// One value after the other, in f64. Of types of more than 16 bits the commonest is drawn.
Statistics counted(const Data& data, double drawn) {
    const Extent& n = data.what.extent;
    const int channels = data.what.channels;
    const std::int64_t values = data.what.samples() * channels;
    Statistics s;
    s.low = kInfinity;
    s.high = -kInfinity;
    std::map<double, std::int64_t> times;
    double sum = 0;
    for (std::int64_t i = 0; i < values; ++i) {
        const double value = value_at(data, i);
        if (!std::isfinite(value)) {
            ++s.non_finite;
            continue;
        }
        if (value < s.low) s.low = value, s.lowest = i / channels;
        if (value > s.high) s.high = value, s.highest = i / channels;
        sum += value;
        ++times[value];
    }
    s.mean = sum / static_cast<double>(values - s.non_finite);
    s.commonest = drawn;
    if (is_integer(data.what.type) && bytes_of(data.what.type) <= 2) {
        // Of ties the smallest, as stored.
        const double direction = data.what.values.slope < 0 ? -1 : 1;
        s.commonest = std::ranges::max_element(times, [&](const auto& a, const auto& b) {
                          return a.second != b.second ? a.second < b.second
                                                      : direction * a.first > direction * b.first;
                      })->first;
    }
    Region box{{n.x, n.y, n.z}, {0, 0, 0}};
    std::int64_t differing = 0;
    for (std::int64_t i = 0; i < values; ++i) {
        if (value_at(data, i) == s.commonest) continue;
        ++differing;
        const std::int64_t sample = i / channels;
        const std::int64_t at[] = {sample % n.x, sample / n.x % n.y, sample / n.x / n.y};
        for (std::size_t k = 0; k < 3; ++k) {
            box.begin[k] = std::min(box.begin[k], at[k]);
            box.end[k] = std::max(box.end[k], at[k] + 1);
        }
    }
    if (differing > 0) s.occupied = box;
    s.occupied_fraction = static_cast<double>(differing) / static_cast<double>(values);
    return s;
}

void expect_same(const Statistics& got, const Statistics& expected) {
    EXPECT_EQ(got.low, expected.low);
    EXPECT_EQ(got.high, expected.high);
    EXPECT_EQ(got.lowest, expected.lowest);
    EXPECT_EQ(got.highest, expected.highest);
    EXPECT_NEAR(got.mean, expected.mean, 1e-12 * (1 + std::abs(expected.mean)));
    EXPECT_EQ(got.commonest, expected.commonest);
    EXPECT_EQ(got.non_finite, expected.non_finite);
    EXPECT_EQ(got.occupied, expected.occupied);
    EXPECT_EQ(got.occupied_fraction, expected.occupied_fraction);
}

void expect_counted(const Data& data) {
    const Statistics got = statistics_of(data, heap());
    expect_same(got, counted(data, got.commonest));
}

double least_of(Type type) { return type == Type::f16 ? -2047 : limits_of(type)[0]; }
double greatest_of(Type type) { return type == Type::f16 ? 2047 : limits_of(type)[1]; }

constexpr std::int64_t kTargets[] = {0, HWY_AVX2, HWY_STATIC_TARGET};

class OnEachTarget : public testing::TestWithParam<std::int64_t> {
 protected:
    void SetUp() override {
        if (GetParam() && !has_vectors(GetParam())) GTEST_SKIP();
        choose_vectors(GetParam());
    }
    void TearDown() override { choose_vectors(0); }
};
INSTANTIATE_TEST_SUITE_P(Vectors, OnEachTarget, testing::ValuesIn(kTargets));

TEST_P(OnEachTarget, CountsObjectsInBoxesOfAnySize) {
    std::mt19937 bits(5);
    for (const Extent& n : {Extent{1, 1, 1}, Extent{3, 1, 1}, Extent{17, 5, 1}, Extent{1, 1, 401},
                            Extent{67, 33, 29}, Extent{263, 31, 15}, Extent{4, 300, 70}})
        for (const Type type : kTypes)
            for (const int channels : {1, 3}) {
                const std::int64_t x0 = bits() % n.x, y0 = bits() % n.y, z0 = bits() % n.z;
                const std::int64_t x1 = x0 + 1 + bits() % (n.x - x0);
                const std::int64_t y1 = y0 + 1 + bits() % (n.y - y0);
                const std::int64_t z1 = z0 + 1 + bits() % (n.z - z0);
                const Data data = made(type, n, channels, {-0.5, 2}, [&](std::int64_t i) {
                    const std::int64_t s = i / channels, x = s % n.x, y = s / n.x % n.y,
                                       z = s / n.x / n.y;
                    const bool in = x >= x0 && x < x1 && y >= y0 && y < y1 && z >= z0 && z < z1;
                    return in ? 4.0 + bits() % 100 : 3.0;
                });
                SCOPED_TRACE(std::string(name_of(type)) + " " + std::to_string(n.x));
                expect_counted(data);
            }
}

TEST_P(OnEachTarget, CountsNoiseAndWholeRanges) {
    std::mt19937 bits(6);
    for (const Type type : kTypes) {
        const double low = least_of(type), high = greatest_of(type);
        const bool real = !is_integer(type);
        SCOPED_TRACE(std::string(name_of(type)));
        const auto any = [&](std::int64_t) {
            const double value = low / 2 + (high / 2 - low / 2) * (bits() * 0x1p-32);
            return real ? std::round(0x1p-100 * value) : std::round(value);
        };
        for (const ValueMap map : {ValueMap{1, 0}, ValueMap{-2, 7}}) {
            expect_counted(made(type, {131, 37, 11}, 1, map, any));
            // Extremes at the first and last value of chunks, more than once.
            const std::int64_t values = 131 * 37 * 11;
            for (const std::int64_t edge : {values * 5 / 16, values * 5 / 16 - 1, values - 1})
                expect_counted(made(type, {131, 37, 11}, 1, map, [&](std::int64_t i) {
                    const double value = 1 + bits() % 50;
                    return i == edge || i == values - 7 ? (real ? 99 : high)
                           : i == values * 2 / 16       ? (real ? -99 : low)
                                                        : value;
                }));
        }
    }
}

TEST_P(OnEachTarget, LeavesOutWhatIsNotFinite) {
    std::mt19937 bits(7);
    for (const Type type : {Type::f16, Type::f32, Type::f64})
        for (const int one_in : {1, 2, 50, 20000}) {
            const auto some = [&](double value) {
                constexpr double kOthers[] = {kNan, kInfinity, -kInfinity};
                return bits() % static_cast<unsigned>(one_in) == 0 ? kOthers[bits() % 3] : value;
            };
            const auto check = [&](const std::function<double(std::int64_t)>& value) {
                const Data data = made(type, {71, 13, 19}, 1, {2, 1}, value);
                const Statistics got = statistics_of(data, heap());
                Statistics expected = counted(data, got.commonest);
                if (one_in == 1) expected.low = expected.high = expected.mean = 0;
                expect_same(got, expected);
            };
            check([&](std::int64_t i) { return some(i % 9 < 6 ? -0.0 : 1.0 * (bits() % 40)); });
            check([&](std::int64_t) { return some(-40.0 + bits() % 40); });
        }
}

TEST_P(OnEachTarget, TakesTheLeastWhereNoValueIsCommon) {
    std::mt19937_64 bits(8);
    for (const Type type : {Type::u32, Type::i32, Type::f32, Type::f64}) {
        const Data data = made(type, {97, 41, 23}, 1, {-1, 0}, [&](std::int64_t i) {
            // The least occurs in three chunks.
            if (i == 40000 || i == 40001 || i == 60000 || i == 90000) return 1.0;
            return 2.0 + static_cast<double>(bits() % 100000000);
        });
        const Statistics got = statistics_of(data, heap());
        EXPECT_EQ(got.commonest, -1);
        expect_same(got, counted(data, -1));
    }
}

TEST_P(OnEachTarget, TakesTheSmallestOfTies) {
    for (const Type type : {Type::u8, Type::i8, Type::u16, Type::i16})
        for (const double slope : {1.0, -1.0}) {
            const double low = least_of(type), high = greatest_of(type);
            const auto half = [&](std::int64_t i) { return i % 2 == 0 ? high : low; };
            const Data two = made(type, {64, 64, 16}, 1, {slope, 0}, half);
            EXPECT_EQ(statistics_of(two, heap()).commonest, slope * low);
            expect_counted(two);
            // One more than half of all, and one less.
            for (const std::int64_t more : {1, -1})
                expect_counted(made(type, {64, 64, 16}, 1, {slope, 0},
                                    [&](std::int64_t i) { return i < 32768 + more ? high : low; }));
            expect_counted(made(type, {61, 61, 16}, 1, {slope, 0},
                                [&](std::int64_t i) { return static_cast<double>(i % 100); }));
        }
}

TEST_P(OnEachTarget, ProvesTheCommonestByRanges) {
    // Of a hundred values in a row, how many are of each level: the first ones are guessed rightly,
    // the others tie, or come where a look at a few values misses them.
    const std::vector<std::vector<int>> kShares = {
        {30, 25, 20, 15, 10}, {10, 20, 30, 25, 15}, {35, 35, 10, 10, 10}, {10, 10, 10, 35, 35},
        {25, 0, 25, 0, 50},   {20, 20, 20, 20, 20}, {34, 33, 33},         {12, 11, 11, 11, 55}};
    for (const Type type : {Type::u8, Type::i8, Type::u16, Type::i16})
        for (const std::vector<int>& shares : kShares)
            for (const bool rows : {false, true}) {
                const Extent n{100, 83, 17};
                const auto level = [&](std::int64_t at) {
                    int k = 0;
                    for (int below = shares[0]; at >= below; below += shares[++k]) continue;
                    return (k - 1.0) * (k % 2 == 0 ? 37 : 5) + 64;
                };
                const Data data = made(type, n, 1, {1, 0}, [&](std::int64_t i) {
                    return rows ? level(i * 100 / n.samples()) : level(i * 37 % 100);
                });
                expect_counted(data);
                // One more of another level decides.
                const Data other = made(type, n, 1, {1, 0}, [&](std::int64_t i) {
                    return i == 0 ? level(99) : level(i * 37 % 100);
                });
                expect_counted(other);
            }
}

TEST_P(OnEachTarget, FindsNothingInConstants) {
    for (const Type type : kTypes)
        for (const Extent& n : {Extent{1, 1, 1}, Extent{97, 41, 1}, Extent{66, 30, 40}}) {
            const Data data = made(type, n, 1, {3, 1}, [](std::int64_t) { return 7.0; });
            const Statistics s = statistics_of(data, heap());
            expect_counted(data);
            EXPECT_EQ(s.commonest, 22);
            EXPECT_TRUE(s.occupied.empty());
        }
}

TEST_P(OnEachTarget, ReadsAllHalves) {
    Representation what;
    what.axes = 2;
    what.extent = {256, 256, 1};
    what.type = Type::f16;
    Data data = Data::make(what, heap());
    for (int i = 0; i < 65536; ++i)
        data.as<StoredHalf>()[i].bits = static_cast<std::uint16_t>(i * 40503);
    const Statistics s = statistics_of(data, heap());
    EXPECT_EQ(s.low, -65504);
    EXPECT_EQ(s.high, 65504);
    EXPECT_EQ(s.mean, 0);
    EXPECT_EQ(s.non_finite, 4 * 512);
    expect_same(s, counted(data, s.commonest));
}

TEST(Sums, AreTheSameToTheLastBit) {
    std::mt19937_64 bits(9);
    for (const Type type : {Type::u32, Type::i32, Type::f16, Type::f32, Type::f64}) {
        const Data data = made(type, {139, 57, 43}, 1, {1, 0}, [&](std::int64_t) {
            const double value = static_cast<double>(bits() % 4000);
            return type == Type::f32 || type == Type::f64 ? std::sqrt(value) : value / 2;
        });
        std::vector<double> means;
        for (const std::size_t threads : {1, 2, 7})
            for (const std::int64_t target : {std::int64_t{0}, std::int64_t{HWY_STATIC_TARGET}}) {
                const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                                threads);
                choose_vectors(target);
                means.push_back(statistics_of(data, heap()).mean);
            }
        for (const double mean : means) EXPECT_EQ(mean, means.front());
    }
    choose_vectors(0);
}

}  // namespace
}  // namespace edgewise
