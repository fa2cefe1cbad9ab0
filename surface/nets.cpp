#include "surface/nets.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <optional>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <type_traits>

#include "graph/errors.hpp"
#include "graph/with_type.hpp"
#include "surface/cell_cases.hpp"
#include "surface/frame.hpp"
#include "surface/label_groups.hpp"
#include "surface/nets_smoothing.hpp"

namespace edgewise::surface {
namespace {

using Cell = std::array<std::int32_t, 3>;  // its first corner
constexpr std::size_t kLeaf = 1 << 14;     // quads, vertices

/// A cell that surfaces run through, and the first of its vertices within its slice of cells.
struct Record {
    std::int32_t x = 0;
    std::uint32_t vertex = 0;
};

/// The stored number that means a value, where there is one.
template <class T>
std::optional<T> stored(double value, const ValueMap& values) {
    const double number = (value - values.offset) / values.slope;
    if (!(number >= double(std::numeric_limits<T>::lowest()) &&
          number <= double(std::numeric_limits<T>::max())))
        return {};
    const T sample = static_cast<T>(number);
    return values(double(sample)) == value ? std::optional(sample) : std::nullopt;
}

/// Labels at the corners of cells.
template <class T>
class Cells {
 public:
    Cells(const Data& labels, std::optional<T> background)
        : labels_(labels.as<T>()), n_(labels.what.extent), background_(background) {
        for (int corner = 0; corner < 8; ++corner)
            corners_[corner] = (corner & 1) + n_.x * ((corner >> 1 & 1) + n_.y * (corner >> 2));
    }

    const Extent& extent() const noexcept { return n_; }
    bool is_label(T value) const noexcept {
        if constexpr (std::is_floating_point_v<T>)
            if (!std::isfinite(value)) return false;
        return !background_ || value != *background_;
    }
    const T* at(const Cell& cell) const noexcept {
        return labels_ + cell[0] + n_.x * (cell[1] + n_.y * cell[2]);
    }
    bool is_there(const Cell& cell) const noexcept {
        return cell[0] >= 0 && cell[1] >= 0 && cell[2] >= 0 && cell[0] < n_.x - 1 &&
               cell[1] < n_.y - 1 && cell[2] < n_.z - 1;
    }

    /// Whether a cell has no corner in the frame.
    bool is_inner(const Cell& cell) const noexcept {
        return cell[0] >= 1 && cell[1] >= 1 && cell[2] >= 1 && cell[0] < n_.x - 2 &&
               cell[1] < n_.y - 2 && cell[2] < n_.z - 2;
    }

    /// Which corners hold a label.
    unsigned set_of(const Cell& cell, T label) const noexcept {
        const T* first = at(cell);
        unsigned set = 0;
        for (unsigned corner = 0; corner < 8; ++corner)
            set |= static_cast<unsigned>(first[corners_[corner]] == label) << corner;
        return set;
    }

    /// The surface of a label through a cell.
    const CellCase& case_of(const Cell& cell, T label) const noexcept {
        const unsigned set = set_of(cell, label);
        const CellCase& apart = cell_cases()[set];
        const int face = apart.passed_twice;
        if (face == CellCase::kNone) return apart;
        // Both parts of one loop run through a face. Where that holds for the cell beyond it too,
        // both join the corners there.
        Cell beyond = cell;
        beyond[static_cast<std::size_t>(face / 2)] += face % 2 == 0 ? -1 : 1;
        if (!is_there(beyond) || cell_cases()[set_of(beyond, label)].passed_twice != (face ^ 1))
            return apart;
        return joined_cell_cases()[set];
    }

    /// Calls visit(label) for each label at a cell's corners, in the order of corners.
    template <class Visit>
    void for_each_label(const Cell& cell, Visit visit) const {
        const T* first = at(cell);
        T seen[8];
        int count = 0;
        for (const std::int64_t corner : corners_) {
            const T label = first[corner];
            if (!is_label(label) || std::find(seen, seen + count, label) != seen + count) continue;
            seen[count++] = label;
            visit(label);
        }
    }

