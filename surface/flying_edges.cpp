#include "surface/flying_edges.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <span>
#include <tbb/parallel_for.h>

#include "graph/errors.hpp"
#include "surface/cell_cases.hpp"
#include "surface/frame.hpp"
#include "surface/inside_bits.hpp"
#include "surface/level.hpp"

namespace edgewise::surface {
namespace {

using Word = std::uint64_t;
constexpr int kBits = 64;

bool has_cells(const Extent& n) noexcept { return n.x > 1 && n.y > 1 && n.z > 1; }

/// One bit a sample, or a cell, of all rows of a volume. Zero outside.
class BitRows {
 public:
    BitRows() = default;
    BitRows(std::int64_t n, std::int64_t ny, std::int64_t nz, std::pmr::memory_resource* memory)
        : words_(words_of_row(n)),
          ny_(ny),
          bits_(static_cast<std::size_t>(words_ * ny * nz) * sizeof(Word), memory) {}

    bool empty() const noexcept { return bits_.bytes() == 0; }
    std::int64_t words() const noexcept { return words_; }
    Word* row(std::int64_t y, std::int64_t z) noexcept {
        return static_cast<Word*>(bits_.data()) + (z * ny_ + y) * words_;
    }
    const Word* row(std::int64_t y, std::int64_t z) const noexcept {
        return static_cast<const Word*>(bits_.data()) + (z * ny_ + y) * words_;
    }

 private:
    std::int64_t words_ = 0, ny_ = 0;
    Array bits_;
};

/// The bits of the samples one step along x.
Word next_of(const Word* row, std::int64_t w) noexcept {
    return row[w] >> 1 | row[w + 1] << (kBits - 1);
}

/// Bits below n, of word w.
Word below(std::int64_t n, std::int64_t w) noexcept {
    const std::int64_t left = n - w * kBits;
    return left >= kBits ? ~Word{0} : left <= 0 ? 0 : (Word{1} << left) - 1;
}

/// Where the vertices and triangles of a row begin: first those on edges along x, then along y,
/// then along z. While they are counted: how many there are.
struct RowStart {
    std::uint32_t x = 0, y = 0, z = 0, triangles = 0;
};

/// What is known of a volume before vertices are made: which samples are inside, which cells count.
class Cuts {
 public:
    Cuts(const Data& samples, const Level& level, std::pmr::memory_resource* memory,
         const std::function<void()>& poll)
        : n_(samples.what.extent), inside_(n_.x, n_.y, n_.z, memory) {
        std::atomic<bool> finite = true;
        const Type type = samples.what.type;
        tbb::parallel_for(std::int64_t{0}, n_.z, [&](std::int64_t z) {
            if (poll) poll();
            for (std::int64_t y = 0; y < n_.y; ++y) {
                const void* row = samples.row_at(0, y, z);
                inside_bits(row, type, n_.x, level, inside_.row(y, z));
                if (type == Type::f32 && !all_finite(static_cast<const float*>(row), n_.x))
                    finite.store(false, std::memory_order_relaxed);
            }
        });
        if (!finite) take_cells(samples, memory, poll);
    }

    const Extent& extent() const noexcept { return n_; }
    /// Words that the cells of a row fill.
    std::int64_t cell_words() const noexcept { return (n_.x - 1 + kBits - 1) / kBits; }
    std::int64_t words() const noexcept { return (n_.x + kBits - 1) / kBits; }
    const Word* inside(std::int64_t y, std::int64_t z) const noexcept { return inside_.row(y, z); }
    /// Whether all cells count.
    bool whole() const noexcept { return cells_.empty(); }
    /// The cells of a row that count; none outside the volume.
    Word cells(std::int64_t y, std::int64_t z, std::int64_t w) const noexcept {
        if (y < 0 || z < 0 || y >= n_.y - 1 || z >= n_.z - 1 || w < 0 || w >= cell_words())
            return 0;
        return whole() ? below(n_.x - 1, w) : cells_.row(y, z)[w];
    }

