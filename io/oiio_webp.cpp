// WebP by its own library: OpenImageIO's writer loses colour whatever it is asked, and its reader
// composes a picture over black.

#include <fstream>
#include <iterator>
#include <vector>
#include <webp/decode.h>
#include <webp/encode.h>

#include "io/oiio_module.hpp"

namespace edgewise::store {
namespace {

constexpr int kEffort = 2;  // of 9: twice as fast as 6, for a few per cent more bytes

struct Target {
    const ModuleSink& sink;
    std::uint64_t at = 0;
};

int put(const std::uint8_t* data, std::size_t size, const WebPPicture* picture) {
    Target& to = *static_cast<Target*>(picture->custom_ptr);
    const bool done = to.sink.put(to.sink.self, to.at, data, size);
    to.at += size;
    return done;
}

struct Picture : WebPPicture {
    Picture() : WebPPicture{} {}
    Picture(const Picture&) = delete;
    Picture& operator=(const Picture&) = delete;
    ~Picture() { WebPPictureFree(this); }
};

std::vector<std::uint8_t> bytes_in(const char* path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace

bool inspect_webp(const char* path, ModuleImage& found, char* error) {
    const std::vector<std::uint8_t> bytes = bytes_in(path);
    WebPBitstreamFeatures features;
    if (WebPGetFeatures(bytes.data(), bytes.size(), &features) != VP8_STATUS_OK) {
        tell(error, "damaged WebP header");
        return false;
    }
    if (features.has_animation) return false;
    found.size[0] = features.width;
    found.size[1] = features.height;
    found.channels = features.has_alpha ? 4 : 3;
    found.type = static_cast<int>(Type::u8);
    found.alpha = static_cast<int>(features.has_alpha ? Alpha::straight : Alpha::none);
    return true;
}

bool read_webp(const char* path, const ModuleImage& image, void* into, std::size_t bytes,
               char* error) {
    const std::vector<std::uint8_t> packed = bytes_in(path);
    const auto decode = image.channels == 4 ? WebPDecodeRGBAInto : WebPDecodeRGBInto;
    const int stride = static_cast<int>(image.size[0]) * image.channels;
    if (decode(packed.data(), packed.size(), static_cast<std::uint8_t*>(into), bytes, stride))
        return true;
    tell(error, "its compressed data are damaged or end too early");
    return false;
}

bool write_webp(const ModuleImage& image, const void* samples, int quality, const ModuleSink& sink,
                char* error) {
    WebPConfig config;
    Picture picture;
    bool made = WebPPictureInit(&picture) && WebPConfigInit(&config);
    if (quality == 0)
        made = made && WebPConfigLosslessPreset(&config, kEffort);
    else
        config.quality = static_cast<float>(quality);
    config.exact = 1;  // colour stays where alpha is 0
    picture.use_argb = quality == 0;
    picture.width = static_cast<int>(image.size[0]);
    picture.height = static_cast<int>(image.size[1]);
    Target target{sink};
    picture.writer = put;
    picture.custom_ptr = &target;
    const auto* bytes = static_cast<const std::uint8_t*>(samples);
    const int stride = image.channels * picture.width;
    made = made && (image.channels == 4 ? WebPPictureImportRGBA(&picture, bytes, stride)
                                        : WebPPictureImportRGB(&picture, bytes, stride));
    if (made && WebPEncode(&config, &picture)) return true;
    tell(error, "WebP encoder: error " + std::to_string(picture.error_code));
    return false;
}

}  // namespace edgewise::store
