#include "presentation/depth_coloured.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <tbb/parallel_for.h>

#include "reference/field.hpp"
#include "reference/view_geometry.hpp"

namespace edgewise {
namespace {

/// Where a ray is largest, from 0 in front to 1 behind.
double depth_of(const RaySpan& ray, const ReferenceField& field, const Mat4& to_screen,
                double depth) {
    double most = -std::numeric_limits<double>::infinity(), at = ray.low;
    for (double t = std::floor(ray.low) + 1; t < ray.high; ++t) {
        double value = 0;
        if (!field.simple_at(ray.origin + t * ray.direction, value) || !(value > most)) continue;
        most = value;
        at = t;
    }
    const Eigen::Vector4d screen = to_screen * (ray.origin + at * ray.direction).homogeneous();
    return (screen[2] + 0.5) / depth;
}

}  // namespace

Array depth_coloured(const Data& result, const Tail& tail, const Shades& levels,
                     const Colormap& map, const Request& want, const Data& samples, int view,
                     double depth, std::pmr::memory_resource* memory) {
    Tail fine = tail;
    fine.type = Type::u16;
    fine.view = true;
    const Array grey = finished(result, fine, levels, memory);
    const ReferenceField field(samples,
                               want.field == Field::nearest ? Field::nearest : Field::linear);
    const ViewGeometry geometry(want);
    const Mat4 to_screen = want.views.at(view).matrix();
    const Extent n = result.what.extent;
    Array out(static_cast<std::size_t>(3 * n.x * n.y), memory);
    const auto* from = static_cast<const std::uint16_t*>(grey.data());
    auto* to = static_cast<std::uint8_t*>(out.data());
    tbb::parallel_for(std::int64_t{0}, n.y, [&](std::int64_t y) {
        for (std::int64_t x = 0; x < n.x; ++x) {
            const std::int64_t pixel = x + n.x * y;
            std::fill(to + 3 * pixel, to + 3 * pixel + 3, std::uint8_t{0});
            const double light = from[pixel] / 65535.0;
            const auto ray =
                light > 0 ? geometry.ray(view, static_cast<double>(x), static_cast<double>(y))
                          : std::nullopt;
            if (!ray) continue;
            const Colormap::Colour colour = map.at(depth_of(*ray, field, to_screen, depth));
            for (std::size_t c = 0; c < 3; ++c)
                to[3 * pixel + static_cast<std::int64_t>(c)] =
                    static_cast<std::uint8_t>(std::lround(255 * light * colour[c]));
        }
    });
    return out;
}

}  // namespace edgewise
