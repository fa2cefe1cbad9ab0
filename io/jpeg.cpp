// JPEG by libjpeg-turbo: 8 bits, grey or RGB; EXIF and ICC profile are kept.

#include <cstdio>
// jpeglib.h needs size_t and FILE before it.
#include <cstring>
#include <fmt/format.h>
#include <jerror.h>
#include <jpeglib.h>

#include "graph/errors.hpp"
#include "io/picture.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

constexpr std::size_t kBuffer = 1 << 16;
constexpr unsigned kExifMarker = JPEG_APP0 + 1, kIccMarker = JPEG_APP0 + 2;
constexpr std::string_view kExifName{"Exif\0\0", 6};
// A small file may ask for thousands of passes over a large picture.
constexpr int kMostScans = 500;
// Huffman codes take a bit for each block of 64 samples; arithmetic ones may take less.
constexpr std::int64_t kDensest = 3 * 64 * 8, kDensestArithmetic = 1 << 18;

std::string text_of(j_common_ptr jpeg) {
    char text[JMSG_LENGTH_MAX];
    jpeg->err->format_message(jpeg, text);
    return text;
}

/// Decoder with its source; errors leave libjpeg as exceptions, and this frees what it holds.
struct Decoder {
    jpeg_decompress_struct jpeg{};
    jpeg_error_mgr errors{};
    jpeg_source_mgr source{};
    const File& file;
    std::uint64_t at = 0;
    Bytes buffer = Bytes(kBuffer);

    explicit Decoder(const File& from) : file(from) {
        jpeg.err = jpeg_std_error(&errors);
        jpeg.client_data = this;
        errors.error_exit = [](j_common_ptr j) { self(j).fail("damaged JPEG: " + text_of(j)); };
        errors.output_message = [](j_common_ptr) {};
        // Level -1 is a warning: data that were made up for what is missing.
        errors.emit_message = [](j_common_ptr j, int level) {
            if (level < 0 && j->err->msg_code != JWRN_EXTRANEOUS_DATA &&
                j->err->msg_code != JWRN_ADOBE_XFORM)
                self(j).fail("damaged JPEG: " + text_of(j));
        };
        jpeg_create_decompress(&jpeg);
        source.init_source = [](j_decompress_ptr) {};
        source.term_source = [](j_decompress_ptr) {};
        source.resync_to_restart = jpeg_resync_to_restart;
        source.fill_input_buffer = [](j_decompress_ptr j) -> boolean {
            Decoder& here = self(reinterpret_cast<j_common_ptr>(j));
            const std::size_t got = here.file.read_some(here.at, here.buffer);
            if (got == 0) here.fail("short file: the picture is not complete");
            here.at += got;
            here.source.next_input_byte = reinterpret_cast<const JOCTET*>(here.buffer.data());
            here.source.bytes_in_buffer = got;
            return TRUE;
        };
        source.skip_input_data = [](j_decompress_ptr j, long count) {
            Decoder& here = self(reinterpret_cast<j_common_ptr>(j));
            const auto skipped = static_cast<std::size_t>(std::max(count, 0L));
            if (skipped <= here.source.bytes_in_buffer) {
                here.source.next_input_byte += skipped;
                here.source.bytes_in_buffer -= skipped;
            } else {
                here.at += skipped - here.source.bytes_in_buffer;
                here.source.bytes_in_buffer = 0;
            }
        };
        jpeg.src = &source;
    }
    Decoder(const Decoder&) = delete;
    Decoder& operator=(const Decoder&) = delete;
    ~Decoder() { jpeg_destroy_decompress(&jpeg); }

    static Decoder& self(j_common_ptr j) { return *static_cast<Decoder*>(j->client_data); }
    [[noreturn]] void fail(const std::string& what) const { refuse(file.path(), what); }

    void header() {
        jpeg_save_markers(&jpeg, kExifMarker, 0xffff);
        jpeg_save_markers(&jpeg, kIccMarker, 0xffff);
        jpeg_read_header(&jpeg, TRUE);
        if (jpeg.jpeg_color_space == JCS_CMYK || jpeg.jpeg_color_space == JCS_YCCK)
            fail("CMYK pictures are not supported");
    }
};

class JpegReader : public Reader {
 public:
    explicit JpegReader(int orientation) : orientation_(orientation) {}
    void read(const Header& header, const Selection& pick, std::span<std::byte> into,
              std::vector<Message>&) const override {
        const File file(header.file);
        Decoder decoder(file);
        decoder.header();
        jpeg_progress_mgr watch{};
        watch.progress_monitor = [](j_common_ptr j) {
            const auto* jpeg = reinterpret_cast<j_decompress_ptr>(j);
            if (jpeg->input_scan_number > kMostScans) Decoder::self(j).fail("more than 500 scans");
        };
        decoder.jpeg.progress = &watch;
        jpeg_start_decompress(&decoder.jpeg);
        const std::int64_t width = decoder.jpeg.output_width, height = decoder.jpeg.output_height;
        if (width * height != header.extent.samples() ||
            decoder.jpeg.output_components != header.channels)
            decoder.fail("changed while it was read");
        Rows rows(width, height, header.channels, Type::u8, orientation_, pick, into);
        std::vector<JSAMPLE> row(static_cast<std::size_t>(width * header.channels));
        JSAMPROW pointer = row.data();
        for (std::int64_t y = 0; y < height; ++y) {
            jpeg_read_scanlines(&decoder.jpeg, &pointer, 1);
            rows.put(y, reinterpret_cast<const std::byte*>(row.data()));
        }
        jpeg_finish_decompress(&decoder.jpeg);
    }

