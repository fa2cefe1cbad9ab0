#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <memory_resource>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "graph/data.hpp"
#include "graph/message.hpp"
#include "graph/samples.hpp"

namespace edgewise::store {

using Vector = std::array<double, 3>;
using Bytes = std::vector<std::byte>;

/// What the last channel of a picture means. Straight: colour is not multiplied by it.
enum class Alpha { none, straight, premultiplied };

/// Integers of 64 bits, which no Type is: they are read as the smallest type that holds them all,
/// or as their bits in the place of doubles.
enum class Wide { no, with_sign, without_sign, as_bits };

/// How the samples of one opened file are fetched; known to the formats only.
class Reader;

/// What a file says of one of its labels.
struct Segment {
    std::int64_t label = 0;
    std::string name;                            // "": it has none
    std::optional<std::array<double, 3>> color;  // red, green, blue, 0 to 1
    std::optional<int> channel;                  // where it is a label; absent: in all
};

/// All that a file says, but for its samples. Also the description of what `write` writes.
struct Header {
    std::string file;    // as it was given
    std::string format;  // "NIfTI", "PNG" ...
    bool volume = true;  // two axes: image; three: volume, also with one plane
    Extent extent;       // after EXIF orientation
    int channels = 1;    // of one sample, together in memory
    int times = 1;
    Type type = Type::u8;  // as stored
    /// Of f64: the samples are 64-bit integers, which are read as f64 and then become the smallest
    /// type that holds them (narrow_wide), or as they are (Selection::bits64). `write` takes them
    /// so.
    Wide integers = Wide::no;
    ValueMap values;
    Vector spacing{1, 1, 1}, origin{0, 0, 0};  // [unit]; origin: centre of the first sample
    /// Columns: where x, y and z point, unit vectors. In LPS (x to the left, y to the back, z up)
    /// where the file is anatomical, else in the file's own space.
    std::array<Vector, 3> direction{Vector{1, 0, 0}, Vector{0, 1, 0}, Vector{0, 0, 1}};
    std::string unit;         // "mm", or "" where the file has none
    double file_unit = 1;     // millimetres in the file's own unit; what is above is in mm already
    bool anatomical = false;  // the file says how it lies in the body
    std::string orientation;  // "RAS": x to the right, y to the front, z up; "" if not anatomical
    bool labels = false;      // the file says that it holds labels
    std::vector<Segment> segments;  // what it says of them
    std::string modality;           // "CT", "MR" ...: DICOM; "" where the file does not say
    std::string value_unit;         // of the values: "HU" ...; "" where nothing says it
    Alpha alpha = Alpha::none;
    /// The first three channels are red, green and blue of one colour, not three measurements.
    bool colour = false;
    Bytes exif, icc;                                        // TIFF block of EXIF; ICC profile
    std::vector<std::pair<std::string, Bytes>> png_chunks;  // colour chunks of a PNG, kept as found
    std::vector<Extent> levels;  // resolutions that the file holds, finest first; empty: this one
    int level = 0;               // that this is
    std::size_t reading_bytes = 1 << 20;  // memory that reading takes beside the samples, about
    std::vector<Message> warnings;
    std::shared_ptr<const Reader> reader;
};

/// What becomes of samples that their file calls padding, no measurements (DICOM).
enum class Padding {
    stored,    // they stay as they are
    smallest,  // they take the smallest value that was measured
    largest,   // they take the largest
    nothing    // they take a value that adds nothing to a sum
};

/// What to take from a source that holds more than one volume or image.
struct Selection {
    std::optional<std::string> series;  // UID of a DICOM series, or its number from 0
    std::optional<int> time, channel;   // from 0
    std::optional<int> level;           // of several resolutions, from 0, the finest
    std::string orient;                 // "RAS" ...: overrides what the file says
    std::vector<double> spacing;        // overrides the file's, one for all axes or one each
    std::string unit;                   // of these, and of the file's: "mm", "um", "nm" ...
    Padding padding = Padding::stored;
    bool by_alpha = false;  // the channel of a colour: to be multiplied by the last, its alpha
    std::optional<double> nothing;  // that value; none: 0, or the smallest where that is negative
    std::size_t memory_limit = 0;   // for samples and reading, bytes; 0: no limit
    bool as_stored = false;         // 32-bit integers and f64 too
    bool bits64 = false;            // 64-bit integers that are read as f64: their bits in its place