    /// Labels at the four corners of a cell at one side along an axis; beyond the scan's other ends
    /// they go on as they were there.
    std::array<T, 4> layer(const Cell& cell, int axis, int side) const noexcept {
        std::array<T, 4> all;
        if (is_inner(cell)) {
            const T* first = at(cell) + side * corners_[std::size_t{1} << axis];
            const std::int64_t one = corners_[std::size_t{1} << (axis + 1) % 3],
                               two = corners_[std::size_t{1} << (axis + 2) % 3];
            return {first[0], first[one], first[two], first[one + two]};
        }
        for (int corner = 0; corner < 4; ++corner) {
            Cell at_corner = cell;
            at_corner[static_cast<std::size_t>(axis)] += side;
            for (int k = 1; k < 3; ++k) {
                const int other = (axis + k) % 3;
                auto& place = at_corner[static_cast<std::size_t>(other)];
                place = std::clamp<std::int32_t>(place + (corner >> (k - 1) & 1), 1,
                                                 static_cast<std::int32_t>(n_[other]) - 2);
            }
            all[static_cast<std::size_t>(corner)] = *at(at_corner);
        }
        return all;
    }

    /// Labels at a cell's corners as smoothing sees them: beyond the scan's end, which a frame of
    /// one sample lies around, they go on as they were there.
    std::array<T, 8> going_on(const Cell& cell) const noexcept {
        std::array<T, 8> all;
        if (is_inner(cell)) {
            for (std::size_t corner = 0; corner < 8; ++corner)
                all[corner] = at(cell)[corners_[corner]];
            return all;
        }
        for (unsigned corner = 0; corner < 8; ++corner) {
            Cell at_corner;
            for (unsigned axis = 0; axis < 3; ++axis)
                at_corner[axis] = std::clamp<std::int32_t>(
                    cell[axis] + static_cast<std::int32_t>(corner >> axis & 1), 1,
                    static_cast<std::int32_t>(n_[static_cast<int>(axis)]) - 2);
            all[corner] = *at(at_corner);
        }
        return all;
    }

    /// Whether smoothing sees one label at all corners of a cell.
    bool is_filled(const Cell& cell, T label) const noexcept {
        if (!is_inner(cell)) {
            const std::array<T, 8> all = going_on(cell);
            return std::count(all.begin(), all.end(), label) == 8;
        }
        const T* first = at(cell);
        return std::all_of(corners_.begin(), corners_.end(),
                           [&](std::int64_t corner) { return first[corner] == label; });
    }

    /// Calls visit(x) for the cells of a row whose corners are not all equal.
    /// @param unequal  room for a byte a sample and 8 more
    template <class Visit>
    void for_each_active(std::int64_t y, std::int64_t z, std::uint8_t* unequal, Visit visit) const {
        const T* rows[4];
        for (int r = 0; r < 4; ++r)
            rows[r] = labels_ + n_.x * (y + (r & 1) + n_.y * (z + (r >> 1)));
        for (std::int64_t x = 0; x < n_.x; ++x)
            unequal[x] =
                static_cast<std::uint8_t>((rows[0][x] != rows[1][x]) | (rows[0][x] != rows[2][x]) |
                                          (rows[0][x] != rows[3][x]));
        const std::int64_t cells = n_.x - 1;
        for (std::int64_t x = 0; x < cells; ++x)
            unequal[x] = static_cast<std::uint8_t>(unequal[x] | unequal[x + 1] |
                                                   (rows[0][x] != rows[0][x + 1]));
        std::memset(unequal + cells, 0, 8);
        for (std::int64_t x = 0; x < cells; x += 8) {
            std::uint64_t eight;
            std::memcpy(&eight, unequal + x, 8);
            if (eight == 0) continue;
            for (std::int64_t i = x; i < x + 8; ++i)
                if (unequal[i]) visit(i);
        }
    }

