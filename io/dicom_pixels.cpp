// The pixels of DICOM: encodings, unused bits, colour and tables (PS3.3 C.7.6.3, PS3.5 8 and A).

#include "io/dicom_pixels.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <limits>
#include <optional>
#include <vector>

#include "io/module.hpp"
#include "io/reader.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

constexpr std::string_view kRle = "1.2.840.10008.1.2.5";
constexpr std::int64_t kRleDensest = 64;  // two bytes stand for 128 at most
constexpr std::string_view kJpegs = "1.2.840.10008.1.2.4.";

bool has_table(const DicomTable& table) { return !table.descriptor.empty(); }
bool is_palette(const DicomFile& file) { return file.photometric == "PALETTE COLOR"; }

Type stored_type(const DicomFile& file) {
    if (file.kind == DicomFile::Pixels::floats) return Type::f32;
    if (file.kind == DicomFile::Pixels::doubles) return Type::f64;
    if (file.allocated <= 8) return file.is_signed ? Type::i8 : Type::u8;
    if (file.allocated == 16) return file.is_signed ? Type::i16 : Type::u16;
    return file.is_signed ? Type::i32 : Type::u32;
}

std::uint16_t big16(std::span<const std::byte> bytes, std::size_t at) {
    return static_cast<std::uint16_t>(std::to_integer<unsigned>(bytes[at]) << 8 |
                                      std::to_integer<unsigned>(bytes[at + 1]));
}
std::uint32_t big32(std::span<const std::byte> bytes, std::size_t at) {
    return static_cast<std::uint32_t>(big16(bytes, at)) << 16 | big16(bytes, at + 2);
}
std::uint32_t little32(std::span<const std::byte> bytes, std::size_t at) {
    std::uint32_t word;
    std::memcpy(&word, bytes.data() + at, sizeof word);
    return word;
}

struct Size {
    std::int64_t columns = 0, rows = 0, samples = 0, bits = 0;
    std::optional<bool> ybr;  // whether the stream says that it holds luminance and differences
};

/// What a JPEG or JPEG-LS stream says of itself; zeros where it says nothing sound.
Size size_of_jpeg(std::span<const std::byte> bytes) {
    std::optional<bool> ybr;
    for (std::size_t at = 2; at + 10 <= bytes.size();) {
        if (bytes[at] != std::byte{0xff}) return {};
        const auto marker = std::to_integer<unsigned>(bytes[at + 1]);
        if (marker == 0xff) {
            ++at;  // markers may be preceded by any number of these
            continue;
        }
        const bool lossless = marker == 0xc3 || marker == 0xc7 || marker == 0xcb || marker == 0xf7;
        const bool frame = (marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 &&
                            marker != 0xcc) ||
                           lossless;
        if (frame)
            return {big16(bytes, at + 7), big16(bytes, at + 5),
                    std::to_integer<std::int64_t>(bytes[at + 9]),
                    std::to_integer<std::int64_t>(bytes[at + 4]), lossless ? std::nullopt : ybr};
        if (marker == 0xda || marker == 0xd9) return {};
        const std::size_t length = big16(bytes, at + 2);
        if (length >= 7 && marker == 0xe0 && !ybr && std::memcmp(&bytes[at + 4], "JFIF", 4) == 0)
            ybr = true;
        if (length >= 14 && marker == 0xee && at + 16 <= bytes.size() &&
            std::memcmp(&bytes[at + 4], "Adobe", 5) == 0)
            ybr = bytes[at + 15] != std::byte{0};
        at += 2 + length;
    }
    return {};
}

