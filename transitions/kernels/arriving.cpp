#include "transitions/kernels/arriving.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "transitions/kernels/scalar_load.hpp"

namespace edgewise::kernels {
namespace {

using Index = std::array<double, 3>;

/// Optical depth of a unit of length: opaque is so much that nothing is left of a tenth of it.
constexpr double kMostDepth = 1e3;

double opacity_of(const Optics& optics, float stored) {
    float opacity = optics.opacity;
    for (const OpticsRamp& ramp : optics.ramps)
        opacity +=
            ramp.opacity * std::clamp((stored - ramp.start) * ramp.inverse_width, 0.0F, 1.0F);
    return std::clamp(static_cast<double>(opacity), 0.0, 1.0);
}

double depth_of(const Optics& optics, float stored) {
    if (!std::isfinite(stored)) return 0;
    const double opacity = opacity_of(optics, stored);
    return opacity > 0 ? std::min(kMostDepth, -std::log1p(-opacity)) / optics.unit : 0;
}

bool is_kept(const Medium& medium, const Index& p) {
    const Extent& n = medium.volume.extent;
    for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        const double low = medium.kept ? medium.kept->low[a] : -0.5;
        const double high = medium.kept ? medium.kept->high[a] : static_cast<double>(n[axis]) - 0.5;
        if (!(p[a] >= low && p[a] <= high)) return false;
    }
    if (medium.kept)
        for (const auto& [normal, offset] : medium.kept->planes)
            if (normal[0] * p[0] + normal[1] * p[1] + normal[2] * p[2] + offset < 0) return false;
    if (medium.kept)
        for (const Kept::Ball& ball : medium.kept->balls) {
            const Index from = ball.from_centre(p);
            if (from[0] * from[0] + from[1] * from[1] + from[2] * from[2] > 1) return false;
        }
    return true;
}

/// Trilinear stored numbers; beyond the outermost samples these.
template <class T>
float linear_at(const Grid& volume, const Index& p) {
    std::int64_t cell[3];
    float share[3];
    std::int64_t next[3];
    const std::int64_t strides[3] = {1, volume.row_step(), volume.slice_step()};
    for (int axis = 0; axis < 3; ++axis) {
        const double q = std::clamp(p[static_cast<std::size_t>(axis)], 0.0,
                                    static_cast<double>(volume.extent[axis] - 1));
        cell[axis] = static_cast<std::int64_t>(q);
        share[axis] = static_cast<float>(q - static_cast<double>(cell[axis]));
        next[axis] = share[axis] > 0 ? strides[axis] : 0;
    }
    const T* at = volume.as<T>() + cell[0] + cell[1] * strides[1] + cell[2] * strides[2];
    const auto line = [&](const T* from) {
        const auto a = static_cast<float>(from[0]), b = static_cast<float>(from[next[0]]);
        return a + share[0] * (b - a);
    };
    const auto plane = [&](const T* from) {
        const float a = line(from), b = line(from + next[1]);
        return a + share[1] * (b - a);
    };
    const float a = plane(at), b = plane(at + next[2]);
    return a + share[2] * (b - a);
}

template <class T>
double depth_in(const Medium& medium, const Index& p) {
    if (!is_kept(medium, p)) return 0;
    if (medium.bricks) {
        const Extent& n = medium.volume.extent;
        std::int64_t brick[3];
        for (int axis = 0; axis < 3; ++axis)
            brick[axis] =
                static_cast<std::int64_t>(std::clamp(p[static_cast<std::size_t>(axis)], 0.0,
                                                     static_cast<double>(n[axis] - 1))) >>
                Bricks::kShift;
        const Extent& bricks = medium.bricks->extent;
        if (medium.bricks->level[static_cast<std::size_t>(
                (brick[2] * bricks.y + brick[1]) * bricks.x + brick[0])] <= 0)
            return 0;
    }
    return depth_of(*medium.optics, linear_at<T>(medium.volume, p));
}

/// Calls body(depth) with the function that reads a medium's type.
template <class Body>
void with_depth(const Medium& medium, const Body& body) {
    switch (medium.volume.type) {
        case Type::u8:
            return body(depth_in<std::uint8_t>);
        case Type::i8:
            return body(depth_in<std::int8_t>);
        case Type::u16:
            return body(depth_in<std::uint16_t>);
        case Type::i16:
            return body(depth_in<std::int16_t>);
        case Type::f32:
            return body(depth_in<float>);
        default: {
            const auto slow = [](const Medium& from, const Index& p) -> double {
                if (!is_kept(from, p)) return 0;
                const Grid& volume = from.volume;
                const ScalarLoad load = scalar_load(volume.type);
                double sum = 0;
                for (int corner = 0; corner < 8; ++corner) {
                    double weight = 1;
                    std::int64_t at = 0;
                    const std::int64_t strides[3] = {1, volume.row_step(), volume.slice_step()};
                    for (int axis = 0; axis < 3; ++axis) {
                        const auto last = static_cast<double>(volume.extent[axis] - 1);
                        const double q = std::clamp(p[static_cast<std::size_t>(axis)], 0.0, last);
                        const double share = q - std::floor(q);
                        const bool upper = corner >> axis & 1;
                        weight *= upper ? share : 1 - share;
                        at += strides[axis] *
                              static_cast<std::int64_t>(std::min(last, std::floor(q) + upper));
                    }
                    if (weight > 0) sum += weight * static_cast<double>(load(volume.samples, at));
                }
                return depth_of(*from.optics, static_cast<float>(sum));
            };
            return body(slow);
        }
    }
}

struct Corner {
    std::int64_t cell[3];
    double share[3];
};

/// The lower corner of the points around a place, brought onto the grid.
Corner corner_of(const Extent& n, const Index& at) {
    Corner corner;
    for (int axis = 0; axis < 3; ++axis) {
        const double q =
            std::clamp(at[static_cast<std::size_t>(axis)], 0.0, static_cast<double>(n[axis] - 1));
        corner.cell[axis] = std::min<std::int64_t>(static_cast<std::int64_t>(q), n[axis] - 1);
        corner.share[axis] = q - static_cast<double>(corner.cell[axis]);
    }
    return corner;
}

}  // namespace

