#include <algorithm>
#include <fmt/format.h>

#include "io/frames.hpp"
#include "io/geometry.hpp"
#include "io/reader.hpp"
#include "io/store.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

constexpr const char* kFilm = "MP4";  // never one picture

const std::vector<Type> kNumbers{Type::u8,  Type::i8,  Type::u16, Type::i16,
                                 Type::u32, Type::i32, Type::f32, Type::f64};

/// With several pictures in one file.
Format animated(Format format) {
    format.frames = true;
    return format;
}

std::vector<Format> table() {
    return {
        {"NIfTI",
         {".nii.gz", ".nii", ".img"},
         true,
         true,
         kNumbers,
         true,
         true,
         64,
         true,
         "1 and 2; pairs of .hdr and .img are read"},
        {"NRRD",
         {".nrrd", ".nhdr"},
         true,
         true,
         kNumbers,
         true,
         true,
         64,
         false,
         "attached and detached are read"},
        {"MetaImage",
         {".mha", ".mhd"},
         true,
         true,
         kNumbers,
         true,
         true,
         64,
         false,
         "written with its data inside"},
        {"MGH",
         {".mgz", ".mgh", ".mgh.gz"},
         true,
         true,
         {Type::u8, Type::i16, Type::i32, Type::f32},
         false,
         true,
         1,
         false,
         "FreeSurfer; its frames are time points"},
        {"DICOM",
         {".dcm"},
         true,
         false,
         {},
         true,
         true,
         3,
         true,
         "a file, or a folder with a series"},
        {"OME-Zarr",
         {".zarr", ".zarr.zip", ".ozx"},
         true,
         false,
         {},
         true,
         true,
         64,
         false,
         message("a folder or a ZIP file, of Zarr 2 or 3; @level N takes a coarser resolution")},
        {"VTK",
         {".vtk"},
         true,
         false,
         {},
         true,
         true,
         4,
         false,
         "legacy structured points: points or cells"},
        {"VTI", {".vti"}, true, false, {}, true, true, 4, false, "VTK image data in XML"},
        {"raw",
         {".json"},
         true,
         false,
         {},
         true,
         true,
         1,
         false,
         "raw:FILE:WxHxD:TYPE, or a JSON that describes it"},
        {"PNG",
         {".png"},
         true,
         true,
         {Type::u8, Type::u16},
         true,
         false,
         4,
         false,
         "a folder of them is a volume"},
        animated({"APNG",
                  {".apng"},
                  true,
                  true,
                  {Type::u8, Type::u16},
                  true,
                  false,
                  4,
                  false,
                  "several frames are an animation; the first is read"}),
        // Sides of H.264's highest level.
        animated({kFilm,
                  {".mp4"},
                  false,
                  true,
                  {Type::u8},
                  true,
                  false,
                  3,
                  false,
                  "films of several frames; the program ffmpeg makes them",
                  "",
                  {2},
                  16384}),
        {"JPEG",
         {".jpg", ".jpeg"},
         true,
         true,
         {Type::u8},
         true,
         false,
         3,
         false,
         "1 or 3 channels",
         "",
         {2},
         65500},
        {"TIFF",
         {".tif", ".tiff"},
         true,
         true,
         {Type::u8, Type::i8, Type::u16, Type::i16, Type::u32, Type::i32, Type::f16, Type::f32,
          Type::f64},
         true,
         true,
         4,
         false,
         "several pages are a volume; ImageJ and OME say channels and times"},
        {"PNM",
         {".pnm", ".ppm", ".pgm", ".pbm"},
         true,
         true,
         {Type::u8, Type::u16},
         true,
         false,
         3,
         false,
         "written binary; .pgm is grey, .ppm colour",
         "pnm",
         {2}},
        {"PFM",
         {".pfm"},
         true,
         true,
         {Type::f32},
         true,
         false,
         3,
         false,
         "1 or 3 channels",
         "pnm",
         {2}},
        {"MRC",
         {".mrc", ".rec", ".map", ".mrcs", ".ccp4"},
         true,
         false,
         {},
         true,
         true,
         3,
         false,
         "MRC2014 and CCP4 maps"},
        {"OpenVDB", {".vdb"}, true, false, {}, false, true, 4, false, "", "openvdb"},
    };
}

struct Written {
    std::vector<Type> types;
    int channels = 4;
    std::vector<int> cannot{};
    std::int64_t side = 0;
    Alpha alpha = Alpha::straight;
};