/// The same of a JPEG 2000 codestream, bare or in the boxes that some writers leave around it.
Size size_of_jpeg2000(std::span<const std::byte> bytes) {
    constexpr std::byte kStart[] = {std::byte{0xff}, std::byte{0x4f}, std::byte{0xff},
                                    std::byte{0x51}};
    const auto head = bytes.first(std::min<std::size_t>(bytes.size(), 4096));
    const auto found = std::search(head.begin(), head.end(), std::begin(kStart), std::end(kStart));
    const auto at = static_cast<std::size_t>(found - head.begin());
    if (at + 43 > bytes.size()) return {};
    // Marker segment SIZ: capabilities, size and origin of the grid, of tiles, count, depth.
    const std::uint32_t x = big32(bytes, at + 8), y = big32(bytes, at + 12);
    const std::uint32_t x0 = big32(bytes, at + 16), y0 = big32(bytes, at + 20);
    const std::uint32_t tile_x = big32(bytes, at + 24), tile_y = big32(bytes, at + 28);
    if (x <= x0 || y <= y0 || tile_x == 0 || tile_y == 0) return {};
    // Many tiny tiles cost memory each.
    if (double(x) / tile_x * (double(y) / tile_y) > 65535) return {};
    return {x - x0, y - y0, big16(bytes, at + 40),
            (std::to_integer<std::int64_t>(bytes[at + 42]) & 0x7f) + 1, std::nullopt};
}

/// The last number of a syntax's UID: from 50 JPEG, from 80 JPEG-LS, from 90 JPEG 2000.
std::int64_t jpeg_of(const DicomFile& file) {
    return to_integer(std::string_view(file.syntax).substr(kJpegs.size())).value_or(0);
}

/// What the stream says of its size must be what the file says, before a library believes it.
/// @param whole  all of the frame is there; else it may say nothing yet
Size expect_size(const DicomFile& file, std::int64_t k, std::span<const std::byte> bytes,
                 bool whole) {
    const Size size = jpeg_of(file) >= 90 ? size_of_jpeg2000(bytes) : size_of_jpeg(bytes);
    if (size.columns == 0 && !whole) return size;
    if (size.columns != file.columns || size.rows != file.rows || size.samples != file.samples ||
        size.bits < 1 || size.bits > file.allocated)
        refuse(file.path,
               fmt::format("frame {}: its compressed pixels are {} x {} of {} samples of {} bits; "
                           "the file says {} x {}, {}, {}",
                           k, size.columns, size.rows, size.samples, size.bits, file.columns,
                           file.rows, file.samples, file.stored));
    return size;
}

/// PackBits (PS3.5 annex G). @return bytes written
std::size_t unpack(std::span<const std::byte> packed, std::byte* into, std::size_t count,
                   std::size_t stride) {
    std::size_t done = 0;
    for (std::size_t at = 0; at < packed.size() && done < count;) {
        const auto n = std::to_integer<unsigned>(packed[at++]);
        if (n == 128) continue;
        const bool repeats = n > 128;
        for (std::size_t left = repeats ? 257 - n : n + 1; left > 0 && done < count; --left) {
            if (at >= packed.size()) return done;
            into[done++ * stride] = packed[at];
            if (!repeats) ++at;
        }
        if (repeats) ++at;
    }
    return done;
}

/// One segment for each byte of each sample, the most significant first.
void decode_rle(const DicomFile& file, std::span<const std::byte> bytes, Bytes& into) {
    const auto width = static_cast<std::size_t>(file.allocated / 8);
    const std::size_t segments = static_cast<std::size_t>(file.samples) * width;
    if (bytes.size() < 64 || little32(bytes, 0) != segments || segments > 15)
        refuse(file.path,
               fmt::format("run length encoding: {} segments in {} bytes, expected {} segments",
                           bytes.size() < 4 ? 0 : little32(bytes, 0), bytes.size(), segments));
    const auto pixels = static_cast<std::size_t>(file.rows * file.columns);
    for (std::size_t i = 0; i < segments; ++i) {
        const std::size_t begin = little32(bytes, 4 + 4 * i);
        const std::size_t end = i + 1 < segments ? little32(bytes, 8 + 4 * i) : bytes.size();
        if (begin < 64 || end < begin || end > bytes.size())
            refuse(file.path, fmt::format("run length encoding: segment {} lies at {} to {} of {}",
                                          i, begin, end, bytes.size()));
        const std::size_t sample = i / width, byte = width - 1 - i % width;
        const std::size_t got = unpack(bytes.subspan(begin, end - begin),
                                       into.data() + sample * width + byte, pixels, segments);
        if (got < pixels)
            refuse(file.path, fmt::format("run length encoding: segment {} holds {} of {} bytes", i,
                                          got, pixels));
    }
}