double Medium::depth_at(const Index& p) const {
    double depth = 0;
    with_depth(*this, [&](auto read) { depth = read(*this, p); });
    return depth;
}

LightGrid LightGrid::around(const Extent& volume, const Eigen::Matrix4d& to_screen,
                            const Eigen::Vector3d& towards, std::pmr::memory_resource* memory) {
    const Eigen::Matrix3d linear = to_screen.topLeftCorner<3, 3>();
    // Any two axes across the light.
    int least = 0;
    towards.cwiseAbs().minCoeff(&least);
    const Eigen::Vector3d u = towards.cross(Eigen::Vector3d::Unit(least)).normalized();
    Eigen::Matrix3d frame;
    frame << u.transpose(), towards.cross(u).transpose(), -towards.transpose();
    const Eigen::Matrix3d to_light = frame * linear;
    constexpr double kEnd = std::numeric_limits<double>::infinity();
    Eigen::Vector3d low = Eigen::Vector3d::Constant(kEnd), high = -low;
    for (int corner = 0; corner < 8; ++corner) {
        Eigen::Vector3d p;
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = corner >> axis & 1 ? static_cast<double>(volume[axis]) - 0.5 : -0.5;
        low = low.cwiseMin(to_light * p);
        high = high.cwiseMax(to_light * p);
    }
    double step = linear.colwise().norm().minCoeff();
    const Eigen::Vector3d size = high - low;
    const auto points = [&] { return (size / step + Eigen::Vector3d::Constant(2)).prod(); };
    constexpr double kMost = 4;  // a sample
    const double most = kMost * static_cast<double>(volume.samples()) + 4096;
    while (points() > most) step *= 1.05;

    LightGrid grid{.extent = {},
                   .step = step,
                   .origin = {},
                   .axes = {},
                   .to_grid = {},
                   .left = std::pmr::vector<float>(memory)};
    for (int axis = 0; axis < 3; ++axis)
        grid.extent[axis] = static_cast<std::int64_t>(std::ceil(size[axis] / step)) + 1;
    const Eigen::Matrix3d to_input = to_light.inverse();
    const Eigen::Vector3d origin = to_input * low;
    const Eigen::Matrix3d to_points = to_light / step;
    const Eigen::Vector3d shift = -low / step;
    for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        grid.origin[a] = origin[axis];
        for (int row = 0; row < 3; ++row)
            grid.axes[axis][static_cast<std::size_t>(row)] = step * to_input(row, axis);
        for (int column = 0; column < 3; ++column)
            grid.to_grid[4 * a + static_cast<std::size_t>(column)] = to_points(axis, column);
        grid.to_grid[4 * a + 3] = shift[axis];
    }
    return grid;
}