    /// Calls visit(axis, below, above) for each grid edge from a cell's first corner whose ends
    /// differ.
    template <class Visit>
    void for_each_wall(const Cell& cell, Visit visit) const {
        const T* first = at(cell);
        for (unsigned axis = 0; axis < 3; ++axis) {
            const T a = first[0], b = first[corners_[1U << axis]];
            if (a == b || cell[(axis + 1) % 3] == 0 || cell[(axis + 2) % 3] == 0) continue;
            visit(static_cast<int>(axis), a, b);
        }
    }

 private:
    const T* labels_;
    const Extent n_;
    const std::optional<T> background_;
    std::array<std::int64_t, 8> corners_{};
};

/// A slice of cells: those that surfaces run through, row by row, and counts of mesh elements.
struct Slice {
    std::pmr::vector<Record> records;
    std::pmr::vector<std::uint32_t> rows;  // of each row its first record, and the end
    std::uint32_t vertices = 0, quads = 0, walls = 0;
    std::int64_t first_point = 0, first_vertex = 0, first_quad = 0, first_wall = 0;

    explicit Slice(std::pmr::memory_resource* memory) : records(memory), rows(memory) {}
    std::span<const Record> row(std::int64_t y) const noexcept {
        return {records.data() + rows[static_cast<std::size_t>(y)],
                records.data() + rows[static_cast<std::size_t>(y) + 1]};
    }
};

/// How many different labels there are among some.
template <class T, std::size_t N>
int different(const std::array<T, N>& labels) noexcept {
    int count = 0;
    for (std::size_t i = 0; i < N; ++i)
        count += std::find(labels.begin(), labels.begin() + static_cast<std::ptrdiff_t>(i),
                           labels[i]) == labels.begin() + static_cast<std::ptrdiff_t>(i);
    return count;
}

/// The net of labels within a frame of background, which is 0.
template <class T>
class Net {
 public:
    Net(const Data& labels, std::pmr::memory_resource* memory, const std::function<void()>& poll)
        : cells_(labels, T{0}), n_(labels.what.extent), memory_(memory), poll_(poll) {
        slices_.reserve(static_cast<std::size_t>(n_.z - 1));
        for (std::int64_t z = 0; z < n_.z - 1; ++z) slices_.emplace_back(memory);
        tbb::parallel_for(std::size_t{0}, slices_.size(), [&](std::size_t z) {
            if (poll_) poll_();
            look_at(static_cast<std::int32_t>(z));
        });
        std::int64_t points = 0, vertices = 0, quads = 0, walls = 0;
        for (Slice& slice : slices_) {
            slice.first_point = points;
            slice.first_vertex = vertices;
            slice.first_quad = quads;
            slice.first_wall = walls;
            points += static_cast<std::int64_t>(slice.records.size());
            vertices += slice.vertices;
            quads += slice.quads;
            walls += slice.walls;
        }
        if (2 * quads > Mesh::kMost || vertices > Mesh::kMost)
            Mesh(vertices, 2 * quads, true, memory);  // refuses
        points_ = static_cast<std::size_t>(points);
        vertices_ = static_cast<std::size_t>(vertices);
        quad_count_ = static_cast<std::size_t>(quads);
        walls_ = static_cast<std::size_t>(walls);
        make();
    }

    Mesh mesh(const Frame& frame, double smooth) {
        smooth_net(points(), walls(), static_cast<float>(smooth), moved(), memory_, poll_);
        points_array_ = {};
        walls_array_ = {};
        Mesh mesh(static_cast<std::int64_t>(vertices_), 2 * static_cast<std::int64_t>(quad_count_),
                  true, memory_);
        tbb::parallel_for(
            tbb::blocked_range<std::size_t>(0, vertices_, kLeaf), [&](const auto& part) {
                for (std::size_t v = part.begin(); v != part.end(); ++v) {
                    const std::uint32_t point = point_of()[v];
                    Eigen::Vector3d index = moved()[point].template cast<double>();
                    // The middle of a cell, but for the frame.
                    for (int axis = 0; axis < 3; ++axis)
                        index[axis] +=
                            double(cells_of_points()[point][static_cast<std::size_t>(axis)]) - 0.5;
                    mesh.positions()[v] = float3(frame.at(index));
                }
            });
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, quad_count_, kLeaf),
                          [&](const auto& part) {
                              for (std::size_t q = part.begin(); q != part.end(); ++q)
                                  cut_quad(q, frame.mirrored, mesh);
                          });
        take_normals(mesh);
        return mesh;
    }

