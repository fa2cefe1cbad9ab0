#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/file.hpp"

namespace edgewise::store {

/// The bytes of a DICOM file, inflated where its syntax is the deflated one.
class DicomBytes {
 public:
    explicit DicomBytes(const std::string& path);
    /// From here on the file is one raw deflate stream. What it holds is kept as far as it was
    /// read.
    void deflated_from(std::uint64_t offset);
    /// Bytes that there can be at most.
    std::uint64_t size() const noexcept;
    std::size_t read_some(std::uint64_t offset, std::span<std::byte> into);
    /// @throws InputError where the file is shorter
    void read(std::uint64_t offset, std::span<std::byte> into);

 private:
    std::shared_ptr<const File> file_;
    std::uint64_t begin_ = 0;  // of the deflate stream
    std::unique_ptr<Stream> stream_;
    Bytes inflated_;
    bool ended_ = false;
};

/// What one frame says of itself: in its functional groups, or its file for all frames.
struct DicomFrame {
    std::optional<Vector> position;                    // centre of its first pixel [mm]
    std::array<int, 3> decimals{17, 17, 17};           // that its numbers were written with
    std::optional<std::array<double, 6>> orientation;  // directions of rows and of columns
    std::optional<std::array<double, 2>> spacing;      // between rows, between columns [mm]
    std::optional<double> thickness, between;          // [mm]; between slices, NM: signed
    std::optional<double> slope, intercept;
    std::optional<double> world_slope, world_intercept;  // of a real world value mapping
    std::optional<std::array<double, 2>>
        tile;                        // column and row of its first pixel in the whole, from 1
    std::int64_t temporal = 0;       // from 1; 0: not said
    std::int64_t segment = 0;        // number of what is segmented; 0: not said
    std::vector<double> dimensions;  // DimensionIndexValues

    /// Takes from `other` what is not said here.
    void fill(const DicomFrame& other);
};

/// What a segmentation says of one of its segments.
struct DicomSegment {
    std::int64_t number = 0;
    std::string label;        // as stored
    std::vector<double> lab;  // RecommendedDisplayCIELabValue: 16 bits each
};

/// A table that stored numbers are looked up in.
struct DicomTable {
    std::vector<double> descriptor;  // entries (0: 65536), first number mapped, bits of an entry
    Bytes data;                      // little-endian
    bool segmented = false;
};

/// The elements of one DICOM file that describe its pixels (PS3.3 C.7.6, PS3.5). Checked: every
/// length lies inside the file, sequences are nested at most 32 deep, sizes are at least 1.
struct DicomFile {
    enum class Pixels { none, integers, floats, doubles };
    struct Fragment {
        std::uint64_t offset = 0;
        std::uint32_t length = 0;
    };

    std::string path;
    std::string syntax;  // UID of the transfer syntax
    bool big_endian = false, compressed = false, deflated = false;
    bool unknown_syntax = false;  // its pixels cannot be decoded
    std::uint64_t body = 0;       // where the data set begins
    std::string uid, series, text, modality, sop_class, image_type;
    std::string rescale_type, units;  // of the values; units: of PET

    Pixels kind = Pixels::none;
    std::int64_t rows = 0, columns = 0, frames = 1;
    int samples = 1, planar = 0, allocated = 0, stored = 0, high = 0;
    bool is_signed = false;
    std::string photometric = "MONOCHROME2";
    std::optional<std::array<double, 2>> padding;  // stored numbers that are no measurements
    std::array<DicomTable, 3> palette;
    DicomTable modality_table;

    std::int64_t instance = 0;
    std::int64_t acquisition = 0;  // its number, from 1; 0: not said
    std::string acquired;          // date and time
    std::string moment;  // echo, trigger time, b-value: all that tells images at one place apart
    DicomFrame own, shared;
    std::vector<DicomFrame> each;  // per-frame functional groups, as many as were found
    std::optional<std::array<double, 2>> detector_spacing;  // at the detector, or on the film [mm]
    std::optional<std::array<double, 2>> aspect;            // height and width of a pixel
    std::vector<double> grid_offsets;                       // GridFrameOffsetVector [mm]
    std::vector<double> slice_vector;                       // slice of each frame, from 1 (NM)
    bool frames_are_times = false;                          // the frame increment is a time
    double dose_scaling = 0;                                // 0: not said
    std::int64_t tiles = 0;                                 // slices in a mosaic; 0: not said
    std::optional<Vector> tiles_normal;                     // where the slices of a mosaic follow
    std::int64_t total_columns = 0, total_rows = 0;         // of a picture in tiles; 0: not tiled
    bool fractional = false;                                // segmentation of fractions
    double most_fraction = 255;
    std::vector<DicomSegment> segments;
    std::string characters;  // SpecificCharacterSet

    std::uint64_t pixels = 0, pixel_bytes = 0;  // where they are; compressed: bytes of all
    bool pixel_words = true;                    // their representation is OW
    std::vector<Fragment> fragments;            // of compressed pixels, without the offset table
    std::vector<std::uint64_t> frame_offsets;   // from the first fragment's item, one a frame

    /// @throws InputError; not where it is sound and holds no pixels
    explicit DicomFile(const std::string& file);
    /// The same, but tells what is wrong in `damage` and keeps what was read before that.
    DicomFile(const std::string& file, std::string& damage);

    /// What is said of frame k, by itself, for all, or outside the groups.
    DicomFrame frame(std::int64_t k) const;
    /// Bits of one frame of pixels that are not compressed.
    std::int64_t frame_bits() const noexcept;
    /// "RTSTRUCT", "CT" ...: what kind of object it is.
    std::string kind_of_object() const;
    /// What to say of a syntax that is not known.
    std::string syntax_problem() const;
};

bool is_dicom(const std::string& path);

}  // namespace edgewise::store
