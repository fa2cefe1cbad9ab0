#include "io/file.hpp"

#include <algorithm>
#include <array>
#include <bzlib.h>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include "graph/errors.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

constexpr std::size_t kChunk = 1 << 16;
// So much behind the last needed byte is inflated to reach the checksum, and no more.
constexpr std::size_t kTrailing = 1 << 20;

class PlainStream : public Stream {
 public:
    PlainStream(FilePointer file, std::uint64_t begin, std::uint64_t end)
        : file_(std::move(file)), at_(begin), end_(end) {}
    std::size_t read(std::span<std::byte> into) override {
        const std::uint64_t left = end_ > at_ ? end_ - at_ : 0;
        if (into.size() > left) into = into.first(static_cast<std::size_t>(left));
        const std::size_t got = file_->read_some(at_, into);
        at_ += got;
        return got;
    }
    bool skip(std::uint64_t bytes) override {
        if (bytes > (end_ > at_ ? end_ - at_ : 0)) return false;
        at_ += bytes;
        return true;
    }

 private:
    FilePointer file_;
    std::uint64_t at_, end_;
};

class InflateStream : public Stream {
 public:
    InflateStream(FilePointer file, std::uint64_t begin, std::uint64_t end, Wrapping wrapping)
        : file_(std::move(file)), input_(file_, begin, end), gzip_(wrapping == Wrapping::gzip) {
        const int window = gzip_ ? 15 + 16 : wrapping == Wrapping::deflate ? -15 : 15;
        if (inflateInit2(&z_, window) != Z_OK) throw std::bad_alloc();
    }
    ~InflateStream() override { inflateEnd(&z_); }

    std::size_t read(std::span<std::byte> into) override {
        std::size_t done = 0;
        while (done < into.size() && !ended_) {
            fill();
            const auto room = std::min<std::size_t>(into.size() - done, 1 << 30);
            z_.next_out = reinterpret_cast<Bytef*>(into.data() + done);
            z_.avail_out = static_cast<uInt>(room);
            const int status = inflate(&z_, Z_NO_FLUSH);
            done += room - z_.avail_out;
            if (status == Z_STREAM_END)
                next_member();
            else if (status != Z_OK && status != Z_BUF_ERROR)
                refuse(file_->path(), fmt::format("compressed data are damaged: {}",
                                                  z_.msg ? z_.msg : "unknown error"));
        }
        return done;
    }

 private:
    void fill() {
        if (z_.avail_in > 0) return;
        z_.avail_in = static_cast<uInt>(input_.read(std::as_writable_bytes(std::span(buffer_))));
        z_.next_in = reinterpret_cast<Bytef*>(buffer_.data());
        if (z_.avail_in == 0) refuse(file_->path(), "the compressed stream ends too early");
    }
    /// gzip files may be several streams one after another; zeros or junk behind them are ignored.
    void next_member() {
        std::memmove(buffer_.data(), z_.next_in, z_.avail_in);
        const auto rest = std::as_writable_bytes(std::span(buffer_)).subspan(z_.avail_in);
        if (gzip_) z_.avail_in += static_cast<uInt>(input_.read(rest));
        z_.next_in = reinterpret_cast<Bytef*>(buffer_.data());
        ended_ = !gzip_ || z_.avail_in < 2 || buffer_[0] != 0x1f || buffer_[1] != 0x8b;
        if (!ended_) inflateReset(&z_);
    }

    FilePointer file_;
    PlainStream input_;
    bool gzip_, ended_ = false;
    z_stream z_{};
    std::array<unsigned char, kChunk> buffer_;
};

class Bzip2Stream : public Stream {
 public:
    Bzip2Stream(FilePointer file, std::uint64_t begin, std::uint64_t end)
        : file_(std::move(file)), input_(file_, begin, end) {
        if (BZ2_bzDecompressInit(&z_, 0, 0) != BZ_OK) throw std::bad_alloc();
    }
    Bzip2Stream(const Bzip2Stream&) = delete;
    Bzip2Stream& operator=(const Bzip2Stream&) = delete;
    ~Bzip2Stream() override { BZ2_bzDecompressEnd(&z_); }

    std::size_t read(std::span<std::byte> into) override {
        std::size_t done = 0;
        while (done < into.size() && !ended_) {
            if (z_.avail_in == 0 && !fill())
                refuse(file_->path(), "the compressed stream ends too early");
            const auto room = std::min<std::size_t>(into.size() - done, 1 << 30);
            z_.next_out = reinterpret_cast<char*>(into.data() + done);
            z_.avail_out = static_cast<unsigned>(room);
            const int status = BZ2_bzDecompress(&z_);
            done += room - z_.avail_out;
            if (status == BZ_STREAM_END)
                next_member();
            else if (status != BZ_OK)
                refuse(file_->path(), status == BZ_MEM_ERROR
                                          ? "out of memory in bzip2"
                                          : "compressed data are damaged: bzip2");
        }
        return done;
    }

 private:
    bool fill() {
        z_.avail_in =
            static_cast<unsigned>(input_.read(std::as_writable_bytes(std::span(buffer_))));
        z_.next_in = buffer_.data();
        return z_.avail_in > 0;
    }
    /// Programs that work in parallel write several streams, one after another.
    void next_member() {
        ended_ = (z_.avail_in == 0 && !fill()) || *z_.next_in != 'B';
        if (ended_) return;
        const bz_stream rest = z_;
        BZ2_bzDecompressEnd(&z_);
        z_ = {};
        if (BZ2_bzDecompressInit(&z_, 0, 0) != BZ_OK) throw std::bad_alloc();
        z_.next_in = rest.next_in;
        z_.avail_in = rest.avail_in;
    }

