// VTK image data in XML (.vti) of one piece: ascii, base64 or appended; plain or in zlib blocks.
// The active scalars of the points, or else of the cells.

#include <algorithm>
#include <cstring>
#include <fmt/format.h>
#include <zlib.h>

#include "io/geometry.hpp"
#include "io/number_streams.hpp"
#include "io/reader.hpp"
#include "io/text.hpp"
#include "io/xml.hpp"

namespace edgewise::store {
namespace {

struct TypeName {
    std::string_view name;
    Type type;
    Wide wide = Wide::no;
};
constexpr TypeName kTypes[] = {{"UInt8", Type::u8},
                               {"Int8", Type::i8},
                               {"UInt16", Type::u16},
                               {"Int16", Type::i16},
                               {"UInt32", Type::u32},
                               {"Int32", Type::i32},
                               {"Float32", Type::f32},
                               {"Float64", Type::f64},
                               {"Int64", Type::f64, Wide::with_sign},
                               {"UInt64", Type::f64, Wide::without_sign}};
constexpr std::uint64_t kLargestBlock = 256 << 20;

/// Where and how the chosen array is written.
struct Array {
    enum class Form { ascii, base64, raw } form = Form::ascii;
    std::uint64_t begin = 0, end = 0;
    std::size_t header_width = 4;  // bytes of the numbers that count bytes
    bool compressed = false;
};

/// The numbers in front of an array, in the file's byte order.
std::uint64_t count_of(Stream& stream, const Array& array, bool big, const std::string& path) {
    std::byte raw[8] = {};
    read_all(stream, std::span(raw).first(array.header_width), path);
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < array.header_width; ++i)
        value |= std::to_integer<std::uint64_t>(raw[i])
                 << 8 * (big ? array.header_width - 1 - i : i);
    return value;
}

/// Blocks that were compressed one by one (vtkZLibDataCompressor).
class BlockStream : public Stream {
 public:
    BlockStream(std::unique_ptr<Stream> from, const Array& array, bool big, std::uint64_t expected,
                std::string path)
        : from_(std::move(from)), path_(std::move(path)) {
        const std::uint64_t blocks = count_of(*from_, array, big, path_);
        size_ = count_of(*from_, array, big, path_);
        const std::uint64_t partial = count_of(*from_, array, big, path_);
        last_ = partial ? partial : size_;
        // Counts are believed only where they agree with the header's sizes and fit into the file.
        if (blocks < 1 || size_ < 1 || size_ > kLargestBlock || last_ > size_ ||
            blocks > expected || (blocks - 1) * size_ + last_ != expected ||
            blocks > (array.end - array.begin) / 4)
            refuse(path_, fmt::format(
                              "compressed array of {} blocks of {} bytes, expected {} bytes in all",
                              blocks, size_, expected));
        for (std::uint64_t i = 0; i < blocks; ++i) {
            packed_.push_back(count_of(*from_, array, big, path_));
            if (packed_.back() > array.end - array.begin)
                refuse(path_,
                       fmt::format("block {} claims {} compressed bytes", i, packed_.back()));
        }
    }
    std::size_t read(std::span<std::byte> into) override {
        std::size_t done = 0;
        while (done < into.size()) {
            if (used_ == block_.size() && !unpack()) break;
            const std::size_t part = std::min(into.size() - done, block_.size() - used_);
            std::memcpy(into.data() + done, block_.data() + used_, part);
            done += part;
            used_ += part;
        }
        return done;
    }

 private:
    bool unpack() {
        if (index_ == packed_.size()) return false;
        Bytes packed(packed_[index_]);
        read_all(*from_, packed, path_);
        block_.resize(++index_ == packed_.size() ? last_ : size_);
        uLongf size = block_.size();
        const int status = uncompress(reinterpret_cast<Bytef*>(block_.data()), &size,
                                      reinterpret_cast<const Bytef*>(packed.data()), packed.size());
        if (status != Z_OK || size != block_.size())
            refuse(path_, fmt::format("compressed block {} is damaged", index_ - 1));
        used_ = 0;
        return true;
    }