 private:
    void look_at(std::int32_t z) {
        Slice& slice = slices_[static_cast<std::size_t>(z)];
        std::vector<std::uint8_t> unequal(static_cast<std::size_t>(n_.x) + 8);
        for (std::int32_t y = 0; y < n_.y - 1; ++y) {
            slice.rows.push_back(static_cast<std::uint32_t>(slice.records.size()));
            cells_.for_each_active(y, z, unequal.data(), [&](std::int64_t x) {
                const Cell cell{static_cast<std::int32_t>(x), y, z};
                slice.records.push_back({cell[0], slice.vertices});
                cells_.for_each_label(
                    cell, [&](T label) { slice.vertices += cells_.case_of(cell, label).loops; });
                cells_.for_each_wall(cell, [&](int axis, T below, T above) {
                    slice.quads += cells_.is_label(below) + cells_.is_label(above);
                    slice.walls += !is_end(cell, axis);
                });
            });
        }
        slice.rows.push_back(static_cast<std::uint32_t>(slice.records.size()));
    }

    /// Whether a grid edge from a cell's first corner leads out of the scan.
    bool is_end(const Cell& cell, int axis) const noexcept {
        const std::int32_t at = cell[static_cast<std::size_t>(axis)];
        return at == 0 || at == n_[axis] - 2;
    }

    void make() {
        points_array_ = Array(points_ * sizeof(NetPoint), memory_);
        moved_array_ = Array(points_ * sizeof(Eigen::Vector3f), memory_);
        cells_array_ = Array(points_ * sizeof(Cell), memory_);
        point_of_array_ = Array(vertices_ * sizeof(std::uint32_t), memory_);
        quads_array_ = Array(quad_count_ * sizeof(Quad), memory_);
        groups_array_ = Array(quad_count_ * sizeof(std::uint32_t), memory_);
        walls_array_ = Array(walls_ * sizeof(NetWall), memory_);
        tbb::parallel_for(std::size_t{0}, slices_.size(), [&](std::size_t z) {
            if (poll_) poll_();
            make_vertices(static_cast<std::int32_t>(z));
            make_quads(static_cast<std::int32_t>(z));
        });
        slices_.clear();
        slices_.shrink_to_fit();
    }

    void make_vertices(std::int32_t z) {
        const Slice& slice = slices_[static_cast<std::size_t>(z)];
        auto vertex = static_cast<std::size_t>(slice.first_vertex);
        auto point = static_cast<std::size_t>(slice.first_point);
        for (std::int32_t y = 0; y < n_.y - 1; ++y)
            for (const Record& record : slice.row(y)) {
                const Cell cell{record.x, y, z};
                cells_.for_each_label(cell, [&](T label) {
                    for (int loop = 0; loop < cells_.case_of(cell, label).loops; ++loop)
                        point_of()[vertex++] = static_cast<std::uint32_t>(point);
                });
                cells_of_points()[point] = cell;
                points()[point++] = net_point(cell);
            }
    }

    /// The point of a cell, which is there.
    std::uint32_t point_at(const Cell& cell) const {
        const Slice& slice = slices_[static_cast<std::size_t>(cell[2])];
        const auto row = slice.row(cell[1]);
        const auto found =
            std::lower_bound(row.begin(), row.end(), cell[0],
                             [](const Record& record, std::int32_t x) { return record.x < x; });
        return static_cast<std::uint32_t>(slice.first_point + (&*found - slice.records.data()));
    }