Format picture(const char* name, const char* library, std::vector<std::string> endings,
               const Written& written, const Message& note) {
    return {name,          std::move(endings),
            true,          !written.types.empty(),
            written.types, true,
            false,         written.channels,
            false,         note,
            library,       written.cannot,
            written.side,  written.alpha};
}

/// Pictures that OpenImageIO reads. Sides are what their headers hold, or their encoders.
std::vector<Format> pictures_of_the_library() {
    constexpr Type u8 = Type::u8, u16 = Type::u16, f32 = Type::f32;
    const auto multiplied = Alpha::premultiplied;
    return {
        picture("EXR", "openexr", {".exr"}, {{Type::f16, f32}, 4, {}, 0, multiplied},
                "half, float"),
        picture("WebP", "webp", {".webp"}, {{u8}, 4, {2}, 16383},
                message("keeps every value without @quality; grey becomes colour")),
        picture("JPEG 2000", "jpeg2000", {".jp2", ".j2k", ".j2c"}, {{u8, u16}, 4, {2}},
                message("keeps every value without @quality")),
        picture("Radiance HDR", "hdr", {".hdr", ".rgbe"}, {{f32}, 3, {2}},
                "8 bits of the largest channel; grey becomes colour, below 0 becomes 0"),
        picture("TGA", "targa", {".tga", ".tpic"}, {{u8}, 4, {}, 65535}, ""),
        picture("BMP", "bmp", {".bmp", ".dib"}, {{u8}, 4, {2}, 32767}, ""),
        picture("DPX", "dpx", {".dpx"}, {{u8, u16, f32}, 4, {2}, 0, multiplied}, ""),
        picture("SGI", "sgi", {".sgi", ".rgb", ".rgba", ".bw"}, {{u8, u16}, 4, {}, 65535}, ""),
        picture("RLA", "rla", {".rla"}, {}, ""),
        animated(picture("GIF", "gif", {".gif"}, {{u8}, 3, {2}, 65535},
                         "several frames are an animation; the first is read; 256 colours a "
                         "frame")),
        picture("PSD", "psd", {".psd", ".psb", ".pdd"}, {}, "the merged picture"),
        picture("HEIF", "heif", {".heic", ".heif", ".avif"}, {}, "the first picture"),
        picture("ICO", "ico", {".ico"}, {}, "the first picture"),
        picture("Cineon", "cineon", {".cin"}, {}, ""),
        picture("DDS", "dds", {".dds"}, {}, "the largest picture"),
        picture("IFF", "iff", {".iff"}, {}, "of Maya"),
    };
}

/// Whether axes are no right angle apart, by a tenth of a sample at the end of one.
bool leans(const Header& what) {
    constexpr double kSeen = 0.1;
    const int axes = what.volume ? 3 : 2;
    for (int a = 0; a < axes; ++a)
        for (int b = 0; b < axes; ++b)
            if (a != b && std::abs(dot(what.direction[a], what.direction[b])) *
                                  static_cast<double>(what.extent[b]) * what.spacing[b] >
                              kSeen * what.spacing[a])
                return true;
    return false;
}

}  // namespace

const std::vector<Format>& formats() {
    static const std::vector<Format> kFormats = [] {
        std::vector<Format> all = table();
        for (Format& format : pictures_of_the_library()) all.push_back(std::move(format));
        return all;
    }();
    return kFormats;
}

std::string library_of(const Format& format) {
    struct Row {
        std::string_view format, library;
    };
    constexpr std::string_view kOwn = "edgewise";
    // What is not here and has no name of OpenImageIO's is read and written by own code.
    constexpr Row kRows[] = {{"NIfTI", "edgewise, zlib"},
                             {"NRRD", "edgewise, zlib, libbz2"},
                             {"MetaImage", "edgewise, zlib"},
                             {"MGH", "edgewise, zlib"},
                             {"VTI", "edgewise, zlib"},
                             {"DICOM", "edgewise; compressed frames: DCMTK, CharLS, OpenJPEG"},
                             {"OME-Zarr", "edgewise, Blosc, zlib, Zstandard"},
                             {"PNG", "libpng"},
                             {"APNG", "libpng"},
                             {"JPEG", "libjpeg"},
                             {"TIFF", "libtiff; written by edgewise; rare pages: OpenImageIO"},
                             {"MP4", "ffmpeg"},
                             {"WebP", "libwebp"},
                             {"JPEG 2000", "OpenJPEG"},
                             {"PNM", "OpenImageIO; written by edgewise"},
                             {"PFM", "OpenImageIO; written by edgewise"},
                             {"SGI", "OpenImageIO; written by edgewise"},
                             {"GIF", "OpenImageIO; written by edgewise"}};
    for (const Row& row : kRows)
        if (row.format == format.name) return std::string(row.library);
    return std::string(format.library.empty() ? kOwn : "OpenImageIO");
}

