#include "transitions/store/dicom_file.hpp"

#include <cmath>
#include <cstring>
#include <fmt/format.h>

#include "transitions/store/text.hpp"

namespace edgewise::store {
namespace {

constexpr int kDeepest = 32;
constexpr std::uint32_t kUndefined = 0xffffffff;
constexpr std::uint32_t kItem = 0xfffee000, kItemEnd = 0xfffee00d, kSequenceEnd = 0xfffee0dd;
constexpr std::uint32_t kPixelData = 0x7fe00010;
constexpr std::uint32_t kLongestValue = 1 << 16;  // of an element that describes pixels
constexpr int kMostElements = 1 << 20;

constexpr std::string_view kImplicit = "1.2.840.10008.1.2", kExplicit = "1.2.840.10008.1.2.1",
                           kBigEndian = "1.2.840.10008.1.2.2";
/// RLE, JPEG, JPEG-LS and JPEG 2000: what the decoder knows.
constexpr std::string_view kCompressed[] = {
    "1.2.840.10008.1.2.5",    "1.2.840.10008.1.2.4.50", "1.2.840.10008.1.2.4.51",
    "1.2.840.10008.1.2.4.57", "1.2.840.10008.1.2.4.70", "1.2.840.10008.1.2.4.80",
    "1.2.840.10008.1.2.4.81", "1.2.840.10008.1.2.4.90", "1.2.840.10008.1.2.4.91"};

struct Element {
    std::uint32_t tag = 0, length = 0;
    char vr[3] = "";
    std::uint64_t value = 0;  // offset
};

bool is_long_vr(std::string_view vr) {
    for (std::string_view known :
         {"OB", "OW", "OF", "OD", "OL", "OV", "SQ", "UN", "UT", "UC", "UR", "SV", "UV"})
        if (vr == known) return true;
    return false;
}

class Parser {
 public:
    explicit Parser(DicomFile& out) : out_(out), file_(out.path), buffer_(1 << 16) {}

    void run() {
        std::byte marker[132];
        const bool preamble = file_.size() > 140 && file_.read_some(0, marker) == 132 &&
                              std::memcmp(marker + 128, "DICM", 4) == 0;
        if (!preamble) refuse(out_.path, "not DICOM: no DICM marker at byte 128");
        at_ = 132;
        meta();
        syntax();
        body();
        finish();
    }

 private:
    template <class T>
    T number(std::uint64_t offset) {
        std::byte raw[sizeof(T)];
        bytes(offset, raw);
        if (out_.big_endian) std::reverse(raw, raw + sizeof raw);
        T value;
        std::memcpy(&value, raw, sizeof value);
        return value;
    }
    void bytes(std::uint64_t offset, std::span<std::byte> into) {
        if (offset < start_ || offset + into.size() > start_ + filled_) {
            start_ = offset;
            filled_ = file_.read_some(offset, buffer_);
            if (filled_ < into.size())
                refuse(out_.path, fmt::format("ends inside an element at byte {}", offset));
        }
        std::memcpy(into.data(), buffer_.data() + (offset - start_), into.size());
    }
    std::string text(const Element& element) {
        if (element.length > kLongestValue)
            refuse(out_.path,
                   fmt::format("element {} is {} bytes long", name(element), element.length));
        std::string value(element.length, '\0');
        if (element.length > 0) bytes(element.value, std::as_writable_bytes(std::span(value)));
        while (!value.empty() && (value.back() == '\0' || value.back() == ' ')) value.pop_back();
        return std::string(trim(value));
    }
    static std::string name(const Element& element) {
        return fmt::format("({:04x},{:04x})", element.tag >> 16, element.tag & 0xffff);
    }

    /// Reads the head of the element at at_, and moves at_ to its value.
    Element element(bool explicit_vr) {
        if (++elements_ > kMostElements) refuse(out_.path, "has too many elements");
        Element found;
        const auto group = number<std::uint16_t>(at_);
        found.tag = static_cast<std::uint32_t>(group) << 16 | number<std::uint16_t>(at_ + 2);
        at_ += 4;
        if (group == 0xfffe || !explicit_vr) {
            found.length = number<std::uint32_t>(at_);
            at_ += 4;
        } else {
            bytes(at_, std::as_writable_bytes(std::span(found.vr, 2)));
            const bool wide = is_long_vr(found.vr);
            found.length = wide ? number<std::uint32_t>(at_ + 4) : number<std::uint16_t>(at_ + 2);
            at_ += wide ? 8 : 4;
        }
        found.value = at_;
        if (found.length != kUndefined && found.length > file_.size() - std::min(at_, file_.size()))
            refuse(out_.path, fmt::format("element {} claims {} bytes at byte {}, the file has {}",
                                          name(found), found.length, at_, file_.size()));
        return found;
    }

