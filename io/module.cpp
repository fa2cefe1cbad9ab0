#include "io/module.hpp"

#include <array>
#include <cstdio>
#include <dlfcn.h>
#include <exception>
#include <filesystem>
#include <fmt/format.h>
#include <mutex>

#include "graph/errors.hpp"
#include "io/apart.hpp"
#include "io/reader.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

struct Opened {
    ModuleInspect inspect = nullptr;
    ModuleRead read = nullptr;
    ModuleWrite write = nullptr;
    ModuleDecode decode = nullptr;
    std::string why;  // it is not there

    bool there() const { return (inspect && read) || decode; }
};

const char* name_of(Library library) {
    switch (library) {
        case Library::itk:
            return "libedgewise_itk.so";
        case Library::oiio:
            return "libedgewise_oiio.so";
        default:
            return "libedgewise_dicom.so";
    }
}

/// Beside the executable, in ../lib of it, and where it was built or installed.
std::vector<std::string> places(Library library) {
    std::error_code error;
    const auto here = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
    std::vector<std::string> found;
    for (const auto& folder : {here, here / "../lib", here / "../lib/edgewise"})
        found.push_back((folder / name_of(library)).string());
#ifdef EDGEWISE_MODULE_FOLDERS
    for (std::string_view folder : split(EDGEWISE_MODULE_FOLDERS, ':'))
        found.push_back(std::string(folder) + "/" + name_of(library));
#endif
    return found;
}

Opened open(Library library) {
    Opened opened;
    for (const std::string& path : places(library)) {
        if (!std::filesystem::exists(path)) continue;
        void* handle = ::dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
        if (!handle) {
            opened.why = ::dlerror();
            continue;
        }
        opened.inspect = reinterpret_cast<ModuleInspect>(::dlsym(handle, kInspectName));
        opened.read = reinterpret_cast<ModuleRead>(::dlsym(handle, kReadName));
        opened.write = reinterpret_cast<ModuleWrite>(::dlsym(handle, kWriteName));
        opened.decode = reinterpret_cast<ModuleDecode>(::dlsym(handle, kDecodeName));
        if (opened.there()) return opened;
    }
    if (opened.why.empty()) opened.why = fmt::format("{} is not installed", name_of(library));
    return opened;
}

const Opened& opened(Library library, const std::string& path) {
    static std::array<Opened, 3> libraries;
    static std::mutex mutex;
    const std::lock_guard lock(mutex);
    Opened& found = libraries[static_cast<std::size_t>(library)];
    if (!found.there()) found = open(library);
    if (!found.there()) refuse(path, "needs a library that cannot be opened: " + found.why);
    return found;
}

/// Libraries name their objects by address, which differs from run to run.
std::string without_addresses(std::string text) {
    for (std::size_t at = text.find("(0x"); at != text.npos; at = text.find("(0x", at)) {
        const std::size_t end = text.find_first_not_of("0123456789abcdefABCDEF", at + 3);
        if (end == text.npos || text[end] != ')')
            ++at;
        else
            text.erase(at, end + 1 - at);
    }
    return text;
}

/// What OpenImageIO may use: decoders of JPEG 2000 hold each sample of 8 bits as two of 32, with
/// what they decode from. OpenVDB says its size last of all.
Allowance allowance_of(const std::string& path, const ModuleImage& image, std::int64_t bytes) {
    constexpr std::size_t kAlways = 256u << 20, kCopies = 12;
    constexpr std::size_t kBytesEachSecond = 1 << 20;  // a tenth of the slowest decoder's rate
    const auto samples = static_cast<std::size_t>(bytes);
    const std::size_t there = File(path).size();
    Allowance allowance;
    allowance.seconds += static_cast<unsigned>((samples + there) / kBytesEachSecond);
    if (std::string_view(image.format) != "openvdb")
        allowance.memory = kAlways + kCopies * samples + 2 * there;
    return allowance;
}

ModuleImage call_apart(const std::string& path, const ModuleImage& image, std::span<std::byte> into,
                       std::int64_t bytes,
                       const std::function<bool(ModuleImage&, void*, char*)>& call) {
    const Apart answer = apart(image, into, allowance_of(path, image, bytes), call);
    if (!answer.whole) refuse(path, "its data are damaged: they end the library that reads them");
    if (!answer.done) refuse(path, shown(without_addresses(answer.error)));
    return answer.image;
}

class ModuleReader : public Reader {
 public:
    ModuleReader(Library library, std::string path, const ModuleImage& image)
        : library_(library), path_(std::move(path)), image_(image) {}
    void read(const Header& header, const Selection& pick, std::span<std::byte> into,
              std::vector<Message>& warnings) const override {
        const Type type = module_type(image_);
        const auto count = header.extent.samples() * image_.channels;
        if (loaded_type(type, pick.as_stored) == type &&
            into.size() == static_cast<std::size_t>(count) * edgewise::bytes_of(type))
            return module_read(library_, path_, image_, into);
        // One channel of several, or another type: through a copy.
        Bytes all(static_cast<std::size_t>(count) * edgewise::bytes_of(type));
        module_read(library_, path_, image_, all);
        Stored stored;
        stored.type = type;
        stored.axes = {{Axis::channel, image_.channels},
                       {Axis::x, header.extent.x},
                       {Axis::y, header.extent.y},
                       {Axis::z, header.extent.z}};
        MemoryStream stream(all);
        scatter(stored, pick, stream, path_, into, warnings);
    }

