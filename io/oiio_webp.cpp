// WebP by its own library: OpenImageIO's writer loses colour whatever it is asked.

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

}  // namespace

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