    bool operator==(const Selection&) const = default;
};

/// One DICOM series of a folder.
struct Series {
    std::string uid, text;  // text: modality, description
    int files = 0;
};

/// Describes a source: a file, a folder with one DICOM series or one stack of pictures, or
/// `raw:FILE:WxHxD:TYPE[:little|big][:offset]`. Reads headers only.
/// @throws InputError   missing, malformed or not supported: file, what was wrong, at which field
/// @throws RequestError several series and none selected (with their list), bad `raw:` or --orient
Header inspect(const std::string& source, const Selection& = {});

/// The series of a folder in the order of `--series N`; empty where it holds no DICOM.
std::vector<Series> list_series(const std::string& source);

/// Type of the samples in memory: f64, 32-bit integers and f16 are computed in f32. As stored, f16
/// alone is, which loses nothing.
Type loaded_type(Type stored, bool as_stored = false) noexcept;
/// Channels in memory: 1 where the selection names one.
int loaded_channels(const Header&, const Selection&) noexcept;
/// Bytes that `read_samples` fills.
/// @throws InputError   more than Selection::memory_limit, with the size
/// @throws RequestError several time points and none selected, or one that is not there
std::size_t loaded_bytes(const Header&, const Selection&);

/// Reads the samples: x fastest, then y, then z, channels of one sample together, native byte
/// order, loaded_type(header.type, selection.as_stored), values not applied.
/// @param bytes   loaded_bytes(header, selection)
/// @return warnings (values that f32 cannot hold, data behind the end)
/// @throws InputError
std::vector<Message> read_samples(const Header&, const Selection&, void* into, std::size_t bytes);

/// Samples that are no measurements, as runs in the order of read_samples.
struct PaddingRuns {
    struct Run {
        std::int64_t first = 0, count = 0;
    };
    std::vector<Run> runs;
    std::optional<double> value;  // that the file gives them
};
/// Of a file that has padding (DICOM) this reads its samples once more; of others nothing.
/// @throws InputError
PaddingRuns padding_runs(const Header&, const Selection&);

/// Files and folders that the description and the samples come from: while none of them changes,
/// neither do these. Absent where a library that reads them does not tell.
std::optional<std::vector<std::string>> files_of(const Header&);

/// 64-bit integers that were read, in the smallest type that holds them all: only now is it known.
/// @param type  of the samples: f32 or f64; becomes that of integers of 8 or 16 bits, of 32 bits
///              too where it is f64
/// @return the type that stands for what is stored: Header::type from now on
/// @throws std::bad_alloc
Type narrow_wide(const Header&, Type& type, Array& samples, std::pmr::memory_resource* from,
                 std::vector<Message>& warnings);

struct Loaded {
    Header header;  // channels and type as in memory, one time point, warnings of both
    Array samples;
};
/// inspect and read_samples at once. @throws std::bad_alloc where the resource's limit is reached
Loaded load(const std::string& source, const Selection&, std::pmr::memory_resource* from);

struct WriteOptions {
    /// 1..100; none: 95 for JPEG, while WebP and JPEG 2000 keep every value.
    std::optional<int> quality{};
};

/// Writes samples (x fastest, channels together, native byte order, `what.type`) in the format of
/// the path's ending, under a name beside it that is renamed when whole: the old file stays until
/// then, and stays where anything fails. No dates inside: equal input gives equal bytes.
/// @throws RequestError a format that cannot hold this (see Format)
/// @throws RunError     disk full, folder that cannot be written
void write(const std::string& path, const Header& what, const void* samples,
           const WriteOptions& = {});

/// A file format, as `list formats` shows it and the command asks before any work.
struct Format {
    std::string name;
    std::vector<std::string> endings;  // lower case, with the dot; the first is the usual one
    bool reads = false, writes = false;
    std::vector<Type> types;  // that can be written
    bool images = false, volumes = false;
    int channels = 4;     // at most
    bool values = false;  // can say that value = slope * stored + offset
    Message note;
    std::string library{};               // OpenImageIO's name of it, where that reads it
    std::vector<int> cannot_channels{};  // counts below `channels` that cannot be written
    std::int64_t side = 0;               // pixels of a side at most; 0: no limit
    Alpha alpha = Alpha::straight;       // what its files hold, where a writer has the choice
    bool frames = false;                 // holds several pictures, one after another (Animation)
};
const std::vector<Format>& formats();
/// Which libraries decode and encode it.
std::string library_of(const Format&);
/// The format of a path's ending (the longest that fits), or none. "-", standard output, is PNG.
const Format* format_of(std::string_view path);
/// Why a file of this name cannot hold this (by its ending, type, axes, channels), or "".
std::string cannot_write(std::string_view path, const Header& what);

}  // namespace edgewise::store
