#include "io/xml.hpp"

#include <array>
#include <fmt/format.h>

#include "io/text.hpp"

namespace edgewise::store {
namespace {

constexpr std::size_t kLongestTag = 1 << 16;

bool is_blank(char c) noexcept { return c == ' ' || (c >= '\t' && c <= '\r'); }

class Base64Stream : public Stream {
 public:
    Base64Stream(FilePointer file, std::uint64_t begin, std::uint64_t end)
        : file_(std::move(file)), at_(begin), end_(end), buffer_(1 << 16) {}

    std::size_t read(std::span<std::byte> into) override {
        std::size_t done = 0;
        while (done < into.size()) {
            if (ready_ == 0 && !quantum()) break;
            into[done++] = bytes_[next_++];
            --ready_;
        }
        return done;
    }

 private:
    static int value_of(char c) noexcept {
        if (c >= 'A' && c <= 'Z') return c - 'A';
        if (c >= 'a' && c <= 'z') return c - 'a' + 26;
        if (c >= '0' && c <= '9') return c - '0' + 52;
        return c == '+' ? 62 : c == '/' ? 63 : -1;
    }
    /// The next letter that is no blank, or 0 at the end.
    char letter() {
        for (;;) {
            if (used_ == filled_) {
                const auto most = std::min<std::uint64_t>(buffer_.size(), end_ - at_);
                filled_ =
                    file_->read_some(at_, std::span(buffer_).first(static_cast<std::size_t>(most)));
                used_ = 0;
                at_ += filled_;
                if (filled_ == 0) return 0;
            }
            const char c = static_cast<char>(buffer_[used_++]);
            if (!is_blank(c)) return c;
        }
    }
    /// Four letters are three bytes, fewer where the last are '='.
    bool quantum() {
        unsigned bits = 0;
        std::size_t padding = 0;
        for (int i = 0; i < 4; ++i) {
            const char c = letter();
            if (c == 0 && i == 0) return false;
            if (c == '=' && i >= 2) {
                ++padding;
                bits <<= 6;
                continue;
            }
            const int value = value_of(c);
            if (value < 0 || padding > 0)
                refuse(file_->path(), fmt::format("base64 data hold '{}' before byte {}",
                                                  shown({&c, 1}), at_ - filled_ + used_));
            bits = bits << 6 | static_cast<unsigned>(value);
        }
        for (int i = 0; i < 3; ++i) bytes_[i] = static_cast<std::byte>(bits >> (16 - 8 * i) & 0xff);
        next_ = 0;
        ready_ = 3 - padding;
        return true;
    }

    FilePointer file_;
    std::uint64_t at_, end_;
    Bytes buffer_;
    std::size_t used_ = 0, filled_ = 0, ready_ = 0, next_ = 0;
    std::array<std::byte, 3> bytes_{};
};

}  // namespace

int TagReader::byte(std::uint64_t at) {
    if (at >= end_) return -1;
    if (at < start_ || at >= start_ + filled_) {
        start_ = at;
        filled_ = file_->read_some(at, buffer_);
        if (filled_ == 0) return -1;
    }
    return std::to_integer<int>(buffer_[at - start_]);
}

std::uint64_t TagReader::text_end(std::uint64_t from) {
    for (;; ++from)
        if (const int c = byte(from); c < 0 || c == '<') return from;
}

/// What stands between the next '<' and its '>'; empty at the end of the file.
std::string TagReader::markup() {
    at_ = text_end(at_);
    if (byte(at_) < 0) return {};
    std::string text;
    char quote = 0;
    for (++at_;; ++at_) {
        const int c = byte(at_);
        if (c < 0) refuse(file_->path(), "XML ends inside a tag");
        if (text.starts_with("!--") ? c == '>' && text.size() >= 5 && text.ends_with("--")
                                    : c == '>' && !quote)
            break;
        if (!text.starts_with('!') && !text.starts_with('?') && (c == '"' || c == '\'')) {
            if (!quote)
                quote = static_cast<char>(c);
            else if (quote == c)
                quote = 0;
        }
        text += static_cast<char>(c);
        if (text.size() > kLongestTag)
            refuse(file_->path(), fmt::format("an XML tag longer than {} bytes", kLongestTag));
        if (text == "!DOCTYPE" || text == "!ENTITY")
            refuse(file_->path(), "XML with a DOCTYPE is refused");
    }
    ++at_;
    if (text.empty()) refuse(file_->path(), "an empty XML tag");
    return text;
}

bool TagReader::next(Tag& tag) {
    std::string text;
    do {
        text = markup();
        if (text.empty()) return false;
        if (++tags_ > most_tags_) refuse(file_->path(), "has too many XML tags");
    } while (text[0] == '?' || text[0] == '!');
    tag = Tag{};
    tag.end = at_;
    std::string_view rest = text;
    tag.closes = rest.starts_with('/');
    if (tag.closes) rest.remove_prefix(1);
    tag.empty = rest.ends_with('/');
    if (tag.empty) rest.remove_suffix(1);
    const auto name_end = std::min(rest.find_first_of(" \t\r\n"), rest.size());
    tag.name = rest.substr(0, name_end);
    rest = trim(rest.substr(name_end));
    while (!rest.empty()) {
        const auto equal = rest.find('=');
        const std::string key(trim(rest.substr(0, equal)));
        rest = equal == rest.npos ? std::string_view{} : trim(rest.substr(equal + 1));
        const auto end = rest.empty() ? rest.npos : rest.find(rest[0], 1);
        if (end == rest.npos || (rest[0] != '"' && rest[0] != '\''))
            refuse(file_->path(), "XML attribute '" + shown(key) + "' has no value in quotes");
        tag.attributes[key] = rest.substr(1, end - 1);
        rest = trim(rest.substr(end + 1));
    }
    return true;
}

std::unique_ptr<Stream> base64_stream(FilePointer file, std::uint64_t begin, std::uint64_t end) {
    return std::make_unique<Base64Stream>(std::move(file), begin, end);
}

}  // namespace edgewise::store
