#pragma once

#include <cstddef>
#include <cstring>
#include <span>
#include <string_view>
#include <vector>

#include "io/file.hpp"

namespace edgewise::store {

/// Small pieces for a file, written together.
class FileBuffer {
 public:
    explicit FileBuffer(Replacement& file) : file_(file) { bytes_.reserve(kFull + 4096); }

    template <class T>
    void add(const T& value) {
        add(std::as_bytes(std::span(&value, 1)));
    }
    void add(std::string_view text) { add(std::as_bytes(std::span(text.data(), text.size()))); }
    void add(std::span<const std::byte> piece) {
        bytes_.insert(bytes_.end(), piece.begin(), piece.end());
        if (bytes_.size() >= kFull) flush();
    }
    void flush() {
        file_.write(bytes_);
        bytes_.clear();
    }

 private:
    static constexpr std::size_t kFull = 1 << 18;
    Replacement& file_;
    std::vector<std::byte> bytes_;
};

}  // namespace edgewise::store
