// What the pages of a TIFF are. OME-TIFF has an XML document in the description of the first page
// (www.openmicroscopy.org/Schemas/OME/2016-06); for ImageJ see tiff_imagej.cpp.

#include "io/tiff_layout.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fmt/format.h>
#include <map>
#include <set>

#include "graph/errors.hpp"
#include "io/geometry.hpp"
#include "io/text.hpp"
#include "io/tiff_imagej.hpp"
#include "io/xml.hpp"

namespace edgewise::store {
namespace {

constexpr std::uint64_t kLongestImageJ = 1 << 20;
constexpr std::uint64_t kLongestOme = 256 << 20;
constexpr int kMostTags = 1 << 22;
constexpr std::int64_t kMostPlanes = 1 << 22;
constexpr double kInch = 25.4, kCentimetre = 10;  // [mm]

std::string start_of(const File& file, const TiffPage& page, std::uint64_t most) {
    std::string text(static_cast<std::size_t>(std::min(page.text_bytes, most)), '\0');
    text.resize(file.read_some(page.text, std::as_writable_bytes(std::span(text))));
    text.resize(std::min(text.size(), text.find('\0')));
    return text;
}

/// Spacing in pages of a size that was said: x and y by their resolution, `between` pages.
void take_resolution(Header& header, const TiffPage& page, double millimetres_a_unit,
                     std::optional<double> between) {
    for (std::size_t axis = 0; axis < 2; ++axis) header.spacing[axis] = 1 / page.resolution[axis];
    header.spacing[2] = between.value_or(header.spacing[0]);
    if (millimetres_a_unit > 0) to_millimetres(header, millimetres_a_unit);
}

/// A resolution without more is how dense to print, unless it is a scientist's. Pictures keep
/// pixels, but where it is per centimetre; stacks take it, with a word.
void plain_spacing(Header& header, const TiffPage& page, bool volume) {
    if (!has_resolution(page)) return;
    const bool centimetre = page.resolution_unit == 3;
    if (!centimetre && page.resolution_unit != 2) return;
    if (!volume && !centimetre) {
        if (page.resolution[0] != page.resolution[1])
            header.warnings.push_back(
                message("{}: is {} x {} pixels an inch, so its pixels are not square; "
                        "@input_spacing says how large they are",
                        header.file, page.resolution[0], page.resolution[1]));
        return;
    }
    take_resolution(header, page, centimetre ? kCentimetre : kInch, std::nullopt);
    if (volume)
        header.warnings.push_back(
            message("{}: {} pixels {} are taken as {:.6g} mm, and pages as far apart as columns, "
                    "which it does not say; @input_spacing says otherwise",
                    header.file, page.resolution[0], centimetre ? "a centimetre" : "an inch",
                    header.spacing[0]));
}

// OME ----------------------------------------------------------------------------------------

struct TiffData {
    std::int64_t ifd, z, c, t, planes;  // -1: not said
};

struct OmeChannel {
    std::int64_t samples = 1;
    std::optional<Colour> colour;
    std::string name;
};

struct OmeImage {
    std::string name;
    std::map<std::string, std::string> pixels;  // attributes
    std::vector<TiffData> data;
    std::int64_t samples = 1;  // of one page, as the first channel says
    std::vector<OmeChannel> channels;
};

struct Ome {
    std::vector<OmeImage> images;
    std::set<std::string> files;  // that planes are said to lie in
};

/// "-16776961": red, green, blue and opacity as the bytes of a signed number.
std::optional<Colour> ome_colour(const std::string& text) {
    const auto number = to_integer(text);
    if (!number || *number < INT32_MIN || *number > UINT32_MAX) return std::nullopt;
    const auto bits = static_cast<std::uint32_t>(*number);
    return Colour{(bits >> 24) / 255.0, (bits >> 16 & 0xff) / 255.0, (bits >> 8 & 0xff) / 255.0};
}

/// The few characters beyond ASCII that units need.
std::string without_entities(std::string text) {
    constexpr std::pair<std::string_view, std::string_view> kEntities[] = {
        {"&#181;", "\xc2\xb5"},  {"&#xb5;", "\xc2\xb5"},  {"&#xB5;", "\xc2\xb5"},
        {"&#956;", "\xce\xbc"},  {"&#x3bc;", "\xce\xbc"}, {"&#197;", "\xc3\x85"},
        {"&#8491;", "\xc3\x85"}, {"&amp;", "&"}};
    for (const auto& [entity, letter] : kEntities)
        if (const auto at = text.find(entity); at != text.npos)
            text.replace(at, entity.size(), letter);
    return text;
}

Ome parsed(const FilePointer& file, const TiffPage& page) {
    Ome ome;
    std::uint64_t bytes = page.text_bytes;
    // The text ends with a zero, which is no XML.
    std::byte last{1};
    while (bytes > 0 && file->read_some(page.text + bytes - 1, {&last, 1}) == 1 &&
           last == std::byte{0})
        --bytes;
    TagReader tags(file, page.text, page.text + bytes, kMostTags);
    Tag tag;
    bool inside = false;
    while (tags.next(tag)) {
        if (tag.closes) {
            if (tag.name.ends_with("Pixels")) inside = false;
            continue;
        }
        const auto colon = tag.name.find(':');
        const std::string name = colon == tag.name.npos ? tag.name : tag.name.substr(colon + 1);
        if (name == "Image") {
            ome.images.push_back({});
            ome.images.back().name = tag.attribute("Name");
        }
        if (ome.images.empty()) continue;
        OmeImage& image = ome.images.back();
        const auto whole = [&](const char* key) {
            const std::string text = tag.attribute(key);
            if (text.empty()) return std::int64_t{-1};
            const auto value = to_integer(text);
            if (!value || *value < 0)
                refuse(file->path(), fmt::format("OME attribute '{}' is '{}'", key, shown(text)));
            return *value;
        };
        if (name == "Pixels" && image.pixels.empty()) {
            image.pixels = tag.attributes;
            inside = !tag.empty;
        } else if (inside && name == "Channel") {
            const std::int64_t samples = std::max<std::int64_t>(whole("SamplesPerPixel"), 1);
            image.samples = std::max(image.samples, samples);
            image.channels.push_back({samples, ome_colour(tag.attribute("Color")),
                                      without_entities(tag.attribute("Name"))});
        } else if (inside && name == "TiffData") {
            image.data.push_back({whole("IFD"), whole("FirstZ"), whole("FirstC"), whole("FirstT"),
                                  whole("PlaneCount")});
        } else if (inside && name == "UUID" && !tag.attribute("FileName").empty()) {
            ome.files.insert(tag.attribute("FileName"));
        }
    }
    return ome;
}

/// Puts the planes of one image where its order and its TiffData say.
class OmeLayout {
 public:
    OmeLayout(Header& header, const std::vector<TiffPage>& pages, const OmeImage& image)
        : header_(header), pages_(pages), image_(image) {}