    void meta() {
        while (at_ + 8 <= file_.size() && number<std::uint16_t>(at_) == 2) {
            const Element here = element(true);
            if (here.length == kUndefined)
                refuse(out_.path, "undefined length in the file meta group");
            if (here.tag == 0x00020010) out_.syntax = text(here);
            at_ = here.value + here.length;
        }
        if (out_.syntax.empty())
            refuse(out_.path, "element (0002,0010), the transfer syntax, is missing");
    }
    void syntax() {
        for (std::string_view known : kCompressed) out_.compressed |= known == out_.syntax;
        explicit_ = out_.syntax != kImplicit;
        if (!out_.compressed && explicit_ && out_.syntax != kExplicit && out_.syntax != kBigEndian)
            refuse(out_.path,
                   "transfer syntax '" + shown(out_.syntax) + "' is unknown or not supported");
        out_.big_endian = out_.syntax == kBigEndian;
        filled_ = 0;
    }

    /// Elements up to the pixels. Sequences are walked with a list of their ends, not by recursion.
    void body() {
        std::vector<std::uint64_t> ends;  // 0: ended by a delimiter
        for (;;) {
            while (!ends.empty() && ends.back() != 0 && at_ >= ends.back()) ends.pop_back();
            if (at_ + 8 > file_.size()) return;
            const Element here = element(explicit_);
            if (here.tag == kItemEnd || here.tag == kSequenceEnd) {
                if (ends.empty() || ends.back() != 0)
                    refuse(out_.path,
                           fmt::format("a delimiter without a sequence at byte {}", at_));
                ends.pop_back();
                continue;
            }
            if (here.tag == kPixelData && ends.empty()) return pixels(here);
            const bool sequence = std::string_view(here.vr) == "SQ" || here.tag == kItem ||
                                  here.length == kUndefined || (!explicit_ && opens_item(here));
            if (sequence) {
                ends.push_back(here.length == kUndefined ? 0 : here.value + here.length);
                if (ends.size() > 2 * kDeepest)
                    refuse(out_.path, fmt::format("sequences nested deeper than {} at byte {}",
                                                  kDeepest, at_));
                continue;
            }
            if (ends.empty()) take(here);
            at_ = here.value + here.length;
        }
    }
    /// Implicit VR does not say what is a sequence; one starts with an item that fits into it.
    bool opens_item(const Element& here) {
        if (here.length < 8 || here.tag >> 16 == 0x7fe0) return false;
        if (number<std::uint16_t>(here.value) != 0xfffe ||
            number<std::uint16_t>(here.value + 2) != 0xe000)
            return false;
        const auto inner = number<std::uint32_t>(here.value + 4);
        return inner == kUndefined || inner <= here.length - 8;
    }
    void pixels(const Element& here) {
        found_ = true;
        if (here.length == kUndefined && !out_.compressed)
            refuse(out_.path, "pixel data (7fe0,0010) of undefined length, but not compressed");
        out_.pixels = here.value;
        out_.pixel_bytes = here.length == kUndefined ? 0 : here.length;
        if (here.length == kUndefined) fragments();
    }
    void fragments() {
        for (;;) {
            const Element item = element(explicit_);
            if (item.tag == kSequenceEnd) return;
            if (item.tag != kItem || item.length == kUndefined)
                refuse(out_.path, "the fragments of the pixel data (7fe0,0010) are damaged");
            out_.pixel_bytes += item.length;
            at_ = item.value + item.length;
        }
    }

