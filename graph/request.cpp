#include "graph/request.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <limits>

namespace edgewise {

std::string_view name_of(Minimize what) noexcept {
    constexpr std::string_view names[] = {"time", "error", "memory"};
    return names[static_cast<int>(what)];
}

std::array<double, 4> Transfer::at(double value) const noexcept {
    const auto above = std::upper_bound(points.begin(), points.end(), value,
                                        [](double v, const Point& p) { return v < p.value; });
    const Point& high = above == points.end() ? points.back() : *above;
    const Point& low = above == points.begin() ? points.front() : *(above - 1);
    const double width = high.value - low.value;
    const double f = width > 0 ? (value - low.value) / width : 0;
    std::array<double, 4> result{};
    for (int c = 0; c < 3; ++c) result[c] = low.color[c] + f * (high.color[c] - low.color[c]);
    result[3] = low.opacity + f * (high.opacity - low.opacity);
    return result;
}

double Transfer::edge_at(double magnitude) const noexcept {
    if (edges.empty()) return 1;
    const auto above =
        std::upper_bound(edges.begin(), edges.end(), magnitude,
                         [](double m, const Edge& edge) { return m < edge.magnitude; });
    if (above == edges.begin()) return edges.front().opacity;
    if (above == edges.end()) return edges.back().opacity;
    const Edge& low = *(above - 1);
    const double f = (magnitude - low.magnitude) / (above->magnitude - low.magnitude);
    return low.opacity + f * (above->opacity - low.opacity);
}

void Stretch::add(std::span<const double> values, const double* pieces,
                  const Request& want) noexcept {
    want.mode->add(*this, values, pieces, want);
}

void Stretch::append(const Stretch& behind, Mode mode) noexcept {
    mode->append(*this, behind);
    length += behind.length;
}

void Stretch::result(const Request& want, double* values) const noexcept {
    want.mode->result(*this, want, values);
}

bool Request::projective() const noexcept {
    for (int view = 0; view < frames; ++view)
        if (const Mat4* map = views.at(view).as_matrix();
            map && map->row(3) != Eigen::RowVector4d(0, 0, 0, 1))
            return true;
    return false;
}

std::optional<int> Request::deformed() const noexcept {
    for (int view = 0; view < frames; ++view)
        if (!views.at(view).is_matrix()) return view;
    return {};
}

double nearest_corner(const Request& want, int view) {
    const Transform& map = want.views.at(view);
    double nearest = std::numeric_limits<double>::infinity();
    for (int corner = 0; corner < 8; ++corner) {
        Vec3 p;
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = corner >> axis & 1 ? static_cast<double>(want.input[axis]) - 0.5 : -0.5;
        nearest = std::min(nearest, map.apply(p).z());
    }
    // What is behind the eye is not seen: light falls off from the eye on.
    return want.eye ? std::max(nearest, want.eye->at.z()) : nearest;
}

Transform residual_transform(const Representation& from, const Request& want, int view) {
    return want.views.at(view) * from.placed.at(view).inverse();
}

Mat4 residual(const Representation& from, const Request& want, int view) {
    return residual_transform(from, want, view).matrix();
}

Representation screen_scalar(const Representation& from, const Request& want) {
    Representation to = from;
    to.space = "screen";
    to.content = "scalar";
    to.drop_facets();
    to.extent = want.screen;
    to.type = Type::f32;
    to.values = {};
    to.placed = want.views;
    return to;
}

Representation screen_picture(const Representation& from, const Request& want) {
    Representation to = screen_scalar(from, want);
    to.content = "picture";
    to.axes = 2;
    to.extent = want.output();
    to.channels = want.mode->channels;
    return to;
}

bool is_target(const Representation& here, const Request& want) {
    return takes_kind(want.job->target, here.kind()) &&
           (here.place == Place::memory || (here.place == Place::ranks && want.ranks > 1));
}

}  // namespace edgewise
