#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/number_streams.hpp"
#include "io/reader.hpp"
#include "io/zarr_array.hpp"
#include "io/zarr_image.hpp"

namespace edgewise::store {

/// Reads chunks and puts their numbers where they belong.
class ZarrReader : public Reader {
 public:
    ZarrReader(ZarrArray array, std::vector<ZarrImage::Named> axes)
        : array_(std::move(array)), axes_(std::move(axes)) {}

    void read(const Header& header, const Selection& pick, std::span<std::byte> into,
              std::vector<Message>& warnings) const override;

    /// Chunks come and go without their folder's knowing.
    std::optional<std::vector<std::string>> files() const override { return array_.store->files(); }

 private:
    struct Target {
        const Header& header;
        const Selection& pick;
        std::span<std::byte> into;
        std::int64_t channels;  // in memory
    };

    using Place = std::vector<std::int64_t>;  // one an axis, slowest first

    /// The only index that is read along an axis, or -1: all are.
    std::int64_t only(std::size_t axis, const Selection& pick) const;
    /// How many files are read along each axis.
    Place file_counts(const Selection& pick) const;
    Place file_at(std::int64_t number, const Place& counts, const Selection& pick) const;
    /// Whether a chunk has numbers that are read. @param low  its first place in the array
    bool is_read(const Place& low, const Selection& pick) const;

    /// Calls use(first place in the array, native numbers) for the chunks of a file that are read.
    template <class Use>
    void each_chunk(const Place& file, const Selection& pick, Use use) const;
    Bytes fill_chunk() const;
    /// The same numbers, unpacked, in native byte order.
    Bytes unpacked(const std::string& name, Bytes packed) const;
    /// Where the chunks of a shard lie in its file.
    struct Part {
        std::uint64_t offset = 0, bytes = 0;
        bool missing() const noexcept { return offset == ~0ull && bytes == ~0ull; }
    };
    std::vector<Part> index_of(const ZarrFile& shard, const std::string& name) const;

    /// Calls run(index of the first, its place in the chunk, how many) for numbers of a chunk that
    /// lie in the array and are read, one after another in the chunk.
    template <class Run>
    void each_run(const Place& origin, const Selection& pick, Run run) const;
    /// @param wide_rounded  integers of 64 bits that f64 rounds are added
    void put_chunk(const Place& low, const Bytes& numbers, const Target& target, Rounding& rounding,
                   std::int64_t& wide_rounded) const;

    ZarrArray array_;
    std::vector<ZarrImage::Named> axes_;  // slowest first
};

}  // namespace edgewise::store