    std::optional<std::vector<std::string>> files() const override {
        return std::vector<std::string>{};
    }

 private:
    int orientation_;
};

/// Writes through a Replacement; its exceptions pass libjpeg on their way out.
struct Encoder {
    jpeg_compress_struct jpeg{};
    jpeg_error_mgr errors{};
    jpeg_destination_mgr target{};
    Replacement& out;
    Bytes buffer = Bytes(kBuffer);

    explicit Encoder(Replacement& to) : out(to) {
        jpeg.err = jpeg_std_error(&errors);
        jpeg.client_data = this;
        errors.error_exit = [](j_common_ptr j) {
            throw RunError(static_cast<Encoder*>(j->client_data)->out.path() + ": " + text_of(j));
        };
        errors.output_message = [](j_common_ptr) {};
        jpeg_create_compress(&jpeg);
        target.init_destination = [](j_compress_ptr j) { self(j).rewind(); };
        target.empty_output_buffer = [](j_compress_ptr j) -> boolean {
            self(j).out.write(self(j).buffer);
            self(j).rewind();
            return TRUE;
        };
        target.term_destination = [](j_compress_ptr j) {
            self(j).out.write(
                std::span(self(j).buffer).first(kBuffer - self(j).target.free_in_buffer));
        };
        jpeg.dest = &target;
    }
    Encoder(const Encoder&) = delete;
    Encoder& operator=(const Encoder&) = delete;
    ~Encoder() { jpeg_destroy_compress(&jpeg); }

    static Encoder& self(j_compress_ptr j) { return *static_cast<Encoder*>(j->client_data); }
    void rewind() {
        target.next_output_byte = reinterpret_cast<JOCTET*>(buffer.data());
        target.free_in_buffer = kBuffer;
    }
    void metadata(const Header& what) {
        constexpr std::size_t kLongestMarker = 65533;
        if (!what.exif.empty() && what.exif.size() + kExifName.size() <= kLongestMarker) {
            std::string marker(kExifName);
            marker.append(reinterpret_cast<const char*>(what.exif.data()), what.exif.size());
            jpeg_write_marker(&jpeg, static_cast<int>(kExifMarker),
                              reinterpret_cast<const JOCTET*>(marker.data()),
                              static_cast<unsigned>(marker.size()));
        }
        if (!what.icc.empty())
            jpeg_write_icc_profile(&jpeg, reinterpret_cast<const JOCTET*>(what.icc.data()),
                                   static_cast<unsigned>(what.icc.size()));
    }
};

}  // namespace

Header inspect_jpeg(const std::string& path) {
    const File file(path);
    Decoder decoder(file);
    decoder.header();
    Header header;
    header.file = path;
    header.format = "JPEG";
    header.channels = decoder.jpeg.num_components == 1 ? 1 : 3;
    header.colour = header.channels == 3;
    for (auto* marker = decoder.jpeg.marker_list; marker; marker = marker->next) {
        const std::string_view data(reinterpret_cast<const char*>(marker->data),
                                    marker->data_length);
        if (marker->marker != kExifMarker || !data.starts_with(kExifName) || !header.exif.empty())
            continue;
        const auto bytes = std::as_bytes(std::span(data.substr(kExifName.size())));
        header.exif.assign(bytes.begin(), bytes.end());
    }
    JOCTET* profile = nullptr;
    unsigned length = 0;
    if (jpeg_read_icc_profile(&decoder.jpeg, &profile, &length)) {
        const auto bytes = std::as_bytes(std::span(profile, length));
        header.icc.assign(bytes.begin(), bytes.end());
        std::free(profile);
    }
    const int orientation = exif_orientation(header.exif);
    set_upright(header.exif);
    take_size(header, decoder.jpeg.image_width, decoder.jpeg.image_height, orientation);
    check_density(path, header.extent.samples() * header.channels, file.size(),
                  decoder.jpeg.arith_code ? kDensestArithmetic : kDensest);
    // A progressive picture is kept as coefficients of two bytes until its last scan.
    if (jpeg_has_multiple_scans(&decoder.jpeg))
        header.reading_bytes +=
            static_cast<std::size_t>(header.extent.samples() * header.channels) * 2;
    header.reader = std::make_shared<const JpegReader>(orientation);
    return header;
}

void write_jpeg(Replacement& out, const Header& what, const void* samples, int quality) {
    Encoder encoder(out);
    jpeg_compress_struct& jpeg = encoder.jpeg;
    jpeg.image_width = static_cast<JDIMENSION>(what.extent.x);
    jpeg.image_height = static_cast<JDIMENSION>(what.extent.y);
    jpeg.input_components = what.channels;
    jpeg.in_color_space = what.channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, quality, TRUE);
    // Halved colour would blur edges that the sampling kept.
    if (quality >= 90 && what.channels == 3)
        jpeg.comp_info[0].h_samp_factor = jpeg.comp_info[0].v_samp_factor = 1;
    jpeg_start_compress(&jpeg, TRUE);
    encoder.metadata(what);
    const std::size_t stride =
        static_cast<std::size_t>(what.extent.x) * static_cast<std::size_t>(what.channels);
    for (std::int64_t y = 0; y < what.extent.y; ++y) {
        auto* row = const_cast<JSAMPROW>(static_cast<const JSAMPLE*>(samples) +
                                         static_cast<std::size_t>(y) * stride);
        jpeg_write_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_compress(&jpeg);
}

}  // namespace edgewise::store