    /// Edges along x, y and z from the samples of a row that have a vertex.
    Word along_x(std::int64_t y, std::int64_t z, std::int64_t w) const noexcept {
        const Word* row = inside(y, z);
        const Word cut = (row[w] ^ next_of(row, w)) & below(n_.x - 1, w);
        if (whole() || !cut) return cut;
        return cut &
               (cells(y - 1, z - 1, w) | cells(y, z - 1, w) | cells(y - 1, z, w) | cells(y, z, w));
    }
    Word along_y(std::int64_t y, std::int64_t z, std::int64_t w) const noexcept {
        if (y == n_.y - 1) return 0;
        const Word cut = inside(y, z)[w] ^ inside(y + 1, z)[w];
        if (whole() || !cut) return cut;
        return cut & beside(y, z - 1, y, z, w);
    }
    Word along_z(std::int64_t y, std::int64_t z, std::int64_t w) const noexcept {
        if (z == n_.z - 1) return 0;
        const Word cut = inside(y, z)[w] ^ inside(y, z + 1)[w];
        if (whole() || !cut) return cut;
        return cut & beside(y - 1, z, y, z, w);
    }

 private:
    /// Samples beside cells of two rows that count.
    Word beside(std::int64_t ya, std::int64_t za, std::int64_t yb, std::int64_t zb,
                std::int64_t w) const noexcept {
        const Word here = cells(ya, za, w) | cells(yb, zb, w);
        const Word before = cells(ya, za, w - 1) | cells(yb, zb, w - 1);
        return here | here << 1 | before >> (kBits - 1);
    }

    /// Finds the cells whose corners are all finite.
    void take_cells(const Data& samples, std::pmr::memory_resource* memory,
                    const std::function<void()>& poll) {
        if (!has_cells(n_)) return;
        BitRows lost(n_.x, n_.y, n_.z, memory);
        tbb::parallel_for(std::int64_t{0}, n_.z, [&](std::int64_t z) {
            if (poll) poll();
            for (std::int64_t y = 0; y < n_.y; ++y) {
                Word* bits = lost.row(y, z);
                std::fill_n(bits, lost.words(), 0);
                const float* row = samples.at<float>(0, y, z);
                for (std::int64_t x = 0; x < n_.x; ++x)
                    if (!std::isfinite(row[x])) bits[x / kBits] |= Word{1} << x % kBits;
            }
        });
        cells_ = BitRows(n_.x - 1, n_.y - 1, n_.z - 1, memory);
        tbb::parallel_for(std::int64_t{0}, n_.z - 1, [&](std::int64_t z) {
            for (std::int64_t y = 0; y < n_.y - 1; ++y)
                for (std::int64_t w = 0; w < cell_words(); ++w) {
                    Word bad = 0;
                    for (const Word* row : {lost.row(y, z), lost.row(y + 1, z), lost.row(y, z + 1),
                                            lost.row(y + 1, z + 1)})
                        bad |= row[w] | next_of(row, w);
                    cells_.row(y, z)[w] = below(n_.x - 1, w) & ~bad;
                }
        });
    }

