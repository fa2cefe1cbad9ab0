#include "charts/pictures.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <png.h>
#include <random>

namespace edgewise::charts {
namespace {

std::vector<unsigned char> from_base64(const std::string& uri) {
    const std::string head = "data:image/png;base64,";
    EXPECT_TRUE(uri.starts_with(head));
    const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::vector<unsigned char> bytes;
    unsigned bits = 0;
    int have = 0;
    for (const char c : uri.substr(head.size())) {
        if (c == '=') break;
        bits = bits << 6 | static_cast<unsigned>(letters.find(c));
        have += 6;
        if (have >= 8) bytes.push_back(static_cast<unsigned char>(bits >> (have -= 8)));
    }
    return bytes;
}

/// Samples of a PNG, read by libpng.
std::vector<unsigned char> read(const std::string& uri, int channels) {
    const std::vector<unsigned char> bytes = from_base64(uri);
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    EXPECT_TRUE(png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()));
    image.format = channels == 1 ? PNG_FORMAT_GRAY : PNG_FORMAT_RGB;
    std::vector<unsigned char> samples(PNG_IMAGE_SIZE(image));
    EXPECT_TRUE(png_image_finish_read(&image, nullptr, samples.data(), 0, nullptr));
    return samples;
}

Raster noise(int width, int height, int channels, unsigned seed) {
    Raster raster{width, height, channels, {}};
    std::mt19937 bits(seed);
    std::normal_distribution<float> values(100, 30);
    for (int i = 0; i < width * height * channels; ++i) raster.values.push_back(values(bits));
    return raster;
}

TEST(Pictures, AreThereAgainWithinWhatIsPromised) {
    const int width = 17, height = 9, channels = 3;
    Pictures pictures;
    pictures.base = noise(width, height, channels, 1);
    const Raster other = noise(width, height, channels, 2);
    pictures.points = {std::nullopt, other};
    const auto json = to_json(pictures);
    EXPECT_TRUE(json["differences"][0].is_null());
    const auto base = read(json["base"], 3), codes = read(json["differences"][1]["png"], 1);
    const double low = json["low"], high = json["high"];
    const double scale = json["differences"][1]["scale"], levels = json["levels"];
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < channels; ++c) {
                const auto there = static_cast<std::size_t>((y * width + x) * channels + c);
                const auto here = static_cast<std::size_t>(x + width * (y + height * c));
                const double value =
                    low + (high - low) * (256 * base[3 * here] + base[3 * here + 1]) / 65535;
                // Half of a step of 16 bits, and what f32 rounds.
                EXPECT_NEAR(value, pictures.base.values[there], (high - low) / 65535 * 0.51);
                const double root = (codes[here] - 128.0) / levels;
                const double d = other.values[there] - pictures.base.values[there];
                // A root is half a step off: |d| by 2 root scale / (2 levels) and scale / (2
                // levels)^2.
                const double bound =
                    std::sqrt(std::abs(d) * scale) / levels + scale / (4 * levels * levels);
                EXPECT_NEAR(std::copysign(root * root * scale, root), d, bound * 1.0001);
            }
}

TEST(Pictures, WhatIsNotFiniteHasACodeOfItsOwn) {
    Pictures pictures;
    pictures.base = {2, 1, 1, {0, 1}};
    pictures.points = {Raster{2, 1, 1, {NAN, 2}}};
    const auto codes = read(to_json(pictures)["differences"][0]["png"], 1);
    EXPECT_EQ(codes, (std::vector<unsigned char>{0, 128 + 95}));
}

TEST(Pictures, OfAConstantAndOfNoDifference) {
    Pictures pictures;
    pictures.base = {2, 2, 1, {5, 5, 5, 5}};
    pictures.points = {pictures.base};
    const auto json = to_json(pictures);
    EXPECT_EQ(json["low"], json["high"]);
    EXPECT_EQ(json["differences"][0]["scale"], 0);
    EXPECT_EQ(read(json["differences"][0]["png"], 1), (std::vector<unsigned char>(4, 128)));
}

TEST(Pictures, OfAnotherSizeAreRefused) {
    Pictures pictures;
    pictures.base = {2, 1, 1, {0, 1}};
    pictures.points = {Raster{1, 2, 1, {0, 1}}};
    EXPECT_THROW(to_json(pictures), std::invalid_argument);
}

TEST(Pictures, ThirtyOfNoiseAt256StayUnderThreeMegabytes) {
    Pictures pictures;
    pictures.base = noise(256, 256, 1, 1);
    for (unsigned i = 0; i < 30; ++i) pictures.points.push_back(noise(256, 256, 1, 2 + i));
    // What is left of 3 MiB is for d3 (258 kB), the page (40 kB) and the points (3.3 kB each).
    EXPECT_LT(to_json(pictures).dump().size(), (3u << 20) - 400'000);
}

}  // namespace
}  // namespace edgewise::charts
