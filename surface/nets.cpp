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
#include "surface/cell_cases.hpp"
#include "surface/frame.hpp"
#include "surface/level.hpp"
#include "surface/nets_smoothing.hpp"

namespace edgewise::surface {
namespace {

using Cell = std::array<std::int32_t, 3>;  // its first corner
constexpr std::size_t kLeaf = 1 << 14;     // quads, vertices

bool has_cells(const Extent& n) noexcept { return n.x > 1 && n.y > 1 && n.z > 1; }

/// A cell with vertices, and the first of them within its slice of cells.
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
    Cells(const Data& labels, double background)
        : labels_(labels.as<T>()),
          n_(labels.what.extent),
          background_(stored<T>(background, labels.what.values)) {
        for (int corner = 0; corner < 8; ++corner)
            corners_[corner] = (corner & 1) + n_.x * ((corner >> 1 & 1) + n_.y * (corner >> 2));
    }

    const Extent& extent() const noexcept { return n_; }
    bool is_label(T value) const noexcept { return !background_ || value != *background_; }
    const T* at(const Cell& cell) const noexcept {
        return labels_ + cell[0] + n_.x * (cell[1] + n_.y * cell[2]);
    }
    bool is_there(const Cell& cell) const noexcept {
        return cell[0] >= 0 && cell[1] >= 0 && cell[2] >= 0 && cell[0] < n_.x - 1 &&
               cell[1] < n_.y - 1 && cell[2] < n_.z - 1;
    }
    /// Whether a cell is there and all its corners are finite.
    bool counts(const Cell& cell) const noexcept {
        if (!is_there(cell)) return false;
        if constexpr (std::is_floating_point_v<T>)
            for (const std::int64_t corner : corners_)
                if (!std::isfinite(at(cell)[corner])) return false;
        return true;
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
        if (!counts(beyond) || cell_cases()[set_of(beyond, label)].passed_twice != (face ^ 1))
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

    /// Calls visit(axis, label, rises) for each quad at the edges from a cell's first corner: one
    /// for each end that is a label. It rises where the label is at the first corner.
    template <class Visit>
    void for_each_quad(const Cell& cell, Visit visit) const {
        const T* first = at(cell);
        for (int axis = 0; axis < 3; ++axis) {
            const T a = first[0], b = first[corners_[1 << axis]];
            if (a == b || !has_all_cells(cell, axis)) continue;
            if (is_label(a)) visit(axis, a, true);
            if (is_label(b)) visit(axis, b, false);
        }
    }

 private:
    /// Whether the four cells at an edge from a cell's first corner count.
    bool has_all_cells(const Cell& cell, int axis) const noexcept {
        const auto u = static_cast<std::size_t>((axis + 1) % 3);
        const auto v = static_cast<std::size_t>((axis + 2) % 3);
        if (cell[u] == 0 || cell[v] == 0) return false;
        if constexpr (!std::is_floating_point_v<T>) return true;
        for (int around = 0; around < 4; ++around) {
            Cell other = cell;
            other[u] -= around & 1;
            other[v] -= around >> 1;
            if (!counts(other)) return false;
        }
        return true;
    }

    const T* labels_;
    const Extent n_;
    const std::optional<T> background_;
    std::array<std::int64_t, 8> corners_{};
};

/// A slice of cells: those with vertices, row by row, and how many vertices and quads there are.
template <class T>
struct Slice {
    std::pmr::vector<Record> records;
    std::pmr::vector<std::uint32_t> rows;  // of each row its first record, and the end
    std::vector<T> labels;                 // ascending
    std::uint32_t vertices = 0, quads = 0;
    std::int64_t first_vertex = 0, first_quad = 0;