    Extent n_;
    BitRows inside_, cells_;  // cells_ is empty where all count
};

/// Calls visit(x, set, cut) for each cell of a row that the surface may run through, in order. The
/// set has one bit a corner. Every edge with a vertex is an edge of such a cell.
template <class Visit>
void for_each_cell(const Cuts& cuts, std::int64_t y, std::int64_t z, Visit visit) {
    const Word* rows[4] = {cuts.inside(y, z), cuts.inside(y + 1, z), cuts.inside(y, z + 1),
                           cuts.inside(y + 1, z + 1)};
    const std::int64_t cells = cuts.extent().x - 1;
    for (std::int64_t w = 0; w < cuts.cell_words(); ++w) {
        Word here[4], next[4], any = 0, all = ~Word{0};
        for (int r = 0; r < 4; ++r) {
            here[r] = rows[r][w];
            next[r] = next_of(rows[r], w);
            any |= here[r] | next[r];
            all &= here[r] & next[r];
        }
        for (Word active = any & ~all & below(cells, w); active; active &= active - 1) {
            const int bit = std::countr_zero(active);
            unsigned set = 0;
            for (int r = 0; r < 4; ++r)
                set |= static_cast<unsigned>((here[r] >> bit & 1) | (next[r] >> bit & 1) << 1)
                       << 2 * r;
            visit(w * kBits + bit, set);
        }
    }
}

bool counts(const Cuts& cuts, std::int64_t x, std::int64_t y, std::int64_t z) noexcept {
    return cuts.whole() || (cuts.cells(y, z, x / kBits) >> x % kBits & 1);
}

std::uint32_t ones(Word word) noexcept {
    return word ? static_cast<std::uint32_t>(std::popcount(word)) : 0;
}

RowStart counted(const Cuts& cuts, std::int64_t y, std::int64_t z) {
    RowStart row;
    for (std::int64_t w = 0; w < cuts.words(); ++w) {
        row.x += ones(cuts.along_x(y, z, w));
        row.y += ones(cuts.along_y(y, z, w));
        row.z += ones(cuts.along_z(y, z, w));
    }
    const Extent& n = cuts.extent();
    if (y == n.y - 1 || z == n.z - 1) return row;
    const auto& cases = cell_cases();
    for_each_cell(cuts, y, z, [&](std::int64_t x, unsigned set) {
        if (counts(cuts, x, y, z)) row.triangles += cases[set].triangles;
    });
    return row;
}

/// The vertices of a volume of one type.
template <class T>
class Vertices {
 public:
    Vertices(const Data& samples, const Cuts& cuts, const Level& level, const Frame& frame)
        : samples_(samples.as<T>()),
          n_(samples.what.extent),
          step_{1, n_.x, n_.x * n_.y},
          cuts_(cuts),
          at_(level.at),
          outwards_(level.falls ? 1.0f : -1.0f),
          frame_(frame) {}

    void make_row(std::int64_t y, std::int64_t z, const RowStart& start, Mesh& mesh) const {
        std::uint32_t place[3] = {start.x, start.y, start.z};
        const Eigen::Vector3d origin = frame_.at(Eigen::Vector3d(0, double(y), double(z)));
        for (std::int64_t w = 0; w < cuts_.words(); ++w) {
            const Word cut[3] = {cuts_.along_x(y, z, w), cuts_.along_y(y, z, w),
                                 cuts_.along_z(y, z, w)};
            for (int axis = 0; axis < 3; ++axis)
                for (Word left = cut[axis]; left; left &= left - 1)
                    make({w * kBits + std::countr_zero(left), y, z}, axis, origin, place[axis]++,
                         mesh);
        }
    }

 private:
    using Place = std::array<std::int64_t, 3>;

    void make(const Place& at, int axis, const Eigen::Vector3d& origin, std::uint32_t vertex,
              Mesh& mesh) const {
        const T* low = samples_ + at[0] + step_[1] * at[1] + step_[2] * at[2];
        const T* high = low + step_[axis];
        const float a = static_cast<float>(*low), b = static_cast<float>(*high);
        float t = (at_ - a) / (b - a);
        if (!(t >= 0)) t = 0;  // the isovalue, rounded to f32, may lie beyond the edge
        if (t > 1) t = 1;
        if (!std::isfinite(b - a)) t = 0.5f;
        Eigen::Vector3d position = origin + frame_.steps.col(0) * double(at[0]);
        position += frame_.steps.col(axis) * double(t);
        mesh.positions()[vertex] = float3(position);

        Place beyond = at;
        ++beyond[axis];
        const Eigen::Vector3f g = difference(low, at), h = difference(high, beyond);
        mesh.normals()[vertex] = normal(g + t * (h - g), axis, a < b);
    }

    /// Central differences, one-sided at the volume's faces.
    Eigen::Vector3f difference(const T* sample, const Place& at) const {
        Eigen::Vector3f all;
        const std::int64_t n[3] = {n_.x, n_.y, n_.z};
        for (int axis = 0; axis < 3; ++axis) {
            const bool first = at[axis] == 0, last = at[axis] == n[axis] - 1;
            const auto before = static_cast<float>(sample[first ? 0 : -step_[axis]]);
            const auto behind = static_cast<float>(sample[last ? 0 : step_[axis]]);
            all[axis] = (behind - before) * (first || last ? 1.0f : 0.5f);
        }
        return all;
    }

