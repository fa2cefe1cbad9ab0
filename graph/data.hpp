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
    Array samples;                           // those of held(), and kArraySlack bytes more
    Region box;                              // of the whole; empty: all of it
    std::any other;                          // content that is no array: a type of the edge's own
    std::map<std::string, std::any> facets;  // one entry a name in what.facets

    /// Allocates the samples of `what`.
    static Data make(const Representation& what, std::pmr::memory_resource* from);
    /// Allocates those of a box of it. Indices, geometry and borders stay those of the whole.
    static Data make(const Representation& what, const Region& box,
                     std::pmr::memory_resource* from);

    /// The box of the whole whose samples are here, x fastest.
    Region held() const noexcept { return box.empty() ? Region::all(what.extent) : box; }
    /// Numbers from one row to the next.
    std::int64_t row() const noexcept { return held().extent().x * what.channels; }
    /// Sample (x, y, z) of the whole, which must be held; channel 0.
    template <class T>
    T* at(std::int64_t x, std::int64_t y, std::int64_t z) noexcept {
        return as<T>() + offset(x, y, z);
    }
    template <class T>
    const T* at(std::int64_t x, std::int64_t y, std::int64_t z) const noexcept {
        return as<T>() + offset(x, y, z);
    }

    template <class T>
    T* as() noexcept {
        return static_cast<T*>(samples.data());
    }
    template <class T>
    const T* as() const noexcept {
        return static_cast<const T*>(samples.data());
    }

    /// The same of whatever type.
    void* row_at(std::int64_t x, std::int64_t y, std::int64_t z) noexcept {
        return as<char>() + offset(x, y, z) * static_cast<std::int64_t>(bytes_of(what.type));
    }
    const void* row_at(std::int64_t x, std::int64_t y, std::int64_t z) const noexcept {
        return as<char>() + offset(x, y, z) * static_cast<std::int64_t>(bytes_of(what.type));
    }

 private:
    std::int64_t offset(std::int64_t x, std::int64_t y, std::int64_t z) const noexcept {
        const Region here = held();
        const Extent n = here.extent();
        return what.channels *
               (x - here.begin[0] + n.x * (y - here.begin[1] + n.y * (z - here.begin[2])));
    }
};

/// Copies all samples of `from` into `to`, which holds them too, of the same representation.
void copy_box(const Data& from, Data& to) noexcept;

}  // namespace edgewise
