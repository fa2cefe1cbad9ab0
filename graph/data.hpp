#pragma once

#include <any>
#include <cstddef>
#include <map>
#include <memory>
#include <memory_resource>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "graph/representation.hpp"

namespace edgewise {

/// Bytes that stand readable behind the last sample of arrays of memory of their own (never used,
/// only fetched).
inline constexpr std::size_t kArraySlack = 64;

/// Uninitialised bytes from a counting memory resource, aligned to 64, or bytes that something else
/// holds. Moves; a copy shares the bytes, and has to be asked for.
class Array {
 public:
    Array() = default;
    /// @throws std::bad_alloc where the resource's limit is reached
    Array(std::size_t bytes, std::pmr::memory_resource* from);
    Array(Array&&) noexcept = default;
    Array& operator=(Array&&) noexcept = default;

    /// Bytes of a caller, aligned to their samples. Nothing is read before or behind them. No
    /// resource counts them or gives them back: they live as long as their owner, which lives as
    /// long as any array that shares them.
    static Array around(void* data, std::size_t bytes, std::shared_ptr<const void> owner);

    /// The same bytes, which live as long as any that share them.
    Array shared() const { return Array(block_); }
    std::size_t bytes() const noexcept { return block_ ? block_->bytes : 0; }
    /// Whether kArraySlack bytes behind them can be read: not those of a caller.
    bool has_slack() const noexcept { return block_ && block_->from; }
    void* data() noexcept { return block_ ? block_->data : nullptr; }
    const void* data() const noexcept { return block_ ? block_->data : nullptr; }

 private:
    struct Block {
        void* data = nullptr;
        std::size_t bytes = 0;
        std::pmr::memory_resource* from = nullptr;  // null: the owner gives them back
        std::shared_ptr<const void> owner;

        Block(std::size_t bytes, std::pmr::memory_resource* from);
        Block(void* data, std::size_t bytes, std::shared_ptr<const void> owner);
        Block(const Block&) = delete;
        Block& operator=(const Block&) = delete;
        ~Block();
    };
    explicit Array(std::shared_ptr<Block> block) : block_(std::move(block)) {}

    std::shared_ptr<Block> block_;
};

/// What was worked out of samples on the way and lies beside them, for whoever needs it next: what
/// somebody counts to choose a path, say, and the path reads. Each says itself all that it hangs
/// on. Threads share it. It lives as long as the samples do.
class WorkedOut {
 public:
    /// @param memory  where things come from; it lives as long as they do
    explicit WorkedOut(std::shared_ptr<std::pmr::memory_resource> memory)
        : memory_(std::move(memory)) {}
    std::pmr::memory_resource* memory() const noexcept { return memory_.get(); }

    /// The first of a kind that fits; null: none.
    template <class Thing, class Fits>
    std::shared_ptr<const Thing> find(const char* kind, const Fits& fits) const {
        const std::lock_guard lock(mutex_);
        for (const auto& [of, thing] : things_)
            if (of == std::string_view(kind) && fits(*static_cast<const Thing*>(thing.get())))
                return std::static_pointer_cast<const Thing>(thing);
        return nullptr;
    }
    /// No more than a few are kept: then those that are there stay.
    void keep(const char* kind, std::shared_ptr<const void> thing);

 private:
    const std::shared_ptr<std::pmr::memory_resource> memory_;
    mutable std::mutex mutex_;
    std::vector<std::pair<std::string_view, std::shared_ptr<const void>>> things_;
};

/// A vertex made real: a representation, its samples, and what lies beside them. Written once.
struct Data {
    Representation what;
    Array samples;   // those of held()
    Region box;      // of the whole; empty: all of it
    Array tail;      // the last rows of a caller's samples once more, see with_slack(); else empty
    std::any other;  // content that is no array: a type of the edge's own
    /// What lies beside the samples, one entry a name in what.facets. Large ones are
    /// std::shared_ptr, so that data which share samples share them too.
    std::map<std::string, std::any> facets;
    std::shared_ptr<WorkedOut> worked_out = {};  // null: nothing is kept

    /// Allocates the samples of `what`.
    static Data make(const Representation& what, std::pmr::memory_resource* from);
    /// Allocates those of a box of it. Indices, geometry and borders stay those of the whole.
    static Data make(const Representation& what, const Region& box,
                     std::pmr::memory_resource* from);

    /// The samples and facets of other data, which are not copied, under a representation that says
    /// more of them.
    static Data sharing(const Data& other, const Representation& what);

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

/// Data for edges, which fetch whole vectors of a row: samples behind which nothing may be read are
/// shared, and their last rows stand in `tail` once more, with kArraySlack readable bytes behind
/// them. Few samples, and such as do not lie row by row, are copied; those with slack are shared.
/// @param from  where copies are taken from; at most 64 bytes and two rows of what is shared
/// @throws std::bad_alloc where the resource's limit is reached
Data with_slack(const Data& data, std::pmr::memory_resource* from);

/// Copies all samples of `from` into `to`, which holds them too, of the same representation.
void copy_box(const Data& from, Data& to) noexcept;

}  // namespace edgewise