template <class T, class F>
void for_each_sample(Bytes& samples, F change) {
    // As far as a compiler knows, a written std::byte may change `samples` itself: no vectors then.
    std::byte* const at = samples.data();
    const std::size_t count = samples.size() / sizeof(T);
    for (std::size_t i = 0; i < count; ++i) {
        T value;
        std::memcpy(&value, at + i * sizeof(T), sizeof value);
        value = change(value);
        std::memcpy(at + i * sizeof(T), &value, sizeof value);
    }
}

template <class F>
void with_integer(Type type, F use) {
    if (type == Type::u8) use(std::uint8_t{});
    if (type == Type::i8) use(std::int8_t{});
    if (type == Type::u16) use(std::uint16_t{});
    if (type == Type::i16) use(std::int16_t{});
    if (type == Type::u32) use(std::uint32_t{});
    if (type == Type::i32) use(std::int32_t{});
}

/// A table that is not written out: runs of values, and straight lines to a value.
std::vector<std::uint16_t> expanded(const std::string& path, const std::vector<std::uint16_t>& in,
                                    std::size_t entries) {
    std::vector<std::uint16_t> out;
    std::size_t at = 0;
    const auto next = [&] {
        if (at >= in.size() || out.size() > entries)
            refuse(path, "a segmented palette (0028,1221) is damaged");
        return in[at++];
    };
    while (at < in.size() && out.size() < entries) {
        const std::uint16_t kind = next(), count = next();
        if (kind > 1) refuse(path, "a segmented palette (0028,1221) repeats itself: not supported");
        if (kind == 0) {
            for (int i = 0; i < count; ++i) out.push_back(next());
            continue;
        }
        const double from = out.empty() ? 0 : out.back(), to = next();
        for (int i = 1; i <= count; ++i)
            out.push_back(static_cast<std::uint16_t>(std::lround(from + (to - from) * i / count)));
    }
    return out;
}

std::size_t entries_of(const DicomTable& table) {
    return table.descriptor[0] == 0 ? 65536 : static_cast<std::size_t>(table.descriptor[0]);
}

std::vector<std::uint16_t> values_of(const DicomFile& file, const DicomTable& table) {
    if (table.descriptor.size() != 3 || table.descriptor[0] < 0)
        refuse(file.path, "the descriptor of a table (0028,1101) or (0028,3002) needs 3 numbers");
    const std::size_t entries = entries_of(table);
    std::vector<std::uint16_t> values;
    // Entries of 8 bits are written two in a word, or one in a word of their own.
    const bool packed =
        !table.segmented && table.descriptor[2] <= 8 && table.data.size() < 2 * entries;
    if (packed)
        for (std::byte byte : table.data) values.push_back(std::to_integer<std::uint16_t>(byte));
    for (std::size_t i = 0; !packed && i + 1 < table.data.size(); i += 2)
        values.push_back(
            static_cast<std::uint16_t>(std::to_integer<unsigned>(table.data[i]) |
                                       std::to_integer<unsigned>(table.data[i + 1]) << 8));
    if (table.segmented) values = expanded(file.path, values, entries);
    if (values.size() < entries || entries == 0)
        refuse(file.path,
               fmt::format("a table of {} entries holds {} values", entries, values.size()));
    values.resize(entries);
    return values;
}

Type table_type(const DicomTable& table) {
    const bool narrow = table.descriptor.size() == 3 && table.descriptor[2] <= 8;
    return narrow ? Type::u8 : Type::u16;
}

std::int64_t pixels_of(const DicomFile& file) { return file.rows * file.columns; }

std::size_t raw_bytes(const DicomFile& file) {
    return static_cast<std::size_t>(pixels_of(file)) * static_cast<std::size_t>(file.samples) *
           bytes_of(stored_type(file));
}

}  // namespace

Type sample_type(const DicomFile& file) {
    if (is_palette(file)) return table_type(file.palette[0]);
    if (has_table(file.modality_table)) return table_type(file.modality_table);
    return stored_type(file);
}

int sample_channels(const DicomFile& file) { return is_palette(file) ? 3 : file.samples; }

std::size_t decoding_bytes(const DicomFile& file) {
    const std::size_t frame = raw_bytes(file);
    const bool by_module = file.compressed && file.syntax != kRle;
    const std::size_t inflated = file.deflated ? 2 * static_cast<std::size_t>(file.pixel_bytes) : 0;
    return (by_module ? bytes_of(Library::dicom) + 3 * frame : 0) + 3 * frame + inflated;
}

