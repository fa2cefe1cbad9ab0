#pragma once

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <unistd.h>
#include <vector>
#include <zlib.h>

#include "graph/errors.hpp"
#include "io/store.hpp"

namespace edgewise::store::testing {

/// A folder of its own that is gone afterwards.
class Scratch {
 public:
    Scratch() {
        static int count = 0;
        const char* given = std::getenv("EDGEWISE_SCRATCH");
        const auto base =
            given ? std::filesystem::path(given) : std::filesystem::temp_directory_path();
        folder_ = base / ("store_" + std::to_string(::getpid()) + "_" + std::to_string(count++));
        std::filesystem::create_directories(folder_);
    }
    Scratch(const Scratch&) = delete;
    Scratch& operator=(const Scratch&) = delete;
    ~Scratch() {
        std::error_code ignored;
        std::filesystem::remove_all(folder_, ignored);
    }
    std::string path(const std::string& name) const { return (folder_ / name).string(); }
    std::string put(const std::string& name, const std::string& bytes) const {
        const auto file = folder_ / name;
        std::filesystem::create_directories(file.parent_path());
        std::ofstream(file, std::ios::binary) << bytes;
        return file.string();
    }
    std::size_t files() const {
        std::size_t count = 0;
        for (const auto& entry : std::filesystem::directory_iterator(folder_))
            count += entry.is_regular_file();
        return count;
    }

 private:
    std::filesystem::path folder_;
};

/// The text with every occurrence of `from` replaced.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
    for (std::size_t at = 0; (at = text.find(from, at)) != text.npos; at += to.size())
        text.replace(at, from.size(), to);
    return text;
}

inline std::string bytes_in(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

template <class T>
void put(std::string& to, std::size_t at, T value) {
    if (to.size() < at + sizeof value) to.resize(at + sizeof value);
    std::memcpy(to.data() + at, &value, sizeof value);
}
template <class T>
std::string raw(const std::vector<T>& values) {
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

/// Numbers 0, 7, 14 ... below 1000, again and again.
inline std::vector<std::int16_t> ramp(std::size_t count) {
    std::vector<std::int16_t> values(count);
    for (std::size_t i = 0; i < count; ++i) values[i] = static_cast<std::int16_t>(i * 7 % 1000);
    return values;
}

/// NIfTI-1 of 5 x 4 x 3 i16 and a unit sform, for tests to spoil.
inline std::string nifti() {
    std::string head(352, '\0');
    put(head, 0, std::int32_t{348});
    const std::int16_t dims[8] = {3, 5, 4, 3, 1, 1, 1, 1};
    const float steps[8] = {1, 1, 1, 1, 0, 0, 0, 0};
    for (std::size_t i = 0; i < 8; ++i)
        put(head, 40 + 2 * i, dims[i]), put(head, 76 + 4 * i, steps[i]);
    put(head, 70, std::int16_t{4});
    put(head, 72, std::int16_t{16});
    put(head, 108, 352.0f);
    put(head, 112, 1.0f);
    put(head, 254, std::int16_t{1});
    for (std::size_t i = 0; i < 3; ++i) put(head, 280 + 20 * i, 1.0f);
    std::memcpy(head.data() + 344, "n+1", 4);
    return head;
}

inline std::string zipped(const std::string& bytes) {
    z_stream z{};
    deflateInit2(&z, 9, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY);
    std::string packed(compressBound(bytes.size()) + 32, '\0');
    z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    z.avail_in = static_cast<uInt>(bytes.size());
    z.next_out = reinterpret_cast<Bytef*>(packed.data());
    z.avail_out = static_cast<uInt>(packed.size());
    deflate(&z, Z_FINISH);
    packed.resize(z.total_out);
    deflateEnd(&z);
    return packed;
}

/// Loads a source and returns its samples as T.
template <class T>
std::vector<T> samples_of(const Loaded& loaded) {
    std::vector<T> values(loaded.samples.bytes() / sizeof(T));
    std::memcpy(values.data(), loaded.samples.data(), values.size() * sizeof(T));
    return values;
}
inline Loaded loaded(const std::string& source, const Selection& pick = {}) {
    return load(source, pick, std::pmr::new_delete_resource());
}

/// The message of the InputError that loading ends with, "" where it loads.
inline std::string refusal(const std::string& source, const Selection& pick = {}) {
    try {
        loaded(source, pick);
        return {};
    } catch (const InputError& error) {
        return error.what();
    }
}

/// Real data that a developer may have: the folder of EDGEWISE_SHARED, or "".
inline std::string shared_data() {
    const char* folder = std::getenv("EDGEWISE_SHARED");
    const std::string data = folder ? std::string(folder) + "/data" : "";
    return std::filesystem::is_directory(data) ? data : "";
}

}  // namespace edgewise::store::testing
