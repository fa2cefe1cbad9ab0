#include "io/dicom_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <map>

#include "graph/errors.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

constexpr std::size_t kDeepest = 32;
constexpr std::uint32_t kUndefined = 0xffffffff;
constexpr std::uint32_t kItem = 0xfffee000, kItemEnd = 0xfffee00d, kSequenceEnd = 0xfffee0dd;
constexpr std::uint32_t kFloatPixels = 0x7fe00008, kDoublePixels = 0x7fe00009,
                        kPixelData = 0x7fe00010;
constexpr std::uint32_t kSharedGroups = 0x52009229, kFrameGroups = 0x52009230;
constexpr std::uint32_t kDetectors = 0x00540022, kModalityTable = 0x00283000,
                        kWorldValues = 0x00409096, kSegments = 0x00620002;
constexpr std::uint32_t kLongestValue = 1 << 20;  // of an element that describes pixels
constexpr int kMostElements = 1 << 24;
constexpr std::uint32_t kMostFrames = 1 << 19;
constexpr std::int64_t kMostSegments = 65535;
constexpr std::size_t kMostInflated = 64 << 20;  // in front of the pixels

constexpr std::string_view kImplicit = "1.2.840.10008.1.2", kExplicit = "1.2.840.10008.1.2.1",
                           kBigEndian = "1.2.840.10008.1.2.2", kDeflated = "1.2.840.10008.1.2.1.99";
/// RLE, JPEG, JPEG-LS, JPEG 2000 and its high-throughput form: what can be decoded.
constexpr std::string_view kCompressed[] = {
    "1.2.840.10008.1.2.5",     "1.2.840.10008.1.2.4.50", "1.2.840.10008.1.2.4.51",
    "1.2.840.10008.1.2.4.53",  "1.2.840.10008.1.2.4.55", "1.2.840.10008.1.2.4.57",
    "1.2.840.10008.1.2.4.70",  "1.2.840.10008.1.2.4.80", "1.2.840.10008.1.2.4.81",
    "1.2.840.10008.1.2.4.90",  "1.2.840.10008.1.2.4.91", "1.2.840.10008.1.2.4.201",
    "1.2.840.10008.1.2.4.202", "1.2.840.10008.1.2.4.203"};

struct Coding {
    bool explicit_vr = true, big_endian = false;
};

struct Element {
    std::uint32_t tag = 0, length = 0;
    std::string vr;           // "" where it is implicit
    std::uint64_t value = 0;  // offset
};

std::string name(std::uint32_t tag) {
    return fmt::format("({:04x},{:04x})", tag >> 16, tag & 0xffff);
}

bool contains(std::initializer_list<std::string_view> list, std::string_view word) {
    return std::find(list.begin(), list.end(), word) != list.end();
}
/// Lengths of these take two bytes; all others, also those to come (PS3.5 7.1.2), take four.
bool is_short_vr(std::string_view vr) {
    return contains({"AE", "AS", "AT", "CS", "DA", "DS", "DT", "FD", "FL", "IS", "LO",
                     "LT", "PN", "SH", "SL", "SS", "ST", "TM", "UI", "UL", "US"},
                    vr);
}
bool is_vr(std::string_view vr) {
    return is_short_vr(vr) ||
           contains({"OB", "OD", "OF", "OL", "OV", "OW", "SQ", "SV", "UC", "UN", "UR", "UT", "UV"},
                    vr);
}

bool has_marker(std::span<const std::byte> head) {
    return head.size() == 140 && std::memcmp(head.data() + 128, "DICM", 4) == 0;
}
/// Old files have no marker: they start with an element of the file meta group, or with one of
/// those that a data set starts with, and its value is short.
bool starts_data_set(std::span<const std::byte> head) {
    if (head.size() < 140) return false;
    const auto byte = [&](std::size_t i) { return std::to_integer<unsigned>(head[i]); };
    const unsigned group = byte(0), number = byte(2);
    if ((group != 2 && group != 8) || byte(1) != 0 || byte(3) != 0) return false;
    const char vr[3] = {static_cast<char>(byte(4)), static_cast<char>(byte(5)), 0};
    if (is_vr(vr)) return number <= 0x20;
    const bool first = number == 0 || number == 1 || number == 5 || number == 8 || number == 0x16;
    const unsigned length = byte(4);
    return group == 8 && first && byte(5) + byte(6) + byte(7) == 0 &&
           (number <= 1 ? length == 4 : length >= 2 && length <= 64 && length % 2 == 0);
}

/// What the elements of a nested item are about.
enum class About { file, shared, frame, table, segment, nothing };

/// A sequence, or an item of one. A list of these takes the place of recursion.
struct Level {
    bool sequence = true;
    std::uint32_t tag = 0;    // of the sequence
    std::uint64_t end = 0;    // 0: ended by a delimiter
    std::uint64_t limit = 0;  // no element inside may go beyond
    std::int64_t items = 0;   // of a sequence, so far
    Coding coding;
    About about = About::nothing;
    std::int64_t frame = 0;
};