    std::unique_ptr<Stream> from_;
    std::string path_;
    std::uint64_t size_ = 0, last_ = 0;
    std::vector<std::uint64_t> packed_;
    std::size_t index_ = 0, used_ = 0;
    Bytes block_;
};

/// The numbers of the array, in the byte order that `stored` says.
std::unique_ptr<Stream> stream_of(const std::string& path, const Stored& stored,
                                  const Array& array) {
    const auto file = std::make_shared<const File>(path);
    const auto expected = static_cast<std::uint64_t>(stored.numbers()) * stored.width();
    auto stream = array.form == Array::Form::base64
                      ? base64_stream(file, array.begin, array.end)
                      : open_stream(file, array.begin, array.end, Wrapping::none);
    if (array.form == Array::Form::ascii)
        return text_stream(std::move(stream), stored.type, stored.wide, path);
    if (array.compressed)
        return std::make_unique<BlockStream>(std::move(stream), array, stored.big_endian, expected,
                                             path);
    if (const auto bytes = count_of(*stream, array, stored.big_endian, path); bytes != expected)
        refuse(path, fmt::format("the array claims {} bytes, expected {}", bytes, expected));
    return stream;
}

class VtiReader : public Reader {
 public:
    VtiReader(Stored stored, Array array) : stored_(std::move(stored)), array_(array) {}
    void read(const Header& header, const Selection& pick, std::span<std::byte> into,
              std::vector<Message>& warnings) const override {
        auto stream = stream_of(header.file, stored_, array_);
        Stored plain = stored_;
        std::int64_t rounded = 0;
        if (stored_.wide != Wide::no) {
            stream = wide_stream(std::move(stream), as_read(stored_.wide, pick), stored_.big_endian,
                                 header.file, rounded);
            plain.wide = Wide::no;
            plain.big_endian = false;
        }
        scatter(plain, pick, *stream, header.file, into, warnings);
        tell_wide(header, rounded, warnings);
    }

    std::optional<std::vector<std::string>> files() const override {
        return std::vector<std::string>{};
    }

 private:
    Stored stored_;
    Array array_;
};

class Vti {
 public:
    explicit Vti(const std::string& path)
        : path_(path), file_(std::make_shared<const File>(path)), tags_(file_) {
        header_.file = path;
        header_.format = "VTI";
    }

    Header run() {
        Tag tag;
        // A large array of text is not read to its end for nothing.
        while (!ends_ && !(done_ && !of_cells_) && tags_.next(tag)) take(tag);
        if (!found_)
            refuse(path_,
                   root_ ? "no DataArray in PointData or CellData" : "not VTI: no tag VTKFile");
        if (!done_) refuse(path_, "the AppendedData of its array are missing");
        check_size();
        // Samples of cells lie in their middles.
        for (std::size_t axis = 0; of_cells_ && axis < 3; ++axis)
            if (points_[axis].size > 1)
                for (std::size_t row = 0; row < 3; ++row)
                    header_.origin[row] += header_.direction[axis][row] * header_.spacing[axis] / 2;
        if (array_.form == Array::Form::ascii) stored_.big_endian = false;  // native numbers
        header_.integers = stored_.wide;
        header_.reader = std::make_shared<const VtiReader>(std::move(stored_), array_);
        return std::move(header_);
    }

