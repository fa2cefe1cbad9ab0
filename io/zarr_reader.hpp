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
              std::vector<std::string>& warnings) const override;

    /// Chunks come and go without their folder's knowing.
    std::optional<std::vector<std::string>> files() const override { return std::nullopt; }

    /// Numbers of 64 bits become a type that holds all that the array has.
    void narrow(Header& header);

 private:
    struct Target {
        const Header& header;
        const Selection& pick;
        std::span<std::byte> into;
        std::int64_t channels;  // in memory
    };

    /// The only index that is read along an axis, or -1: all are.
    std::int64_t only(std::size_t axis, const Selection& pick) const;
    /// How many chunks are read along each axis.
    std::vector<std::int64_t> chunk_counts(const Selection& pick) const;
    std::vector<std::int64_t> chunk_at(std::int64_t number, const std::vector<std::int64_t>& counts,
                                       const Selection& pick) const;
    /// Decoded numbers in native byte order.
    Bytes chunk_bytes(const std::vector<std::int64_t>& chunk, const std::string& file) const;
    /// Calls run(index of the first, its place in the chunk, how many) for numbers of a chunk that
    /// lie in the array and are read, one after another in the chunk.
    template <class Run>
    void each_run(const std::vector<std::int64_t>& chunk, const Selection& pick, Run run) const;
    void put_chunk(const std::vector<std::int64_t>& chunk, const Target& target,
                   Rounding& rounding) const;

    ZarrArray array_;
    std::vector<ZarrImage::Named> axes_;  // slowest first
};

}  // namespace edgewise::store
