// ImageJ's TIFF: lines of "key=value" in the description of the first page, and blocks of its own
// under tags 50838 and 50839 (ij.io.FileSaver, TiffEncoder, FileOpener; ij.measure.Calibration).

#include "io/tiff_imagej.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <fmt/format.h>
#include <map>
#include <string_view>

#include "io/geometry.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

constexpr std::int64_t kMostImages = 1 << 22;

class Lines {
 public:
    explicit Lines(const std::string& text) {
        for (std::string_view line : split(text, '\n'))
            if (const auto equal = line.find('='); equal != line.npos)
                values_.emplace(trim(line.substr(0, equal)), trim(line.substr(equal + 1)));
    }
    bool has(const std::string& key) const { return values_.contains(key); }
    std::string value(const std::string& key) const {
        const auto found = values_.find(key);
        return found == values_.end() ? "" : found->second;
    }
    std::int64_t count(const std::string& key) const {
        return std::max<std::int64_t>(to_integer(value(key)).value_or(1), 1);
    }
    std::optional<double> number(const std::string& key) const {
        const auto number = to_double(value(key));
        return number && std::isfinite(*number) ? number : std::nullopt;
    }

 private:
    std::map<std::string, std::string> values_;
};

// Values -------------------------------------------------------------------------------------

/// ij.measure.Calibration; a straight line is 0.
struct Function {
    int number;
    const char* name;
};
constexpr Function kBent[] = {{1, "a polynomial of degree 2"},
                              {2, "a polynomial of degree 3"},
                              {3, "a polynomial of degree 4"},
                              {4, "an exponential"},
                              {5, "a power"},
                              {6, "a logarithm"},
                              {7, "Rodbard's curve"},
                              {8, "a gamma variate"},
                              {9, "a logarithm"},
                              {10, "Rodbard's curve"},
                              {11, "an exponential with an offset"},
                              {12, "a Gaussian"},
                              {13, "an exponential recovery"},
                              {21, "uncalibrated optical density"},
                              {22, "a table"}};
constexpr std::int64_t kStraightLine = 0, kNoCalibration = 20;

bool is_colour(const TiffPage& page) { return page.photometric == 2 || page.samples > 1; }

/// Value = c0 + c1 * stored. Signed samples of 16 bits are stored with 32768 added, and this line
/// says so.
/// @param warnings  none: nothing is told
ValueMap calibration_of(const Lines& lines, const TiffPage& page, const std::string& file,
                        std::vector<Message>* warnings) {
    const auto function = to_integer(lines.value("cf"));
    if (!function || *function == kNoCalibration || is_colour(page)) return {};
    const auto warn = [&](const std::string& why) {
        if (warnings) warnings->push_back(fmt::format("{}: {}; values are as stored", file, why));
        return ValueMap{};
    };
    if (*function != kStraightLine) {
        const auto* bent = std::find_if(
            std::begin(kBent), std::end(kBent),
            [&](const Function& one) { return std::int64_t{one.number} == *function; });
        return warn(fmt::format(
            "ImageJ calibrates its values by {} (cf={}), not by a straight line",
            bent == std::end(kBent) ? "a function that is not known" : bent->name, *function));
    }
    const auto offset = lines.number("c0"), slope = lines.number("c1");
    if (!offset || !slope || *slope == 0)
        return warn(fmt::format("its calibration c0={}, c1={} is no straight line",
                                in_quotes(lines.value("c0")), in_quotes(lines.value("c1"))));
    // Samples that are signed already have nothing added.
    constexpr double kAdded = 32768;
    if (page.bits == 16 && page.format == 2 && *offset == -kAdded && *slope == 1) return {};
    if (warnings && lines.value("zeroclip") == "true")
        warnings->push_back(file +
                            ": ImageJ shows its values below 0 as 0 (zeroclip); they are kept");
    return {*slope, *offset};
}

// Pages and lengths --------------------------------------------------------------------------

bool is_pixel(const std::string& unit) {
    const std::string word = lower(unit);
    return word.empty() || word == "pixel" || word == "pixels";
}

class Layout {
 public:
    Layout(Header& header, const std::vector<TiffPage>& pages, const std::string& text)
        : header_(header), pages_(pages), lines_(text) {}