class Parser {
 public:
    explicit Parser(DicomFile& out) : out_(out), file_(out.path), buffer_(1 << 16) {}

    void run() {
        Bytes head(std::min<std::uint64_t>(140, file_.size()));
        head.resize(file_.read_some(0, head));
        if (!has_marker(head) && !starts_data_set(head))
            refuse(out_.path, "not DICOM: no DICM marker at byte 128, no data set at byte 0");
        at_ = has_marker(head) ? 132 : 0;
        // Without a marker there may be no meta group; then the elements themselves tell.
        if (at_ == 0 && head[0] == std::byte{8}) out_.syntax = kImplicit;
        meta();
        syntax();
        try {
            body();
        } catch (const InputError&) {
            if (!out_.unknown_syntax) throw;
            refuse(out_.path, out_.syntax_problem());
        }
        if (out_.kind == DicomFile::Pixels::none && out_.rows == 0) return;
        finish();
    }

 private:
    template <class T>
    T number(std::uint64_t offset) {
        std::byte raw[sizeof(T)];
        bytes(offset, raw);
        if (coding_.big_endian) std::reverse(raw, raw + sizeof raw);
        T value;
        std::memcpy(&value, raw, sizeof value);
        return value;
    }
    void bytes(std::uint64_t offset, std::span<std::byte> into) {
        if (into.size() > buffer_.size()) {
            if (file_.read_some(offset, into) < into.size())
                refuse(out_.path, fmt::format("ends inside an element at byte {}", offset));
            return;
        }
        if (offset < start_ || offset + into.size() > start_ + filled_) {
            start_ = offset;
            filled_ = file_.read_some(offset, buffer_);
            if (filled_ < into.size())
                refuse(out_.path, fmt::format("ends inside an element at byte {}", offset));
        }
        std::memcpy(into.data(), buffer_.data() + (offset - start_), into.size());
    }
    Bytes value(const Element& element) {
        if (element.length > kLongestValue)
            refuse(out_.path,
                   fmt::format("element {} is {} bytes long", name(element.tag), element.length));
        Bytes value(element.length);
        if (element.length > 0) bytes(element.value, value);
        return value;
    }
    std::string text(const Element& element) {
        const Bytes raw = value(element);
        std::string text(reinterpret_cast<const char*>(raw.data()), raw.size());
        while (!text.empty() && (text.back() == '\0' || text.back() == ' ')) text.pop_back();
        return std::string(trim(text));
    }

    /// Reads the head of the element at at_, and moves at_ to its value.
    Element element() {
        if (++elements_ > kMostElements) refuse(out_.path, "has too many elements");
        Element found;
        const auto group = number<std::uint16_t>(at_);
        found.tag = static_cast<std::uint32_t>(group) << 16 | number<std::uint16_t>(at_ + 2);
        at_ += 4;
        char vr[3] = "";
        if (group != 0xfffe && coding_.explicit_vr) {
            bytes(at_, std::as_writable_bytes(std::span(vr, 2)));
            found.vr = vr;
        }
        const auto capital = [](char c) { return c >= 'A' && c <= 'Z'; };
        // Some writers put elements without a representation between others that have one.
        if (!capital(vr[0]) || !capital(vr[1])) {
            found.vr.clear();
            found.length = number<std::uint32_t>(at_);
            at_ += 4;
        } else {
            const bool wide = !is_short_vr(found.vr);
            found.length = wide ? number<std::uint32_t>(at_ + 4) : number<std::uint16_t>(at_ + 2);
            at_ += wide ? 8 : 4;
        }
        found.value = at_;
        if (found.length != kUndefined && found.length > file_.size() - std::min(at_, file_.size()))
            refuse(out_.path, fmt::format("element {} claims {} bytes at byte {}, the file has {}",
                                          name(found.tag), found.length, at_, file_.size()));
        return found;
    }