DicomFrames::DicomFrames(const DicomFile& file) : file_(file), bytes_(file.path) {
    if (file.unknown_syntax) refuse(file.path, file.syntax_problem());
    const std::string& meaning = file.photometric;
    const bool grey = meaning == "MONOCHROME1" || meaning == "MONOCHROME2";
    const bool colour = meaning == "RGB" || meaning == "YBR_FULL" || meaning == "YBR_FULL_422" ||
                        meaning == "YBR_PARTIAL_422" || meaning == "YBR_ICT" ||
                        meaning == "YBR_RCT";
    const bool fits = (grey || is_palette(file)) ? file.samples == 1 : colour && file.samples == 3;
    if (!fits)
        refuse(
            file.path,
            fmt::format("PhotometricInterpretation (0028,0004) '{}' with {} samples a pixel: not "
                        "supported",
                        shown(meaning), file.samples));
    if (meaning.ends_with("_422") && !file.compressed &&
        (file.columns % 2 != 0 || file.allocated != 8))
        refuse(file.path, meaning + ": expected 8 bits and an even number of columns");
    if (file.deflated) bytes_.deflated_from(file.body);
    if (is_palette(file))
        for (const DicomTable& table : file.palette) values_of(file, table);
    else if (has_table(file.modality_table))
        values_of(file, file.modality_table);
    if (file.compressed) {
        find_starts();
        check_density(file.path,
                      product(file.path, static_cast<std::int64_t>(raw_bytes(file)), file.frames),
                      file.pixel_bytes, file.syntax == kRle ? kRleDensest : kDensest);
        // Nothing is allocated for a stream of another size, if its beginning tells.
        constexpr std::size_t kBeginning = 1 << 16;
        const Bytes first = compressed(0, kBeginning);
        if (file.syntax != kRle) expect_size(file, 0, first, first.size() < kBeginning);
    }
}

std::span<const std::byte> DicomFrames::frame(std::int64_t k) {
    if (k == at_) return samples_;
    at_ = -1;
    planar_ = file_.samples > 1 && file_.planar != 0;
    // The transforms of JPEG 2000 are undone in decoding.
    ybr_ = file_.photometric.starts_with("YBR") && file_.photometric != "YBR_ICT" &&
           file_.photometric != "YBR_RCT";
    if (file_.compressed)
        decode(k);
    else
        read_plain(k);
    put_channels_together();
    clear_unused_bits();
    to_rgb();
    look_up();
    at_ = k;
    return samples_;
}

void DicomFrames::read_plain(std::int64_t k) {
    const std::int64_t bits = file_.frame_bits();
    if (file_.allocated == 1) {
        // Bits of all frames follow each other, the lowest first; frames start inside of bytes.
        const std::int64_t first = k * bits, begin = first / 8;
        Bytes packed(static_cast<std::size_t>((first + bits + 7) / 8 - begin));
        bytes_.read(file_.pixels + static_cast<std::uint64_t>(begin), packed);
        if (file_.big_endian && file_.pixel_words)
            for (std::size_t i = 0; i + 1 < packed.size(); i += 2)
                std::swap(packed[i], packed[i + 1]);
        samples_.resize(static_cast<std::size_t>(bits));
        for (std::int64_t i = 0; i < bits; ++i) {
            const std::int64_t at = first + i - begin * 8;
            samples_[static_cast<std::size_t>(i)] =
                packed[static_cast<std::size_t>(at / 8)] >> (at % 8) & std::byte{1};
        }
        return;
    }
    samples_.resize(static_cast<std::size_t>(bits / 8));
    const std::size_t width = bytes_of(stored_type(file_));
    bytes_.read(file_.pixels + static_cast<std::uint64_t>(k * (bits / 8)), samples_);
    if (!file_.big_endian) return;
    // Single bytes in words change places too, but a frame of an odd number of them.
    if (width > 1 || (file_.pixel_words && samples_.size() % 2 == 0))
        swap_bytes(samples_.data(), std::max<std::size_t>(width, 2),
                   static_cast<std::int64_t>(samples_.size() / std::max<std::size_t>(width, 2)));
}