    /// @param rises  stored numbers rise along the edge
    Float3 normal(const Eigen::Vector3f& difference, int axis, bool rises) const {
        // Divided by the largest, so that squares neither overflow nor vanish.
        const float largest = difference.cwiseAbs().maxCoeff();
        Eigen::Vector3f out = Eigen::Vector3f::Zero();
        if (largest > 0 && largest <= std::numeric_limits<float>::max() && difference.allFinite())
            out = frame_.gradients * (difference * (outwards_ / largest));
        float length = out.norm();
        if (!(length > 0)) {
            out = frame_.steps.col(axis).cast<float>() * (rises ? outwards_ : -outwards_);
            length = out.norm();
        }
        return {out.x() / length, out.y() / length, out.z() / length};
    }

    const T* samples_;
    const Extent n_;
    const std::array<std::int64_t, 3> step_;
    const Cuts& cuts_;
    const float at_, outwards_;
    const Frame& frame_;
};

/// The triangles of a row of cells. Vertices along a row are numbered in order, so that those of a
/// cell are found by counting the cuts before it.
void make_triangles(const Cuts& cuts, const Array& starts, std::int64_t y, std::int64_t z,
                    bool mirrored, Mesh& mesh) {
    const auto* all = static_cast<const RowStart*>(starts.data());
    const std::int64_t ny = cuts.extent().y;
    const RowStart* rows[4] = {all + z * ny + y, all + z * ny + y + 1, all + (z + 1) * ny + y,
                               all + (z + 1) * ny + y + 1};
    std::uint32_t x_at[4] = {rows[0]->x, rows[1]->x, rows[2]->x, rows[3]->x};
    std::uint32_t y_at[2] = {rows[0]->y, rows[2]->y}, z_at[2] = {rows[0]->z, rows[1]->z};
    Triangle* out = mesh.triangles().data() + rows[0]->triangles;
    const auto& cases = cell_cases();
    const std::size_t second = mirrored ? 2 : 1, third = mirrored ? 1 : 2;
    for_each_cell(cuts, y, z, [&](std::int64_t x, unsigned set) {
        std::uint32_t x_cut[4], y_cut[2], z_cut[2];
        if (cuts.whole()) {
            const auto differ = [set](int a, int b) { return (set >> a ^ set >> b) & 1; };
            for (int r = 0; r < 4; ++r) x_cut[r] = differ(2 * r, 2 * r + 1);
            y_cut[0] = differ(0, 2), y_cut[1] = differ(4, 6);
            z_cut[0] = differ(0, 4), z_cut[1] = differ(2, 6);
        } else {
            const std::int64_t w = x / kBits;
            const auto bit = [shift = x % kBits](Word word) {
                return static_cast<std::uint32_t>(word >> shift & 1);
            };
            for (int r = 0; r < 4; ++r) x_cut[r] = bit(cuts.along_x(y + (r & 1), z + (r >> 1), w));
            for (int r = 0; r < 2; ++r) y_cut[r] = bit(cuts.along_y(y, z + r, w));
            for (int r = 0; r < 2; ++r) z_cut[r] = bit(cuts.along_z(y + r, z, w));
        }
        if (counts(cuts, x, y, z)) {
            const std::uint32_t vertices[12] = {x_at[0], x_at[1],
                                                x_at[2], x_at[3],
                                                y_at[0], y_at[0] + y_cut[0],
                                                y_at[1], y_at[1] + y_cut[1],
                                                z_at[0], z_at[0] + z_cut[0],
                                                z_at[1], z_at[1] + z_cut[1]};
            const CellCase& cell = cases[set];
            for (int t = 0; t < cell.triangles; ++t, ++out)
                *out = {vertices[cell.corners[t][0]], vertices[cell.corners[t][second]],
                        vertices[cell.corners[t][third]]};
        }
        for (int r = 0; r < 4; ++r) x_at[r] += x_cut[r];
        for (int r = 0; r < 2; ++r) y_at[r] += y_cut[r], z_at[r] += z_cut[r];
    });
}

/// Turns counts into places. @return how many vertices and triangles there are
std::array<std::int64_t, 2> placed(std::span<RowStart> rows) {
    std::int64_t vertices = 0, triangles = 0;
    for (RowStart& row : rows) {
        const RowStart count = row;
        // Beyond 32 bits these are wrong, and the mesh is refused.
        row.x = static_cast<std::uint32_t>(vertices);
        row.y = static_cast<std::uint32_t>(vertices += count.x);
        row.z = static_cast<std::uint32_t>(vertices += count.y);
        vertices += count.z;
        row.triangles = static_cast<std::uint32_t>(triangles);
        triangles += count.triangles;
    }
    return {vertices, triangles};
}

void expect_samples(const Data& samples) {
    const Representation& what = samples.what;
    if (!can_be_cut(what.type) || what.channels != 1 || what.values.slope == 0)
        throw RequestError(
            "flying edges: expected samples of one channel, of u8, i8, u16, i16 or "
            "f32");
}

}  // namespace

Mesh flying_edges(const Data& samples, double isovalue, const Mat4& to_file,
                  std::pmr::memory_resource* memory, const std::function<void()>& poll) {
    expect_samples(samples);
    const Representation& what = samples.what;
    const Extent n = what.extent;
    if (!has_cells(n)) return Mesh(0, 0, false, memory);
    const Level level = level_of(isovalue, what.type, what.values);
    const Frame frame(to_file);
    const Cuts cuts(samples, level, memory, poll);

    const auto rows = static_cast<std::size_t>(n.y * n.z);
    Array starts(rows * sizeof(RowStart), memory);
    auto* start = static_cast<RowStart*>(starts.data());
    tbb::parallel_for(std::int64_t{0}, n.z, [&](std::int64_t z) {
        if (poll) poll();
        for (std::int64_t y = 0; y < n.y; ++y) start[z * n.y + y] = counted(cuts, y, z);
    });
    const auto [vertices, triangles] = placed({start, rows});
    Mesh mesh(vertices, triangles, false, memory);
    with_cut_type(what.type, [&](auto zero) {
        using T = decltype(zero);
        const Vertices<T> maker(samples, cuts, level, frame);
        tbb::parallel_for(std::int64_t{0}, n.z, [&](std::int64_t z) {
            if (poll) poll();
            for (std::int64_t y = 0; y < n.y; ++y) {
                maker.make_row(y, z, start[z * n.y + y], mesh);
                if (y + 1 < n.y && z + 1 < n.z)
                    make_triangles(cuts, starts, y, z, frame.mirrored, mesh);
            }
        });
    });
    return mesh;
}

double expected_vertices(const Data& samples, double isovalue, std::pmr::memory_resource* memory) {
    expect_samples(samples);
    const Representation& what = samples.what;
    const Extent n = what.extent;
    if (!has_cells(n)) return 0;
    constexpr std::int64_t kEvery = 4;
    const Level level = level_of(isovalue, what.type, what.values);
    std::atomic<std::int64_t> cuts = 0;
    const std::int64_t looked = (n.z - 1 + kEvery - 1) / kEvery;
    tbb::parallel_for(std::int64_t{0}, looked, [&](std::int64_t i) {
        const std::int64_t z = i * kEvery;
        BitRows slices(n.x, n.y, 2, memory);
        for (std::int64_t k = 0; k < 2; ++k)
            for (std::int64_t y = 0; y < n.y; ++y)
                inside_bits(samples.row_at(0, y, z + k), what.type, n.x, level, slices.row(y, k));
        std::int64_t here = 0;
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t w = 0; w < words_of_row(n.x) - 1; ++w) {
                const Word* row = slices.row(y, 0);
                here += ones((row[w] ^ next_of(row, w)) & below(n.x - 1, w));
                here += ones(row[w] ^ slices.row(y, 1)[w]);
                if (y + 1 < n.y) here += ones(row[w] ^ slices.row(y + 1, 0)[w]);
            }
        cuts += here;
    });
    return static_cast<double>(cuts) * static_cast<double>(n.z) / static_cast<double>(looked);
}

double flying_edges_scratch(const Representation& samples) noexcept {
    const Extent n = samples.extent;
    const double rows = static_cast<double>(n.y) * static_cast<double>(n.z);
    const double bits = static_cast<double>(words_of_row(n.x)) * sizeof(Word);
    return rows * (3 * bits + sizeof(RowStart));  // inside; not finite; cells
}

}  // namespace edgewise::surface