    void meta() {
        while (at_ + 8 <= file_.size() && number<std::uint16_t>(at_) == 2) {
            const Element here = element();
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
        out_.deflated = out_.syntax == kDeflated;
        out_.big_endian = out_.syntax == kBigEndian;
        coding_ = {out_.syntax != kImplicit, out_.big_endian};
        // What is not known, videos too, is written as compressed pixels are (PS3.5 A.4).
        out_.unknown_syntax = !out_.compressed && !out_.deflated && coding_.explicit_vr &&
                              out_.syntax != kExplicit && !out_.big_endian;
        out_.compressed |= out_.unknown_syntax;
        out_.body = at_;
        if (out_.deflated) file_.deflated_from(at_);
        filled_ = 0;
        // Written with representations although the syntax says without, or the other way round.
        char vr[3] = "";
        if (file_.size() - at_ >= 8) bytes(at_ + 4, std::as_writable_bytes(std::span(vr, 2)));
        if (!coding_.explicit_vr) coding_.explicit_vr = is_vr(vr);
    }

    /// Elements up to the pixels.
    void body() {
        const Coding whole = coding_;
        std::uint64_t before = at_;
        for (;;) {
            while (!levels_.empty() && levels_.back().end != 0 && at_ >= levels_.back().end)
                levels_.pop_back();
            coding_ = levels_.empty() ? whole : levels_.back().coding;
            if (!more()) return;
            before = at_;
            const Element here = element();
            if (here.tag == kItemEnd || here.tag == kSequenceEnd) {
                if (levels_.empty() || levels_.back().end != 0)
                    refuse(out_.path,
                           fmt::format("a delimiter without a sequence at byte {}", before));
                levels_.pop_back();
                continue;
            }
            if (here.length != kUndefined && !levels_.empty() &&
                here.value + here.length > levels_.back().limit)
                refuse(out_.path, fmt::format("element {} at byte {} goes beyond its sequence",
                                              name(here.tag), before));
            if (levels_.empty() &&
                contains_tag({kPixelData, kFloatPixels, kDoublePixels}, here.tag))
                return pixels(here);
            if (here.tag == kItem)
                open_item(here, before);
            else if (here.length == kUndefined && is_fragments(here))
                fragments(nullptr);
            else if (opens(here))
                open_sequence(here);
            else {
                check_depth(here);
                take(here);
                at_ = here.value + here.length;
            }
        }
    }
    /// What is skipped is not read, but sequences that hold little but each other are an attack on
    /// whatever reads the file next: the first element of the first item, and so on, tells.
    void check_depth(const Element& here) {
        std::uint64_t at = here.value, end = here.value + here.length;
        for (std::size_t depth = levels_.size() / 2; here.vr == "SQ" && end - at >= 20; ++depth) {
            if (depth > kDeepest)
                refuse(out_.path, fmt::format("sequences nested deeper than {} at byte {}",
                                              kDeepest, here.value));
            std::byte head[20];
            bytes(at, head);
            if (head[12] != std::byte{'S'} || head[13] != std::byte{'Q'}) return;
            at += sizeof head;
        }
    }
    bool more() {
        if (at_ + 8 > file_.size()) return false;
        if (!out_.deflated) return true;
        // Where a deflated stream ends is seen only by reading on.
        std::byte head[8];
        if (at_ > kMostInflated)
            refuse(out_.path,
                   fmt::format("more than {} bytes lie in front of its pixels", kMostInflated));
        return file_.read_some(at_, head) == sizeof head;
    }
    static bool contains_tag(std::initializer_list<std::uint32_t> list, std::uint32_t tag) {
        return std::find(list.begin(), list.end(), tag) != list.end();
    }
    /// Compressed pixels of an icon; their fragments hold no elements.
    static bool is_fragments(const Element& here) {
        return here.tag == kPixelData || contains({"OB", "OW"}, here.vr);
    }
    /// Whether to look inside. What has a length and is not needed is skipped as a whole.
    bool opens(const Element& here) {
        if (here.length == kUndefined) return true;
        if (!contains({"SQ", "UN", ""}, here.vr) || here.length < 8) return false;
        if (levels_.empty())
            return contains_tag(
                {kSharedGroups, kFrameGroups, kDetectors, kModalityTable, kWorldValues, kSegments},
                here.tag);
        if (levels_.back().sequence) return false;
        return is_group(here.tag);
    }
    /// Whether what is in this sequence of functional groups is about the frame.
    bool is_group(std::uint32_t tag) const {
        const About about = levels_.back().about;
        return (about == About::shared || about == About::frame) &&
               contains_tag({0x00209111, 0x00209113, 0x00209116, 0x00289110, 0x00289145, 0x0062000a,
                             0x0048021a, kWorldValues},
                            tag);
    }
    std::uint64_t limit() const { return levels_.empty() ? file_.size() : levels_.back().limit; }
    void push(Level level, const Element& here) {
        level.end = here.length == kUndefined ? 0 : here.value + here.length;
        level.limit = level.end ? level.end : limit();
        levels_.push_back(level);
        if (levels_.size() > 2 * kDeepest)
            refuse(out_.path,
                   fmt::format("sequences nested deeper than {} at byte {}", kDeepest, at_));
    }
    void open_sequence(const Element& here) {
        Level level;
        level.tag = here.tag;
        level.coding = coding_;
        // PS3.5 6.2.2: inside UN everything is implicit and little-endian, whatever the file is.
        if (here.vr == "UN") level.coding = {false, false};
        if (!levels_.empty() && is_group(here.tag)) {
            level.about = levels_.back().about;
            level.frame = levels_.back().frame;
        }
        push(level, here);
    }
    void open_item(const Element& here, std::uint64_t before) {
        if (levels_.empty() || !levels_.back().sequence)
            refuse(out_.path, fmt::format("an item without a sequence at byte {}", before));
        Level& sequence = levels_.back();
        Level level = sequence;
        level.sequence = false;
        const std::int64_t index = sequence.items++;
        if (levels_.size() == 1) {
            if (sequence.tag == kSharedGroups && index == 0) level.about = About::shared;
            if (sequence.tag == kDetectors && index == 0) level.about = About::file;
            if (sequence.tag == kWorldValues && index == 0) level.about = About::file;
            if (sequence.tag == kModalityTable && index == 0) level.about = About::table;
            if (sequence.tag == kSegments) {
                level.about = About::segment;
                if (index >= kMostSegments)
                    refuse(out_.path, "more than 65535 segments (0062,0002)");
                out_.segments.emplace_back();
            }
            if (sequence.tag == kFrameGroups) {
                level.about = About::frame;
                level.frame = index;
                if (index >= std::min<std::int64_t>(out_.frames, kMostFrames))
                    refuse(out_.path,
                           fmt::format("more functional groups (5200,9230) than frames: {}",
                                       out_.frames));
                out_.each.emplace_back();
            }
        } else if (index > 0 || levels_.size() > 3) {
            level.about = About::nothing;  // only the first of several says what holds
        }
        push(level, here);
    }

    void pixels(const Element& here) {
        using Kind = DicomFile::Pixels;
        out_.kind = here.tag == kFloatPixels    ? Kind::floats
                    : here.tag == kDoublePixels ? Kind::doubles
                                                : Kind::integers;
        if (here.length == kUndefined && !out_.compressed)
            refuse(out_.path, "pixel data (7fe0,0010) of undefined length, but not compressed");
        out_.pixels = here.value;
        out_.pixel_bytes = here.length == kUndefined ? 0 : here.length;
        out_.pixel_words = here.vr != "OB";
        // Some archives decode frames and forget to change the syntax.
        if (here.length != kUndefined && !out_.unknown_syntax) out_.compressed = false;
        if (here.length == kUndefined) fragments(&out_.fragments);
    }
    /// Up to the end of a sequence of fragments; the first is the table of frame offsets.
    void fragments(std::vector<DicomFile::Fragment>* into) {
        bool first = true;
        for (;;) {
            if (!more()) refuse(out_.path, "ends inside the fragments of its pixel data");
            const Element item = element();
            if (item.tag == kSequenceEnd) return;
            if (item.tag != kItem || item.length == kUndefined)
                refuse(out_.path, "the fragments of the pixel data (7fe0,0010) are damaged");
            if (into && first) {
                if (out_.frame_offsets.empty())
                    for (std::uint32_t i = 0; i + 4 <= std::min(item.length, 4 * kMostFrames);
                         i += 4)
                        out_.frame_offsets.push_back(number<std::uint32_t>(item.value + i));
            } else if (into) {
                into->push_back({item.value, item.length});
                out_.pixel_bytes += item.length;
            }
            first = false;
            at_ = item.value + item.length;
        }
    }

    /// Numbers, written in the element's representation or, where it says none, in the usual one.
    std::vector<double> numbers(const Element& here, std::string_view usual) {
        const std::string_view vr = here.vr.empty() || here.vr == "UN" ? usual : here.vr;
        std::vector<double> found;
        const auto binary = [&]<class T>(T) {
            if (here.length % sizeof(T) != 0 || here.length > kLongestValue)
                refuse(out_.path, fmt::format("element {} has {} bytes, expected numbers of {}",
                                              name(here.tag), here.length, sizeof(T)));
            for (std::uint32_t i = 0; i < here.length; i += sizeof(T))
                found.push_back(static_cast<double>(number<T>(here.value + i)));
        };
        if (vr == "US")
            binary(std::uint16_t{});
        else if (vr == "SS")
            binary(std::int16_t{});
        else if (vr == "UL")
            binary(std::uint32_t{});
        else if (vr == "SL")
            binary(std::int32_t{});
        else if (vr == "FL")
            binary(float{});
        else if (vr == "FD")
            binary(double{});
        else {
            const std::string all = text(here);
            if (all.empty()) return found;
            for (std::string_view part : split(all, '\\')) {
                const auto entry = to_double(trim(part));
                if (!entry)
                    refuse(out_.path, fmt::format("element {} is '{}', expected numbers",
                                                  name(here.tag), shown(all)));
                found.push_back(*entry);
            }
        }
        for (double entry : found)
            if (!std::isfinite(entry))
                refuse(out_.path, fmt::format("element {} holds {}", name(here.tag), entry));
        return found;
    }
    template <std::size_t N>
    void several(const Element& here, std::string_view usual,
                 std::optional<std::array<double, N>>& into) {
        const std::vector<double> found = numbers(here, usual);
        if (found.empty()) return;
        if (found.size() != N)
            refuse(out_.path, fmt::format("element {} holds {} numbers, expected {}",
                                          name(here.tag), found.size(), N));
        std::copy(found.begin(), found.end(), into.emplace().begin());
    }
    /// How many digits behind the point three numbers were written with; negative: so many of those
    /// before it are not said. Numbers that are no text have all there are.
    std::array<int, 3> decimals_of(const Element& here) {
        constexpr int kAll = 17;
        std::array<int, 3> decimals{kAll, kAll, kAll};
        const bool is_text = here.vr.empty() || here.vr == "UN" || here.vr == "DS";
        if (!is_text) return decimals;
        const std::string all = text(here);
        std::size_t axis = 0;
        for (const std::string_view word : split(all, '\\')) {
            if (axis == decimals.size()) break;
            const std::string_view part = trim(word);
            const std::size_t e = part.find_first_of("eE");
            const std::string_view digits = part.substr(0, e);
            const std::size_t point = digits.find('.');
            const auto behind = point == digits.npos ? 0 : digits.size() - point - 1;
            double power = 0;
            if (e != part.npos) power = to_double(part.substr(e + 1)).value_or(0);
            decimals[axis++] = static_cast<int>(
                std::clamp(static_cast<double>(behind) - power, -double(kAll), double(kAll)));
        }
        return decimals;
    }
    void one(const Element& here, std::string_view usual, std::optional<double>& into) {
        const std::vector<double> found = numbers(here, usual);
        if (!found.empty()) into = found[0];
    }
    std::int64_t whole(const Element& here, std::string_view usual, std::int64_t otherwise) {
        const std::vector<double> found = numbers(here, usual);
        const bool fits = !found.empty() && std::abs(found[0]) < 9e15;
        return fits ? static_cast<std::int64_t>(found[0]) : otherwise;
    }
    int small(const Element& here) {
        if (here.length != 2)
            refuse(out_.path,
                   fmt::format("element {} has {} bytes, expected 2", name(here.tag), here.length));
        return number<std::uint16_t>(here.value);
    }

    void take(const Element& here) {
        if (levels_.empty()) {
            take_file(here);
            take_place(here, out_.own);
            return;
        }
        const Level& level = levels_.back();
        if (level.sequence) return;
        if (level.about == About::shared) take_place(here, out_.shared);
        if (level.about == About::frame)
            take_place(here, out_.each[static_cast<std::size_t>(level.frame)]);
        if (level.about == About::file) take_place(here, out_.own);
        if (level.about == About::table) take_table(here, out_.modality_table);
        if (level.about == About::segment) take_segment(here, out_.segments.back());
    }
    void take_segment(const Element& here, DicomSegment& segment) {
        if (here.tag == 0x00620004) segment.number = whole(here, "US", 0);
        if (here.tag == 0x00620005) segment.label = text(here);
        if (here.tag == 0x0062000d) segment.lab = numbers(here, "US");
    }
    void take_table(const Element& here, DicomTable& table) {
        if (here.tag == 0x00283002) table.descriptor = numbers(here, "US");
        if (here.tag == 0x00283006) table.data = words(here);
    }
    /// Table data, little-endian.
    Bytes words(const Element& here) {
        Bytes data = value(here);
        if (coding_.big_endian && here.vr != "OB")
            for (std::size_t i = 0; i + 1 < data.size(); i += 2) std::swap(data[i], data[i + 1]);
        return data;
    }

    /// What a frame may say of itself.
    void take_place(const Element& here, DicomFrame& frame) {
        std::optional<double> number;
        switch (here.tag) {
            case 0x00180050:
                return one(here, "DS", frame.thickness);
            case 0x00180088:
                return one(here, "DS", frame.between);
            case 0x00200032:
                several(here, "DS", frame.position);
                if (frame.position) frame.decimals = decimals_of(here);
                return;
            case 0x00200037:
                return several(here, "DS", frame.orientation);
            case 0x00280030:
                return several(here, "DS", frame.spacing);
            case 0x00281052:
                return one(here, "DS", frame.intercept);
            case 0x00281053:
                return one(here, "DS", frame.slope);
            case 0x00281054:
                out_.rescale_type = text(here);
                return;
            case 0x00409224:
                return one(here, "FD", frame.world_intercept);
            case 0x00409225:
                return one(here, "FD", frame.world_slope);
            case 0x00200100:  // TemporalPositionIdentifier of a file, ...Index of a frame
                frame.temporal = whole(here, "IS", 0);
                return;
            case 0x00209128:
                frame.temporal = whole(here, "UL", 0);
                return;
            case 0x00209157:
                frame.dimensions = numbers(here, "UL");
                return;
            case 0x0062000b:
                frame.segment = whole(here, "US", 0);
                return;
            case 0x0048021e:
            case 0x0048021f:
                one(here, "SL", number);
                if (!frame.tile) frame.tile.emplace();
                (*frame.tile)[here.tag & 1] = number.value_or(1);
                return;
            default:
                return;
        }
    }

    void take_file(const Element& here) {
        switch (here.tag) {
            case 0x00080005:
                out_.characters = text(here);
                break;
            case 0x00080008:
                out_.image_type = text(here);
                break;
            case 0x00080016:
                out_.sop_class = text(here);
                break;
            case 0x00080018:
                out_.uid = text(here);
                break;
            case 0x00080022:
            case 0x00080032:
                out_.acquired += text(here);
                break;
            case 0x00080033:  // ContentTime
            case 0x00180081:  // EchoTime
            case 0x00180086:  // EchoNumbers
            case 0x00181060:  // TriggerTime
                out_.moment += fmt::format("{:x}={} ", here.tag, text(here));
                break;
            case 0x00189087:  // DiffusionBValue
                out_.moment += fmt::format("b={} ", fmt::join(numbers(here, "FD"), ","));
                break;
            case 0x00080060:
                out_.modality = text(here);
                break;
            case 0x0008103e:
                out_.text = text(here);
                break;
            case 0x00541001:
                out_.units = text(here);
                break;
            case 0x00181063:
            case 0x00181065:
                has_frame_time_ = true;
                break;
            case 0x00181164:
            case 0x00182010:
            case 0x30020011:
                if (!out_.detector_spacing) several(here, "DS", out_.detector_spacing);
                break;
            case 0x0020000e:
                out_.series = text(here);
                break;
            case 0x00200012:
                out_.acquisition = to_integer(text(here)).value_or(0);
                break;
            case 0x00200013:
                out_.instance = to_integer(text(here)).value_or(0);
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
            case 0x00280009:
                // Pairs of group and element; a time, or a vector of times.
                for (std::uint32_t i = 0; i + 4 <= std::min(here.length, 64u); i += 4)
                    if (number<std::uint16_t>(here.value + i) == 0x0018)
                        out_.frames_are_times = true;
                has_increment_ = here.length >= 4;
                break;
            case 0x00280010:
                out_.rows = small(here);
                break;
            case 0x00280011:
                out_.columns = small(here);
                break;
            case 0x00280034:
                several(here, "IS", out_.aspect);
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
            case 0x00280120:
            case 0x00280121:
                if (here.length == 2) padding_[here.tag & 1] = number<std::uint16_t>(here.value);
                break;
            case 0x00280122:
            case 0x00280124:
                float_padding_[here.tag == 0x00280124] = first(numbers(here, "FL"));
                break;
            case 0x00280123:
            case 0x00280125:
                float_padding_[here.tag == 0x00280125] = first(numbers(here, "FD"));
                break;
            case 0x00281101:
            case 0x00281102:
            case 0x00281103:
                out_.palette[here.tag - 0x00281101].descriptor = numbers(here, "US");
                break;
            case 0x00281201:
            case 0x00281202:
            case 0x00281203:
                out_.palette[here.tag - 0x00281201].data = words(here);
                break;
            case 0x00281221:
            case 0x00281222:
            case 0x00281223:
                out_.palette[here.tag - 0x00281221].data = words(here);
                out_.palette[here.tag - 0x00281221].segmented = true;
                break;
            case 0x00480006:
                out_.total_columns = whole(here, "UL", 0);
                break;
            case 0x00480007:
                out_.total_rows = whole(here, "UL", 0);
                break;
            case 0x00540080:
                out_.slice_vector = numbers(here, "US");
                break;
            case 0x00620001:
                out_.fractional = text(here) == "FRACTIONAL";
                break;
            case 0x0062000e:
                out_.most_fraction = static_cast<double>(whole(here, "US", 255));
                break;
            case 0x3004000c:
                out_.grid_offsets = numbers(here, "DS");
                break;
            case 0x3004000e:
                out_.dose_scaling = first(numbers(here, "DS")).value_or(0);
                break;
            case 0x7fe00001:  // ExtendedOffsetTable: for frames beyond 4 GiB
                for (std::uint32_t i = 0; i + 8 <= std::min(here.length, 8 * kMostFrames); i += 8)
                    out_.frame_offsets.push_back(number<std::uint64_t>(here.value + i));
                break;
            default:
                take_private(here);
                break;
        }
    }
    static std::optional<double> first(const std::vector<double>& all) {
        return all.empty() ? std::nullopt : std::optional(all[0]);
    }

    /// A maker's own elements: who owns which block is said by the elements 10 to ff of the group.
    void take_private(const Element& here) {
        const std::uint32_t group = here.tag >> 16, number = here.tag & 0xffff;
        if (group != 0x0019 && group != 0x0029) return;
        if (number >= 0x10 && number <= 0xff) {
            owners_[group << 8 | number] = text(here);
            return;
        }
        const auto owner = owners_.find(group << 8 | number >> 8);
        if (owner == owners_.end()) return;
        if (owner->second == "SIEMENS MR HEADER" && (number & 0xff) == 0x0a)
            out_.tiles = whole(here, "US", 0);
        if (owner->second == "SIEMENS CSA HEADER" && (number & 0xff) == 0x10) take_csa(here);
    }
    /// The table of names and texts that Siemens scanners add: "SV10", four bytes, a count, 77;
    /// each entry has a name of 64 bytes, 20 more bytes of which the count of its items is the last
    /// but one, and items of four lengths and a text, padded to 4.
    void take_csa(const Element& here) {
        if (here.length < 16 || here.length > kLongestValue) return;
        const Bytes raw = value(here);
        if (std::memcmp(raw.data(), "SV10", 4) != 0) return;
        const auto word = [&](std::size_t at) {
            std::uint32_t found;
            std::memcpy(&found, raw.data() + at, sizeof found);
            return found;
        };
        std::size_t at = 16;
        for (std::uint32_t entries = word(8); entries > 0 && at + 84 <= raw.size(); --entries) {
            const auto* start = reinterpret_cast<const char*>(raw.data() + at);
            const std::string title(start, std::find(start, start + 64, '\0'));
            const std::uint32_t items = word(at + 76);
            at += 84;
            std::vector<double> found;
            for (std::uint32_t i = 0; i < items; ++i) {
                if (at + 16 > raw.size()) return;
                const std::size_t length = word(at + 4);
                at += 16;
                if (length > raw.size() - at) return;
                const std::string_view entry(reinterpret_cast<const char*>(raw.data() + at),
                                             length);
                const auto number = to_double(trim(entry.substr(0, entry.find('\0'))));
                if (number && std::isfinite(*number)) found.push_back(*number);
                at += std::min((length + 3) / 4 * 4, raw.size() - at);
            }
            if (title == "NumberOfImagesInMosaic" && !found.empty() && out_.tiles == 0)
                out_.tiles = static_cast<std::int64_t>(std::clamp(found[0], 0.0, 65535.0));
            if (title == "SliceNormalVector" && found.size() == 3)
                out_.tiles_normal = {found[0], found[1], found[2]};
        }
    }

    void finish() {
        using Kind = DicomFile::Pixels;
        const auto check = [&](bool good, const std::string& what) {
            if (!good) refuse(out_.path, what);
        };
        check(out_.rows >= 1 && out_.columns >= 1 && out_.frames >= 1 && out_.frames < (1 << 30),
              fmt::format("Rows (0028,0010) {}, Columns (0028,0011) {}, NumberOfFrames {}: "
                          "expected 1 or more",
                          out_.rows, out_.columns, out_.frames));
        check(out_.kind != Kind::none, "pixel data (7fe0,0010) are missing");
        if (out_.kind != Kind::integers) {
            out_.allocated = out_.kind == Kind::floats ? 32 : 64;
            out_.stored = out_.allocated;
            out_.high = out_.stored - 1;
            out_.is_signed = true;
            check(out_.samples == 1 && !out_.compressed, "pixels of floats: expected one sample");
        } else {
            const bool mask = out_.allocated == 1 && !out_.compressed && out_.samples == 1;
            check(mask || out_.allocated == 8 || out_.allocated == 16 || out_.allocated == 32,
                  fmt::format("BitsAllocated (0028,0100) is {}: not supported", out_.allocated));
        }
        check(out_.stored >= 1 && out_.stored <= out_.allocated && out_.high < out_.allocated &&
                  out_.high + 1 >= out_.stored,
              fmt::format("BitsStored (0028,0101) {} and HighBit (0028,0102) {} do not fit",
                          out_.stored, out_.high));
        check(out_.samples == 1 || out_.samples == 3,
              fmt::format("SamplesPerPixel (0028,0002) is {}: not supported", out_.samples));
        const auto check_frame = [&](const DicomFrame& frame) {
            check(frame.slope.value_or(1) != 0, "RescaleSlope (0028,1053) is 0");
            check(!frame.spacing || ((*frame.spacing)[0] > 0 && (*frame.spacing)[1] > 0),
                  fmt::format("PixelSpacing (0028,0030) is {}\\{}, expected two positive numbers",
                              frame.spacing ? (*frame.spacing)[0] : 0,
                              frame.spacing ? (*frame.spacing)[1] : 0));
        };
        check_frame(out_.own);
        check_frame(out_.shared);
        for (const DicomFrame& frame : out_.each) check_frame(frame);
        for (auto* lengths : {&out_.detector_spacing, &out_.aspect})
            if (*lengths && !((**lengths)[0] > 0 && (**lengths)[1] > 0)) lengths->reset();
        if (!has_increment_) out_.frames_are_times = has_frame_time_;
        take_padding();
        if (out_.compressed) return;
        const std::int64_t bits = product(out_.path, out_.frame_bits(), out_.frames);
        check(static_cast<std::int64_t>(out_.pixel_bytes) >= (bits + 7) / 8,
              fmt::format("short pixel data (7fe0,0010): expected {} bytes, found {}",
                          (bits + 7) / 8, out_.pixel_bytes));
    }
    void take_padding() {
        if (out_.kind != DicomFile::Pixels::integers) {
            if (!float_padding_[0]) return;
            const double value = *float_padding_[0], limit = float_padding_[1].value_or(value);
            out_.padding = {std::min(value, limit), std::max(value, limit)};
            return;
        }
        if (!padding_[0] || out_.allocated < 8) return;
        // 16 bits with the sign that the pixels have; bits that are not stored mean nothing.
        const auto meant = [&](std::uint16_t raw) {
            const int unused = 16 - std::min(out_.stored, 16);
            const auto up = static_cast<std::uint16_t>(raw << unused);
            return out_.is_signed ? static_cast<std::int16_t>(up) >> unused : up >> unused;
        };
        const double value = meant(*padding_[0]), limit = meant(padding_[1].value_or(*padding_[0]));
        out_.padding = {std::min(value, limit), std::max(value, limit)};
    }

    DicomFile& out_;
    DicomBytes file_;
    Bytes buffer_;
    std::uint64_t at_ = 0, start_ = 0;
    std::size_t filled_ = 0;
    int elements_ = 0;
    Coding coding_;
    std::vector<Level> levels_;
    std::map<std::uint32_t, std::string> owners_;
    std::array<std::optional<std::uint16_t>, 2> padding_;
    std::array<std::optional<double>, 2> float_padding_;
    bool has_frame_time_ = false, has_increment_ = false;
};

}  // namespace