/// Frames of one fragment each, or as the table of offsets says, or where streams begin.
void DicomFrames::find_starts() {
    const auto& all = file_.fragments;
    const auto frames = static_cast<std::size_t>(file_.frames);
    if (all.size() == frames || frames == 1) {
        for (std::size_t i = 0; i < std::min(frames, all.size()); ++i) starts_.push_back(i);
    } else if (file_.frame_offsets.size() == frames && !all.empty()) {
        for (std::size_t i = 0; i < all.size() && starts_.size() < frames; ++i)
            // Offsets count from the first fragment's item, whose head is 8 bytes long.
            if (all[i].offset - all[0].offset == file_.frame_offsets[starts_.size()])
                starts_.push_back(i);
    } else {
        for (std::size_t i = 0; i < all.size(); ++i) {
            std::byte head[2];
            if (all[i].length < 2) continue;
            bytes_.read(all[i].offset, head);
            const auto second = std::to_integer<unsigned>(head[1]);
            if (head[0] == std::byte{0xff} && (second == 0xd8 || second == 0x4f))
                starts_.push_back(i);
        }
    }
    if (starts_.size() != frames || starts_[0] != 0)
        refuse(file_.path, fmt::format("{} fragments of pixel data (7fe0,0010) do not say where {} "
                                       "frames begin",
                                       all.size(), frames));
}

std::pair<std::size_t, std::size_t> DicomFrames::fragments_of(std::int64_t k) const {
    const auto frame = static_cast<std::size_t>(k);
    return {starts_[frame],
            frame + 1 < starts_.size() ? starts_[frame + 1] : file_.fragments.size()};
}

Bytes DicomFrames::compressed(std::int64_t k, std::size_t most) const {
    const auto [begin, end] = fragments_of(k);
    std::size_t total = 0;
    for (std::size_t i = begin; i < end; ++i) total += file_.fragments[i].length;
    Bytes bytes(std::min(total, most));
    std::size_t done = 0;
    for (std::size_t i = begin; i < end && done < bytes.size(); ++i) {
        const DicomFile::Fragment& part = file_.fragments[i];
        const std::size_t length = std::min<std::size_t>(part.length, bytes.size() - done);
        bytes_.read(part.offset, std::span(bytes).subspan(done, length));
        done += length;
    }
    return bytes;
}

void DicomFrames::decode(std::int64_t k) {
    const Bytes bytes = compressed(k, std::numeric_limits<std::size_t>::max());
    check_density(file_.path, static_cast<std::int64_t>(raw_bytes(file_)), bytes.size(), kDensest);
    samples_.resize(raw_bytes(file_));
    if (file_.syntax == kRle) {
        decode_rle(file_, bytes, samples_);
        planar_ = false;
        return;
    }
    const Size size = expect_size(file_, k, bytes, true);
    ModuleFrame frame;
    const std::int64_t number = jpeg_of(file_);
    frame.kind = number >= 90 ? "JPEG 2000" : number >= 80 ? "JPEG-LS" : "JPEG";
    frame.columns = static_cast<int>(file_.columns);
    frame.rows = static_cast<int>(file_.rows);
    frame.samples = file_.samples;
    frame.allocated = file_.allocated;
    frame.bits = static_cast<int>(size.bits);
    module_decode(Library::dicom, file_.path, frame, bytes, samples_);
    planar_ = frame.planar != 0;
    // Streams of photographs say themselves what their colours are; some files say otherwise.
    if (file_.samples == 3 && size.ybr) ybr_ = *size.ybr;
}

void DicomFrames::put_channels_together() {
    if (!planar_ || file_.samples == 1) return;
    const std::size_t width = bytes_of(stored_type(file_));
    const auto pixels = static_cast<std::size_t>(pixels_of(file_));
    const auto samples = static_cast<std::size_t>(file_.samples);
    if (samples_.size() != pixels * samples * width) return;  // colours shared by two pixels
    Bytes together(samples_.size());
    for (std::size_t c = 0; c < samples; ++c)
        for (std::size_t i = 0; i < pixels; ++i)
            std::memcpy(together.data() + (i * samples + c) * width,
                        samples_.data() + (c * pixels + i) * width, width);
    samples_.swap(together);
}

