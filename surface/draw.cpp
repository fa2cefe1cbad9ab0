#include "surface/draw.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tbb/parallel_for.h>
#include <vector>

#include "graph/label_surface.hpp"

namespace edgewise::surface {
namespace {

constexpr std::int64_t kTile = 32;  // pixels along each side
constexpr double kNear = 1e-3;      // what is closer to the eye is not drawn [t]
constexpr std::uint32_t kNone = 0xffffffff;

/// Where a vertex lies on the picture. Weights that are even on the screen are even in space after
/// division by `w`; without an eye that is 1.
struct Point {
    double x = 0, y = 0;  // pixel
    double w = 1;         // inverse of the distance from the eye along z
    double z = 0;         // screen z
};

/// A triangle, maybe a part of one that the eye's plane cuts: corners as shares of its own.
struct Piece {
    std::array<Point, 3> at;
    std::array<Eigen::Vector3d, 3> share;  // of the triangle's corners
    std::uint32_t triangle = 0;
};

class Drawer {
 public:
    Drawer(const Drawing& drawing, std::pmr::memory_resource* memory)
        : mesh_(*drawing.mesh),
          want_(*drawing.want),
          by_vertex_(drawing.by_vertex),
          clip_(want_.clip(drawing.view)),
          map_(want_.views.at(drawing.view).matrix()),
          to_input_(map_.inverse()),
          points_(memory),
          bins_(memory),
          begins_(memory) {
        const Vec3 steps(want_.pixel[0], want_.pixel[1], 1);
        to_screen_ =
            steps.cwiseInverse().asDiagonal() * to_input_.topLeftCorner<3, 3>().transpose();
        for (const double label : mesh_.labels) colors_.push_back(color_of_label(want_, label));
        if (mesh_.groups().empty()) colors_ = {{1, 1, 1}};
        nearest_ = want_.cue ? nearest_corner(want_, drawing.view) : 0;
    }

    void draw(const Region& region, float* pixels, std::ptrdiff_t row,
              const std::function<void()>& poll) {
        region_ = region;
        const Extent size = region.extent();
        across_ = (size.x + kTile - 1) / kTile;
        down_ = (size.y + kTile - 1) / kTile;
        project();
        poll();
        sort();
        poll();
        tbb::parallel_for(std::int64_t{0}, across_ * down_,
                          [&](std::int64_t tile) { fill(tile, pixels, row); });
        poll();
    }

 private:
    Vec3 screen_of(std::uint32_t vertex) const {
        const Float3& p = mesh_.positions()[vertex];
        return map_.topLeftCorner<3, 3>() * Vec3(p[0], p[1], p[2]) + map_.topRightCorner<3, 1>();
    }
    Point point_of(const Vec3& p) const {
        if (!want_.eye) return {p.x(), p.y(), 1, p.z()};
        const Eye& eye = *want_.eye;
        const double w = 1 / (p.z() - eye.at.z()), scale = (eye.plane - eye.at.z()) * w;
        return {eye.at.x() + (p.x() - eye.at.x()) * scale,
                eye.at.y() + (p.y() - eye.at.y()) * scale, w, p.z()};
    }

    void project() {
        const std::size_t count = mesh_.positions().size();
        points_.resize(count);
        constexpr std::size_t kAtOnce = 4096;
        tbb::parallel_for(std::size_t{0}, (count + kAtOnce - 1) / kAtOnce, [&](std::size_t part) {
            for (std::size_t i = part * kAtOnce; i < std::min(count, (part + 1) * kAtOnce); ++i)
                points_[i] = point_of(screen_of(static_cast<std::uint32_t>(i)));
        });
    }

    /// Whether a corner lies behind the eye's plane, or in it.
    bool is_cut(const Triangle& triangle) const {
        if (!want_.eye) return false;
        for (const std::uint32_t corner : triangle)
            if (!(points_[corner].z > want_.eye->at.z() + kNear)) return true;
        return false;
    }