namespace {

/// @param read  of the medium's type
template <class Read>
void march_by(const LightGrid& grid, const Medium& medium, std::int64_t i, std::int64_t j,
              std::int64_t last, float* left_at, Read&& read) {
    constexpr double kNothing = 1e-5;
    Index p;
    for (std::size_t axis = 0; axis < 3; ++axis)
        p[axis] = grid.origin[axis] + static_cast<double>(i) * grid.axes[0][axis] +
                  static_cast<double>(j) * grid.axes[1][axis];
    double depth = 0, left = 1;
    left_at[0] = 1;
    for (std::int64_t k = 0; k < last; ++k) {
        if (left > kNothing) {
            Index middle;
            for (std::size_t axis = 0; axis < 3; ++axis)
                middle[axis] = p[axis] + (static_cast<double>(k) + 0.5) * grid.axes[2][axis];
            if (const double more = read(medium, middle); more > 0) {
                depth += more * grid.step;
                left = std::exp(-depth);
            }
        }
        left_at[k + 1] = static_cast<float>(left);
    }
}

}  // namespace

void LightGrid::march(const Medium& medium, std::int64_t i, std::int64_t j, std::int64_t last,
                      float* left_at) const {
    with_depth(medium, [&](auto read) { march_by(*this, medium, i, j, last, left_at, read); });
}

void LightGrid::fill(const Medium& medium, std::int64_t begin, std::int64_t end) {
    with_depth(medium, [&](auto read) {
        SmallVector<float> column(static_cast<std::size_t>(extent.z));
        for (std::int64_t j = begin; j < end; ++j)
            for (std::int64_t i = 0; i < extent.x; ++i) {
                march_by(*this, medium, i, j, extent.z - 1, column.data(), read);
                for (std::int64_t k = 0; k < extent.z; ++k)
                    left[static_cast<std::size_t>((k * extent.y + j) * extent.x + i)] =
                        column[static_cast<std::size_t>(k)];
            }
    });
}

double LightGrid::at(const Medium& medium, const Index& p) const {
    const Corner corner = corner_of(extent, apply(to_grid, p[0], p[1], p[2]));
    const std::int64_t last = std::min(corner.cell[2] + 1, extent.z - 1);
    std::vector<float> column(left.empty() ? static_cast<std::size_t>(last + 1) : 0);
    double sum = 0;
    for (int b = 0; b < 2; ++b)
        for (int a = 0; a < 2; ++a) {
            const double weight = (a ? corner.share[0] : 1 - corner.share[0]) *
                                  (b ? corner.share[1] : 1 - corner.share[1]);
            if (weight == 0) continue;
            const std::int64_t i = std::min(corner.cell[0] + a, extent.x - 1),
                               j = std::min(corner.cell[1] + b, extent.y - 1);
            float ends[2];
            if (left.empty()) {
                march(medium, i, j, last, column.data());
                ends[0] = column[static_cast<std::size_t>(corner.cell[2])];
                ends[1] = column[static_cast<std::size_t>(last)];
            } else {
                const auto of = [&](std::int64_t k) {
                    return left[static_cast<std::size_t>((k * extent.y + j) * extent.x + i)];
                };
                ends[0] = of(corner.cell[2]);
                ends[1] = of(last);
            }
            sum += weight * (ends[0] + corner.share[2] * (ends[1] - ends[0]));
        }
    return sum;
}