    TiffLayout run() {
        TiffLayout layout;
        const std::int64_t channels = size("SizeC");
        layout.slices = size("SizeZ");
        layout.times = size("SizeT");
        if (image_.samples < 1 || channels % image_.samples != 0)
            refuse(header_.file, fmt::format("OME attribute 'SizeC' is {}, but {} samples a pixel",
                                             channels, image_.samples));
        layout.channels = channels / image_.samples;
        const std::int64_t planes = product(
            header_.file, product(header_.file, layout.channels, layout.slices), layout.times);
        if (planes > kMostPlanes || planes > static_cast<std::int64_t>(pages_.size()))
            refuse(header_.file,
                   fmt::format("OME says {} channels, {} slices and {} times, but the "
                               "file has {} pages",
                               layout.channels, layout.slices, layout.times, pages_.size()));
        layout.volume = layout.slices > 1;
        place(layout, planes);
        for (const char* axis : {"X", "Y"}) {
            const std::int64_t said = size(std::string("Size") + axis);
            const TiffPage& page = pages_[layout.pages[0]];
            if (const std::int64_t is = axis[0] == 'X' ? page.width : page.height; said != is)
                refuse(header_.file,
                       fmt::format("OME attribute 'Size{}' is {}, but its pages have {}", axis,
                                   said, is));
        }
        spacing();
        return layout;
    }

 private:
    std::string attribute(const std::string& key) const {
        const auto found = image_.pixels.find(key);
        return found == image_.pixels.end() ? "" : found->second;
    }
    std::int64_t size(const std::string& key) const {
        const auto value = to_integer(attribute(key));
        if (!value || *value < 1 || *value > (std::int64_t{1} << 31))
            refuse(header_.file,
                   fmt::format("OME attribute '{}' is '{}', expected a number of 1 or more", key,
                               shown(attribute(key))));
        return *value;
    }

