#include "surface/lids.hpp"

#include <algorithm>
#include <limits>
#include <tbb/parallel_for.h>

#include "graph/with_type.hpp"
#include "surface/level.hpp"

namespace edgewise::surface {
namespace {

/// A type that holds the values as they are, where there is one.
Type framed_type(const Representation& samples) noexcept {
    const bool small = bytes_of(samples.type) <= 2 || samples.type == Type::f32;
    return (small && samples.values.identity()) || !can_be_cut(Type::f64) ? Type::f32 : Type::f64;
}

Representation framed(const Representation& samples) noexcept {
    Representation what = samples;
    what.extent = {samples.extent.x + 2, samples.extent.y + 2, samples.extent.z + 2};
    what.type = framed_type(samples);
    what.values = {};
    return what;
}

template <class T, class F>
void put_row(const T* from, std::int64_t count, const ValueMap& values, F* to) noexcept {
    for (std::int64_t x = 0; x < count; ++x)
        to[x] = static_cast<F>(values(static_cast<double>(from[x])));
}

template <class F>
void put_framed(const Data& samples, Data& out) {
    const Extent n = samples.what.extent;
    constexpr F kBelow = std::numeric_limits<float>::lowest();
    tbb::parallel_for(std::int64_t{-1}, n.z + 1, [&](std::int64_t z) {
        for (std::int64_t y = -1; y <= n.y; ++y) {
            F* to = out.at<F>(0, y + 1, z + 1);
            std::fill(to, to + n.x + 2, kBelow);
            if (y < 0 || z < 0 || y == n.y || z == n.z) continue;
            with_type(samples.what.type, [&]<class T>(T) {
                put_row(samples.at<T>(0, y, z), n.x, samples.what.values, to + 1);
            });
        }
    });
}

}  // namespace

Data with_frame(const Data& samples, std::pmr::memory_resource* memory) {
    Data out = Data::make(framed(samples.what), memory);
    if (out.what.type == Type::f32)
        put_framed<float>(samples, out);
    else
        put_framed<double>(samples, out);
    return out;
}

double frame_bytes(const Representation& samples) noexcept { return framed(samples).bytes(); }

}  // namespace edgewise::surface
