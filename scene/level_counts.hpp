#pragma once

#include <cstdint>
#include <memory_resource>
#include <mutex>
#include <tbb/enumerable_thread_specific.h>
#include <vector>

#include "scene/tally.hpp"

namespace edgewise {

/// How often each number of a type of 8 or 16 bits is stored. Threads count side by side.
class LevelCounts {
 public:
    /// Takes memory, 0.25 MiB a thread at most as counting begins; where more than 2^32 values are
    /// counted, 0.5 MiB besides.
    LevelCounts(Type type, std::pmr::memory_resource* memory);

    void count(const Stretched& values);

    struct Level {
        double stored;
        std::int64_t times;
    };
    /// The number that is stored most often; of ties the smallest. After all counting.
    /// @param least,greatest  that are stored
    Level commonest(std::int64_t least, std::int64_t greatest) const;

 private:
    struct Part {
        std::pmr::vector<std::uint32_t> counts;
        std::int64_t counted = 0;
    };
    /// Adds what a thread has counted to the sum.
    void add(Part& part);

    Type type_;
    std::size_t levels_;
    std::pmr::memory_resource* memory_;
    std::mutex summing_;
    std::pmr::vector<std::int64_t> sum_;  // by the bits of a number
    tbb::enumerable_thread_specific<Part> parts_;
};

}  // namespace edgewise