    std::optional<std::vector<std::string>> files() const override {
        // ITK may open files that it names by itself.
        if (library_ == Library::itk) return std::nullopt;
        return std::vector<std::string>{};
    }

 private:
    Library library_;
    std::string path_;
    ModuleImage image_;
};

}  // namespace

Header inspect_by(Library library, const std::string& path, const char* format,
                  std::int64_t claimed) {
    const ModuleImage image = module_inspect(library, path, format, claimed);
    Header header;
    header.file = path;
    header.format = image.format;
    header.volume = image.axes == 3;
    header.channels = image.channels;
    header.colour = !header.volume && (image.channels == 3 || image.channels == 4);
    header.type = static_cast<Type>(image.type);
    header.alpha = static_cast<Alpha>(image.alpha);
    std::int64_t bytes = static_cast<std::int64_t>(edgewise::bytes_of(module_type(image)));
    bytes = product(path, bytes, image.channels);
    for (int axis = 0; axis < 3; ++axis) {
        if (image.size[axis] < 1)
            refuse(path, fmt::format("size of axis {} is {}", axis, image.size[axis]));
        bytes = product(path, bytes, image.size[axis]);
        header.extent[axis] = image.size[axis];
        header.spacing[axis] = image.spacing[axis];
        header.origin[axis] = image.origin[axis];
        for (int row = 0; row < 3; ++row)
            header.direction[axis][row] = image.direction[3 * axis + row];
    }
    check_density(path, bytes, File(path).size(), kDensest);
    if (!image.window)
        header.warnings.push_back(
            path + ": the picture differs from its display window, which is ignored");
    if (image.several)
        header.warnings.push_back(path + ": holds several pictures, of which the first is read");
    // Both libraries hold a second copy while they decode.
    header.reading_bytes = bytes_of(library) + 2 * static_cast<std::size_t>(bytes);
    header.reader = std::make_shared<const ModuleReader>(library, path, image);
    return header;
}

std::size_t bytes_of(Library library) noexcept {
    // Measured, x86-64, Debian 12.
    return (library == Library::itk ? 24u : library == Library::oiio ? 136u : 8u) << 20;
}

ModuleImage module_inspect(Library library, const std::string& path, const char* format,
                           std::int64_t claimed) {
    ModuleImage image;
    std::snprintf(image.format, sizeof image.format, "%s", format);
    const ModuleInspect inspect = opened(library, path).inspect;
    if (library == Library::oiio)
        return call_apart(path, image, {}, claimed, [&](ModuleImage& found, void*, char* error) {
            return inspect(path.c_str(), &found, error);
        });
    char error[kModuleError] = "";
    if (!inspect(path.c_str(), &image, error)) refuse(path, shown(without_addresses(error)));
    return image;
}

void module_read(Library library, const std::string& path, const ModuleImage& image,
                 std::span<std::byte> into) {
    const ModuleRead read = opened(library, path).read;
    if (library == Library::oiio) {
        call_apart(path, image, into, static_cast<std::int64_t>(into.size()),
                   [&](const ModuleImage& found, void* samples, char* error) {
                       return read(path.c_str(), &found, samples, into.size(), error);
                   });
        return;
    }
    char error[kModuleError] = "";
    if (!read(path.c_str(), &image, into.data(), into.size(), error))
        refuse(path, shown(without_addresses(error)));
}

void module_write(Library library, Replacement& out, const ModuleImage& image,
                  std::span<const std::byte> samples, int quality) {
    struct Target {
        Replacement& out;
        std::exception_ptr failure;  // it must not pass through the library
    } target{out, nullptr};
    ModuleSink sink;
    sink.self = &target;
    sink.put = [](void* self, std::uint64_t at, const void* bytes, std::size_t count) {
        Target& to = *static_cast<Target*>(self);
        try {
            to.out.seek(at);
            to.out.write({static_cast<const std::byte*>(bytes), count});
        } catch (...) {
            to.failure = std::current_exception();
        }
        return !to.failure;
    };
    const Opened* module = nullptr;
    try {
        module = &opened(library, out.path());
    } catch (const InputError& error) {
        throw RunError(error.message());
    }
    char error[kModuleError] = "";
    const bool done = module->write &&
                      module->write(&image, samples.data(), samples.size(), quality, &sink, error);
    if (target.failure) std::rethrow_exception(target.failure);
    if (!done) throw RunError(out.path() + ": " + shown(without_addresses(error)));
}

void module_decode(Library library, const std::string& path, ModuleFrame& frame,
                   std::span<const std::byte> data, std::span<std::byte> into) {
    char error[kModuleError] = "";
    if (!opened(library, path)
             .decode(data.data(), data.size(), &frame, into.data(), into.size(), error))
        refuse(path, std::string("its compressed pixels: ") + shown(error));
}

Header inspect_by_itk(const std::string& path) { return inspect_by(Library::itk, path, ""); }

}  // namespace edgewise::store