    /// The parts of a triangle in front of the eye's plane.
    int pieces_of(std::uint32_t number, std::array<Piece, 2>& pieces) const {
        const Triangle& triangle = mesh_.triangles()[number];
        pieces[0].triangle = pieces[1].triangle = number;
        if (!is_cut(triangle)) {
            for (std::size_t c = 0; c < 3; ++c) {
                pieces[0].at[c] = points_[triangle[c]];
                pieces[0].share[c] = Eigen::Vector3d::Unit(static_cast<int>(c));
            }
            return 1;
        }
        // Sutherland and Hodgman 1974, of one plane.
        const double plane = want_.eye->at.z() + kNear;
        std::array<Vec3, 3> corners;
        for (std::size_t c = 0; c < 3; ++c) corners[c] = screen_of(triangle[c]);
        std::array<Point, 4> at;
        std::array<Eigen::Vector3d, 4> share;
        std::size_t kept = 0;
        const auto keep = [&](const Vec3& p, const Eigen::Vector3d& of) {
            at[kept] = point_of(p);
            share[kept++] = of;
        };
        for (std::size_t c = 0; c < 3; ++c) {
            const std::size_t next = (c + 1) % 3;
            const double a = corners[c].z() - plane, b = corners[next].z() - plane;
            const Eigen::Vector3d own = Eigen::Vector3d::Unit(static_cast<int>(c)),
                                  other = Eigen::Vector3d::Unit(static_cast<int>(next));
            if (a >= 0) keep(corners[c], own);
            if ((a >= 0) != (b >= 0)) {
                const double f = a / (a - b);
                keep(corners[c] + f * (corners[next] - corners[c]), own + f * (other - own));
            }
        }
        for (std::size_t i = 2; i < kept; ++i) {
            const std::array<std::size_t, 3> from{0, i - 1, i};
            for (std::size_t c = 0; c < 3; ++c) {
                pieces[i - 2].at[c] = at[from[c]];
                pieces[i - 2].share[c] = share[from[c]];
            }
        }
        return kept > 2 ? static_cast<int>(kept) - 2 : 0;
    }

    /// The tiles that a triangle may cover: first and last column and row; empty: none.
    struct Tiles {
        std::int64_t left = 0, right = -1, top = 0, bottom = -1;
    };
    Tiles tiles_of(std::uint32_t number) const {
        std::array<Piece, 2> pieces;
        const int count = pieces_of(number, pieces);
        double low[2] = {HUGE_VAL, HUGE_VAL}, high[2] = {-HUGE_VAL, -HUGE_VAL};
        for (int i = 0; i < count; ++i)
            for (const Point& p : pieces[static_cast<std::size_t>(i)].at) {
                low[0] = std::min(low[0], p.x), high[0] = std::max(high[0], p.x);
                low[1] = std::min(low[1], p.y), high[1] = std::max(high[1], p.y);
            }
        std::int64_t first[2], last[2];
        for (int axis = 0; axis < 2; ++axis) {
            const auto begin = static_cast<double>(region_.begin[axis]),
                       end = static_cast<double>(region_.end[axis] - 1);
            const double from = std::max(std::ceil(low[axis]), begin),
                         to = std::min(std::floor(high[axis]), end);
            if (!(from <= to)) return {};  // between two rows of centres, or outside
            first[axis] = (static_cast<std::int64_t>(from) - region_.begin[axis]) / kTile;
            last[axis] = (static_cast<std::int64_t>(to) - region_.begin[axis]) / kTile;
        }
        return {first[0], last[0], first[1], last[1]};
    }

