#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

namespace edgewise::charts {

/// Values of a picture, [height, width, channels], x fastest but for the channels.
struct Raster {
    int width = 0, height = 0, channels = 1;
    std::vector<float> values;
};

/// The pictures of a page: one that all are compared with, and one a point, all of one size.
struct Pictures {
    Raster base;
    std::string base_is;                        // "reference"
    std::vector<std::optional<Raster>> points;  // as many as the table has
    double black = 0, white = 1;                // values
    std::string note;                           // what the pictures are of
};

/// What the page shows pictures from. Each point has only its difference to the base: 8 bits for
/// its sign and square root, which are finest where differences are small, so that a page of 30
/// points stays small whatever the pictures hold. A difference d comes back within sqrt(|d| scale)
/// / levels + scale / (2 levels)^2, where scale is the largest one. Channels lie below each other.
/// Code 0 stands for what is not finite. {width, height, channels, black, white, base, low, high,
/// base_is, note, levels,
///  differences: [{png, scale} | null]}; base: value = low + (high - low) (256 red + green) /
///  65535;
/// difference: sign(code - 128) scale ((code - 128) / levels)^2
/// @throws std::invalid_argument rasters of several sizes
nlohmann::ordered_json to_json(const Pictures& pictures);

/// A PNG of 8 bits as a data URI. @param channels  1 to 4: grey, with alpha, colour, with alpha
std::string png_uri(const std::vector<unsigned char>& samples, int width, int height, int channels);

/// A picture with what stands below it.
struct ReportPicture {
    std::string uri;  // PNG
    int width = 0, height = 0;
    std::string text;
};

/// Differences as colours: blue below none, red above, none transparent; opacity is the root of
/// their size over the largest, so that small ones are seen. What is not finite is purple.
struct SignedPicture {
    std::string uri;   // PNG
    double scale = 0;  // the largest size [value]
};
/// @param differences  [height, width], x fastest
SignedPicture signed_picture(const std::vector<double>& differences, int width, int height);

}  // namespace edgewise::charts
