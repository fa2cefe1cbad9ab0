#include <algorithm>
#include <array>
#include <cstring>
#include <fmt/format.h>

#include "graph/errors.hpp"
#include "io/number_streams.hpp"
#include "io/reader.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

constexpr std::int64_t kChunkNumbers = 1 << 13;
// bzip2 packs zeros a million times denser than this; noise and pictures never.
constexpr std::int64_t kBzip2Densest = 1 << 16;
constexpr std::int64_t kLeastBzip2 = 14;  // bytes of an empty stream

/// Where numbers along one stored axis go. Merged axes count as one.
struct Walk {
    std::int64_t size, stride;  // stride: in numbers of the output; 0: only `only` is kept
    std::int64_t only = -1;
};

std::vector<Walk> walk_of(const Stored& stored, const Selection& pick, const Extent& extent,
                          int channels) {
    const std::array<std::int64_t, 3> strides{channels, channels * extent.x,
                                              channels * extent.x * extent.y};
    std::vector<Walk> walk;
    for (const Axis& axis : stored.axes) {
        if (axis.size == 1) continue;
        Walk next{axis.size, 0};
        if (axis.kind <= Axis::z)
            next.stride = strides[axis.kind];
        else if (axis.kind == Axis::time)
            next.only = pick.time.value_or(0);
        else if (pick.channel)
            next.only = *pick.channel;
        else
            next.stride = 1;
        if (!walk.empty() && next.only < 0 && walk.back().only < 0 &&
            next.stride == walk.back().stride * walk.back().size)
            walk.back().size *= next.size;
        else
            walk.push_back(next);
    }
    if (walk.empty()) walk.push_back({1, 1});
    return walk;
}

class Scatter {
 public:
    Scatter(const Stored& stored, bool as_stored, Stream& stream, const std::string& file,
            std::span<std::byte> into)
        : stored_(stored),
          stream_(stream),
          file_(file),
          into_(into),
          width_(bytes_of(stored.type)),
          out_type_(loaded_type(stored.type, as_stored)),
          out_width_(bytes_of(out_type_)),
          swaps_(stored.big_endian && width_ > 1) {}

    void run(const std::vector<Walk>& walk) { axis(walk, walk.size() - 1, 0); }
    void tell(std::vector<Message>& warnings) const {
        rounding_.tell(file_, stored_.type, warnings);
    }

 private:
    void axis(const std::vector<Walk>& walk, std::size_t index, std::int64_t to) {
        const Walk& here = walk[index];
        if (index == 0 && here.only < 0) return numbers(here, to);
        std::int64_t inner = 1;
        for (std::size_t i = 0; i < index; ++i) inner *= walk[i].size;
        if (here.only < 0) {
            for (std::int64_t i = 0; i < here.size; ++i)
                axis(walk, index - 1, to + i * here.stride);
            return;
        }
        skip(here.only * inner);
        if (index == 0)
            numbers({1, 1}, to);
        else
            axis(walk, index - 1, to);
        skip((here.size - here.only - 1) * inner);
    }

    void skip(std::int64_t count) {
        if (count > 0) skip_all(stream_, static_cast<std::uint64_t>(count) * width_, file_);
    }

    /// One run of numbers; where nothing changes it goes straight to its place.
    void numbers(const Walk& run, std::int64_t to) {
        std::byte* place = into_.data() + static_cast<std::size_t>(to) * out_width_;
        const bool converts = out_type_ != stored_.type;
        if (run.stride == 1 && !converts) {
            read_all(stream_, {place, static_cast<std::size_t>(run.size) * width_}, file_);
            if (swaps_) swap_bytes(place, width_, run.size);
            return;
        }
        for (std::int64_t done = 0; done < run.size; done += kChunkNumbers) {
            const std::int64_t count = std::min(kChunkNumbers, run.size - done);
            read_all(stream_, {chunk_.data(), static_cast<std::size_t>(count) * width_}, file_);
            if (swaps_) swap_bytes(chunk_.data(), width_, count);
            std::byte* target = place + static_cast<std::size_t>(done * run.stride) * out_width_;
            if (converts)
                rounding_.convert(stored_.type, chunk_.data(), count, target, run.stride);
            else
                for (std::int64_t i = 0; i < count; ++i)
                    std::memcpy(target + static_cast<std::size_t>(i * run.stride) * width_,
                                chunk_.data() + static_cast<std::size_t>(i) * width_, width_);
        }
    }

