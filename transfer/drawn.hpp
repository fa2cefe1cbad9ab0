#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "graph/data.hpp"

namespace edgewise {

/// Some of the values of a volume's first channel, the same ones each time and for any number of
/// threads: runs of neighbours along x, one from each of many stretches of equal length, so that
/// the memory they come from is read line by line. A region with few samples is drawn whole.
class Drawn {
 public:
    /// @param runs,length  at most so many, of at most so many samples
    /// @param only_unlike  runs of nothing but this value are not kept: of sparse data many more
    /// can
    ///                     be looked at; of what is left at most some 2^15 samples
    Drawn(const Data& data, const Region& region, std::int64_t runs, std::int64_t length,
          const double* only_unlike = nullptr);

    /// All that were kept; some may be not finite.
    std::span<const float> values() const noexcept { return values_; }
    std::size_t runs() const noexcept { return starts_.empty() ? 0 : starts_.size() - 1; }
    std::span<const float> run(std::size_t i) const noexcept {
        return std::span(values_).subspan(starts_[i], starts_[i + 1] - starts_[i]);
    }

 private:
    std::vector<float> values_;
    std::vector<std::size_t> starts_;  // of each run, and the end
};

/// The value below which a share of some lies, of which there is at least one; changes their order.
double quantile_of(std::vector<float>& values, double share);

}  // namespace edgewise
