// The module that reads and writes by OpenImageIO: EXR, OpenVDB, and pictures of rare kinds.

#include "io/oiio_module.hpp"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <mutex>
#include <utility>
#include <vector>

namespace edgewise::store {

void tell(char* error, const std::string& what) {
    std::snprintf(error, kModuleError, "%s", what.c_str());
}

}  // namespace edgewise::store

namespace {

using edgewise::Type;
using edgewise::store::Alpha;
using edgewise::store::kDensest;
using edgewise::store::ModuleImage;
using edgewise::store::ModuleSink;
using edgewise::store::tell;

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
        case OIIO::TypeDesc::HALF:
            return Type::f16;
        default:
            return Type::f32;
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
        case Type::f16:
            return OIIO::TypeDesc::HALF;
        default:
            return OIIO::TypeDesc::FLOAT;
    }
}

/// OpenImageIO's settings are the process's. While one of these lives they are ours; afterwards
/// they are what the program had. One at a time.
class Settings {
 public:
    /// @param most  size of a picture that is believed [MB]; 0: as it is
    explicit Settings(int most = 0) : lock_(mutex()) {
        // "threads" stays as it is: to change it starts or ends threads, which a process that was
        // forked does not have. Each reader and writer is told by itself.
        set("exr_threads", -1);
        if (most > 0) set("limits:imagesize_MB", most);
    }
    ~Settings() {
        for (const auto& [name, value] : before_) OIIO::attribute(name, value);
    }
    Settings(const Settings&) = delete;
    Settings& operator=(const Settings&) = delete;

 private:
    static std::mutex& mutex() {
        static std::mutex one;
        return one;
    }
    void set(const char* name, int value) {
        int before = 0;
        if (OIIO::getattribute(name, before)) before_.emplace_back(name, before);
        OIIO::attribute(name, value);
    }

    std::lock_guard<std::mutex> lock_;
    std::vector<std::pair<const char*, int>> before_;
};

/// Values as stored: colour stays unmultiplied where the file has it so, and threads stay few.
std::unique_ptr<OIIO::ImageInput> open(const char* path, const std::string& format, char* error) {
    constexpr std::uint64_t kBelieved = 64;  // [MB], as check_density does
    const std::uint64_t megabytes = std::filesystem::file_size(path) / (1 << 20) + 1;
    const Settings settings(
        static_cast<int>(std::clamp<std::uint64_t>(megabytes * kDensest, kBelieved, INT32_MAX)));
    OIIO::ImageSpec wish, spec;
    wish["oiio:UnassociatedAlpha"] = 1;
    auto input = OIIO::ImageInput::create(format);
    if (!input) {
        tell(error, OIIO::geterror());
        return nullptr;
    }
    input->threads(1);
    if (input->open(path, spec, wish)) return input;
    const std::string why = input->geterror();
    tell(error, why.empty() ? "not " + format + ", or damaged" : why);
    return nullptr;
}

Alpha alpha_of(const OIIO::ImageSpec& spec, const std::string& format) {
    // Grey with alpha: only its count says so.
    const bool counted = spec.nchannels == 2 && (format == "sgi" || format == "targa");
    if (!counted && (spec.alpha_channel < 0 || spec.alpha_channel < spec.nchannels - 1))
        return Alpha::none;
    // They hold straight alpha, which OpenImageIO does not say.
    for (const char* straight : {"bmp", "sgi", "gif", "ico", "webp", "jpeg2000"})
        if (format == straight) return Alpha::straight;
    return counted || spec.get_int_attribute("oiio:UnassociatedAlpha", 0) != 0
               ? Alpha::straight
               : Alpha::premultiplied;
}

/// What of the picture is given out: of OpenVDB the box of the active voxels, around which
/// OpenImageIO puts what fills its tiles; of all others everything.
struct Window {
    int begin[3], size[3];
};
Window window_of(const OIIO::ImageSpec& spec, const std::string& format) {
    const int depth = std::max(spec.depth, 1);
    const Window whole{{0, 0, 0}, {spec.width, spec.height, depth}};
    if (format != "openvdb") return whole;
    const Window active{{spec.full_x - spec.x, spec.full_y - spec.y, spec.full_z - spec.z},
                        {spec.full_width, spec.full_height, spec.full_depth}};
    for (int axis = 0; axis < 3; ++axis)
        if (active.begin[axis] < 0 || active.size[axis] < 1 ||
            active.size[axis] > whole.size[axis] - active.begin[axis])
            return whole;
    return active;
}

