#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "graph/errors.hpp"
#include "io/file.hpp"

namespace edgewise::store {
namespace {

/// Distinct within the process; the process number makes it distinct among processes.
std::string temporary_name(const std::string& path) {
    static std::atomic<unsigned> count{0};
    const std::filesystem::path target(path);
    const std::string name = fmt::format(
        ".{}.{}.{}.part", target.filename().string().substr(0, 200), ::getpid(), count++);
    return (target.parent_path() / name).string();
}

}  // namespace

Replacement::Replacement(std::string path) : path_(std::move(path)) {
    if (path_ == "-") {
        direct_ = true;
        descriptor_ = ::dup(STDOUT_FILENO);
        if (descriptor_ < 0) fail("standard output cannot be written");
        return;
    }
    struct stat status {};
    const bool there = ::stat(path_.c_str(), &status) == 0;
    if (there && S_ISDIR(status.st_mode)) {
        errno = EISDIR;
        fail("cannot be written");
    }
    direct_ = there && !S_ISREG(status.st_mode);
    temporary_ = direct_ ? path_ : temporary_name(path_);
    const int how = direct_ ? O_RDWR : O_RDWR | O_CREAT | O_EXCL;
    descriptor_ = ::open(temporary_.c_str(), how | O_CLOEXEC, 0666);
    if (descriptor_ < 0) fail("cannot be written");
}

Replacement::~Replacement() {
    if (descriptor_ < 0) return;
    ::close(descriptor_);
    if (!direct_) ::unlink(temporary_.c_str());
}

void Replacement::fail(const char* what) const {
    throw RunError(fmt::format("{}: {}: {}", path_, what, std::strerror(errno)));
}

void Replacement::write(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
        const ssize_t done = ::write(descriptor_, bytes.data(), bytes.size());
        if (done < 0 && errno == EINTR) continue;
        if (done < 0) fail("writing failed");
        bytes = bytes.subspan(static_cast<std::size_t>(done));
    }
}

void Replacement::seek(std::uint64_t to) {
    if (::lseek(descriptor_, static_cast<off_t>(to), SEEK_SET) < 0 && !direct_)
        fail("writing failed");
}

std::uint64_t Replacement::tell() const {
    const off_t at = ::lseek(descriptor_, 0, SEEK_CUR);
    return at < 0 ? 0 : static_cast<std::uint64_t>(at);
}

std::size_t Replacement::read_back(std::span<std::byte> into) {
    const ssize_t got = ::read(descriptor_, into.data(), into.size());
    if (got < 0) fail("writing failed");
    return static_cast<std::size_t>(got);
}

void Replacement::commit() {
    // close() is where a full network disk reports; a file that is not whole must not be renamed.
    const int closed = ::close(descriptor_);
    descriptor_ = -1;
    if (direct_) return;
    if (closed != 0 || ::rename(temporary_.c_str(), path_.c_str()) != 0) {
        const int reason = errno;
        ::unlink(temporary_.c_str());
        errno = reason;
        fail("writing failed");
    }
}

}  // namespace edgewise::store