    template <std::size_t N>
    bool decimals(const Element& here, std::array<double, N>& into) {
        const std::string value = text(here);
        if (value.empty()) return false;
        const auto parts = split(value, '\\');
        for (std::size_t i = 0; i < N; ++i) {
            const auto entry = i < parts.size() ? to_double(parts[i]) : std::nullopt;
            if (parts.size() != N || !entry || !std::isfinite(*entry))
                refuse(out_.path, fmt::format("element {} is '{}', expected {} numbers", name(here),
                                              shown(value), N));
            into[i] = *entry;
        }
        return true;
    }
    double decimal(const Element& here, double otherwise) {
        std::array<double, 1> value;
        return decimals(here, value) ? value[0] : otherwise;
    }
    int small(const Element& here) {
        if (here.length != 2)
            refuse(out_.path,
                   fmt::format("element {} has {} bytes, expected 2", name(here), here.length));
        return number<std::uint16_t>(here.value);
    }
    void take(const Element& here) {
        switch (here.tag) {
            case 0x00080016:
                out_.sop_class = text(here);
                break;
            case 0x00080060:
                out_.modality = text(here);
                break;
            case 0x0008103e:
                out_.text = text(here);
                break;
            case 0x00180050:
                if (out_.thickness == 0) out_.thickness = decimal(here, 0);
                break;
            case 0x00180088:
                out_.thickness = decimal(here, out_.thickness);
                break;
            case 0x0020000e:
                out_.series = text(here);
                break;
            case 0x00200013:
                out_.instance = static_cast<int>(to_integer(text(here)).value_or(0));
                break;
            case 0x00200032:
                out_.has_position = decimals(here, out_.position);
                break;
            case 0x00200037:
                out_.has_orientation = decimals(here, out_.orientation);
                break;
            case 0x00280002:
                out_.samples = small(here);
                break;
            case 0x00280004:
                out_.photometric = text(here);
                break;
            case 0x00280006:
                out_.planar = small(here);
                break;
            case 0x00280008:
                out_.frames = to_integer(text(here)).value_or(0);
                break;
            case 0x00280010:
                out_.rows = small(here);
                break;
            case 0x00280011:
                out_.columns = small(here);
                break;
            case 0x00280030:
                out_.has_spacing = decimals(here, out_.spacing);
                break;
            case 0x00280100:
                out_.allocated = small(here);
                break;
            case 0x00280101:
                out_.stored = small(here);
                break;
            case 0x00280102:
                out_.high = small(here);
                break;
            case 0x00280103:
                out_.is_signed = small(here) == 1;
                break;
            case 0x00281052:
                out_.intercept = decimal(here, 0);
                break;
            case 0x00281053:
                out_.slope = decimal(here, 1);
                break;
            default:
                break;
        }
    }

    void finish() {
        const auto check = [&](bool good, const std::string& what) {
            if (!good) refuse(out_.path, what);
        };
        check(out_.rows >= 1 && out_.columns >= 1 && out_.frames >= 1,
              fmt::format("Rows (0028,0010) {}, Columns (0028,0011) {}, NumberOfFrames {}: "
                          "expected 1 or more",
                          out_.rows, out_.columns, out_.frames));
        check(found_, "pixel data (7fe0,0010) are missing");
        check(out_.allocated == 8 || out_.allocated == 16 || out_.allocated == 32,
              fmt::format("BitsAllocated (0028,0100) is {}: not supported", out_.allocated));
        check(out_.stored >= 1 && out_.stored <= out_.allocated && out_.high < out_.allocated &&
                  out_.high + 1 >= out_.stored,
              fmt::format("BitsStored (0028,0101) {} and HighBit (0028,0102) {} do not fit",
                          out_.stored, out_.high));
        check(out_.samples == 1 || out_.samples == 3,
              fmt::format("SamplesPerPixel (0028,0002) is {}: not supported", out_.samples));
        check(out_.slope != 0, "RescaleSlope (0028,1053) is 0");
        check(!out_.has_spacing || (out_.spacing[0] > 0 && out_.spacing[1] > 0),
              fmt::format("PixelSpacing (0028,0030) is {}\\{}, expected two positive numbers",
                          out_.spacing[0], out_.spacing[1]));
        if (out_.compressed) return;
        const std::int64_t frame = out_.rows * out_.columns * out_.samples * (out_.allocated / 8);
        const std::int64_t bytes = product(out_.path, frame, out_.frames);
        check(static_cast<std::int64_t>(out_.pixel_bytes) >= bytes,
              fmt::format("short pixel data (7fe0,0010): expected {} bytes, found {}", bytes,
                          out_.pixel_bytes));
    }

    DicomFile& out_;
    File file_;
    Bytes buffer_;
    std::uint64_t at_ = 0, start_ = 0;
    std::size_t filled_ = 0;
    int elements_ = 0;
    bool explicit_ = true, found_ = false;
};

}  // namespace

DicomFile::DicomFile(const std::string& file) : path(file) { Parser(*this).run(); }

}  // namespace edgewise::store
