#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "io/file.hpp"

namespace edgewise::store {

/// One tag of an XML file: "<name a="b">", "</name>", "<name/>".
struct Tag {
    std::string name;
    std::map<std::string, std::string> attributes;
    bool closes = false;    // </name>
    bool empty = false;     // <name/>
    std::uint64_t end = 0;  // offset of the first byte behind it
    std::string attribute(const std::string& key, const std::string& otherwise = "") const {
        const auto found = attributes.find(key);
        return found == attributes.end() ? otherwise : found->second;
    }
};

/// Reads tags one after another; text between them is passed over. Entities are never expanded,
/// and a DOCTYPE, the only place where they can be declared, is refused.
class TagReader {
 public:
    explicit TagReader(FilePointer file) : file_(std::move(file)), buffer_(1 << 16) {}
    /// XML that is a part of a file: bytes `begin` to `end`.
    TagReader(FilePointer file, std::uint64_t begin, std::uint64_t end, int most_tags)
        : file_(std::move(file)), buffer_(1 << 16), at_(begin), end_(end), most_tags_(most_tags) {}
    /// False at the end of the file. @throws InputError malformed or hostile XML
    bool next(Tag& tag);
    /// Offset of the next '<' at or behind `from`.
    std::uint64_t text_end(std::uint64_t from);

 private:
    int byte(std::uint64_t at);
    std::string markup();
    FilePointer file_;
    Bytes buffer_;
    std::uint64_t at_ = 0, start_ = 0, end_ = UINT64_MAX;
    std::size_t filled_ = 0;
    int tags_ = 0, most_tags_ = 1 << 16;
};

/// Bytes written as base64; padding may also stand between parts that were encoded one by one.
std::unique_ptr<Stream> base64_stream(FilePointer, std::uint64_t begin, std::uint64_t end);

}  // namespace edgewise::store