    explicit Slice(std::pmr::memory_resource* memory) : records(memory), rows(memory) {}
    std::span<const Record> row(std::int64_t y) const noexcept {
        return {records.data() + rows[static_cast<std::size_t>(y)],
                records.data() + rows[static_cast<std::size_t>(y) + 1]};
    }
};

template <class T>
void add_label(std::vector<T>& labels, T label) {
    const auto at = std::lower_bound(labels.begin(), labels.end(), label);
    if (at == labels.end() || *at != label) labels.insert(at, label);
}

/// The net of labels of one type.
template <class T>
class Net {
 public:
    Net(const Data& labels, double background, std::pmr::memory_resource* memory,
        const std::function<void()>& poll)
        : cells_(labels, background), n_(labels.what.extent), memory_(memory), poll_(poll) {
        slices_.reserve(static_cast<std::size_t>(n_.z - 1));
        for (std::int64_t z = 0; z < n_.z - 1; ++z) slices_.emplace_back(memory);
        tbb::parallel_for(std::size_t{0}, slices_.size(), [&](std::size_t z) {
            if (poll_) poll_();
            look_at(static_cast<std::int32_t>(z));
        });
        std::int64_t vertices = 0, quads = 0;
        std::vector<T> all;
        for (Slice<T>& slice : slices_) {
            slice.first_vertex = vertices;
            slice.first_quad = quads;
            vertices += slice.vertices;
            quads += slice.quads;
            for (const T label : slice.labels) add_label(all, label);
        }
        if (2 * quads > Mesh::kMost || vertices > Mesh::kMost)
            Mesh(vertices, 2 * quads, true, memory);  // refuses
        labels_ = std::move(all);
        vertices_ = static_cast<std::size_t>(vertices);
        quad_count_ = static_cast<std::size_t>(quads);
        make();
    }

    Mesh mesh(const Frame& frame, int smoothing_steps, const ValueMap& values) {
        smooth_net(quads(), cells_of_vertices(), places(), smoothing_steps, memory_, poll_);
        Mesh mesh(static_cast<std::int64_t>(vertices_), 2 * static_cast<std::int64_t>(quad_count_),
                  true, memory_);
        for (const T label : labels_) mesh.labels.push_back(values(double(label)));
        tbb::parallel_for(
            tbb::blocked_range<std::size_t>(0, vertices_, kLeaf), [&](const auto& part) {
                for (std::size_t v = part.begin(); v != part.end(); ++v) {
                    Eigen::Vector3d index = places()[v].template cast<double>();
                    for (int axis = 0; axis < 3; ++axis)
                        index[axis] += cells_of_vertices()[v][static_cast<std::size_t>(axis)];
                    mesh.positions()[v] = float3(frame.at(index));
                }
            });
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, quad_count_, kLeaf),
                          [&](const auto& part) {
                              for (std::size_t q = part.begin(); q != part.end(); ++q)
                                  cut_quad(q, frame.mirrored, mesh);
                          });
        take_normals(mesh);
        // Labels of falling values were ascending as stored numbers.
        if (values.slope < 0) {
            std::reverse(mesh.labels.begin(), mesh.labels.end());
            const auto last = static_cast<std::uint32_t>(labels_.size()) - 1;
            for (std::uint32_t& group : mesh.groups()) group = last - group;
        }
        return mesh;
    }

 private:
    void look_at(std::int32_t z) {
        Slice<T>& slice = slices_[static_cast<std::size_t>(z)];
        std::vector<std::uint8_t> unequal(static_cast<std::size_t>(n_.x) + 8);
        for (std::int32_t y = 0; y < n_.y - 1; ++y) {
            slice.rows.push_back(static_cast<std::uint32_t>(slice.records.size()));
            cells_.for_each_active(y, z, unequal.data(), [&](std::int64_t x) {
                const Cell cell{static_cast<std::int32_t>(x), y, z};
                if (!cells_.counts(cell)) return;
                slice.records.push_back({cell[0], slice.vertices});
                cells_.for_each_label(cell, [&](T label) {
                    slice.vertices += cells_.case_of(cell, label).loops;
                    add_label(slice.labels, label);
                });
                cells_.for_each_quad(cell, [&](int, T, bool) { ++slice.quads; });
            });
        }
        slice.rows.push_back(static_cast<std::uint32_t>(slice.records.size()));
    }

