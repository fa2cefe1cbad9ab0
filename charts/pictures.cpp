#include "charts/pictures.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <png.h>
#include <stdexcept>

namespace edgewise::charts {
namespace {

using Json = nlohmann::ordered_json;

/// Codes of a difference on either side of none. With 127 thirty pictures of noise, which nothing
/// compresses, would be beyond what a page may have.
constexpr int kLevels = 95;

std::string base64(const std::vector<unsigned char>& bytes) {
    static constexpr char kLetters[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t there = std::min<std::size_t>(3, bytes.size() - i);
        unsigned bits = 0;
        for (std::size_t k = 0; k < 3; ++k) bits = bits << 8 | (k < there ? bytes[i + k] : 0u);
        for (std::size_t k = 0; k < 4; ++k)
            text += k <= there ? kLetters[bits >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

/// The place of channel c of pixel i of a raster where channels lie below each other.
std::size_t plane_place(const Raster& raster, std::size_t pixel, std::size_t channel) {
    return pixel + channel * static_cast<std::size_t>(raster.width) *
                       static_cast<std::size_t>(raster.height);
}

template <class Body>
void each_value(const Raster& raster, const Body& body) {
    const auto channels = static_cast<std::size_t>(raster.channels);
    for (std::size_t i = 0; i < raster.values.size(); ++i)
        body(i, plane_place(raster, i / channels, i % channels));
}

Json base_json(const Raster& base) {
    double low = INFINITY, high = -INFINITY;
    for (const float value : base.values) {
        if (!std::isfinite(value)) continue;
        low = std::min(low, double(value));
        high = std::max(high, double(value));
    }
    if (!(low <= high)) low = high = 0;
    std::vector<unsigned char> samples(3 * base.values.size());
    each_value(base, [&](std::size_t from, std::size_t to) {
        const double value = std::isfinite(base.values[from]) ? base.values[from] : low;
        const double share = high > low ? (value - low) / (high - low) : 0;
        const auto code = static_cast<unsigned>(std::lround(65535 * share));
        samples[3 * to] = static_cast<unsigned char>(code >> 8);
        samples[3 * to + 1] = static_cast<unsigned char>(code & 255);
    });
    return {{"base", png_uri(samples, base.width, base.height * base.channels, 3)},
            {"low", low},
            {"high", high}};
}

Json difference_json(const Raster& base, const Raster& raster) {
    if (raster.width != base.width || raster.height != base.height ||
        raster.channels != base.channels || raster.values.size() != base.values.size())
        throw std::invalid_argument("pictures of several sizes");
    double scale = 0;
    const auto difference = [&](std::size_t i) {
        const double there = std::isfinite(base.values[i]) ? base.values[i] : 0;
        return double(raster.values[i]) - there;
    };
    for (std::size_t i = 0; i < base.values.size(); ++i)
        if (std::isfinite(difference(i))) scale = std::max(scale, std::abs(difference(i)));
    std::vector<unsigned char> samples(base.values.size());
    each_value(base, [&](std::size_t from, std::size_t to) {
        const double d = difference(from);
        if (!std::isfinite(d)) return;  // stays 0
        const double root = scale > 0 ? std::sqrt(std::abs(d) / scale) : 0;
        samples[to] =
            static_cast<unsigned char>(128 + std::lround(std::copysign(kLevels * root, d)));
    });
    return {{"png", png_uri(samples, base.width, base.height * base.channels, 1)},
            {"scale", scale}};
}

}  // namespace

std::string png_uri(const std::vector<unsigned char>& samples, int width, int height,
                    int channels) {
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = static_cast<png_uint_32>(width);
    image.height = static_cast<png_uint_32>(height);
    constexpr png_uint_32 kFormats[] = {PNG_FORMAT_GRAY, PNG_FORMAT_GA, PNG_FORMAT_RGB,
                                        PNG_FORMAT_RGBA};
    image.format = kFormats[channels - 1];
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
    std::vector<unsigned char> bytes(size);
    if (!png_image_write_to_memory(&image, bytes.data(), &size, 0, samples.data(), 0, nullptr))
        throw std::runtime_error(std::string("libpng: ") + image.message);
    bytes.resize(size);
    return "data:image/png;base64," + base64(bytes);
}

SignedPicture signed_picture(const std::vector<double>& differences, int width, int height) {
    // As bright on white paper as on a dark screen; see also report.css.
    constexpr unsigned char kBelow[] = {32, 110, 210}, kAbove[] = {220, 62, 28};
    constexpr unsigned char kNone[] = {255, 0, 255};
    SignedPicture picture;
    for (const double d : differences)
        if (std::isfinite(d)) picture.scale = std::max(picture.scale, std::abs(d));
    std::vector<unsigned char> samples;
    for (const double d : differences) {
        const unsigned char* colour = !std::isfinite(d) ? kNone : d < 0 ? kBelow : kAbove;
        samples.insert(samples.end(), colour, colour + 3);
        const double share = picture.scale > 0 ? std::sqrt(std::abs(d) / picture.scale) : 0;
        samples.push_back(std::isfinite(d) ? static_cast<unsigned char>(std::lround(255 * share))
                                           : 255);
    }
    picture.uri = png_uri(samples, width, height, 4);
    return picture;
}

Json to_json(const Pictures& pictures) {
    Json json = {{"width", pictures.base.width},
                 {"height", pictures.base.height},
                 {"channels", pictures.base.channels},
                 {"black", pictures.black},
                 {"white", pictures.white},
                 {"base_is", pictures.base_is},
                 {"note", pictures.note},
                 {"levels", kLevels}};
    json.update(base_json(pictures.base));
    json["differences"] = Json::array();
    for (const auto& point : pictures.points)
        json["differences"].push_back(point ? difference_json(pictures.base, *point) : Json());
    return json;
}

}  // namespace edgewise::charts