/// Where the samples of OpenVDB lie: its map from index to world, of row vectors. Maps that are not
/// linear are not there.
void place(const OIIO::ImageSpec& spec, const Window& window, ModuleImage& found) {
    const auto* map = spec.find_attribute(
        "openvdb:indextoworld", OIIO::TypeDesc(OIIO::TypeDesc::DOUBLE, OIIO::TypeDesc::MATRIX44));
    if (!map) return;
    const auto* entries = static_cast<const double*>(map->data());
    const int first[3] = {spec.x + window.begin[0], spec.y + window.begin[1],
                          spec.z + window.begin[2]};
    double spacing[3];
    for (int axis = 0; axis < 3; ++axis) {
        const double* step = entries + 4 * axis;
        spacing[axis] = std::sqrt(step[0] * step[0] + step[1] * step[1] + step[2] * step[2]);
        if (!(std::isfinite(spacing[axis]) && spacing[axis] > 0)) return;
    }
    for (int row = 0; row < 3; ++row) {
        found.origin[row] = entries[12 + row];
        for (int axis = 0; axis < 3; ++axis) {
            found.origin[row] += entries[4 * axis + row] * first[axis];
            found.direction[3 * axis + row] = entries[4 * axis + row] / spacing[axis];
        }
    }
    std::copy_n(spacing, 3, found.spacing);
}

/// The samples of a window out of all of them.
bool read_window(OIIO::ImageInput& input, const Window& window, OIIO::TypeDesc type,
                 std::byte* into) {
    const OIIO::ImageSpec& spec = input.spec();
    const std::size_t pixel = static_cast<std::size_t>(spec.nchannels) * type.size();
    const auto width = static_cast<std::size_t>(spec.width),
               height = static_cast<std::size_t>(spec.height);
    std::vector<std::byte> all(static_cast<std::size_t>(spec.image_pixels()) * pixel);
    if (!input.read_image(0, 0, 0, spec.nchannels, type, all.data())) return false;
    const std::size_t row = static_cast<std::size_t>(window.size[0]) * pixel;
    for (int z = 0; z < window.size[2]; ++z)
        for (int y = 0; y < window.size[1]; ++y, into += row) {
            const auto at = (static_cast<std::size_t>(z + window.begin[2]) * height +
                             static_cast<std::size_t>(y + window.begin[1])) *
                                width +
                            static_cast<std::size_t>(window.begin[0]);
            std::memcpy(into, all.data() + at * pixel, row);
        }
    return true;
}

bool inspect(const char* path, ModuleImage* found, char* error) {
    const std::string format = found->format;
    if (format == "webp") {
        const bool one = edgewise::store::inspect_webp(path, *found, error);
        if (one || *error) return one;
        std::snprintf(found->format, sizeof found->format, "animated webp");
    }
    const auto input = open(path, format, error);
    if (!input) return false;
    const OIIO::ImageSpec& spec = input->spec();
    if (spec.deep) {
        tell(error, "deep pictures are not supported");
        return false;
    }
    const Window window = window_of(spec, format);
    std::copy_n(window.size, 3, found->size);
    place(spec, window, *found);
    found->axes = spec.depth > 1 ? 3 : 2;
    found->channels = spec.nchannels;
    found->type = static_cast<int>(type_of(spec));
    found->alpha = static_cast<int>(alpha_of(spec, format));
    found->window =
        format != "openexr" || (spec.x == spec.full_x && spec.y == spec.full_y &&
                                spec.width == spec.full_width && spec.height == spec.full_height);
    // The other pictures of a PSD are layers, of which the first is made.
    found->several = format != "psd" && input->seek_subimage(1, 0);
    return true;
}