    void make() {
        places_array_ = Array(vertices_ * sizeof(Eigen::Vector3f), memory_);
        cells_array_ = Array(vertices_ * sizeof(Cell), memory_);
        quads_array_ = Array(quad_count_ * sizeof(Quad), memory_);
        groups_array_ = Array(quad_count_ * sizeof(std::uint32_t), memory_);
        tbb::parallel_for(std::size_t{0}, slices_.size(), [&](std::size_t z) {
            if (poll_) poll_();
            make_vertices(static_cast<std::int32_t>(z));
            make_quads(static_cast<std::int32_t>(z));
        });
        slices_.clear();
        slices_.shrink_to_fit();
    }

    void make_vertices(std::int32_t z) {
        const Slice<T>& slice = slices_[static_cast<std::size_t>(z)];
        auto vertex = static_cast<std::size_t>(slice.first_vertex);
        for (std::int32_t y = 0; y < n_.y - 1; ++y)
            for (const Record& record : slice.row(y)) {
                const Cell cell{record.x, y, z};
                cells_.for_each_label(cell, [&](T label) {
                    const CellCase& cuts = cells_.case_of(cell, label);
                    for (int loop = 0; loop < cuts.loops; ++loop, ++vertex) {
                        places()[vertex] = middle_of(cuts, loop);
                        cells_of_vertices()[vertex] = cell;
                    }
                });
            }
    }

    /// The mean of a loop's cuts, half way along the edges of a cell.
    static Eigen::Vector3f middle_of(const CellCase& cuts, int loop) {
        Eigen::Vector3f sum = Eigen::Vector3f::Zero();
        float count = 0;
        for (int edge = 0; edge < 12; ++edge) {
            if (cuts.loop_of[static_cast<std::size_t>(edge)] != loop) continue;
            for (const int corner : ends_of(edge))
                sum += Eigen::Vector3f(static_cast<float>(corner & 1),
                                       static_cast<float>(corner >> 1 & 1),
                                       static_cast<float>(corner >> 2)) /
                       2;
            ++count;
        }
        return sum / count;
    }

    void make_quads(std::int32_t z) {
        const Slice<T>& slice = slices_[static_cast<std::size_t>(z)];
        auto quad = static_cast<std::size_t>(slice.first_quad);
        // First vertices of the cells of four rows, at the active ones: (y, z) modulo 2.
        const auto length = static_cast<std::size_t>(n_.x);
        std::vector<std::uint32_t> firsts(4 * length);
        const auto row = [&](std::int32_t y, std::int32_t slice_z) {
            return firsts.data() + static_cast<std::size_t>((y & 1) + 2 * (slice_z & 1)) * length;
        };
        T last_label{};
        std::uint32_t last_group = std::numeric_limits<std::uint32_t>::max();
        for (std::int32_t y = 0; y < n_.y - 1; ++y) {
            for (std::int32_t k = std::max(0, z - 1); k <= z; ++k) {
                const Slice<T>& of = slices_[static_cast<std::size_t>(k)];
                std::uint32_t* first = row(y, k);
                for (const Record& record : of.row(y))
                    first[record.x] = static_cast<std::uint32_t>(of.first_vertex + record.vertex);
            }
            for (const Record& record : slice.row(y)) {
                const Cell cell{record.x, y, z};
                cells_.for_each_quad(cell, [&](int axis, T label, bool rises) {
                    Quad corners;
                    for (int around = 0; around < 4; ++around)
                        corners[static_cast<std::size_t>(rises ? around : 3 - around)] =
                            vertex_at(cell, axis, around, label, row);
                    if (label != last_label ||
                        last_group == std::numeric_limits<std::uint32_t>::max()) {
                        last_label = label;
                        last_group = static_cast<std::uint32_t>(
                            std::lower_bound(labels_.begin(), labels_.end(), label) -
                            labels_.begin());
                    }
                    quads()[quad] = corners;
                    groups()[quad++] = last_group;
                });
            }
        }
    }

