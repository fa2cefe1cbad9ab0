#include <algorithm>
#include <fmt/format.h>

#include "io/geometry.hpp"
#include "io/reader.hpp"
#include "io/store.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

const std::vector<Type> kNumbers{Type::u8,  Type::i8,  Type::u16, Type::i16,
                                 Type::u32, Type::i32, Type::f32, Type::f64};

std::vector<Format> table() {
    return {
        {"NIfTI",
         {".nii.gz", ".nii", ".hdr", ".img"},
         true,
         true,
         kNumbers,
         true,
         true,
         64,
         true,
         "1 and 2, pairs are read"},
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
        {"JPEG",
         {".jpg", ".jpeg"},
         true,
         true,
         {Type::u8},
         true,
         false,
         3,
         false,
         "1 or 3 channels"},
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
        {"EXR",
         {".exr"},
         true,
         true,
         {Type::f16, Type::f32},
         true,
         false,
         4,
         false,
         "read by OpenImageIO"},
        {"OpenVDB", {".vdb"}, true, false, {}, false, true, 4, false, "read by OpenImageIO"},
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
    };
}

}  // namespace

namespace {

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
    static const std::vector<Format> kFormats = table();
    return kFormats;
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

std::string cannot_write(std::string_view path, const Header& what) {
    const Format* found = format_of(path);
    if (!found) return "the ending of '" + shown(path) + "' names no format";
    if (ends_with_any(path, {".hdr", ".img", ".nhdr"}))
        return "headers apart from their data are not written";
    const Format& format = *found;
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
    if (what.times != 1) return "time series are not written";
    if (!has(format.types, what.type))
        return fmt::format("{} cannot hold {}", format.name, name_of(what.type));
    if (what.channels < 1 || what.channels > format.channels ||
        (format.name == "JPEG" && what.channels == 2))
        return fmt::format("{} cannot hold {} channels", format.name, what.channels);
    if (format.name == "JPEG" && std::max(what.extent.x, what.extent.y) > 65500)
        return "JPEG holds at most 65500 pixels a side";
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

}  // namespace edgewise::store