 private:
    void take(const Tag& tag) {
        if (tag.name == "VTKFile" && !tag.closes) root(tag);
        if (tag.name == "ImageData" && !tag.closes) image(tag);
        if (tag.name == "Piece" && !tag.closes && tag.attribute("Extent", extent_) != extent_)
            refuse(path_, "its Piece is not the whole: several pieces are not supported");
        if (tag.name == "PointData" || tag.name == "CellData") {
            inside_ = !tag.closes && !tag.empty;
            cells_ = tag.name == "CellData";
            wanted_ = tag.attribute("Scalars");
        }
        // What lies at the points is taken before what lies in the cells.
        if (tag.name == "DataArray" && !tag.closes && inside_ &&
            (!found_ || (of_cells_ && !cells_)) &&
            (wanted_.empty() || tag.attribute("Name") == wanted_))
            array(tag);
        if (tag.name == "AppendedData" && !tag.closes && found_ && appended_) appended(tag);
        if (tag.name == "AppendedData" && !tag.closes) ends_ = true;  // raw bytes are no tags
    }
    void root(const Tag& tag) {
        root_ = true;
        if (tag.attribute("type") != "ImageData")
            refuse(path_, "attribute 'type' is '" + shown(tag.attribute("type")) +
                              "', expected ImageData");
        stored_.big_endian = tag.attribute("byte_order") == "BigEndian";
        array_.header_width = tag.attribute("header_type", "UInt32") == "UInt64" ? 8 : 4;
        const std::string compressor = tag.attribute("compressor");
        array_.compressed = compressor == "vtkZLibDataCompressor";
        if (!compressor.empty() && !array_.compressed)
            refuse(path_, "attribute 'compressor' is '" + shown(compressor) + "': not supported");
    }
    template <std::size_t N>
    std::array<double, N> numbers(const Tag& tag, const std::string& name,
                                  const std::string& otherwise) const {
        const auto values = doubles(path_, name, tag.attribute(name, otherwise));
        if (values.size() != N)
            refuse(path_, fmt::format("attribute '{}' has {} entries, expected {}", name,
                                      values.size(), N));
        std::array<double, N> result;
        std::copy(values.begin(), values.end(), result.begin());
        return result;
    }
    void image(const Tag& tag) {
        if (!points_.empty()) refuse(path_, "tag ImageData is repeated");
        extent_ = tag.attribute("WholeExtent");
        const auto bounds = integers(path_, "WholeExtent", extent_);
        if (bounds.size() != 6)
            refuse(path_, fmt::format("attribute 'WholeExtent' has {} entries, expected 6",
                                      bounds.size()));
        constexpr Axis::Kind kKinds[] = {Axis::x, Axis::y, Axis::z};
        header_.spacing = numbers<3>(tag, "Spacing", "1 1 1");
        header_.origin = numbers<3>(tag, "Origin", "0 0 0");
        const auto matrix = numbers<9>(tag, "Direction", "1 0 0 0 1 0 0 0 1");
        std::array<Vector, 3> steps;
        check_spacing(header_, "Spacing");
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::int64_t low = bounds[2 * axis], high = bounds[2 * axis + 1];
            if (low < -(1LL << 31) || high > (1LL << 31) || high < low)
                refuse(path_, fmt::format("attribute 'WholeExtent' goes from {} to {}", low, high));
            points_.push_back({kKinds[axis], high - low + 1});
            for (std::size_t row = 0; row < 3; ++row)
                steps[axis][row] = matrix[3 * row + axis] * header_.spacing[axis];
        }
        take_steps(header_, steps, "Direction");
        for (std::size_t axis = 0; axis < 3; ++axis)
            for (std::size_t row = 0; row < 3; ++row)
                header_.origin[row] += static_cast<double>(bounds[2 * axis]) * steps[axis][row];
    }
    void array(const Tag& tag) {
        if (points_.empty()) refuse(path_, "tag ImageData is missing");
        const auto known =
            std::find_if(std::begin(kTypes), std::end(kTypes),
                         [&](const TypeName& row) { return row.name == tag.attribute("type"); });
        if (known == std::end(kTypes))
            refuse(path_, "attribute 'type' is '" + shown(tag.attribute("type")) +
                              "': unknown or not supported");
        const auto channels = to_integer(tag.attribute("NumberOfComponents", "1")).value_or(0);
        if (channels < 1 || channels > 4)
            refuse(path_, "attribute 'NumberOfComponents' is not 1 to 4");
        stored_.type = known->type;
        stored_.wide = known->wide;
        stored_.axes = points_;
        of_cells_ = cells_;
        if (cells_) {
            // One cell fewer than points along each axis; along a flat one the cells are flat too.
            for (Axis& axis : stored_.axes) axis.size = std::max<std::int64_t>(axis.size - 1, 1);
        }
        if (channels > 1) stored_.axes.insert(stored_.axes.begin(), {Axis::channel, channels});
        take_axes(header_, stored_);
        take_bytes_of_colour(header_);
        done_ = appended_ = false;
        const std::string format = tag.attribute("format", "ascii");
        array_.begin = tag.end;
        found_ = true;
        if (format == "appended") {
            const auto offset = to_integer(tag.attribute("offset", "0"));
            if (!offset || *offset < 0)
                refuse(path_, "attribute 'offset' is '" + shown(tag.attribute("offset")) + "'");
            offset_ = static_cast<std::uint64_t>(*offset);
            appended_ = true;
            return;
        }
        if (format != "ascii" && format != "binary")
            refuse(path_, "attribute 'format' is '" + shown(format) +
                              "', expected ascii, binary or appended");
        array_.form = format == "ascii" ? Array::Form::ascii : Array::Form::base64;
        array_.end = tags_.text_end(tag.end);
        done_ = true;
    }
    /// The data start behind an underscore.
    void appended(const Tag& tag) {
        array_.form =
            tag.attribute("encoding", "raw") == "base64" ? Array::Form::base64 : Array::Form::raw;
        Bytes blank(4096);
        blank.resize(file_->read_some(tag.end, blank));
        std::size_t start = 0;
        while (start < blank.size() && blank[start] != std::byte{'_'}) ++start;
        if (start == blank.size()) refuse(path_, "AppendedData do not start with '_'");
        array_.begin = tag.end + start + 1;
        array_.end = file_->size();
        if (offset_ > array_.end - array_.begin)
            refuse(path_, "attribute 'offset' leads beyond the end of the file");
        array_.begin += offset_;
        done_ = true;
    }
    void check_size() const {
        // Each number takes a digit and a blank at least.
        const auto expected = array_.form == Array::Form::ascii
                                  ? product(path_, stored_.numbers(), 2) - 1
                                  : stored_.numbers() * static_cast<std::int64_t>(stored_.width());
        const std::int64_t there = static_cast<std::int64_t>(array_.end - array_.begin);
        if (expected / (array_.compressed ? kDeflateRatio : 1) > there)
            refuse(path_, fmt::format("short data: expected {} bytes, found {}", expected, there));
    }

    std::string path_, extent_, wanted_;
    FilePointer file_;
    TagReader tags_;
    bool root_ = false, inside_ = false, found_ = false, done_ = false, ends_ = false;
    bool cells_ = false, of_cells_ = false;  // this part of the file; the array that was taken
    bool appended_ = false;                  // so is its array
    std::vector<Axis> points_;
    std::uint64_t offset_ = 0;
    Header header_;
    Stored stored_;
    Array array_;
};

}  // namespace

Header inspect_vti(const std::string& path) { return Vti(path).run(); }

}  // namespace edgewise::store