    /// The vertex of a label's surface in one of the four cells at an edge from a cell's first
    /// corner; counter-clockwise about the edge.
    template <class Row>
    std::uint32_t vertex_at(const Cell& cell, int axis, int around, T label, const Row& row) const {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        Cell other = cell;
        int local[3] = {0, 0, 0};  // where the edge lies in the other cell
        if (around == 0 || around == 3) --other[static_cast<std::size_t>(u)], local[u] = 1;
        if (around == 0 || around == 1) --other[static_cast<std::size_t>(v)], local[v] = 1;
        const int first = axis == 0 ? 1 : 0, second = axis == 2 ? 1 : 2;
        const auto edge = static_cast<std::size_t>(4 * axis + local[first] + 2 * local[second]);
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

    void cut_quad(std::size_t q, bool mirrored, Mesh& mesh) {
        const Quad quad = quads()[q];
        const auto apart = [&](std::size_t a, std::size_t b) {
            double sum = 0;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const double d = double(mesh.positions()[quad[a]][axis]) -
                                 double(mesh.positions()[quad[b]][axis]);
                sum += d * d;
            }
            return sum;
        };
        const std::size_t from = apart(0, 2) <= apart(1, 3) ? 0 : 1;
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

    std::span<Eigen::Vector3f> places() noexcept {
        return {static_cast<Eigen::Vector3f*>(places_array_.data()), vertices_};
    }
    std::span<Cell> cells_of_vertices() noexcept {
        return {static_cast<Cell*>(cells_array_.data()), vertices_};
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
    std::vector<Slice<T>> slices_;
    std::vector<T> labels_;
    std::size_t vertices_ = 0, quad_count_ = 0;
    Array places_array_, cells_array_, quads_array_, groups_array_;
};

void expect_labels(const Data& labels) {
    const Representation& what = labels.what;
    constexpr std::int64_t kMostAnAxis = std::numeric_limits<std::int32_t>::max();
    if (!can_be_cut(what.type) || what.channels != 1 || what.values.slope == 0 ||
        std::max({what.extent.x, what.extent.y, what.extent.z}) > kMostAnAxis)
        throw RequestError(
            "surface nets: expected labels of one channel, of u8, i8, u16, i16 or "
            "f32");
}

}  // namespace

Mesh surface_nets(const Data& labels, double background, int smoothing_steps, const Mat4& to_file,
                  std::pmr::memory_resource* memory, const std::function<void()>& poll) {
    expect_labels(labels);
    if (!has_cells(labels.what.extent)) return Mesh(0, 0, true, memory);
    return with_cut_type(labels.what.type, [&](auto zero) {
        Net<decltype(zero)> net(labels, background, memory, poll);
        return net.mesh(Frame(to_file), smoothing_steps, labels.what.values);
    });
}

double expected_net_vertices(const Data& labels, double background) {
    expect_labels(labels);
    const Extent n = labels.what.extent;
    if (!has_cells(n)) return 0;
    constexpr std::int64_t kEvery = 4;
    const std::int64_t looked = (n.z - 1 + kEvery - 1) / kEvery;
    const std::int64_t active = with_cut_type(labels.what.type, [&](auto zero) {
        using T = decltype(zero);
        const Cells<T> cells(labels, background);
        return tbb::parallel_reduce(
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
    });
    return static_cast<double>(active) * static_cast<double>(n.z - 1) / static_cast<double>(looked);
}

double nets_scratch(const Representation& labels, double vertices, int threads) noexcept {
    // A quad a vertex, about. Vectors of records may hold twice what they need.
    const double quads = vertices;
    const double net = vertices * (sizeof(Eigen::Vector3f) + sizeof(Cell)) +
                       quads * (sizeof(Quad) + sizeof(std::uint32_t));
    const double records =
        2 * vertices * sizeof(Record) + 2 * double(labels.extent.y) * double(labels.extent.z) * 4;
    const double smoothing = vertices * (sizeof(Eigen::Vector3f) + 17) + quads * 16;
    return net + std::max(records, smoothing) +
           5.0 * static_cast<double>(labels.extent.x) * sizeof(std::uint32_t) * threads;
}

}  // namespace edgewise::surface
