#include "transitions/reference/coarse_picture.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <tbb/parallel_for.h>

#include "transitions/reference/stored_cast.hpp"

namespace edgewise {
namespace {

constexpr int kViews = 4, kSide = 16;  // 1024 rays
constexpr double kStep = 1.5;          // samples along the axis that a ray runs along most

struct Coarse {
    OutputSample at;
    double low = std::numeric_limits<double>::infinity(), high = -low;
};

std::vector<Coarse> coarse_pictures(const Request& want, const Data& data,
                                    const ViewGeometry& geometry) {
    const int views = std::min(kViews, want.frames);
    std::vector<Coarse> rays(static_cast<std::size_t>(views * kSide * kSide));
    const int channels = want.mode == Mode::composite ? 4 : 1;
    tbb::parallel_for(0, views * kSide, [&](int line) {
        const int view = static_cast<int>((line / kSide + 0.37) / views * want.frames);
        for (int column = 0; column < kSide; ++column) {
            Coarse& coarse = rays[static_cast<std::size_t>(line * kSide + column)];
            coarse.at = {view, (2 * column + 1) * want.screen.x / (2 * kSide),
                         (2 * (line % kSide) + 1) * want.screen.y / (2 * kSide), 0};
            const std::optional<RaySpan> ray = geometry.ray(coarse.at);
            if (!ray) continue;
            std::array<double, 4> value{};
            with_stored_type(data.what.type, [&](auto zero) {
                cast_stored(NearestStored<decltype(zero)>(data), *ray, kStep, want)
                    .result(want, value.data());
            });
            coarse.low = *std::min_element(value.begin(), value.begin() + channels);
            coarse.high = *std::max_element(value.begin(), value.begin() + channels);
        }
    });
    return rays;
}

}  // namespace

std::vector<OutputSample> likely_extremes(const Request& want, const ReferenceField& field,
                                          const ViewGeometry& geometry,
                                          const Statistics& statistics) {
    const std::vector<Coarse> rays = coarse_pictures(want, field.samples(), geometry);
    const auto most = std::max_element(
        rays.begin(), rays.end(), [](const Coarse& a, const Coarse& b) { return a.high < b.high; });
    const auto least = std::min_element(
        rays.begin(), rays.end(), [](const Coarse& a, const Coarse& b) { return a.low < b.low; });
    std::vector<OutputSample> found;
    if (std::isfinite(most->high)) found = {most->at, least->at};
    if (want.mode != Mode::mip || want.eye) return found;

    const Extent& n = field.extent();
    const std::int64_t place = statistics.highest;
    const Vec3 p(static_cast<double>(place % n.x), static_cast<double>(place / n.x % n.y),
                 static_cast<double>(place / (n.x * n.y)));
    for (int i = 0; i < std::min(2, want.frames); ++i) {
        const int view = i * want.frames / 2;
        const Vec3 screen = (want.views.at(view) * p.homogeneous()).head<3>();
        const double x = std::floor(screen.x()), y = std::floor(screen.y());
        if (x >= 0 && y >= 0 && x < static_cast<double>(want.screen.x) &&
            y < static_cast<double>(want.screen.y))
            found.push_back({view, static_cast<std::int64_t>(x), static_cast<std::int64_t>(y), 0});
    }
    return found;
}

}  // namespace edgewise