    void place(TiffLayout& layout, std::int64_t planes) const {
        const std::string order = attribute("DimensionOrder");
        std::string sorted = order;
        std::sort(sorted.begin(), sorted.end());
        if (!order.starts_with("XY") || sorted != "CTXYZ")
            refuse(header_.file, "OME attribute 'DimensionOrder' is '" + shown(order) +
                                     "', expected XYCZT or another order of these");
        const auto size_of = [&](char axis) {
            return axis == 'C' ? layout.channels : axis == 'Z' ? layout.slices : layout.times;
        };
        constexpr auto kNone = static_cast<std::size_t>(-1);
        layout.pages.assign(static_cast<std::size_t>(planes), kNone);
        const std::vector<TiffData> all{{-1, -1, -1, -1, -1}};
        for (const TiffData& data : image_.data.empty() ? all : image_.data) {
            std::map<char, std::int64_t> at{{'Z', std::max<std::int64_t>(data.z, 0)},
                                            {'C', std::max<std::int64_t>(data.c, 0)},
                                            {'T', std::max<std::int64_t>(data.t, 0)}};
            // FirstC counts samples; a page may hold several.
            at['C'] /= image_.samples;
            std::int64_t index = 0, step = 1;
            for (const char axis : order.substr(2)) {
                if (at[axis] >= size_of(axis))
                    refuse(header_.file, "OME TiffData lie beyond the sizes of the image");
                index += at[axis] * step;
                step *= size_of(axis);
            }
            const std::int64_t first = std::max<std::int64_t>(data.ifd, 0);
            const std::int64_t count = data.planes >= 0 ? data.planes
                                       : data.ifd >= 0  ? 1
                                                        : planes - index;
            if (count > planes - index || first > static_cast<std::int64_t>(pages_.size()) - count)
                refuse(header_.file, fmt::format("OME TiffData of {} planes from page {}: the file "
                                                 "has {} pages",
                                                 count, first, pages_.size()));
            for (std::int64_t i = 0; i < count; ++i) {
                std::int64_t rest = index + i;
                for (const char axis : order.substr(2)) {
                    at[axis] = rest % size_of(axis);
                    rest /= size_of(axis);
                }
                layout.pages[static_cast<std::size_t>(
                    at['C'] + layout.channels * (at['Z'] + layout.slices * at['T']))] =
                    static_cast<std::size_t>(first + i);
            }
        }
        if (const auto missing = std::count(layout.pages.begin(), layout.pages.end(), kNone))
            refuse(header_.file,
                   fmt::format("OME TiffData say nothing of {} of {} planes", missing, planes));
    }

    void spacing() {
        std::optional<double> step[3];
        double factor = 0;
        constexpr const char* kNames[] = {"X", "Y", "Z"};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::string key = std::string("PhysicalSize") + kNames[axis];
            const auto size = to_double(attribute(key));
            if (!size || !std::isfinite(*size) || *size <= 0) continue;
            std::string unit = without_entities(attribute(key + "Unit"));
            if (unit.empty()) unit = "um";  // the schema's default
            factor = millimetres(unit);
            if (factor == 0) {
                if (unit != "pixel" && unit != "reference frame")
                    header_.warnings.push_back(
                        message("{}: OME attribute '{}Unit' is {}, which is not known; @input_unit "
                                "says which it is",
                                header_.file, key, in_quotes(unit)));
                step[axis] = *size;
                unitless_ = true;
                continue;
            }
            step[axis] = *size * factor;
            known_ = true;
        }
        if (!step[0] && !step[1] && !step[2]) return;
        // Without a unit for all of them there is none.
        if (!step[0]) step[0] = step[1] ? step[1] : step[2];
        if (!step[1]) step[1] = step[0];
        if (!step[2]) {
            step[2] = step[0];
            if (size("SizeZ") > 1)
                header_.warnings.push_back(
                    message("{}: OME says no 'PhysicalSizeZ': pages are taken to be as far apart "
                            "as columns; @input_spacing says otherwise",
                            header_.file));
        }
        for (std::size_t axis = 0; axis < 3; ++axis) header_.spacing[axis] = *step[axis];
        if (!known_ || unitless_) return;
        header_.unit = "mm";
        header_.file_unit = factor;
    }

    Header& header_;
    const std::vector<TiffPage>& pages_;
    const OmeImage& image_;
    bool known_ = false, unitless_ = false;
};

bool is_ome(const std::string& text) {
    return text.find("<OME") != text.npos || text.find("<ome:OME") != text.npos ||
           text.find("<OME:OME") != text.npos;
}

std::string list_of(const Ome& ome) {
    std::string list;
    for (std::size_t i = 0; i < ome.images.size(); ++i)
        list += fmt::format("\n  {}  {}", i, shown(ome.images[i].name));
    return list;
}

std::size_t chosen(const std::string& file, const Ome& ome, const Selection& pick) {
    if (ome.images.size() == 1 && !pick.series) return 0;
    if (!pick.series)
        throw RequestError(message("{}: holds {} images, choose one with @series N:{}", file,
                                   ome.images.size(), list_of(ome)));
    const auto index = to_integer(*pick.series);
    if (!index || *index < 0 || *index >= static_cast<std::int64_t>(ome.images.size()))
        throw RequestError(
            message("{}: @series({}): it holds images{}", file, shown(*pick.series), list_of(ome)));
    return static_cast<std::size_t>(*index);
}

}  // namespace