bool read(const char* path, const ModuleImage* image, void* into, std::size_t bytes, char* error) {
    const std::string format = image->format;
    if (format == "webp") return edgewise::store::read_webp(path, *image, into, bytes, error);
    const auto input = open(path, format == "animated webp" ? "webp" : format, error);
    if (!input) return false;
    const OIIO::ImageSpec& spec = input->spec();
    const OIIO::TypeDesc type = description_of(module_type(*image));
    const Window window = window_of(spec, format);
    const auto expected = static_cast<std::size_t>(window.size[0]) *
                          static_cast<std::size_t>(window.size[1]) *
                          static_cast<std::size_t>(window.size[2]) *
                          static_cast<std::size_t>(spec.nchannels) * type.size();
    if (!std::equal(window.size, window.size + 3, image->size) ||
        spec.nchannels != image->channels || bytes != expected) {
        tell(error, "its size is not what its header said");
        return false;
    }
    const bool whole = window.size[0] == spec.width && window.size[1] == spec.height &&
                       window.size[2] == std::max(spec.depth, 1);
    if (whole ? input->read_image(0, 0, 0, spec.nchannels, type, into)
              : read_window(*input, window, type, static_cast<std::byte*>(into)))
        return true;
    tell(error, input->geterror());
    return false;
}

// Writing
// ------------------------------------------------------------------------------------------

/// Hands on what a writer makes, at the place where it belongs.
class Proxy : public OIIO::Filesystem::IOProxy {
 public:
    explicit Proxy(const ModuleSink& sink) : IOProxy("picture", Write), sink_(sink) {}
    const char* proxytype() const override { return "edgewise"; }
    std::size_t write(const void* bytes, std::size_t count) override {
        const std::size_t done = pwrite(bytes, count, m_pos);
        m_pos += static_cast<std::int64_t>(done);
        return done;
    }
    std::size_t pwrite(const void* bytes, std::size_t count, std::int64_t at) override {
        if (failed_ || !sink_.put(sink_.self, static_cast<std::uint64_t>(at), bytes, count)) {
            failed_ = true;
            return 0;
        }
        size_ = std::max(size_, static_cast<std::size_t>(at) + count);
        return count;
    }
    std::size_t size() const override { return size_; }
    bool failed() const { return failed_; }

 private:
    const ModuleSink& sink_;
    std::size_t size_ = 0;
    bool failed_ = false;
};

OIIO::ImageSpec description_of(const ModuleImage& image) {
    OIIO::ImageSpec spec(static_cast<int>(image.size[0]), static_cast<int>(image.size[1]),
                         image.channels, description_of(static_cast<Type>(image.type)));
    if (image.channels < 3) spec.channelnames = {"Y", "A"};
    spec.channelnames.resize(static_cast<std::size_t>(image.channels));
    spec.alpha_channel = image.channels % 2 == 0 ? image.channels - 1 : -1;
    if (image.alpha == static_cast<int>(Alpha::straight)) spec["oiio:UnassociatedAlpha"] = 1;
    // Equal pictures give equal files: no writer puts the time in.
    spec["DateTime"] = "1970:01:01 00:00:00";
    return spec;
}

bool write(const ModuleImage& image, const void* samples, int quality, const ModuleSink& sink,
           char* error) {
    const std::string format = image.format;
    if (format == "webp") return edgewise::store::write_webp(image, samples, quality, sink, error);
    if (format == "jpeg2000" || format == "j2k")
        return edgewise::store::write_jpeg2000(image, samples, quality, sink, error);
    const Settings settings;
    const auto output = OIIO::ImageOutput::create(format);
    if (!output) {
        tell(error, OIIO::geterror());
        return false;
    }
    output->threads(1);
    OIIO::ImageSpec spec = description_of(image);
    Proxy proxy(sink);
    OIIO::Filesystem::IOProxy* const to = &proxy;
    spec.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &to);
    const bool done = output->supports("ioproxy") && output->open("picture", spec) &&
                      output->write_image(spec.format, samples);
    const bool closed = output->close();
    // Some writers fail without saying so in what they return.
    const bool failed = !done || !closed || output->has_error() || proxy.failed();
    if (failed) tell(error, output->geterror());
    return !failed;
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
extern "C" __attribute__((visibility("default"))) bool edgewise_write(
    const ModuleImage* image, const void* samples, std::size_t bytes, int quality,
    const ModuleSink* sink, char* error) {
    return guarded(error, [&] {
        const auto expected = static_cast<std::size_t>(image->size[0] * image->size[1]) *
                              static_cast<std::size_t>(image->channels) *
                              description_of(static_cast<Type>(image->type)).size();
        if (bytes == expected) return write(*image, samples, quality, *sink, error);
        tell(error, "samples do not fill the picture");
        return false;
    });
}
