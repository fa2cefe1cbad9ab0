// The module that decodes frames of DICOM by GDCM: JPEG, JPEG-LS and JPEG 2000. It sees no file:
// the reader has found the frame's bytes and compared what they say of their size.

#include <cstdio>
#include <cstring>
#include <exception>
#include <gdcmDataElement.h>
#include <gdcmFragment.h>
#include <gdcmJPEG2000Codec.h>
#include <gdcmJPEGCodec.h>
#include <gdcmJPEGLSCodec.h>
#include <gdcmSequenceOfFragments.h>
#include <gdcmTrace.h>
#include <new>
#include <string>
#include <string_view>

#include "transitions/store/module.hpp"

namespace {

using edgewise::store::kModuleError;
using edgewise::store::ModuleFrame;

bool tell(char* error, const std::string& what) {
    std::snprintf(error, kModuleError, "%s", what.c_str());
    return false;
}

gdcm::PixelFormat format_of(const ModuleFrame& frame) {
    const auto word = [](int value) { return static_cast<unsigned short>(value); };
    return gdcm::PixelFormat(word(frame.samples), word(frame.allocated), word(frame.stored),
                             word(frame.high), word(frame.is_signed));
}

/// Samples of one byte where two are expected: writers may give JPEG of 8 bits more room.
void widen(const char* from, std::size_t count, std::size_t width, char* into) {
    std::memset(into, 0, count * width);
    for (std::size_t i = 0; i < count; ++i) into[i * width] = from[i];
}

template <class Codec>
bool decode_by(Codec codec, const void* data, std::size_t size, ModuleFrame& frame, char* into,
               std::size_t bytes, char* error) {
    const unsigned sizes[] = {static_cast<unsigned>(frame.columns),
                              static_cast<unsigned>(frame.rows), 1};
    const auto meaning = gdcm::PhotometricInterpretation::GetPIType(frame.photometric);
    codec.SetNumberOfDimensions(2);
    codec.SetDimensions(sizes);
    codec.SetPixelFormat(format_of(frame));
    codec.SetPhotometricInterpretation(gdcm::PhotometricInterpretation(meaning));
    codec.SetPlanarConfiguration(0);
    codec.SetNeedOverlayCleanup(false);

    gdcm::Fragment fragment;
    fragment.SetByteValue(static_cast<const char*>(data), static_cast<std::uint32_t>(size));
    auto fragments = gdcm::SequenceOfFragments::New();
    fragments->AddFragment(fragment);
    gdcm::DataElement packed(gdcm::Tag(0x7fe0, 0x0010)), out;
    packed.SetVR(gdcm::VR::OB);
    packed.SetValue(*fragments);
    if (!codec.Decode(packed, out) || !out.GetByteValue()) return tell(error, "cannot be decoded");

    const gdcm::ByteValue& got = *out.GetByteValue();
    const std::size_t samples = static_cast<std::size_t>(frame.columns) *
                                static_cast<std::size_t>(frame.rows) *
                                static_cast<std::size_t>(frame.samples);
    const std::size_t width = static_cast<std::size_t>(frame.allocated) / 8;
    // A byte may be added to make their number even.
    if (got.GetLength() >= bytes && got.GetLength() <= bytes + 1)
        std::memcpy(into, got.GetPointer(), bytes);
    else if (got.GetLength() >= samples && got.GetLength() <= samples + 1)
        widen(got.GetPointer(), samples, width, into);
    else
        return tell(error, "decode to " + std::to_string(got.GetLength()) + " bytes, expected " +
                               std::to_string(bytes));
    frame.planar = static_cast<int>(codec.GetPlanarConfiguration());
    frame.rgb = codec.GetPhotometricInterpretation() == gdcm::PhotometricInterpretation::RGB;
    return true;
}

bool decode(const void* data, std::size_t size, ModuleFrame& frame, void* into, std::size_t bytes,
            char* error) {
    gdcm::Trace::WarningOff();
    gdcm::Trace::ErrorOff();
    gdcm::Trace::DebugOff();
    const std::string_view syntax = frame.syntax;
    constexpr std::string_view kJpegs = "1.2.840.10008.1.2.4.";
    if (size > 0xffffffff || !syntax.starts_with(kJpegs)) return tell(error, "unknown syntax");
    const std::string_view number = syntax.substr(kJpegs.size());
    char* const to = static_cast<char*>(into);
    if (number.starts_with('9'))
        return decode_by(gdcm::JPEG2000Codec(), data, size, frame, to, bytes, error);
    if (number.starts_with('8'))
        return decode_by(gdcm::JPEGLSCodec(), data, size, frame, to, bytes, error);
    return decode_by(gdcm::JPEGCodec(), data, size, frame, to, bytes, error);
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

extern "C" __attribute__((visibility("default"))) bool edgewise_decode(
    const void* data, std::size_t size, ModuleFrame* frame, void* into, std::size_t bytes,
    char* error) {
    return guarded(error, [&] { return decode(data, size, *frame, into, bytes, error); });
}