    /// What draws a point: on a surface between two groups all neighbours on it; where more meet,
    /// the two along the line where they do. Where such lines meet it stays.
    NetPoint net_point(const Cell& cell) const {
        NetPoint point;
        point.neighbours.fill(NetPoint::kNone);
        const std::array<T, 8> labels = cells_.going_on(cell);
        const int groups = different(labels);
        if (groups < 2) return point;
        bool at_low[3], at_high[3];
        for (int axis = 0; axis < 3; ++axis) {
            const std::int32_t at = cell[static_cast<std::size_t>(axis)];
            at_low[axis] = at == 0;
            at_high[axis] = at == n_[axis] - 2;
            if (!at_low[axis] && !at_high[axis])
                point.free = static_cast<std::uint8_t>(point.free | 1 << axis);
        }
        int drawn = 0;
        for (int way = 0; way < 6; ++way) {
            const int axis = way / 2;
            if (way % 2 == 0 ? at_low[axis] : at_high[axis]) continue;
            std::array<T, 4> face;
            for (unsigned i = 0, corner = 0; corner < 8; ++corner)
                if ((corner >> axis & 1) == static_cast<unsigned>(way % 2))
                    face[i++] = labels[corner];
            if (different(face) < std::min(groups, 3)) continue;
            Cell other = cell;
            other[static_cast<std::size_t>(axis)] += way % 2 == 0 ? -1 : 1;
            point.neighbours[static_cast<std::size_t>(way)] = point_at(other);
            const bool mirrored = way % 2 == 0 ? at_high[axis] : at_low[axis];
            if (mirrored) point.twice = static_cast<std::uint8_t>(point.twice | 1 << way);
            drawn += mirrored ? 2 : 1;
        }
        if (groups > 2 && drawn != 2) point.neighbours.fill(NetPoint::kNone);
        for (int axis = 0; axis < 3; ++axis) look_across(cell, axis, point);
        return point;
    }

    /// Finds the points straight across the labels at both sides of a cell along an axis.
    void look_across(const Cell& cell, int axis, NetPoint& point) const {
        const auto low = cells_.layer(cell, axis, 0), high = cells_.layer(cell, axis, 1);
        for (const int side : {0, 1}) {
            const auto &inside = side == 0 ? low : high, &outside = side == 0 ? high : low;
            const T label = inside[0];
            const auto is_it = [&](T other) { return other == label; };
            if (!cells_.is_label(label) || !std::all_of(inside.begin(), inside.end(), is_it) ||
                std::any_of(outside.begin(), outside.end(), is_it))
                continue;
            Cell other = cell;
            for (int thickness = 1; thickness <= NetPoint::kThick; ++thickness) {
                other[static_cast<std::size_t>(axis)] += side == 0 ? -1 : 1;
                const auto next = cells_.layer(other, axis, side);
                if (std::all_of(next.begin(), next.end(), is_it)) continue;
                if (std::any_of(next.begin(), next.end(), is_it)) break;
                const auto at = static_cast<std::size_t>(side);
                point.axis = static_cast<std::uint8_t>(axis);
                point.across[at] = point_at(other);
                point.thickness[at] = static_cast<std::uint8_t>(thickness);
                break;
            }
        }
    }

