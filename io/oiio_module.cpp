// The module that reads by OpenImageIO: EXR, OpenVDB, and pictures of rare kinds.

#include <OpenImageIO/imageio.h>
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <exception>

#include "io/module.hpp"

namespace {

using edgewise::Type;
using edgewise::store::Alpha;
using edgewise::store::kModuleError;
using edgewise::store::ModuleImage;

void tell(char* error, const std::string& what) {
    std::snprintf(error, kModuleError, "%s", what.c_str());
}

Type type_of(const OIIO::ImageSpec& spec) {
    switch (spec.format.basetype) {
        case OIIO::TypeDesc::UINT8:
            return Type::u8;
        case OIIO::TypeDesc::INT8:
            return Type::i8;
        case OIIO::TypeDesc::UINT16:
            return Type::u16;
        case OIIO::TypeDesc::INT16:
            return Type::i16;
        case OIIO::TypeDesc::UINT32:
            return Type::u32;
        case OIIO::TypeDesc::INT32:
            return Type::i32;
        case OIIO::TypeDesc::DOUBLE:
            return Type::f64;
        default:
            return Type::f32;  // half too
    }
}

OIIO::TypeDesc description_of(Type type) {
    switch (type) {
        case Type::u8:
            return OIIO::TypeDesc::UINT8;
        case Type::i8:
            return OIIO::TypeDesc::INT8;
        case Type::u16:
            return OIIO::TypeDesc::UINT16;
        case Type::i16:
            return OIIO::TypeDesc::INT16;
        case Type::u32:
            return OIIO::TypeDesc::UINT32;
        case Type::i32:
            return OIIO::TypeDesc::INT32;
        case Type::f64:
            return OIIO::TypeDesc::DOUBLE;
        default:
            return OIIO::TypeDesc::FLOAT;
    }
}

/// Values as stored: colour stays unmultiplied where the file has it so, and threads stay few.
std::unique_ptr<OIIO::ImageInput> open(const char* path, char* error) {
    OIIO::attribute("threads", 1);
    OIIO::attribute("exr_threads", -1);
    OIIO::ImageSpec wish;
    wish["oiio:UnassociatedAlpha"] = 1;
    auto input = OIIO::ImageInput::open(path, &wish);
    if (!input) tell(error, OIIO::geterror());
    return input;
}

bool inspect(const char* path, ModuleImage* found, char* error) {
    const auto input = open(path, error);
    if (!input) return false;
    const OIIO::ImageSpec& spec = input->spec();
    if (spec.deep) {
        tell(error, "deep pictures are not supported");
        return false;
    }
    found->size[0] = spec.width;
    found->size[1] = spec.height;
    found->size[2] = std::max(spec.depth, 1);
    found->axes = spec.depth > 1 ? 3 : 2;
    found->channels = spec.nchannels;
    found->type = static_cast<int>(type_of(spec));
    const bool straight = spec.get_int_attribute("oiio:UnassociatedAlpha", 0) != 0;
    if (spec.alpha_channel >= 0 && spec.alpha_channel == spec.nchannels - 1)
        found->alpha = static_cast<int>(straight ? Alpha::straight : Alpha::premultiplied);
    std::snprintf(found->format, sizeof found->format, "%s", input->format_name());
    return true;
}

bool read(const char* path, const ModuleImage* image, void* into, std::size_t bytes, char* error) {
    const auto input = open(path, error);
    if (!input) return false;
    const OIIO::ImageSpec& spec = input->spec();
    const OIIO::TypeDesc type = description_of(static_cast<Type>(image->type));
    const auto expected = static_cast<std::size_t>(spec.image_pixels()) *
                          static_cast<std::size_t>(spec.nchannels) * type.size();
    if (spec.width != image->size[0] || spec.height != image->size[1] ||
        spec.nchannels != image->channels || bytes != expected) {
        tell(error, "its size is not what its header said");
        return false;
    }
    if (input->read_image(0, 0, 0, spec.nchannels, type, into)) return true;
    tell(error, input->geterror());
    return false;
}

/// Exceptions must not cross into a program that was built without this library.
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

extern "C" __attribute__((visibility("default"))) bool edgewise_inspect(const char* path,
                                                                        ModuleImage* found,
                                                                        char* error) {
    return guarded(error, [&] { return inspect(path, found, error); });
}
extern "C" __attribute__((visibility("default"))) bool edgewise_read(const char* path,
                                                                     const ModuleImage* image,
                                                                     void* into, std::size_t bytes,
                                                                     char* error) {
    return guarded(error, [&] { return read(path, image, into, bytes, error); });
}
