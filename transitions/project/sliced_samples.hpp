#pragma once

#include <cstdint>

#include "graph/transition.hpp"
#include "transitions/kernels/grid.hpp"

namespace edgewise {

/// Samples with the slices of an axis behind one another. Rows lie as in the data; those of slices
/// across x, of which a sample lies in each row, are turned into rows of a copy.
class SlicedSamples {
 public:
    SlicedSamples(const Data& in, const Request& want, int axis, Context& context);
    /// The same where the copy was made before.
    SlicedSamples(const Data& in, const Request& want, int axis, const Array& turned);

    /// The extent of such slices.
    static Extent extent_of(const Extent& data, int axis);

    const kernels::Grid& all() const { return grid_; }
    /// Those of some slices.
    kernels::Grid from(std::int64_t first, std::int64_t count) const;
    /// The copy; empty: there is none.
    const Array& turned() const { return turned_; }

 private:
    void take_turned(const Array& turned);

    kernels::Grid grid_;
    Array turned_;
};

}  // namespace edgewise