    void make_quads(std::int32_t z) {
        const Slice& slice = slices_[static_cast<std::size_t>(z)];
        auto wall = static_cast<std::size_t>(slice.first_wall);
        auto quad = static_cast<std::size_t>(slice.first_quad);
        // First vertices of the cells of four rows, at the active ones: (y, z) modulo 2.
        const auto length = static_cast<std::size_t>(n_.x);
        std::vector<std::uint32_t> firsts(4 * length);
        const auto row = [&](std::int32_t y, std::int32_t slice_z) {
            return firsts.data() + static_cast<std::size_t>((y & 1) + 2 * (slice_z & 1)) * length;
        };
        for (std::int32_t y = 0; y < n_.y - 1; ++y) {
            for (std::int32_t k = std::max(0, z - 1); k <= z; ++k) {
                const Slice& of = slices_[static_cast<std::size_t>(k)];
                std::uint32_t* first = row(y, k);
                for (const Record& record : of.row(y))
                    first[record.x] = static_cast<std::uint32_t>(of.first_vertex + record.vertex);
            }
            for (const Record& record : slice.row(y)) {
                const Cell cell{record.x, y, z};
                cells_.for_each_wall(cell, [&](int axis, T below, T above) {
                    for (const bool rises : {true, false}) {
                        const T label = rises ? below : above;
                        if (!cells_.is_label(label)) continue;
                        Quad corners;
                        for (int around = 0; around < 4; ++around)
                            corners[static_cast<std::size_t>(rises ? around : 3 - around)] =
                                vertex_at(cell, axis, around, label, row);
                        quads()[quad] = corners;
                        groups()[quad++] = label - 1U;
                    }
                    if (is_end(cell, axis)) return;
                    NetWall& made = walls()[wall++];
                    Cell next = cell;
                    ++next[static_cast<std::size_t>(axis)];
                    made = {{},
                            below,
                            above,
                            static_cast<std::uint8_t>(axis),
                            is_thin(cell, below) || is_thin(next, above)};
                    for (int around = 0; around < 4; ++around)
                        made.points[static_cast<std::size_t>(around)] =
                            point_at(around_edge(cell, axis, around));
                });
            }
        }
    }

    /// Whether a sample of a label belongs to no block of eight.
    bool is_thin(const Cell& sample, T label) const {
        if (!cells_.is_label(label)) return false;
        for (unsigned corner = 0; corner < 8; ++corner) {
            Cell cell = sample;
            for (unsigned axis = 0; axis < 3; ++axis)
                cell[axis] -= static_cast<std::int32_t>(corner >> axis & 1);
            if (cells_.is_filled(cell, label)) return false;
        }
        return true;
    }

    /// One of the four cells at an edge from a cell's first corner; counter-clockwise about the
    /// edge.
    static Cell around_edge(const Cell& cell, int axis, int around) noexcept {
        Cell other = cell;
        if (around == 0 || around == 3) --other[static_cast<std::size_t>((axis + 1) % 3)];
        if (around == 0 || around == 1) --other[static_cast<std::size_t>((axis + 2) % 3)];
        return other;
    }

    /// The vertex of a label's surface in one of these.
    template <class Row>
    std::uint32_t vertex_at(const Cell& cell, int axis, int around, T label, const Row& row) const {
        const Cell other = around_edge(cell, axis, around);
        std::array<std::int32_t, 3> local;  // where the edge lies in the other cell
        for (std::size_t k = 0; k < 3; ++k) local[k] = cell[k] - other[k];
        const int first = axis == 0 ? 1 : 0, second = axis == 2 ? 1 : 2;
        const auto edge =
            static_cast<std::size_t>(4 * axis + local[static_cast<std::size_t>(first)] +
                                     2 * local[static_cast<std::size_t>(second)]);
        std::uint32_t vertex = row(other[1], other[2])[other[0]];
        bool before = true;
        cells_.for_each_label(other, [&](T each) {
            if (!before) return;
            const CellCase& cuts = cells_.case_of(other, each);
            before = each != label;
            vertex += before ? cuts.loops : cuts.loop_of[edge];
        });
        return vertex;
    }

