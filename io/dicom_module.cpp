// The module that decodes frames of DICOM: JPEG by DCMTK, JPEG-LS by CharLS, JPEG 2000 by OpenJPEG.
// It sees no file: the reader has found the frame's bytes and compared what they say of their size.

#include <algorithm>
#include <charls/charls.h>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmjpeg/djcparam.h>
#include <dcmtk/dcmjpeg/djdijg12.h>
#include <dcmtk/dcmjpeg/djdijg16.h>
#include <dcmtk/dcmjpeg/djdijg8.h>
#include <dcmtk/oflog/oflog.h>
#include <exception>
#include <iterator>
#include <memory>
#include <new>
#include <openjpeg.h>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/module.hpp"

namespace {

using edgewise::store::kModuleError;
using edgewise::store::ModuleFrame;
using Bytes = std::span<std::byte>;
using ConstBytes = std::span<const std::byte>;

bool tell(char* error, const std::string& what) {
    std::snprintf(error, kModuleError, "%s", what.c_str());
    return false;
}

std::size_t samples_of(const ModuleFrame& frame) {
    return static_cast<std::size_t>(frame.columns) * static_cast<std::size_t>(frame.rows) *
           static_cast<std::size_t>(frame.samples);
}
std::size_t width_of(const ModuleFrame& frame) {
    return static_cast<std::size_t>(frame.allocated) / 8;
}

/// Decoders give as many bytes a sample as its bits need; the file may give it more.
void widen(ConstBytes from, std::size_t width, const ModuleFrame& frame, Bytes into) {
    const std::size_t room = width_of(frame);
    std::fill(into.begin(), into.end(), std::byte{0});
    for (std::size_t i = 0; i < samples_of(frame); ++i)
        std::memcpy(into.data() + i * room, from.data() + i * width, std::min(width, room));
}

bool decode_jpeg(ConstBytes data, const ModuleFrame& frame, Bytes into, char* error) {
    OFLog::configure(OFLogger::OFF_LOG_LEVEL);
    // Colour is left as it is in the stream: what it means is said elsewhere.
    const DJCodecParameter parameters(ECC_lossyYCbCr, EDC_never, EUC_never, EPC_default);
    std::unique_ptr<DJDecoder> decoder;
    if (frame.bits <= 8)
        decoder = std::make_unique<DJDecompressIJG8Bit>(parameters, OFFalse);
    else if (frame.bits <= 12)
        decoder = std::make_unique<DJDecompressIJG12Bit>(parameters, OFFalse);
    else
        decoder = std::make_unique<DJDecompressIJG16Bit>(parameters, OFFalse);
    const std::size_t width = frame.bits <= 8 ? 1 : 2;
    std::vector<std::byte> packed(data.begin(), data.end()), out(samples_of(frame) * width);
    OFCondition done = decoder->init();
    if (done.good())
        done = decoder->decode(
            reinterpret_cast<Uint8*>(packed.data()), static_cast<Uint32>(packed.size()),
            reinterpret_cast<Uint8*>(out.data()), static_cast<Uint32>(out.size()), OFFalse);
    if (done.bad()) return tell(error, done.text());
    widen(out, width, frame, into);
    return true;
}

bool decode_jpeg_ls(ConstBytes data, ModuleFrame& frame, Bytes into, char* error) {
    const std::unique_ptr<charls_jpegls_decoder, void (*)(const charls_jpegls_decoder*)> decoder(
        charls_jpegls_decoder_create(), charls_jpegls_decoder_destroy);
    if (!decoder) throw std::bad_alloc();
    const std::size_t width = frame.bits <= 8 ? 1 : 2;
    std::vector<std::byte> out(samples_of(frame) * width);
    charls_interleave_mode mode = charls::interleave_mode::none;
    std::size_t size = 0;
    charls_jpegls_errc done =
        charls_jpegls_decoder_set_source_buffer(decoder.get(), data.data(), data.size());
    const auto next = [&](auto call) {
        if (done == charls::jpegls_errc::success) done = call();
    };
    next([&] { return charls_jpegls_decoder_read_header(decoder.get()); });
    next([&] { return charls_jpegls_decoder_get_interleave_mode(decoder.get(), &mode); });
    next([&] { return charls_jpegls_decoder_get_destination_size(decoder.get(), 0, &size); });
    if (done == charls::jpegls_errc::success && size != out.size())
        return tell(error, "their header is repeated with another size");
    next([&] {
        return charls_jpegls_decoder_decode_to_buffer(decoder.get(), out.data(), out.size(), 0);
    });
    if (done != charls::jpegls_errc::success) return tell(error, charls_get_error_message(done));
    frame.planar = mode == charls::interleave_mode::none;
    widen(out, width, frame, into);
    return true;
}

/// Bytes in memory, as OpenJPEG reads them.
struct Source {
    ConstBytes data;
    std::size_t at = 0;
};
OPJ_SIZE_T read_some(void* into, OPJ_SIZE_T count, void* user) {
    Source& source = *static_cast<Source*>(user);
    const std::size_t got = std::min<std::size_t>(count, source.data.size() - source.at);
    if (got == 0) return static_cast<OPJ_SIZE_T>(-1);
    std::memcpy(into, source.data.data() + source.at, got);
    source.at += got;
    return got;
}
OPJ_OFF_T skip_some(OPJ_OFF_T count, void* user) {
    Source& source = *static_cast<Source*>(user);
    if (count < 0 || static_cast<std::size_t>(count) > source.data.size() - source.at) return -1;
    source.at += static_cast<std::size_t>(count);
    return count;
}
OPJ_BOOL seek_to(OPJ_OFF_T place, void* user) {
    Source& source = *static_cast<Source*>(user);
    if (place < 0 || static_cast<std::size_t>(place) > source.data.size()) return OPJ_FALSE;
    source.at = static_cast<std::size_t>(place);
    return OPJ_TRUE;
}
void keep_message(const char* message, void* user) {
    std::string& kept = *static_cast<std::string*>(user);
    if (kept.empty()) kept = message;
    while (!kept.empty() && kept.back() == '\n') kept.pop_back();
}

bool decode_jpeg_2000(ConstBytes data, const ModuleFrame& frame, Bytes into, char* error) {
    // Some writers leave the boxes of a file around the codestream.
    constexpr std::byte kStart[] = {std::byte{0xff}, std::byte{0x4f}, std::byte{0xff},
                                    std::byte{0x51}};
    const auto start = std::search(data.begin(), data.end(), std::begin(kStart), std::end(kStart));
    Source source{data.subspan(static_cast<std::size_t>(start - data.begin()))};
    std::string message;
    const std::unique_ptr<opj_codec_t, void (*)(opj_codec_t*)> codec(
        opj_create_decompress(OPJ_CODEC_J2K), opj_destroy_codec);
    const std::unique_ptr<opj_stream_t, void (*)(opj_stream_t*)> stream(
        opj_stream_default_create(OPJ_TRUE), opj_stream_destroy);
    if (!codec || !stream) throw std::bad_alloc();
    opj_set_error_handler(codec.get(), keep_message, &message);
    opj_stream_set_user_data(stream.get(), &source, nullptr);
    opj_stream_set_user_data_length(stream.get(), source.data.size());
    opj_stream_set_read_function(stream.get(), read_some);
    opj_stream_set_skip_function(stream.get(), skip_some);
    opj_stream_set_seek_function(stream.get(), seek_to);
    opj_dparameters_t parameters;
    opj_set_default_decoder_parameters(&parameters);
    opj_image_t* found = nullptr;
    const bool begun = opj_setup_decoder(codec.get(), &parameters) &&
                       opj_read_header(stream.get(), codec.get(), &found);
    const std::unique_ptr<opj_image_t, void (*)(opj_image_t*)> image(found, opj_image_destroy);
    const auto failed = [&](const char* what) {
        return tell(error, message.empty() ? what : message);
    };
    if (!begun || !image) return failed("their header cannot be read");
    if (image->numcomps != static_cast<OPJ_UINT32>(frame.samples))
        return failed("other components than samples");
    if (!opj_decode(codec.get(), stream.get(), image.get())) return failed("cannot be decoded");
    const auto pixels = samples_of(frame) / static_cast<std::size_t>(frame.samples);
    const std::size_t room = width_of(frame), samples = image->numcomps;
    for (std::size_t c = 0; c < samples; ++c) {
        const opj_image_comp_t& component = image->comps[c];
        if (!component.data || component.w != static_cast<OPJ_UINT32>(frame.columns) ||
            component.h != static_cast<OPJ_UINT32>(frame.rows))
            return failed("components of another size");
        for (std::size_t i = 0; i < pixels; ++i)
            std::memcpy(into.data() + (i * samples + c) * room, component.data + i, room);
    }
    return true;
}

bool decode(ConstBytes data, ModuleFrame& frame, Bytes into, char* error) {
    if (into.size() != samples_of(frame) * width_of(frame) || data.size() > 0xffffffff)
        return tell(error, "more than 4 GiB");
    frame.planar = 0;
    const std::string_view kind = frame.kind;
    if (kind == "JPEG 2000") return decode_jpeg_2000(data, frame, into, error);
    if (frame.bits > 16) return tell(error, "more than 16 bits a sample");
    if (kind == "JPEG-LS") return decode_jpeg_ls(data, frame, into, error);
    return decode_jpeg(data, frame, into, error);
}

/// Exceptions must not cross into a program that was built without these libraries.
template <class F>
bool guarded(char* error, F call) noexcept {
    try {
        return call();
    } catch (const std::bad_alloc&) {
        tell(error, "out of memory");
    } catch (const std::exception& failure) {
        tell(error, failure.what());
    } catch (...) {
        tell(error, "unknown error");
    }
    return false;
}

}  // namespace

extern "C" __attribute__((visibility("default"))) bool edgewise_decode(
    const void* data, std::size_t size, ModuleFrame* frame, void* into, std::size_t bytes,
    char* error) {
    return guarded(error, [&] {
        return decode({static_cast<const std::byte*>(data), size}, *frame,
                      {static_cast<std::byte*>(into), bytes}, error);
    });
}