DicomBytes::DicomBytes(const std::string& path) : file_(std::make_shared<const File>(path)) {}

void DicomBytes::deflated_from(std::uint64_t offset) {
    begin_ = offset;
    stream_ = open_stream(file_, offset, file_->size(), Wrapping::deflate);
}

std::uint64_t DicomBytes::size() const noexcept {
    if (!stream_) return file_->size();
    if (ended_) return begin_ + inflated_.size();
    return begin_ + (file_->size() - begin_) * kDeflateRatio;
}

std::size_t DicomBytes::read_some(std::uint64_t offset, std::span<std::byte> into) {
    if (!stream_ || offset < begin_) return file_->read_some(offset, into);
    const std::uint64_t from = offset - begin_;
    constexpr std::size_t kStep = 1 << 20;
    while (!ended_ && inflated_.size() < from + into.size()) {
        const std::size_t had = inflated_.size();
        inflated_.resize(had + kStep);
        const std::size_t got = stream_->read(std::span(inflated_).subspan(had));
        inflated_.resize(had + got);
        ended_ = got < kStep;
    }
    if (from >= inflated_.size()) return 0;
    const std::size_t count = std::min(into.size(), inflated_.size() - from);
    std::copy_n(inflated_.begin() + static_cast<std::ptrdiff_t>(from), count, into.begin());
    return count;
}