SmallVector<Eigen::Vector3d> even_directions(int count) {
    // Points of a spiral whose turns go by the golden ratio.
    SmallVector<Eigen::Vector3d> directions;
    directions.reserve(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
        const double z = 1 - (2 * i + 1.0) / count, across = std::sqrt(1 - z * z);
        const double turn = 2 * std::numbers::pi * i / std::numbers::phi;
        directions.emplace_back(across * std::cos(turn), across * std::sin(turn), z);
    }
    return directions;
}

AmbientGrid AmbientGrid::around(const Extent& volume, const Eigen::Matrix3d& to_screen,
                                double radius, std::pmr::memory_resource* memory) {
    constexpr double kCells = 4, kAcross = 24;  // along a radius; along a volume, at least
    // Beyond the volume's diagonal nothing is in the way.
    double diagonal = 0;
    for (int axis = 0; axis < 3; ++axis)
        diagonal += to_screen.col(axis).norm() * static_cast<double>(volume[axis]);
    radius = std::min(radius, diagonal);
    AmbientGrid grid{.extent = {},
                     .cell = {},
                     .radius = radius,
                     .directions = {},
                     .depths = std::allocate_shared<std::pmr::vector<float>>(
                         Recycled<std::pmr::vector<float>>(), memory),
                     .left = std::pmr::vector<float>(memory)};
    double smallest = std::numeric_limits<double>::infinity();
    Eigen::Vector3d cell;
    for (int axis = 0; axis < 3; ++axis) {
        const double sample = to_screen.col(axis).norm();
        const double most = std::max(1.0, static_cast<double>(volume[axis]) / kAcross);
        const int samples = static_cast<int>(std::clamp(radius / kCells / sample, 1.0, most));
        grid.cell[static_cast<std::size_t>(axis)] = samples;
        grid.extent[axis] = (volume[axis] + samples - 1) / samples;
        cell[axis] = samples;
        smallest = std::min(smallest, samples * sample);
    }
    grid.steps = static_cast<int>(std::clamp(std::ceil(radius / smallest), 1.0, 4096.0));
    const Eigen::Matrix3d to_input = to_screen.inverse();
    for (const Eigen::Vector3d& along : even_directions(kDirections)) {
        const Eigen::Vector3d step = (to_input * (along * radius / grid.steps)).cwiseQuotient(cell);
        grid.directions.push_back({step.x(), step.y(), step.z()});
    }
    return grid;
}

void AmbientGrid::fill_depths(const Medium& medium, std::int64_t begin, std::int64_t end) {
    with_depth(medium, [&](auto read) {
        for (std::int64_t k = begin; k < end; ++k)
            for (std::int64_t j = 0; j < extent.y; ++j)
                for (std::int64_t i = 0; i < extent.x; ++i) {
                    const std::int64_t at[3] = {i, j, k};
                    std::int64_t first[3], last[3];
                    double count = 1, sum = 0;
                    for (int axis = 0; axis < 3; ++axis) {
                        const int samples = cell[static_cast<std::size_t>(axis)];
                        first[axis] = at[axis] * samples;
                        last[axis] = std::min(first[axis] + samples, medium.volume.extent[axis]);
                        count *= static_cast<double>(last[axis] - first[axis]);
                    }
                    for (std::int64_t z = first[2]; z < last[2]; ++z)
                        for (std::int64_t y = first[1]; y < last[1]; ++y)
                            for (std::int64_t x = first[0]; x < last[0]; ++x)
                                sum += read(medium,
                                            Index{static_cast<double>(x), static_cast<double>(y),
                                                  static_cast<double>(z)});
                    (*depths)[static_cast<std::size_t>((k * extent.y + j) * extent.x + i)] =
                        static_cast<float>(sum / count);
                }
    });
}

