// JPEG 2000 by its own library: OpenImageIO's writer always asks for six resolutions, which small
// pictures do not have, and takes the kind of file from its name.

#include <algorithm>
#include <bit>
#include <memory>
#include <openjpeg.h>
#include <string_view>

#include "io/oiio_module.hpp"

namespace edgewise::store {
namespace {

constexpr OPJ_SIZE_T kBuffer = 1 << 20;

struct Target {
    const ModuleSink& sink;
    std::uint64_t at = 0;
};

OPJ_SIZE_T put(void* bytes, OPJ_SIZE_T count, void* target) {
    Target& to = *static_cast<Target*>(target);
    if (!to.sink.put(to.sink.self, to.at, bytes, count)) return static_cast<OPJ_SIZE_T>(-1);
    to.at += count;
    return count;
}
OPJ_OFF_T skip(OPJ_OFF_T count, void* target) {
    static_cast<Target*>(target)->at += static_cast<std::uint64_t>(count);
    return count;
}
OPJ_BOOL seek(OPJ_OFF_T to, void* target) {
    static_cast<Target*>(target)->at = static_cast<std::uint64_t>(to);
    return OPJ_TRUE;
}

opj_cparameters_t parameters_of(const ModuleImage& image, int quality) {
    opj_cparameters_t parameters;
    opj_set_default_encoder_parameters(&parameters);
    parameters.tcp_numlayers = 1;
    const auto shorter = static_cast<std::uint64_t>(std::min(image.size[0], image.size[1]));
    parameters.numresolution = std::min(6, static_cast<int>(std::bit_width(shorter)));
    parameters.tcp_mct = image.channels >= 3;
    if (quality == 0) {
        parameters.cp_disto_alloc = 1;  // a rate of 0: all bits
    } else {
        parameters.irreversible = 1;
        parameters.cp_fixed_quality = 1;
        parameters.tcp_distoratio[0] = 20 + 0.3f * static_cast<float>(quality);  // PSNR [dB]
    }
    return parameters;
}

template <class T>
void fill(opj_image_t& to, const T* samples, std::size_t pixels) {
    for (OPJ_UINT32 c = 0; c < to.numcomps; ++c)
        for (std::size_t i = 0; i < pixels; ++i) to.comps[c].data[i] = samples[i * to.numcomps + c];
}

using Picture = std::unique_ptr<opj_image_t, void (*)(opj_image_t*)>;

Picture picture_of(const ModuleImage& image, const void* samples) {
    const auto width = static_cast<OPJ_UINT32>(image.size[0]);
    const auto height = static_cast<OPJ_UINT32>(image.size[1]);
    const bool bytes = static_cast<Type>(image.type) == Type::u8;
    opj_image_cmptparm_t component{};
    component.dx = component.dy = 1;
    component.w = width;
    component.h = height;
    component.prec = bytes ? 8 : 16;
    std::vector<opj_image_cmptparm_t> components(static_cast<std::size_t>(image.channels),
                                                 component);
    Picture picture(opj_image_create(static_cast<OPJ_UINT32>(image.channels), components.data(),
                                     image.channels < 3 ? OPJ_CLRSPC_GRAY : OPJ_CLRSPC_SRGB),
                    opj_image_destroy);
    if (!picture) return picture;
    picture->x1 = width;
    picture->y1 = height;
    if (image.alpha != static_cast<int>(Alpha::none)) picture->comps[image.channels - 1].alpha = 1;
    const auto pixels = static_cast<std::size_t>(width) * height;
    if (bytes)
        fill(*picture, static_cast<const std::uint8_t*>(samples), pixels);
    else
        fill(*picture, static_cast<const std::uint16_t*>(samples), pixels);
    return picture;
}

}  // namespace

bool write_jpeg2000(const ModuleImage& image, const void* samples, int quality,
                    const ModuleSink& sink, char* error) {
    const bool stream = std::string_view(image.format) == "j2k";
    const std::unique_ptr<opj_codec_t, void (*)(opj_codec_t*)> codec(
        opj_create_compress(stream ? OPJ_CODEC_J2K : OPJ_CODEC_JP2), opj_destroy_codec);
    const std::unique_ptr<opj_stream_t, void (*)(opj_stream_t*)> out(
        opj_stream_create(kBuffer, OPJ_FALSE), opj_stream_destroy);
    const Picture picture = picture_of(image, samples);
    std::string said = "out of memory";
    if (codec && out && picture) {
        said.clear();
        opj_set_error_handler(
            codec.get(),
            [](const char* text, void* to) { static_cast<std::string*>(to)->append(text); }, &said);
        Target target{sink};
        opj_stream_set_user_data(out.get(), &target, nullptr);
        opj_stream_set_write_function(out.get(), put);
        opj_stream_set_skip_function(out.get(), skip);
        opj_stream_set_seek_function(out.get(), seek);
        opj_cparameters_t parameters = parameters_of(image, quality);
        if (opj_setup_encoder(codec.get(), &parameters, picture.get()) &&
            opj_start_compress(codec.get(), picture.get(), out.get()) &&
            opj_encode(codec.get(), out.get()) && opj_end_compress(codec.get(), out.get()))
            return true;
    }
    tell(error, "JPEG 2000 encoder: " + said);
    return false;
}

}  // namespace edgewise::store
