#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "io/reader.hpp"
#include "io/store.hpp"
#include "io/zarr_store.hpp"

namespace edgewise::store {

/// One resolution of an image.
struct ZarrLevel {
    std::string key;
    std::vector<double> scale, move;  // one an axis
};

/// An image: its axes, slowest first, and its resolutions, finest first.
struct ZarrImage {
    struct Named {
        Axis::Kind kind;
        std::string unit;
    };
    std::vector<Named> axes;
    std::vector<ZarrLevel> levels;
};

/// An array alone: axes that nobody names, one resolution.
/// @throws InputError  more axes than are known
ZarrImage zarr_image_of_array(const ZarrStore&, const std::string& key, std::size_t axes);
/// What the field `multiscales` of a group says.
/// @throws InputError  the field that is wrong or not supported
ZarrImage zarr_image_of(const ZarrStore&, const std::string& key,
                        const nlohmann::json& multiscales);

/// Extent of an array along x, y and z.
Extent extent_of(const std::vector<ZarrImage::Named>& axes, const std::vector<std::int64_t>& shape);
/// Spacing and origin, in millimetres where the file has a unit. An axis without a known one takes
/// that of the others, with a warning.
void take_lengths(Header& header, const ZarrImage& image, const ZarrLevel& level);

}  // namespace edgewise::store