TiffLayout stack_of(const std::vector<TiffPage>& pages) {
    TiffLayout layout;
    for (std::size_t i = 0; i < pages.size(); ++i)
        if (pages.size() == 1 || !pages[i].reduced) layout.pages.push_back(i);
    layout.slices = static_cast<std::int64_t>(layout.pages.size());
    layout.volume = layout.slices > 1;
    return layout;
}

bool has_resolution(const TiffPage& page) {
    return std::all_of(page.resolution, page.resolution + 2, [](double value) {
        return std::isfinite(value) && value > 1e-12 && value < 1e12;
    });
}

TiffLayout tiff_layout(Header& header, FilePointer file, const std::vector<TiffPage>& pages,
                       const Selection& pick) {
    const std::string text = start_of(*file, pages[0], kLongestImageJ);
    if (is_ome(text.substr(0, 1 << 14)) && pages[0].text_bytes <= kLongestOme) {
        const Ome ome = parsed(file, pages[0]);
        if (ome.files.size() > 1)
            refuse(header.file, fmt::format("is one of a set of {} files by its OME description; "
                                            "sets of files are not supported",
                                            ome.files.size()));
        if (!ome.images.empty())
            return OmeLayout(header, pages, ome.images[chosen(header.file, ome, pick)]).run();
    }
    if (is_imagej(text)) return imagej_layout(header, pages, text);
    TiffLayout layout = stack_of(pages);
    if (!layout.pages.empty()) plain_spacing(header, pages[layout.pages[0]], layout.volume);
    return layout;
}

std::vector<Series> tiff_series(const std::string& path) {
    std::vector<Series> list;
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error)) return list;
    const auto file = std::make_shared<const File>(path);
    if (!is_tiff(file->head(4))) return list;
    const auto pages = tiff_pages(*file);
    if (!is_ome(start_of(*file, pages[0], 1 << 14))) return list;
    for (const OmeImage& image : parsed(file, pages[0]).images)
        list.push_back({std::to_string(list.size()), image.name, 1});
    return list;
}

std::vector<std::optional<Colour>> tiff_colours(const std::string& path, const Selection& pick) {
    const auto file = std::make_shared<const File>(path);
    const TiffPage page = tiff_pages(*file)[0];
    const std::string text = start_of(*file, page, 1 << 14);
    if (is_imagej(text)) return imagej_colours(*file, page);
    std::vector<std::optional<Colour>> colours;
    if (!is_ome(text) || page.text_bytes > kLongestOme) return colours;
    const Ome ome = parsed(file, page);
    if (ome.images.empty()) return colours;
    constexpr std::int64_t kMostSamples = 64;  // of a pixel
    for (const OmeChannel& channel : ome.images[chosen(path, ome, pick)].channels)
        if (channel.samples == 1)
            colours.push_back(channel.colour);
        else  // the samples of a photograph are its colours
            colours.resize(colours.size() +
                           static_cast<std::size_t>(std::min(channel.samples, kMostSamples)));
    return colours;
}

std::vector<std::string> tiff_channel_names(const std::string& path, const Selection& pick) {
    const auto file = std::make_shared<const File>(path);
    const TiffPage page = tiff_pages(*file)[0];
    std::vector<std::string> names;
    if (!is_ome(start_of(*file, page, 1 << 14)) || page.text_bytes > kLongestOme) return names;
    const Ome ome = parsed(file, page);
    if (ome.images.empty()) return names;
    constexpr std::int64_t kMostSamples = 64;  // of a pixel
    for (const OmeChannel& channel : ome.images[chosen(path, ome, pick)].channels) {
        names.push_back(channel.name);
        names.resize(names.size() +
                     static_cast<std::size_t>(std::min(channel.samples, kMostSamples)) - 1);
    }
    return names;
}

std::vector<std::optional<std::array<double, 2>>> tiff_ranges(const std::string& path) {
    const auto file = std::make_shared<const File>(path);
    const TiffPage page = tiff_pages(*file)[0];
    const std::string text = start_of(*file, page, kLongestImageJ);
    if (is_imagej(text)) return imagej_ranges(*file, page, text);
    return {};
}

}  // namespace edgewise::store
