#include "graph/transfer_table.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <memory>
#include <random>

namespace edgewise {
namespace {

TransferTable random_table(std::size_t columns, std::size_t rows, bool colors, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> part(0, 1);
    TransferTable table;
    for (double at = -50; table.values.size() < columns; at += 1 + 10 * part(random))
        table.values.push_back(at);
    for (double at = part(random); table.gradients.size() < rows; at += 1 + 5 * part(random))
        table.gradients.push_back(at);
    for (std::size_t i = 0; i < columns * rows; ++i) {
        table.opacity.push_back(part(random));
        if (colors) table.color.push_back({part(random), part(random), part(random)});
    }
    return table;
}

Transfer with(TransferTable table, std::vector<Transfer::Point> points = {}) {
    Transfer transfer{.points = std::move(points)};
    transfer.table = std::make_shared<const TransferTable>(std::move(table));
    return transfer;
}

/// Weights of hats around each place: no search, no cells.
std::vector<double> hats(const std::vector<double>& places, double at) {
    at = std::min(std::max(at, places.front()), places.back());
    std::vector<double> weights(places.size(), 0);
    for (std::size_t i = 0; i < places.size(); ++i) {
        double& weight = weights[i];
        weight = places.size() == 1 || at == places[i] ? 1 : 0;
        if (i > 0 && at > places[i - 1] && at < places[i])
            weight = (at - places[i - 1]) / (places[i] - places[i - 1]);
        if (i + 1 < places.size() && at > places[i] && at < places[i + 1])
            weight = (places[i + 1] - at) / (places[i + 1] - places[i]);
    }
    return weights;
}

double opacity_of(const TransferTable& table, double value, double gradient) {
    const std::vector<double> across = hats(table.values, value),
                              down = hats(table.gradients, gradient);
    double sum = 0;
    for (std::size_t row = 0; row < down.size(); ++row)
        for (std::size_t i = 0; i < across.size(); ++i)
            sum += down[row] * across[i] * table.opacity[row * across.size() + i];
    return sum;
}

TEST(TransferTable, IsBilinearAndConstantBeyond) {
    for (const auto& [columns, rows] :
         {std::pair<std::size_t, std::size_t>{7, 5}, {1, 4}, {6, 1}, {1, 1}, {2, 2}, {200, 3}}) {
        const TransferTable table = random_table(columns, rows, true, 1);
        std::mt19937 random(2);
        std::uniform_real_distribution<double> value(table.values.front() - 5,
                                                     table.values.back() + 5),
            gradient(0, table.gradients.back() + 5);
        for (int i = 0; i < 500; ++i) {
            const double v = value(random), g = gradient(random);
            EXPECT_NEAR(table.at(v, g)[3], opacity_of(table, v, g), 1e-12);
        }
        for (std::size_t i = 0; i < columns; ++i)
            EXPECT_EQ(table.at(table.values[i], table.gradients[0])[3], table.opacity[i]);
        EXPECT_EQ(table.at(1e9, 1e9)[3], table.opacity.back());
        EXPECT_EQ(table.at(1e9, 1e9)[0], table.color.back()[0]);
        EXPECT_EQ(table.at(-1e9, 0)[3], table.opacity.front());
    }
}

TEST(TransferTable, PointsBecomeWhatIsSeenAtMost) {
    for (const std::size_t columns : {1u, 2u, 7u, 33u, 34u, 500u})
        for (const bool sparse : {false, true}) {
            TransferTable table = random_table(columns, 4, true, 3);
            // Transparent stretches, which have to stay so.
            if (sparse)
                for (std::size_t i = 0; i < table.opacity.size(); ++i)
                    if (i % columns % 100 > 20) table.opacity[i] = 0;
            const Transfer all = completed(with(table));
            EXPECT_LE(all.points.size(), 200u);
            std::mt19937 random(4);
            std::uniform_real_distribution<double> value(table.values.front() - 5,
                                                         table.values.back() + 5);
            for (int i = 0; i < 2000; ++i) {
                const double v = i < int(columns) ? table.values[std::size_t(i)] : value(random);
                double most = 0;
                for (const double g : table.gradients)
                    most = std::max(most, opacity_of(table, v, g));
                EXPECT_GE(all.at(v)[3], most - 1e-12) << v;
                EXPECT_EQ(all.at(v)[3] > 0, most > 0) << v;
                if (columns < 34 && i < int(columns)) {
                    EXPECT_NEAR(all.at(v)[3], most, 1e-12) << v;
                }
            }
        }
}

TEST(TransferTable, WithoutColoursItHasThoseOfThePoints) {
    const std::vector<Transfer::Point> points{{-60, 0, {1, 0, 0}}, {-20, 0, {0, 1, 0}},
                                              {-20, 0, {0, 0, 1}}, {-10, 0, {0.5, 0.5, 1}},
                                              {500, 0, {1, 1, 1}}, {500, 0, {0, 0, 0}}};
    const TransferTable table = random_table(9, 3, false, 5);
    const Transfer colored = completed(with(table, points));
    const Transfer by_value{.points = points};
    for (double v = -70; v < 520; v += 0.37)
        for (const double g : {0.0, 3.3, 99.0}) {
            const auto got = colored.table->at(v, g), want = by_value.at(v);
            for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(got[c], want[c], 1e-12) << v;
            EXPECT_NEAR(got[3], opacity_of(table, v, g), 1e-12);
        }
    EXPECT_EQ(colored.table->at(500, 0)[0], 0);  // behind the jump
    EXPECT_EQ(colored.table->at(499.999999, 0)[0] > 0.99, true);
    const Transfer white = completed(with(table));
    EXPECT_EQ(white.table->at(3, 3)[1], 1);
    // Once more changes nothing.
    const Transfer twice = completed(colored);
    EXPECT_EQ(twice.table->values, colored.table->values);
    EXPECT_EQ(twice.points.size(), colored.points.size());
}

TEST(TransferTable, RescalesWithTheValues) {
    const TransferTable table = random_table(6, 4, true, 6);
    Transfer scaled = with(table, {{2, 0.5, {1, 1, 1}}});
    scaled.edges = {{3, 0.5}};
    rescale(scaled, 100, 2.5);
    EXPECT_EQ(scaled.points[0].value, 105);
    EXPECT_EQ(scaled.edges[0].magnitude, 7.5);
    for (double v = -60; v < 40; v += 3.1)
        EXPECT_NEAR(scaled.table->at(100 + 2.5 * v, 2.5 * 4.4)[3], opacity_of(table, v, 4.4),
                    1e-12);
    rescale(scaled, 7, 0);  // of data that have one value
    const Transfer one = completed(scaled);
    for (const double v : {6.0, 7.0, 8.0})
        for (const double part : one.table->at(v, 0)) EXPECT_TRUE(std::isfinite(part));
}

TEST(TransferTable, WhatIsNone) {
    const auto why = [](auto&& change, std::size_t points = 0) {
        TransferTable table = random_table(3, 2, true, 7);
        change(table);
        return no_table(table, points);
    };
    EXPECT_EQ(why([](auto&) {}), "");
    using T = TransferTable;
    EXPECT_NE(why([](T& t) { t.values.clear(); }).find("values has 0"), std::string::npos);
    EXPECT_NE(why([](T& t) { t.values.resize(5000, 9); }).find("1 to 4096"), std::string::npos);
    EXPECT_NE(why([](T& t) { t.values[1] = t.values[0]; }).find("ascend"), std::string::npos);
    EXPECT_NE(why([](T& t) { t.values[2] = NAN; }).find("values[2]"), std::string::npos);
    EXPECT_NE(why([](T& t) { t.gradients[0] = -1; }).find("gradients[0]"), std::string::npos);
    EXPECT_NE(why([](T& t) { t.gradients[1] = INFINITY; }).find("gradients[1]"), std::string::npos);
    EXPECT_NE(why([](T& t) { t.opacity.pop_back(); }).find("5 opacities"), std::string::npos);
    EXPECT_NE(why([](T& t) { t.opacity[0] = 1.5; }).find("0 to 1"), std::string::npos);
    EXPECT_NE(why([](T& t) { t.opacity[0] = NAN; }).find("0 to 1"), std::string::npos);
    EXPECT_NE(why([](T& t) { t.color.pop_back(); }).find("5 colours"), std::string::npos);
    EXPECT_NE(why([](T& t) { t.color[3][1] = -0.1; }).find("colours"), std::string::npos);
    const auto large = [](T& t) { t = random_table(4096, 256, false, 8); };
    EXPECT_EQ(why(large), "");
    EXPECT_NE(why(large, 1).find("1 points"), std::string::npos);
}

}  // namespace
}  // namespace edgewise