void DicomFrames::clear_unused_bits() {
    if (file_.kind != DicomFile::Pixels::integers || file_.stored == file_.allocated) return;
    const int up = file_.allocated - 1 - file_.high, down = file_.allocated - file_.stored;
    with_integer(stored_type(file_), [&]<class T>(T) {
        for_each_sample<T>(samples_, [&](T value) {
            using Unsigned = std::make_unsigned_t<T>;
            const auto shifted = static_cast<T>(static_cast<Unsigned>(
                static_cast<std::uint32_t>(static_cast<Unsigned>(value)) << up));
            return static_cast<T>(shifted >> down);
        });
    });
}

/// PS3.3 C.7.6.3.1.2: luminance and two colour differences, as in JPEG.
void DicomFrames::to_rgb() {
    const std::string& meaning = file_.photometric;
    if (file_.samples != 3 || !ybr_) return;
    if (meaning.ends_with("_422") && !file_.compressed) {
        // Y Y Cb Cr of two pixels beside each other.
        Bytes all(raw_bytes(file_));
        for (std::size_t pair = 0; pair * 4 + 4 <= samples_.size(); ++pair)
            for (std::size_t pixel = 0; pixel < 2; ++pixel) {
                std::byte* to = all.data() + (pair * 2 + pixel) * 3;
                to[0] = samples_[pair * 4 + pixel];
                to[1] = samples_[pair * 4 + 2];
                to[2] = samples_[pair * 4 + 3];
            }
        samples_.swap(all);
    }
    const bool partial = meaning.starts_with("YBR_PARTIAL");
    with_integer(stored_type(file_), [&]<class T>(T) {
        const double middle = std::ldexp(1, file_.stored - 1), most = 2 * middle - 1;
        // Of the partial range: 219 of 255 steps of luminance above 16, 224 of differences.
        const double black = partial ? middle / 8 : 0, light = partial ? 255. / 219 : 1,
                     tint = partial ? 255. / 224 : 1;
        for (std::size_t i = 0; i + 3 * sizeof(T) <= samples_.size(); i += 3 * sizeof(T)) {
            T ybr[3];
            std::memcpy(ybr, samples_.data() + i, sizeof ybr);
            const double y = (double(ybr[0]) - black) * light, b = (double(ybr[1]) - middle) * tint,
                         r = (double(ybr[2]) - middle) * tint;
            const double rgb[3] = {y + 1.402 * r, y - 0.344136 * b - 0.714136 * r, y + 1.772 * b};
            for (int c = 0; c < 3; ++c)
                ybr[c] = static_cast<T>(std::nearbyint(std::clamp(rgb[c], 0.0, most)));
            std::memcpy(samples_.data() + i, ybr, sizeof ybr);
        }
    });
}

void DicomFrames::look_up() {
    const bool palette = is_palette(file_);
    if (!palette && !has_table(file_.modality_table)) return;
    const std::size_t channels = palette ? 3 : 1;
    const auto pixels = static_cast<std::size_t>(pixels_of(file_));
    const std::size_t width = bytes_of(sample_type(file_));
    Bytes looked_up(pixels * channels * width);
    for (std::size_t c = 0; c < channels; ++c) {
        const DicomTable& table = palette ? file_.palette[c] : file_.modality_table;
        const std::vector<std::uint16_t> values = values_of(file_, table);
        const auto last = static_cast<double>(values.size()) - 1;
        double first = table.descriptor[1];
        // The first number mapped has the sign of the pixels, whatever its representation says.
        if (file_.is_signed && first >= 32768) first -= 65536;
        with_integer(stored_type(file_), [&]<class T>(T) {
            for (std::size_t i = 0; i < pixels; ++i) {
                T stored;
                std::memcpy(&stored, samples_.data() + i * sizeof(T), sizeof stored);
                const auto index = std::clamp(static_cast<double>(stored) - first, 0.0, last);
                const std::uint16_t value = values[static_cast<std::size_t>(index)];
                std::byte* to = looked_up.data() + (i * channels + c) * width;
                if (width == 1)
                    *to = static_cast<std::byte>(value);
                else
                    std::memcpy(to, &value, sizeof value);
            }
        });
    }
    samples_.swap(looked_up);
}

}  // namespace edgewise::store