    /// Triangles by tile, in their order: counted by blocks of them, then written.
    void sort() {
        const std::size_t tiles = static_cast<std::size_t>(across_ * down_);
        const std::size_t count = mesh_.triangles().size();
        constexpr std::size_t kMostBlocks = 64;
        const std::size_t blocks = std::clamp<std::size_t>(count / 4096, 1, kMostBlocks);
        std::vector<std::vector<std::uint32_t>> counts(blocks, std::vector<std::uint32_t>(tiles));
        const auto each = [&](std::size_t block, const auto& use) {
            const std::size_t begin = count * block / blocks, end = count * (block + 1) / blocks;
            for (std::size_t i = begin; i < end; ++i) {
                const Tiles in = tiles_of(static_cast<std::uint32_t>(i));
                for (std::int64_t y = in.top; y <= in.bottom; ++y)
                    for (std::int64_t x = in.left; x <= in.right; ++x)
                        use(static_cast<std::size_t>(y * across_ + x),
                            static_cast<std::uint32_t>(i));
            }
        };
        tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t block) {
            each(block, [&](std::size_t tile, std::uint32_t) { ++counts[block][tile]; });
        });
        begins_.resize(tiles + 1);
        std::uint64_t sum = 0;
        for (std::size_t tile = 0; tile < tiles; ++tile) {
            begins_[tile] = sum;
            for (std::size_t block = 0; block < blocks; ++block) sum += counts[block][tile];
        }
        begins_[tiles] = sum;
        bins_.resize(sum);
        std::vector<std::vector<std::uint64_t>> next(blocks, std::vector<std::uint64_t>(tiles));
        for (std::size_t tile = 0; tile < tiles; ++tile) {
            std::uint64_t at = begins_[tile];
            for (std::size_t block = 0; block < blocks; ++block) {
                next[block][tile] = at;
                at += counts[block][tile];
            }
        }
        tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t block) {
            each(block, [&](std::size_t tile, std::uint32_t triangle) {
                bins_[next[block][tile]++] = triangle;
            });
        });
    }

    struct Pixel {
        double depth = HUGE_VAL;  // the smaller the nearer
        std::uint32_t triangle = kNone;
        std::array<float, 2> share{};  // of the triangle's first two corners
    };

    void fill(std::int64_t tile, float* pixels, std::ptrdiff_t row) const {
        Region box;
        box.begin = {region_.begin[0] + tile % across_ * kTile,
                     region_.begin[1] + tile / across_ * kTile, 0};
        box.end = {std::min(box.begin[0] + kTile, region_.end[0]),
                   std::min(box.begin[1] + kTile, region_.end[1]), 1};
        std::array<Pixel, kTile * kTile> buffer;
        const auto t = static_cast<std::size_t>(tile);
        for (std::uint64_t i = begins_[t]; i < begins_[t + 1]; ++i) {
            std::array<Piece, 2> pieces;
            const int count = pieces_of(bins_[i], pieces);
            for (int piece = 0; piece < count; ++piece)
                cover(pieces[static_cast<std::size_t>(piece)], box, buffer);
        }
        for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y)
            for (std::int64_t x = box.begin[0]; x < box.end[0]; ++x) {
                const Pixel& pixel =
                    buffer[static_cast<std::size_t>((y - box.begin[1]) * kTile + x - box.begin[0])];
                float* const out =
                    pixels + (y - region_.begin[1]) * row + 4 * (x - region_.begin[0]);
                if (pixel.triangle == kNone) {
                    std::fill_n(out, 4, 0.0F);
                    continue;
                }
                put_light(pixel, x, y, out);
                out[3] = 1;
            }
    }

    void cover(const Piece& piece, const Region& box,
               std::array<Pixel, kTile * kTile>& buffer) const {
        const auto& [a, b, c] = piece.at;
        const double area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
        if (area == 0 || !std::isfinite(area)) return;
        const auto first = [](double low, std::int64_t begin) {
            return static_cast<std::int64_t>(std::max(std::ceil(low), static_cast<double>(begin)));
        };
        const auto last = [](double high, std::int64_t end) {
            return static_cast<std::int64_t>(
                std::min(std::floor(high), static_cast<double>(end - 1)));
        };
        const std::int64_t top = first(std::min({a.y, b.y, c.y}), box.begin[1]),
                           bottom = last(std::max({a.y, b.y, c.y}), box.end[1]),
                           left = first(std::min({a.x, b.x, c.x}), box.begin[0]),
                           right = last(std::max({a.x, b.x, c.x}), box.end[0]);
        const double inverse = 1 / area;
        // So that pixels on an edge that two triangles share are never missed by both.
        constexpr double kOnEdge = -1e-9;
        for (std::int64_t y = top; y <= bottom; ++y)
            for (std::int64_t x = left; x <= right; ++x) {
                const auto px = static_cast<double>(x), py = static_cast<double>(y);
                const double u = ((b.x - px) * (c.y - py) - (b.y - py) * (c.x - px)) * inverse;
                const double v = ((c.x - px) * (a.y - py) - (c.y - py) * (a.x - px)) * inverse;
                const double w = 1 - u - v;
                if (u < kOnEdge || v < kOnEdge || w < kOnEdge) continue;
                // Even in space: by the inverse distances.
                const double near = u * a.w + v * b.w + w * c.w;
                const double depth = want_.eye ? -near : u * a.z + v * b.z + w * c.z;
                Pixel& pixel =
                    buffer[static_cast<std::size_t>((y - box.begin[1]) * kTile + x - box.begin[0])];
                if (!(depth < pixel.depth)) continue;
                const Eigen::Vector3d share = (u * a.w * piece.share[0] + v * b.w * piece.share[1] +
                                               w * c.w * piece.share[2]) /
                                              near;
                if (clip_ && !is_kept(piece.triangle, share)) continue;
                pixel = {depth,
                         piece.triangle,
                         {static_cast<float>(share[0]), static_cast<float>(share[1])}};
            }
    }

    Vec3 index_at(std::uint32_t triangle, const Eigen::Vector3d& share) const {
        Vec3 p = Vec3::Zero();
        for (std::size_t c = 0; c < 3; ++c) {
            const Float3& corner = mesh_.positions()[mesh_.triangles()[triangle][c]];
            p += share[static_cast<int>(c)] * Vec3(corner[0], corner[1], corner[2]);
        }
        return p;
    }
    bool is_kept(std::uint32_t triangle, const Eigen::Vector3d& share) const {
        const Vec3 p = index_at(triangle, share);
        for (int axis = 0; axis < 3; ++axis)
            if (p[axis] < clip_->low[axis] || p[axis] > clip_->high[axis]) return false;
        return std::all_of(clip_->planes.begin(), clip_->planes.end(),
                           [&](const HalfSpace& plane) { return plane.at(p) >= 0; }) &&
               std::all_of(clip_->balls.begin(), clip_->balls.end(),
                           [&](const Ball& ball) { return ball.has(p); });
    }

    /// Red, green and blue: light of the label's colour, and white highlights.
    void put_light(const Pixel& pixel, std::int64_t x, std::int64_t y, float* out) const {
        const Triangle& triangle = mesh_.triangles()[pixel.triangle];
        const Eigen::Vector3d share(pixel.share[0], pixel.share[1],
                                    1.0 - pixel.share[0] - pixel.share[1]);
        const Vec3 to_eye = eye_from(static_cast<double>(x), static_cast<double>(y));
        const std::array<double, 3>& color =
            colors_[mesh_.groups().empty() ? 0 : mesh_.groups()[pixel.triangle]];
        std::array<double, 3> light{};
        const auto add = [&](double of, const Vec3& normal) {
            const Lit lit = want_.shading.at(to_screen_ * normal, to_eye);
            for (std::size_t c = 0; c < 3; ++c)
                light[c] += of * (color[c] * lit.diffuse + lit.specular);
        };
        if (by_vertex_) {
            for (std::size_t c = 0; c < 3; ++c)
                add(share[static_cast<int>(c)], normal_of(triangle[c]));
        } else {
            Vec3 normal = Vec3::Zero();
            for (std::size_t c = 0; c < 3; ++c)
                normal += share[static_cast<int>(c)] * normal_of(triangle[c]);
            add(1, normal);
        }
        double left = 1;
        if (want_.cue) {
            const Vec3 p = map_.topLeftCorner<3, 3>() * index_at(pixel.triangle, share) +
                           map_.topRightCorner<3, 1>();
            left = want_.cue->left((p.z() - nearest_) * want_.unit);
        }
        for (std::size_t c = 0; c < 3; ++c) out[c] = static_cast<float>(light[c] * left);
    }
    Vec3 normal_of(std::uint32_t vertex) const {
        const Float3& n = mesh_.normals()[vertex];
        return {n[0], n[1], n[2]};
    }
    Vec3 eye_from(double x, double y) const {
        if (!want_.eye) return {0, 0, -1};
        const Vec3 steps(want_.pixel[0], want_.pixel[1], 1);
        return (want_.eye->at - Vec3(x, y, want_.eye->plane)).cwiseProduct(steps).normalized();
    }

    const Mesh& mesh_;
    const Request& want_;
    bool by_vertex_;
    const Clip* clip_;
    Mat4 map_, to_input_;
    Eigen::Matrix3d to_screen_;
    std::vector<std::array<double, 3>> colors_;  // by group of triangles
    double nearest_ = 0;
    Region region_;
    std::int64_t across_ = 0, down_ = 0;  // tiles
    std::pmr::vector<Point> points_;      // by vertex
    std::pmr::vector<std::uint32_t> bins_;
    std::pmr::vector<std::uint64_t> begins_;  // of each tile in bins_, and the end
};

}  // namespace

void draw(const Drawing& drawing, const Region& region, float* pixels, std::ptrdiff_t row,
          std::pmr::memory_resource* memory, const std::function<void()>& poll) {
    Drawer(drawing, memory).draw(region, pixels, row, poll);
}

double drawing_scratch(double vertices, double triangles, const Extent& picture) noexcept {
    const double tiles = std::ceil(static_cast<double>(picture.x) / kTile) *
                         std::ceil(static_cast<double>(picture.y) / kTile);
    // Most triangles lie in one tile; a few in two.
    return sizeof(Point) * vertices + 1.5 * sizeof(std::uint32_t) * triangles + 64 * 12 * tiles;
}

}  // namespace edgewise::surface