    const Stored& stored_;
    Stream& stream_;
    const std::string& file_;
    std::span<std::byte> into_;
    std::size_t width_;
    Type out_type_;
    std::size_t out_width_;
    bool swaps_;
    Rounding rounding_;
    std::vector<std::byte> chunk_ = std::vector<std::byte>(kChunkNumbers * 8);
};

Wrapping wrapping_of(Stored::Encoding encoding) {
    return encoding == Stored::Encoding::gzip    ? Wrapping::gzip
           : encoding == Stored::Encoding::zlib  ? Wrapping::zlib
           : encoding == Stored::Encoding::bzip2 ? Wrapping::bzip2
                                                 : Wrapping::none;
}

/// All pieces, one after another, each checked to its end.
class PieceStream : public Stream {
 public:
    PieceStream(const Stored& stored, std::vector<Message>& warnings)
        : stored_(stored),
          warnings_(warnings),
          piece_bytes_(static_cast<std::uint64_t>(stored.numbers()) * stored.width() /
                       stored.pieces.size()) {}

    std::size_t read(std::span<std::byte> into) override {
        std::size_t done = 0;
        while (done < into.size()) {
            if (left_ == 0 && !next()) break;
            const auto part =
                static_cast<std::size_t>(std::min<std::uint64_t>(left_, into.size() - done));
            const std::size_t got = current_->read(into.subspan(done, part));
            if (got < part)
                refuse(path_, fmt::format("short data: expected {} bytes, got {}", piece_bytes_,
                                          piece_bytes_ - left_ + got));
            done += got;
            left_ -= got;
            if (left_ == 0) finish();
        }
        return done;
    }
    bool skip(std::uint64_t bytes) override {
        while (bytes > 0 && (left_ > 0 || next())) {
            const auto part = std::min(left_, bytes);
            skip_all(*current_, part, path_);
            bytes -= part;
            left_ -= part;
            if (left_ == 0) finish();
        }
        return bytes == 0;
    }

 private:
    bool next() {
        if (index_ == stored_.pieces.size()) return false;
        const auto& piece = stored_.pieces[index_++];
        path_ = piece.path;
        const auto file = std::make_shared<const File>(piece.path);
        current_ = open_stream(file, piece.offset, file->size(), wrapping_of(stored_.encoding));
        if (stored_.encoding == Stored::Encoding::hex)
            current_ = hex_stream(std::move(current_), path_);
        if (stored_.skip > 0) skip_all(*current_, stored_.skip, path_);
        if (stored_.encoding == Stored::Encoding::text)
            current_ = text_stream(std::move(current_), stored_.type, stored_.wide, path_);
        left_ = piece_bytes_;
        return true;
    }
    void finish() {
        if (wrapping_of(stored_.encoding) == Wrapping::none) return;
        if (std::string warning = check_end(*current_, path_); !warning.empty())
            warnings_.push_back(std::move(warning));
    }

    const Stored& stored_;
    std::vector<Message>& warnings_;
    std::uint64_t piece_bytes_, left_ = 0;
    std::size_t index_ = 0;
    std::string path_;
    std::unique_ptr<Stream> current_;
};

/// Numbers that were written as text are native, whatever the file says of its bytes.
bool swaps(const Stored& stored) {
    return stored.big_endian && stored.encoding != Stored::Encoding::text;
}

class StoredReader : public Reader {
 public:
    explicit StoredReader(Stored stored) : stored_(std::move(stored)) {}
    void read(const Header& header, const Selection& pick, std::span<std::byte> into,
              std::vector<Message>& warnings) const override {
        try {
            std::unique_ptr<Stream> stream = std::make_unique<PieceStream>(stored_, warnings);
            Stored plain = stored_;
            std::int64_t rounded = 0;
            if (stored_.wide != Wide::no) {
                stream = wide_stream(std::move(stream), as_read(stored_.wide, pick), swaps(stored_),
                                     header.file, rounded);
                plain.wide = Wide::no;
                plain.big_endian = false;
            }
            plain.big_endian = swaps(plain);
            scatter(plain, pick, *stream, header.file, into, warnings);
            tell_wide(header, rounded, warnings);
        } catch (const InputError& error) {
            // What is wrong with a data file is told under the name that was asked for.
            const std::string& what = error.message().marked();
            if (what.find(header.file) != what.npos) throw;
            refuse(header.file, what);
        }
    }

    std::optional<std::vector<std::string>> files() const override {
        std::vector<std::string> paths;
        for (const Stored::Piece& piece : stored_.pieces) paths.push_back(piece.path);
        return paths;
    }