    /// Along its shorter diagonal; of equal ones the one with the least corner, so that labels
    /// which share a wall cut it alike.
    void cut_quad(std::size_t q, bool mirrored, Mesh& mesh) {
        const Quad quad = quads()[q];
        std::array<std::array<double, 3>, 4> at;  // among indices
        for (std::size_t corner = 0; corner < 4; ++corner) {
            const std::uint32_t point = point_of()[quad[corner]];
            for (std::size_t axis = 0; axis < 3; ++axis)
                at[corner][axis] = double(cells_of_points()[point][axis]) +
                                   double(moved()[point][static_cast<int>(axis)]);
        }
        const auto apart = [&](std::size_t a, std::size_t b) {
            double sum = 0;
            for (std::size_t axis = 0; axis < 3; ++axis)
                sum += (at[a][axis] - at[b][axis]) * (at[a][axis] - at[b][axis]);
            return sum;
        };
        const double even = apart(0, 2), odd = apart(1, 3);
        const bool least = std::min(at[0], at[2]) < std::min(at[1], at[3]);
        const std::size_t from = even < odd || (even == odd && least) ? 0 : 1;
        const std::uint32_t a = quad[from], b = quad[from + 1], c = quad[from + 2],
                            d = quad[(from + 3) % 4];
        mesh.triangles()[2 * q] = mirrored ? Triangle{a, c, b} : Triangle{a, b, c};
        mesh.triangles()[2 * q + 1] = mirrored ? Triangle{a, d, c} : Triangle{a, c, d};
        mesh.groups()[2 * q] = mesh.groups()[2 * q + 1] = groups()[q];
    }

    static void take_normals(Mesh& mesh) {
        const auto vector = [](const Float3& p) { return Eigen::Vector3f(p[0], p[1], p[2]); };
        for (Float3& normal : mesh.normals()) normal = {0, 0, 0};
        for (const Triangle& t : mesh.triangles()) {
            const Eigen::Vector3f a = vector(mesh.positions()[t[0]]),
                                  b = vector(mesh.positions()[t[1]]),
                                  c = vector(mesh.positions()[t[2]]);
            const Eigen::Vector3f twice = (b - a).cross(c - a);
            for (const std::uint32_t v : t)
                for (int axis = 0; axis < 3; ++axis)
                    mesh.normals()[v][static_cast<std::size_t>(axis)] += twice[axis];
        }
        for (Float3& normal : mesh.normals()) {
            const float length = vector(normal).norm();
            for (float& part : normal) part = length > 0 ? part / length : 0;
        }
    }

    std::span<NetPoint> points() noexcept {
        return {static_cast<NetPoint*>(points_array_.data()), points_};
    }
    std::span<NetWall> walls() noexcept {
        return {static_cast<NetWall*>(walls_array_.data()), walls_};
    }
    std::span<Eigen::Vector3f> moved() noexcept {
        return {static_cast<Eigen::Vector3f*>(moved_array_.data()), points_};
    }
    std::span<Cell> cells_of_points() noexcept {
        return {static_cast<Cell*>(cells_array_.data()), points_};
    }
    std::span<std::uint32_t> point_of() noexcept {
        return {static_cast<std::uint32_t*>(point_of_array_.data()), vertices_};
    }
    std::span<Quad> quads() noexcept {
        return {static_cast<Quad*>(quads_array_.data()), quad_count_};
    }
    std::span<std::uint32_t> groups() noexcept {
        return {static_cast<std::uint32_t*>(groups_array_.data()), quad_count_};
    }

    const Cells<T> cells_;
    const Extent n_;
    std::pmr::memory_resource* memory_;
    const std::function<void()>& poll_;
    std::vector<Slice> slices_;
    std::size_t points_ = 0, vertices_ = 0, quad_count_ = 0, walls_ = 0;
    Array points_array_, moved_array_, cells_array_, point_of_array_, quads_array_, groups_array_,
        walls_array_;
};

void expect_labels(const Data& labels) {
    const Representation& what = labels.what;
    // With the frame.
    constexpr std::int64_t kMostAnAxis = std::numeric_limits<std::int32_t>::max() - 2;
    if (what.type == Type::f16 || what.type == Type::c64 || what.channels != 1 ||
        what.values.slope == 0 ||
        std::max({what.extent.x, what.extent.y, what.extent.z}) > kMostAnAxis)
        throw RequestError("surface nets: expected labels of one channel, of integers or floats");
}

}  // namespace