void DicomBytes::read(std::uint64_t offset, std::span<std::byte> into) {
    const std::size_t got = offset < size() ? read_some(offset, into) : 0;
    if (got < into.size())
        refuse(file_->path(), fmt::format("too short: pixel data need {} bytes at {}, there are {}",
                                          into.size(), offset, got));
}

void DicomFrame::fill(const DicomFrame& other) {
    const auto take = [](auto& mine, const auto& theirs) {
        if (!mine) mine = theirs;
    };
    if (!position) decimals = other.decimals;
    take(position, other.position);
    take(orientation, other.orientation);
    take(spacing, other.spacing);
    take(thickness, other.thickness);
    take(between, other.between);
    // A slope and its intercept belong together.
    if (!slope && !intercept) {
        slope = other.slope;
        intercept = other.intercept;
    }
    if (!world_slope && !world_intercept) {
        world_slope = other.world_slope;
        world_intercept = other.world_intercept;
    }
    take(tile, other.tile);
    if (temporal == 0) temporal = other.temporal;
    if (segment == 0) segment = other.segment;
    if (dimensions.empty()) dimensions = other.dimensions;
}

DicomFile::DicomFile(const std::string& file) : path(file) { Parser(*this).run(); }

DicomFile::DicomFile(const std::string& file, std::string& damage) : path(file) {
    try {
        Parser(*this).run();
    } catch (const InputError& error) {
        damage = error.message().marked();
    }
}

std::string DicomFile::syntax_problem() const {
    return "transfer syntax '" + shown(syntax) + "' is unknown or not supported";
}

DicomFrame DicomFile::frame(std::int64_t k) const {
    DicomFrame found;
    if (static_cast<std::size_t>(k) < each.size()) found = each[static_cast<std::size_t>(k)];
    found.fill(shared);
    found.fill(own);
    return found;
}

std::int64_t DicomFile::frame_bits() const noexcept {
    const std::int64_t pixels_of_frame = rows * columns;
    // Two pixels share their colour: four samples for two.
    const bool halved = samples == 3 && photometric.ends_with("_422") && !compressed;
    return pixels_of_frame * (halved ? 2 : samples) * allocated;
}

std::string DicomFile::kind_of_object() const {
    if (sop_class == "1.2.840.10008.1.3.10") return "DICOMDIR";
    return modality.empty() ? "an object of class '" + shown(sop_class) + "'" : shown(modality);
}

bool is_dicom(const std::string& path) {
    const Bytes head = File(path).head(140);
    return has_marker(head) || starts_data_set(head);
}

}  // namespace edgewise::store
