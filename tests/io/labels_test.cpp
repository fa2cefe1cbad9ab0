#include "io/labels.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "graph/errors.hpp"

namespace edgewise {
namespace {

std::pmr::memory_resource* heap() { return std::pmr::get_default_resource(); }

template <class T>
Data volume_of(Type type, Extent n, const std::vector<T>& values) {
    Representation what;
    what.extent = n;
    what.type = type;
    Data data = Data::make(what, heap());
    std::copy(values.begin(), values.end(), data.as<T>());
    return data;
}

TEST(Labels, PlacesInATableStandForAnyNumber) {
    const std::vector<std::uint32_t> numbers{4294967295u, 0, 16777217, 16777216, 0, 614454277};
    Data data = volume_of(Type::u32, {6, 1, 1}, numbers);
    EXPECT_EQ(rounded_by_f32(data), 3);  // 2^24 itself is held
    const auto table = code_labels(data, 77, heap());
    EXPECT_EQ(table->values,
              (std::vector<double>{0, 77, 16777216, 16777217, 614454277, 4294967295.0}));
    EXPECT_EQ(place_in(*table, 77), 1);
    ASSERT_EQ(data.what.type, Type::f32);
    for (std::size_t i = 0; i < numbers.size(); ++i)
        EXPECT_EQ(table->values[static_cast<std::size_t>(data.as<float>()[i])], numbers[i]);
}

TEST(Labels, TheTableHoldsValuesNotStoredNumbers) {
    Data data = volume_of<double>(Type::f64, {4, 1, 1}, {0x1p40, 1, NAN, 0x1p40});
    data.what.values = {2, -1};
    const auto table = code_labels(data, 0, heap());
    EXPECT_EQ(table->values, (std::vector<double>{0, 1, 0x1p41 - 1}));
    EXPECT_TRUE(data.what.values.identity());
    EXPECT_EQ(data.as<float>()[0], 2);
    EXPECT_EQ(data.as<float>()[1], 1);
    EXPECT_TRUE(std::isnan(data.as<float>()[2]));
}

TEST(Labels, WhatF32HoldsIsChangedWhereItLies) {
    for (const Type type : {Type::i32, Type::f64}) {
        Data data = type == Type::i32
                        ? volume_of<std::int32_t>(type, {3, 1, 1}, {-16777216, 7, 16777216})
                        : volume_of<double>(type, {3, 1, 1}, {-16777216, 7, 16777216});
        data.what.values = {3, 1};
        EXPECT_EQ(rounded_by_f32(data), 0);
        to_f32(data, heap());
        EXPECT_EQ(data.what.type, Type::f32);
        EXPECT_EQ(data.what.values, (ValueMap{3, 1}));
        EXPECT_EQ(data.as<float>()[0], -16777216);
        EXPECT_EQ(data.as<float>()[1], 7);
        EXPECT_EQ(data.as<float>()[2], 16777216);
    }
    EXPECT_EQ(rounded_by_f32(volume_of<double>(Type::f64, {2, 1, 1}, {0.1, 0.5})), 1);
}

/// Boxes of labels, a mask, and what must not be taken for them.
TEST(Labels, AreRecognisedByTheirNeighbours) {
    const Extent n{32, 32, 8};
    const auto made = [&](auto value) {
        std::vector<std::int16_t> values;
        for (std::int64_t z = 0; z < n.z; ++z)
            for (std::int64_t y = 0; y < n.y; ++y)
                for (std::int64_t x = 0; x < n.x; ++x)
                    values.push_back(static_cast<std::int16_t>(value(x, y, z)));
        return volume_of(Type::i16, n, values);
    };
    std::mt19937 bits(3);
    const auto boxes = [](auto x, auto y, auto z) {
        return x < 4 ? 0 : 1 + 37 * ((x / 8 + 4 * (y / 8) + 16 * (z / 4)) % 27);
    };
    const auto mosaic = [](auto x, auto y, auto z) { return x / 8 + 4 * (y / 4) + 32 * (z / 2); };
    const auto mask = [](auto x, auto y, auto) {
        return (x - 16) * (x - 16) + (y - 16) * (y - 16) < 90;
    };
    EXPECT_TRUE(looks_like_labels(made(boxes), 0));
    EXPECT_TRUE(looks_like_labels(made([&](auto... at) { return 29 * mosaic(at...); }), 0));
    EXPECT_TRUE(looks_like_labels(made(mask), 0));
    const auto dim = [](auto x, auto y, auto) {
        return std::lround(20 * std::exp(-((x - 16) * (x - 16) + (y - 16) * (y - 16)) / 90.0));
    };
    const auto photograph = [&](auto x, auto y, auto) {
        return std::min<std::int64_t>(255, 4 * x + 3 * y + static_cast<int>(bits() % 9));
    };
    EXPECT_FALSE(looks_like_labels(made(dim), 0));
    EXPECT_FALSE(looks_like_labels(made(photograph), 0));
    EXPECT_FALSE(looks_like_labels(made([&](auto...) { return bits() % 2000; }), 0));
    EXPECT_FALSE(looks_like_labels(made([](auto...) { return 5; }), 5));
    EXPECT_FALSE(looks_like_labels(volume_of<float>(Type::f32, {64, 1, 1}, {}), 0));
}

}  // namespace
}  // namespace edgewise
