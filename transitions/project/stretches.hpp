#pragma once

#include <optional>
#include <string>

#include "graph/transition.hpp"
#include "transitions/kernels/stretch_cast.hpp"

namespace edgewise {

// What the edges share that cast rays by stretches (kernels/stretch_cast.hpp).

/// Why no rays are cast by stretches; empty: they are.
std::string no_stretches(const Representation& from, const Ask& ask);
/// No ray of any view has a longer way through the data [t].
double longest_way(const Representation& from, const Request& want);
/// Work of a cast that samples a share of the cells inside the data, and asks its map once for so
/// many cells.
Work work_of_stretches(const Offer& offer, const Ask& ask, int view, double share,
                       double cells_a_look);
/// Pictures are regions as a whole, which are cut into tiles inside.
Partition parts_of_stretches(const Offer& offer, const Ask& ask);

/// The rays of a request through samples, for a view. Lives as long as the cast is used.
class StretchRays {
 public:
    StretchRays(const Offer& offer, const Ask& ask, const Data& in, int view);
    StretchRays(const StretchRays&) = delete;
    StretchRays& operator=(const StretchRays&) = delete;

    const kernels::RayCast& cast() const { return cast_; }
    const kernels::Optics* optics() const { return takes_optics_ ? &optics_ : nullptr; }

 private:
    kernels::Optics optics_;
    std::optional<kernels::Kept> kept_;
    bool takes_optics_;
    kernels::RayCast cast_;
};

/// Fills a region of a picture.
void cast_stretches(const kernels::StretchCast& by, const Request& want, Data& out,
                    const Region& region, const Context& context);

}  // namespace edgewise
