#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/file.hpp"
#include "io/store.hpp"

namespace edgewise::store {

class Reader {
 public:
    virtual ~Reader() = default;
    /// Fills `into` as read_samples promises; `pick` has been checked.
    virtual void read(const Header&, const Selection& pick, std::span<std::byte> into,
                      std::vector<Message>& warnings) const = 0;
    /// Samples of the selection that are no measurements.
    virtual PaddingRuns padding(const Header&, const Selection& /*pick*/) const { return {}; }
    /// Paths of all that samples come from, beside the header's own; none: not known.
    virtual std::optional<std::vector<std::string>> files() const = 0;
};

/// One axis of the samples as a file stores them.
struct Axis {
    enum Kind { x, y, z, channel, time } kind;
    std::int64_t size;
};

/// How the 64-bit integers of a file are read for a selection: as numbers, or as they are.
inline Wide as_read(Wide wide, const Selection& pick) noexcept {
    return wide != Wide::no && pick.bits64 ? Wide::as_bits : wide;
}

/// Plain samples in one or several files: all that most volume formats are behind their header.
struct Stored {
    struct Piece {
        std::string path;
        std::uint64_t offset = 0;  // of the first byte; of compressed data: of the stream
    };
    enum class Encoding { raw, gzip, zlib, bzip2, text, hex };
    std::vector<Piece> pieces;  // each holds an equal part, one after another
    Encoding encoding = Encoding::raw;
    std::uint64_t skip = 0;  // bytes to drop after decompression, in every piece
    bool big_endian = false;
    Type type = Type::u8;  // where `wide`: f64
    Wide wide = Wide::no;
    std::vector<Axis> axes;  // fastest first

    std::int64_t numbers() const noexcept;
    /// Of one number as it is stored, before text or compression.
    std::size_t width() const noexcept { return wide == Wide::no ? bytes_of(type) : 8; }
};

/// Checks that a compressed file of `there` bytes can hold `bytes` bytes of samples at all, so that
/// nothing large is allocated for a small file that lies. 64 MiB are always believed.
/// @param densest bytes of samples that one byte of the file may stand for
void check_density(const std::string& file, std::int64_t bytes, std::uint64_t there,
                   std::int64_t densest);

/// Fills the header's extent, channels and times from the axes.
/// @throws InputError a size below 1, products that overflow, two axes of one kind
void take_axes(Header&, const Stored&);
/// Three or four channels of u8 are how VTK keeps colours: it shows them as they are.
void take_bytes_of_colour(Header&) noexcept;
/// Checks that every piece is there and long enough. A file that holds more is no error.
void check_pieces(const std::string& file, const Stored&);
std::shared_ptr<const Reader> stored_reader(Stored);
/// The last step of most formats: checks the pieces and makes the reader. take_axes came before.
void take_reader(Header&, Stored);

/// Puts numbers that arrive in the order of `stored.axes` where they belong in memory: swaps
/// bytes, converts to the loaded type, keeps what is selected.
void scatter(const Stored&, const Selection&, Stream&, const std::string& file,
             std::span<std::byte> into, std::vector<Message>& warnings);

/// Counts the values that do not survive the conversion to f32.
struct Rounding {
    std::int64_t rounded = 0, beyond = 0;
    /// `count` numbers of a wider type, native byte order, to f32; f16 too.
    void convert(Type from, const std::byte* source, std::int64_t count, std::byte* into,
                 std::int64_t stride);
    void tell(const std::string& file, Type from, std::vector<Message>& warnings) const;
};
float half_to_float(std::uint16_t half) noexcept;
std::uint16_t float_to_half(float value) noexcept;
void swap_bytes(std::byte* data, std::size_t width, std::int64_t count) noexcept;

// One function a format; each fills header.reader. Sources of other kinds are told apart in
// store.cpp. Every one throws InputError for what it cannot read.
Header inspect_nifti(const std::string& path);
Header inspect_nrrd(const std::string& path);
Header inspect_metaimage(const std::string& path);
Header inspect_mgh(const std::string& path);
Header inspect_vtk(const std::string& path);
Header inspect_vti(const std::string& path);
Header inspect_json(const std::string& path);
Header inspect_raw(const std::string& source);                    // raw:FILE:WxHxD:TYPE...
Header inspect_dicom(const std::string& path, const Selection&);  // file or folder
Header inspect_png(const std::string& path);
Header inspect_jpeg(const std::string& path);
Header inspect_tiff(const std::string& path, const Selection&);
Header inspect_mrc(const std::string& path);
bool is_mrc(std::span<const std::byte> head) noexcept;
Header inspect_stack(const std::string& folder, const std::vector<std::string>& pictures);
Header inspect_by_itk(const std::string& path);
/// @param library  OpenImageIO's name of the format: "openexr", "openvdb" ...
Header inspect_by_oiio(const std::string& path, const std::string& library);
/// OpenImageIO's name of the format that these first bytes of a file belong to, or "".
std::string_view library_format(std::span<const std::byte> head) noexcept;
bool is_dicom(const std::string& path);

void write_nifti(Replacement&, const Header&, const void* samples);
void write_nrrd(Replacement&, const Header&, const void* samples);
void write_metaimage(Replacement&, const Header&, const void* samples);
void write_mgh(Replacement&, const Header&, const void* samples);
void write_png(Replacement&, const Header&, const void* samples);
void write_jpeg(Replacement&, const Header&, const void* samples, int quality);
void write_tiff(Replacement&, const Header&, const void* samples);
/// Samples with colour as the format holds it, multiplied by alpha or not; empty: as they are.
Bytes with_alpha_of(const Format&, const Header&, const void* samples);
void write_pnm(Replacement&, const Header&, const void* samples);
void write_sgi(Replacement&, const Header&, const void* samples);
void write_gif(Replacement&, const Header&, const void* samples);
void write_by_oiio(Replacement&, const Format&, const Header&, const void* samples, int quality);

/// Whether three or four channels are written as one colour. Pictures always are.
inline bool is_colour(const Header& what) {
    return (what.channels == 3 || what.channels == 4) && (what.colour || !what.volume);
}

/// NIfTI has types for RGB and RGBA, whose values are never scaled; other channels are its fifth
/// axis, and that makes a volume.
inline bool is_nifti_colour(const Header& what) {
    return is_colour(what) && what.type == Type::u8 && what.values.identity();
}

inline std::span<const std::byte> samples_of(const Header& what, const void* samples) {
    return {static_cast<const std::byte*>(samples),
            static_cast<std::size_t>(what.extent.samples()) * static_cast<std::size_t>(what.times) *
                static_cast<std::size_t>(what.channels) * bytes_of(what.type)};
}

}  // namespace edgewise::store
