#pragma once

#include <any>
#include <map>
#include <memory_resource>
#include <string>

#include "graph/representation.hpp"

namespace edgewise {

/// Bytes that stand readable behind the last sample of every array (never used, only fetched).
inline constexpr std::size_t kArraySlack = 64;

/// Uninitialised bytes from a counting memory resource, aligned to 64. Moves, does not copy.
class Array {
 public:
    Array() = default;
    /// @throws std::bad_alloc where the resource's limit is reached
    Array(std::size_t bytes, std::pmr::memory_resource* from);
    Array(Array&& other) noexcept { swap(other); }
    Array& operator=(Array&& other) noexcept {
        Array taken(std::move(other));
        swap(taken);
        return *this;
    }
    ~Array();

    std::size_t bytes() const noexcept { return bytes_; }
    void* data() noexcept { return data_; }
    const void* data() const noexcept { return data_; }

 private:
    void swap(Array& other) noexcept;
    void* data_ = nullptr;
    std::size_t bytes_ = 0;
    std::pmr::memory_resource* from_ = nullptr;
};

/// A vertex made real: a representation, its samples, and what lies beside them. Written once.
struct Data {
    Representation what;
    Array samples;                           // what.bytes() and kArraySlack more
    std::any other;                          // content that is no array: a type of the edge's own
    std::map<std::string, std::any> facets;  // one entry a name in what.facets

    /// Allocates the samples of `what`.
    static Data make(const Representation& what, std::pmr::memory_resource* from);

    template <class T>
    T* as() noexcept {
        return static_cast<T*>(samples.data());
    }
    template <class T>
    const T* as() const noexcept {
        return static_cast<const T*>(samples.data());
    }
};

}  // namespace edgewise