 private:
    Stored stored_;
};

}  // namespace

std::int64_t Stored::numbers() const noexcept {
    std::int64_t count = 1;
    for (const Axis& axis : axes) count *= axis.size;
    return count;
}

void check_density(const std::string& file, std::int64_t bytes, std::uint64_t there,
                   std::int64_t densest) {
    constexpr std::int64_t kBelieved = 64 << 20;
    if (bytes > kBelieved && bytes / densest > static_cast<std::int64_t>(there))
        refuse(file, fmt::format("{} bytes of samples do not fit into {} bytes", bytes, there));
}

void take_axes(Header& header, const Stored& stored) {
    std::int64_t count = static_cast<std::int64_t>(stored.width());
    constexpr const char* kNames[] = {"x", "y", "z", "channels", "times"};
    std::array<std::int64_t, 5> sizes{1, 1, 1, 1, 1};
    for (const Axis& axis : stored.axes) {
        if (axis.size < 1)
            refuse(header.file, fmt::format("size of {} is {}, expected 1 or more",
                                            kNames[axis.kind], axis.size));
        count = product(header.file, count, axis.size);
        if (axis.kind >= Axis::channel && axis.size > (1 << 20))
            refuse(header.file,
                   fmt::format("{} {} are not supported", axis.size, kNames[axis.kind]));
        // One kind once, or memory is asked for less than the walk over all axes fills.
        if (axis.size > 1 && sizes[axis.kind] > 1)
            refuse(header.file, fmt::format("two axes of {} are not supported", kNames[axis.kind]));
        sizes[axis.kind] = std::max(sizes[axis.kind], axis.size);
    }
    header.extent = {sizes[Axis::x], sizes[Axis::y], sizes[Axis::z]};
    header.channels = static_cast<int>(sizes[Axis::channel]);
    header.times = static_cast<int>(sizes[Axis::time]);
    header.type = stored.type;
}

void take_bytes_of_colour(Header& header) noexcept {
    header.colour = header.type == Type::u8 && (header.channels == 3 || header.channels == 4);
    header.alpha = header.colour && header.channels == 4 ? Alpha::straight : Alpha::none;
}

void check_pieces(const std::string& file, const Stored& stored) {
    const auto bytes = stored.numbers() * static_cast<std::int64_t>(stored.width());
    const auto count = static_cast<std::int64_t>(stored.pieces.size());
    if (count == 0 || stored.numbers() % count != 0)
        refuse(file,
               fmt::format("{} samples do not divide into {} data files", stored.numbers(), count));
    for (const auto& piece : stored.pieces) {
        const File data(piece.path);
        const std::int64_t there =
            data.size() > piece.offset ? static_cast<std::int64_t>(data.size() - piece.offset) : 0;
        std::int64_t least = bytes / count;
        // Each number takes a digit and a blank at least.
        if (stored.encoding == Stored::Encoding::text)
            least = product(file, stored.numbers() / count, 2) - 1;
        if (stored.encoding == Stored::Encoding::hex) least = product(file, least, 2);
        if (stored.encoding == Stored::Encoding::bzip2) {
            check_density(file, least, static_cast<std::uint64_t>(there), kBzip2Densest);
            least = std::min<std::int64_t>(least, kLeastBzip2);
        } else if (wrapping_of(stored.encoding) != Wrapping::none) {
            least = least / kDeflateRatio + 1;
        }
        if (there < least)
            refuse(
                piece.path == file ? file : file + ": " + piece.path,
                fmt::format("short data: expected {}{} bytes from byte {}, found {}",
                            least == bytes / count ? "" : "at least ", least, piece.offset, there));
    }
}

std::shared_ptr<const Reader> stored_reader(Stored stored) {
    return std::make_shared<const StoredReader>(std::move(stored));
}

void take_reader(Header& header, Stored stored) {
    check_pieces(header.file, stored);
    header.integers = stored.wide;
    header.reader = stored_reader(std::move(stored));
}

void scatter(const Stored& stored, const Selection& pick, Stream& stream, const std::string& file,
             std::span<std::byte> into, std::vector<Message>& warnings) {
    Header shape;
    shape.file = file;
    take_axes(shape, stored);
    Scatter scatter(stored, pick.as_stored, stream, file, into);
    scatter.run(walk_of(stored, pick, shape.extent, loaded_channels(shape, pick)));
    scatter.tell(warnings);
}

}  // namespace edgewise::store