    FilePointer file_;
    PlainStream input_;
    bool ended_ = false;
    bz_stream z_{};
    std::array<char, kChunk> buffer_;
};

}  // namespace

File::File(const std::string& path) : path_(path) {
    // Without O_NONBLOCK, opening a pipe would wait for a writer.
    descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (descriptor_ < 0) refuse(path, std::strerror(errno));
    struct stat status {};
    if (::fstat(descriptor_, &status) != 0 || !S_ISREG(status.st_mode)) {
        ::close(descriptor_);
        refuse(path, "not a regular file");
    }
    size_ = static_cast<std::uint64_t>(status.st_size);
}

File::~File() { ::close(descriptor_); }

std::size_t File::read_some(std::uint64_t offset, std::span<std::byte> into) const {
    std::size_t done = 0;
    while (done < into.size()) {
        const ssize_t got = ::pread(descriptor_, into.data() + done, into.size() - done,
                                    static_cast<off_t>(offset + done));
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) refuse(path_, std::strerror(errno));
        if (got == 0) break;
        done += static_cast<std::size_t>(got);
    }
    return done;
}

void File::read(std::uint64_t offset, std::span<std::byte> into, const char* what) const {
    const std::size_t got = offset < size_ ? read_some(offset, into) : 0;
    if (got < into.size())
        refuse(path_, fmt::format("too short: {} needs {} bytes at {}, the file has {}", what,
                                  into.size(), offset, size_));
}

Bytes File::head(std::size_t most) const {
    Bytes bytes(static_cast<std::size_t>(std::min<std::uint64_t>(most, size_)));
    bytes.resize(read_some(0, bytes));
    return bytes;
}

bool Stream::skip(std::uint64_t bytes) {
    std::array<std::byte, 1 << 14> scratch;
    while (bytes > 0) {
        const auto part = static_cast<std::size_t>(std::min<std::uint64_t>(bytes, scratch.size()));
        const std::size_t got = read(std::span(scratch).first(part));
        if (got < part) return false;
        bytes -= got;
    }
    return true;
}

std::size_t MemoryStream::read(std::span<std::byte> into) {
    const std::size_t count = std::min(into.size(), left_.size());
    std::copy_n(left_.begin(), count, into.begin());
    left_ = left_.subspan(count);
    return count;
}

void read_all(Stream& stream, std::span<std::byte> into, const std::string& file) {
    const std::size_t got = stream.read(into);
    if (got < into.size())
        refuse(file, fmt::format("short data: expected {} bytes more, got {}", into.size(), got));
}

void skip_all(Stream& stream, std::uint64_t bytes, const std::string& file) {
    if (!stream.skip(bytes))
        refuse(file, fmt::format("data end too early: {} bytes were to be skipped", bytes));
}

std::unique_ptr<Stream> open_stream(FilePointer file, std::uint64_t begin, std::uint64_t end,
                                    Wrapping wrapping) {
    if (wrapping == Wrapping::none)
        return std::make_unique<PlainStream>(std::move(file), begin, end);
    if (wrapping == Wrapping::bzip2)
        return std::make_unique<Bzip2Stream>(std::move(file), begin, end);
    return std::make_unique<InflateStream>(std::move(file), begin, end, wrapping);
}

std::string check_end(Stream& stream, const std::string& file) {
    Bytes scratch(kChunk);
    std::size_t more = 0;
    while (more < kTrailing) {
        const std::size_t got = stream.read(scratch);
        more += got;
        if (got < scratch.size()) break;
    }
    if (more == 0) return {};
    return fmt::format("{}: {}{} bytes follow the samples and are ignored", file,
                       more < kTrailing ? "" : "more than ", more);
}

bool starts_gzip(std::span<const std::byte> bytes) noexcept {
    return bytes.size() > 2 && bytes[0] == std::byte{0x1f} && bytes[1] == std::byte{0x8b};
}

std::string folder_of(const std::string& path) {
    const auto parent = std::filesystem::path(path).parent_path();
    return parent.empty() ? "." : parent.string();
}

std::string beside(const std::string& header, std::string_view name) {
    namespace fs = std::filesystem;
    const fs::path relative{std::string(trim(name))};
    if (relative.empty() || relative.is_absolute() ||
        std::find(relative.begin(), relative.end(), "..") != relative.end())
        refuse(header, "names its data '" + shown(name) + "', outside its own folder");
    const fs::path folder = folder_of(header), path = folder / relative;
    std::error_code error;
    if (name.find('\0') != name.npos || !fs::exists(path, error))
        refuse(header, "its data file '" + shown(name) + "' does not exist");
    if (!fs::is_regular_file(path, error))
        refuse(header, "its data file '" + shown(name) + "' is not a regular file");
    const fs::path real = fs::canonical(path, error), root = fs::canonical(folder, error);
    const auto [end, _] = std::mismatch(root.begin(), root.end(), real.begin(), real.end());
    if (error || end != root.end())
        refuse(header, "its data file '" + shown(name) + "' is a link out of its own folder");
    return path.string();
}

}  // namespace edgewise::store