    TiffLayout run() {
        TiffLayout layout = stack_of(pages_);
        layout.indices = true;
        if (layout.pages.empty()) return layout;
        const auto there = static_cast<std::int64_t>(layout.pages.size());
        const std::int64_t channels = lines_.count("channels"), frames = lines_.count("frames");
        const std::int64_t images = lines_.count("images");
        std::int64_t slices = lines_.count("slices");
        // A stack of no more words is one of slices.
        if (!lines_.has("slices") && channels * frames == 1) slices = images;
        const std::int64_t planes =
            product(header_.file, product(header_.file, channels, slices), frames);
        layout.one_directory = there == 1 && planes > 1 && planes <= kMostImages;
        if (planes == there || layout.one_directory) {
            layout.channels = channels;
            layout.slices = slices;
            layout.times = frames;
            layout.volume = slices > 1;
            layout.pages.resize(static_cast<std::size_t>(planes), 0);
        } else {
            header_.warnings.push_back(fmt::format(
                "{}: its description says {} channels, {} slices and {} frames, but it has {} "
                "pages: taken as a stack of these",
                header_.file, channels, slices, frames, there));
        }
        lengths(layout.volume);
        header_.values =
            calibration_of(lines_, pages_[layout.pages[0]], header_.file, &header_.warnings);
        // What ImageJ writes where it knows none.
        if (!header_.values.identity() && lower(lines_.value("vunit")) != "gray value")
            header_.value_unit = unit_of_values(lines_.value("vunit"));
        return layout;
    }

 private:
    void lengths(bool volume) {
        steps(volume);
        constexpr const char* kOrigins[] = {"xorigin", "yorigin", "zorigin"};
        // The pixel that lies at 0, counted from 0.
        for (std::size_t axis = 0; axis < (volume ? 3u : 2u); ++axis)
            if (const auto zero = lines_.number(kOrigins[axis]); zero && *zero != 0)
                header_.origin[axis] = -*zero * header_.spacing[axis];
    }
    void steps(bool volume) {
        const TiffPage& page = pages_[0];
        const double between = std::abs(lines_.number("spacing").value_or(0));
        std::string unit = lines_.value("unit");
        const bool sized = has_resolution(page);
        if (!sized && millimetres(unit) == 0) {
            if (between > 0) header_.spacing[2] = between;
            return;
        }
        // As ImageJ: 72 pixels an inch are what programs write that know no size.
        const bool nominal = page.resolution[0] == 72 && page.resolution_unit == 2;
        if (unit.empty() && nominal) return;
        if (unit.empty())
            unit = page.resolution_unit == 3 ? "cm" : page.resolution_unit == 2 ? "inch" : "pixel";
        // Without a size pixels are one unit large.
        for (std::size_t axis = 0; axis < 2; ++axis)
            header_.spacing[axis] = sized ? 1 / page.resolution[axis] : 1;
        header_.spacing[2] = between > 0 ? between : 1;
        std::string units[3]{unit, unit, unit};
        if (lines_.has("yunit")) units[1] = lines_.value("yunit");
        if (lines_.has("zunit")) units[2] = lines_.value("zunit");
        // As ImageJ: what other programs write a centimetre, under micrometres, is a centimetre's.
        if (sized && page.resolution_unit == 3 && unit == "um")
            for (std::size_t axis = 0; axis < 2; ++axis)
                if (units[axis] == unit) units[axis] = "cm";
        take_units(units, volume ? 3 : 2);
    }
    void take_units(const std::string (&units)[3], std::size_t axes) {
        double factors[3];
        std::size_t known = 0;
        for (std::size_t axis = 0; axis < axes; ++axis) {
            factors[axis] = millimetres(units[axis]);
            known += factors[axis] > 0;
        }
        if (known == axes) {
            for (std::size_t axis = 0; axis < axes; ++axis) header_.spacing[axis] *= factors[axis];
            if (axes == 2) header_.spacing[2] *= factors[0];
            header_.unit = "mm";
            header_.file_unit = factors[0];
            return;
        }
        for (std::size_t axis = 0; axis < axes; ++axis) {
            if (factors[axis] > 0 || (known == 0 && is_pixel(units[axis]))) continue;
            header_.warnings.push_back(
                message("{}: its unit {}{} is not known: lengths are kept as they stand; "
                        "@input_unit says which it is",
                        header_.file, in_quotes(units[axis]),
                        known > 0 ? fmt::format(" along {}", "xyz"[axis]) : ""));
            return;
        }
    }

    Header& header_;
    const std::vector<TiffPage>& pages_;
    Lines lines_;
};