Mesh surface_nets(const Data& labels, double background, double smooth, const Mat4& to_file,
                  std::pmr::memory_resource* memory, const std::function<void()>& poll) {
    expect_labels(labels);
    const LabelGroups groups = groups_of(labels, background, memory, poll);
    const auto mesh_of = [&](auto zero) {
        Net<decltype(zero)> net(groups.samples, memory, poll);
        return net.mesh(Frame(to_file), smooth);
    };
    const Type type = groups.samples.what.type;
    Mesh mesh = type == Type::u8    ? mesh_of(std::uint8_t{})
                : type == Type::u16 ? mesh_of(std::uint16_t{})
                                    : mesh_of(std::uint32_t{});
    mesh.labels = groups.labels;
    return mesh;
}

double expected_net_vertices(const Data& labels, double background) {
    expect_labels(labels);
    const Extent n = labels.what.extent;
    return with_type(labels.what.type, [&]<class T>(T) {
        const Cells<T> cells(labels, stored<T>(background, labels.what.values));
        // At the ends a sample of a label has a wall, and about a vertex; where the surface turns
        // to another face it has vertices of its own.
        constexpr double kEdges = 1.5, kLeast = 8;
        std::int64_t at_ends = 0;
        for (int axis = 0; axis < 3; ++axis)
            for (const std::int64_t at : {std::int64_t{0}, n[axis] - 1}) {
                Region face = Region::all(n);
                face.begin[static_cast<std::size_t>(axis)] = at;
                face.end[static_cast<std::size_t>(axis)] = at + 1;
                for (std::int64_t z = face.begin[2]; z < face.end[2]; ++z)
                    for (std::int64_t y = face.begin[1]; y < face.end[1]; ++y)
                        for (std::int64_t x = face.begin[0]; x < face.end[0]; ++x)
                            at_ends += cells.is_label(*labels.at<T>(x, y, z));
            }
        const double ends = kEdges * static_cast<double>(at_ends) + kLeast;
        if (std::min({n.x, n.y, n.z}) < 2) return ends;
        constexpr std::int64_t kEvery = 4;
        const std::int64_t looked = (n.z - 1 + kEvery - 1) / kEvery;
        const std::int64_t active = tbb::parallel_reduce(
            tbb::blocked_range<std::int64_t>(0, looked), std::int64_t{0},
            [&](const auto& part, std::int64_t sum) {
                std::vector<std::uint8_t> unequal(static_cast<std::size_t>(n.x) + 8);
                for (std::int64_t i = part.begin(); i != part.end(); ++i)
                    for (std::int64_t y = 0; y < n.y - 1; ++y)
                        cells.for_each_active(y, i * kEvery, unequal.data(), [&](std::int64_t x) {
                            cells.for_each_label(
                                {static_cast<std::int32_t>(x), static_cast<std::int32_t>(y),
                                 static_cast<std::int32_t>(i * kEvery)},
                                [&](T) { ++sum; });
                        });
                return sum;
            },
            std::plus<>());
        return ends + static_cast<double>(active) * static_cast<double>(n.z - 1) /
                          static_cast<double>(looked);
    });
}

double nets_scratch(const Representation& labels, double vertices, int threads) noexcept {
    // A quad a vertex, about, and at most as many points and walls. Vectors of records may hold
    // twice what they need.
    const double net =
        vertices * (sizeof(NetPoint) + sizeof(Eigen::Vector3f) + sizeof(Cell) +
                    sizeof(std::uint32_t) + sizeof(Quad) + sizeof(std::uint32_t) + sizeof(NetWall));
    const double records =
        2 * vertices * sizeof(Record) + 2 * double(labels.extent.y) * double(labels.extent.z) * 4;
    return group_bytes(labels) + net + std::max(records, smoothing_scratch(vertices, vertices)) +
           5.0 * static_cast<double>(labels.extent.x) * sizeof(std::uint32_t) * threads;
}

}  // namespace edgewise::surface