const Format* format_of(std::string_view path) {
    const Format* best = nullptr;
    std::size_t longest = 0;
    const std::string low = lower(path == "-" ? ".png" : path);
    for (const Format& format : formats())
        for (const std::string& ending : format.endings)
            if (low.ends_with(ending) && ending.size() > longest)
                best = &format, longest = ending.size();
    return best;
}

namespace {

/// Why a format cannot hold this, be it one picture or several, or "".
std::string cannot_hold(std::string_view path, const Format& format, const Header& what) {
    if (ends_with_any(path, {".img", ".nhdr"}) || (what.volume && ends_with_any(path, {".hdr"})))
        return "headers apart from their data are not written";
    if (ends_with_any(path, {".pbm"})) return "pictures of one bit are not written";
    const auto has = [](const auto& list, auto wanted) {
        return std::find(list.begin(), list.end(), wanted) != list.end();
    };
    if (!format.writes) return fmt::format("{} is read only", format.name);
    if (what.volume && !format.volumes)
        return fmt::format("{} holds images, not volumes", format.name);
    if (!what.volume && !format.images)
        return fmt::format("{} holds volumes, not images", format.name);
    if (format.name == "NIfTI" && !what.volume && what.channels > 1 && !is_nifti_colour(what))
        return fmt::format("NIfTI cannot say that {} channels of {} are an image", what.channels,
                           name_of(what.type));
    if (what.times != 1 && format.name != "NIfTI" && format.name != "NRRD")
        return fmt::format("{} holds no time series here; NIfTI and NRRD do", format.name);
    if (!has(format.types, what.type) && what.integers == Wide::no)
        return fmt::format("{} cannot hold {}", format.name, name_of(what.type));
    if (what.integers != Wide::no && format.name != "NIfTI" && format.name != "NRRD" &&
        format.name != "MetaImage")
        return fmt::format(
            "{} is not written with 64-bit integers; NIfTI, NRRD and MetaImage (.nii, .nrrd, .mha) "
            "are",
            format.name);
    if (what.channels < 1 || what.channels > format.channels ||
        has(format.cannot_channels, what.channels))
        return fmt::format("{} cannot hold {} channels", format.name, what.channels);
    if (what.channels > 1 && ends_with_any(path, {".pgm"})) return "PGM is grey; PPM holds colour";
    if (format.side > 0 && std::max(what.extent.x, what.extent.y) > format.side)
        return fmt::format("{} holds at most {} pixels a side", format.name, format.side);
    if (!format.values && !what.values.identity())
        return fmt::format("{} cannot say that values are {} x stored + {}", format.name,
                           what.values.slope, what.values.offset);
    if (leans(what) && format.name != "NIfTI" && format.name != "NRRD" &&
        format.name != "MetaImage")
        return fmt::format(
            "{} cannot say that the axes of the grid lean (a tilted gantry); NIfTI, NRRD and "
            "MetaImage can",
            format.name);
    return {};
}

}  // namespace

std::string cannot_write(std::string_view path, const Header& what) {
    const Format* format = format_of(path);
    if (!format) return "the ending of '" + shown(path) + "' names no format";
    const std::string why = cannot_hold(path, *format, what);
    if (why.empty() && format->name == kFilm) return "MP4 holds films of several pictures, not one";
    return why;
}

std::string cannot_animate(std::string_view path, const Header& what, const std::string& encoder) {
    const Format* format = format_of(path);
    if (!format) return "the ending of '" + shown(path) + "' names no format";
    std::string why = cannot_hold(path, *format, what);
    if (!why.empty()) return why;
    if (!format->frames) return fmt::format("{} holds one picture", format->name);
    return no_encoder(path, encoder);
}

std::string no_encoder(std::string_view path, const std::string& encoder) {
    const Format* format = format_of(path);
    return format && format->name == kFilm ? no_film(encoder) : "";
}

}  // namespace edgewise::store