double AmbientGrid::left_of(std::int64_t i, std::int64_t j, std::int64_t k) const {
    double sum = 0;
    const double piece = radius / steps;
    for (const Index& step : directions) {
        double depth = 0;
        for (int s = 0; s < steps; ++s) {
            const double along = s + 0.5;
            const Index p{static_cast<double>(i) + along * step[0],
                          static_cast<double>(j) + along * step[1],
                          static_cast<double>(k) + along * step[2]};
            bool inside = true;
            for (int axis = 0; axis < 3; ++axis)
                inside =
                    inside && p[static_cast<std::size_t>(axis)] >= -0.5 &&
                    p[static_cast<std::size_t>(axis)] <= static_cast<double>(extent[axis]) - 0.5;
            if (!inside) break;
            const Corner corner = corner_of(extent, p);
            double mean = 0;
            for (int c = 0; c < 8; ++c) {
                double weight = 1;
                std::int64_t at[3];
                for (int axis = 0; axis < 3; ++axis) {
                    const bool upper = c >> axis & 1;
                    weight *= upper ? corner.share[axis] : 1 - corner.share[axis];
                    at[axis] = std::min(corner.cell[axis] + upper, extent[axis] - 1);
                }
                if (weight > 0)
                    mean += weight * (*depths)[static_cast<std::size_t>(
                                         (at[2] * extent.y + at[1]) * extent.x + at[0])];
            }
            depth += mean * piece;
        }
        sum += std::exp(-depth);
    }
    return sum / static_cast<double>(directions.size());
}

bool AmbientGrid::is_seen(std::int64_t i, std::int64_t j, std::int64_t k) const {
    for (std::int64_t z = std::max<std::int64_t>(k - 1, 0); z <= std::min(k + 1, extent.z - 1); ++z)
        for (std::int64_t y = std::max<std::int64_t>(j - 1, 0); y <= std::min(j + 1, extent.y - 1);
             ++y)
            for (std::int64_t x = std::max<std::int64_t>(i - 1, 0);
                 x <= std::min(i + 1, extent.x - 1); ++x)
                if ((*depths)[static_cast<std::size_t>((z * extent.y + y) * extent.x + x)] > 0)
                    return true;
    return false;
}

void AmbientGrid::fill(std::int64_t begin, std::int64_t end) {
    for (std::int64_t k = begin; k < end; ++k)
        for (std::int64_t j = 0; j < extent.y; ++j)
            for (std::int64_t i = 0; i < extent.x; ++i)
                left[static_cast<std::size_t>((k * extent.y + j) * extent.x + i)] =
                    is_seen(i, j, k) ? static_cast<float>(left_of(i, j, k)) : 1;
}

double AmbientGrid::at(const Index& p) const {
    Index q;
    for (std::size_t axis = 0; axis < 3; ++axis) q[axis] = (p[axis] + 0.5) / cell[axis] - 0.5;
    const Corner corner = corner_of(extent, q);
    double sum = 0;
    for (int c = 0; c < 8; ++c) {
        double weight = 1;
        std::int64_t at[3];
        for (int axis = 0; axis < 3; ++axis) {
            const bool upper = c >> axis & 1;
            weight *= upper ? corner.share[axis] : 1 - corner.share[axis];
            at[axis] = std::min(corner.cell[axis] + upper, extent[axis] - 1);
        }
        if (weight == 0) continue;
        sum += weight * (left.empty() ? left_of(at[0], at[1], at[2])
                                      : static_cast<double>(left[static_cast<std::size_t>(
                                            (at[2] * extent.y + at[1]) * extent.x + at[0])]));
    }
    return sum;
}

}  // namespace edgewise::kernels