// Blocks -------------------------------------------------------------------------------------

std::uint64_t number_in(const std::byte* at, std::size_t width, bool big) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < width; ++i)
        value |= std::to_integer<std::uint64_t>(at[i]) << 8 * (big ? width - 1 - i : i);
    return value;
}

/// Calls take(offset, bytes) for each part of a kind. The block begins with a head that names kinds
/// of parts and counts them; the parts follow in that order. All numbers are as the file's.
template <class Take>
void parts_of(const File& file, const TiffPage& page, std::uint64_t wanted, Take take) {
    constexpr std::size_t kNumber = 4, kKind = 2 * kNumber;
    constexpr std::uint64_t kLargestHead = 1 << 12;
    if (page.imagej_parts.empty() || page.imagej_parts[0] > kLargestHead) return;
    Bytes head(page.imagej_parts[0]);
    if (head.size() > page.imagej_bytes || file.read_some(page.imagej, head) != head.size()) return;
    const auto number = [&](std::size_t at) {
        return number_in(head.data() + at, kNumber, page.big_endian);
    };
    std::uint64_t at = head.size();
    std::size_t part = 1;
    for (std::size_t kind = kNumber; kind + kKind <= head.size(); kind += kKind)
        for (std::uint64_t i = number(kind + kNumber); i > 0 && part < page.imagej_parts.size();
             --i) {
            const std::uint64_t bytes = page.imagej_parts[part++];
            if (number(kind) == wanted && at + bytes <= page.imagej_bytes)
                take(page.imagej + at, bytes);
            at += bytes;
        }
}

}  // namespace

bool is_imagej(const std::string& description) noexcept {
    return description.starts_with("ImageJ=");
}

TiffLayout imagej_layout(Header& header, const std::vector<TiffPage>& pages,
                         const std::string& description) {
    return Layout(header, pages, description).run();
}

std::vector<std::optional<Colour>> imagej_colours(const File& file, const TiffPage& page) {
    constexpr std::size_t kEntries = 256;
    constexpr std::uint64_t kLuts = 0x6c757473;  // "luts"
    std::vector<std::optional<Colour>> colours;
    if (page.samples > 1) return colours;
    parts_of(file, page, kLuts, [&](std::uint64_t at, std::uint64_t bytes) {
        std::byte table[3 * kEntries];
        if (bytes != sizeof(table) || file.read_some(at, table) != sizeof(table)) return;
        Colour last{};
        for (std::size_t c = 0; c < 3; ++c)
            last[c] = std::to_integer<int>(table[kEntries * (c + 1) - 1]) / 255.0;
        colours.push_back(last == Colour{} ? std::nullopt : std::optional(last));
    });
    return colours;
}

std::vector<std::optional<std::array<double, 2>>> imagej_ranges(const File& file,
                                                                const TiffPage& page,
                                                                const std::string& description) {
    constexpr std::uint64_t kRanges = 0x72616e67, kMost = 1 << 16;  // "rang"
    std::vector<std::optional<std::array<double, 2>>> ranges;
    if (is_colour(page)) return ranges;
    const Lines lines(description);
    // They are of samples as they are stored.
    const ValueMap values = calibration_of(lines, page, "", nullptr);
    const auto add = [&](double low, double high) {
        std::array<double, 2> range{values(low), values(high)};
        if (range[0] > range[1]) std::swap(range[0], range[1]);
        const bool usable =
            std::isfinite(range[0]) && std::isfinite(range[1]) && range[0] < range[1];
        ranges.push_back(usable ? std::optional(range) : std::nullopt);
    };
    parts_of(file, page, kRanges, [&](std::uint64_t at, std::uint64_t bytes) {
        Bytes raw(static_cast<std::size_t>(std::min(bytes, kMost) / 16 * 16));
        if (file.read_some(at, raw) != raw.size()) return;
        for (std::size_t i = 0; i < raw.size(); i += 16)
            add(std::bit_cast<double>(number_in(raw.data() + i, 8, page.big_endian)),
                std::bit_cast<double>(number_in(raw.data() + i + 8, 8, page.big_endian)));
    });
    // The description has the range of the channel that was looked at: of one it is that one's.
    const auto low = lines.number("min"), high = lines.number("max");
    if (ranges.empty() && low && high && lines.count("channels") == 1) add(*low, *high);
    return ranges;
}

}  // namespace edgewise::store
