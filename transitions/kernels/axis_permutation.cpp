#include "transitions/kernels/axis_permutation.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace edgewise::kernels {
namespace {

constexpr double kExactEntry = 1e-12, kExactShift = 1e-9;
constexpr std::int64_t kTile = 64;  // samples along each side of a square

/// One copy, with the strides of the input along the axes of the output [bytes].
struct Copy {
    const std::byte* in;                 // the sample that goes to out (0, 0, 0), inside or not
    std::array<std::int64_t, 3> stride;  // of the input, for one step along each output axis
    std::byte* out;
    Region held;  // of the output: what is in `out`
    std::size_t sample_bytes;
    const std::byte* outside;
    Region filled;  // the part of the output region that has an input

    const std::byte* source(std::int64_t x, std::int64_t y, std::int64_t z) const noexcept {
        return in + x * stride[0] + y * stride[1] + z * stride[2];
    }
    std::byte* target(std::int64_t x, std::int64_t y, std::int64_t z) const noexcept {
        const Extent n = held.extent();
        return out + (((z - held.begin[2]) * n.y + y - held.begin[1]) * n.x + x - held.begin[0]) *
                         std::int64_t(sample_bytes);
    }
};

template <std::size_t size>
void copy_row(const Copy& copy, std::int64_t begin, std::int64_t end, std::int64_t y,
              std::int64_t z) {
    const std::byte* from = copy.source(begin, y, z);
    std::byte* to = copy.target(begin, y, z);
    for (std::int64_t x = begin; x < end; ++x, from += copy.stride[0], to += size)
        std::memcpy(to, from, size);
}

/// Small samples as fields of 64 bits: kSide of them are a row of a block that is transposed by
/// exchanging halves, quarters and eighths of rows.
template <std::size_t size>
struct Patch {
    static constexpr std::int64_t kSide = 8 / size;
    std::array<std::uint64_t, kSide> rows;

    void transpose() noexcept {
        if constexpr (kSide == 8) exchange<4>();
        exchange<2>();
        exchange<1>();
    }

 private:
    /// Exchanges fields `half` apart with rows `half` apart.
    template <std::int64_t half>
    void exchange() noexcept {
        constexpr int bits = static_cast<int>(half * 8 * std::int64_t(size));
        constexpr std::uint64_t low = ~std::uint64_t{0} / ((std::uint64_t{1} << bits) + 1);
        for (std::int64_t i = 0; i < kSide; ++i) {
            if ((i & half) != 0) continue;
            const std::uint64_t change = ((rows[i] >> bits) ^ rows[i + half]) & low;
            rows[i + half] ^= change;
            rows[i] ^= change << bits;
        }
    }
};

/// The square [x0, x1) x [a0, a1) of the output's x and `along`, whose neighbours along `along` are
/// neighbours in the input.
template <std::size_t size>
struct Square {
    const Copy& copy;
    int along;
    std::int64_t other, x0, x1, a0, a1;

    const std::byte* source(std::int64_t x, std::int64_t a) const {
        return along == 1 ? copy.source(x, a, other) : copy.source(x, other, a);
    }
    std::byte* target(std::int64_t x, std::int64_t a) const {
        return along == 1 ? copy.target(x, a, other) : copy.target(x, other, a);
    }
    void one_by_one() const {
        for (std::int64_t a = a0; a < a1; ++a) {
            const std::byte* from = source(x0, a);
            std::byte* to = target(x0, a);
            for (std::int64_t x = x0; x < x1; ++x, from += copy.stride[0], to += size)
                std::memcpy(to, from, size);
        }
    }
    /// Blocks of rows that lie forwards in the input.
    void by_blocks() const {
        constexpr std::int64_t kSide = Patch<size>::kSide;
        const std::int64_t x2 = x1 - (x1 - x0) % kSide, a2 = a1 - (a1 - a0) % kSide;
        for (std::int64_t a = a0; a < a2; a += kSide)
            for (std::int64_t x = x0; x < x2; x += kSide) {
                Patch<size> block;
                for (std::int64_t i = 0; i < kSide; ++i)
                    std::memcpy(&block.rows[i], source(x + i, a), 8);
                block.transpose();
                for (std::int64_t i = 0; i < kSide; ++i)
                    std::memcpy(target(x, a + i), &block.rows[i], 8);
            }
        Square{copy, along, other, x2, x1, a0, a2}.one_by_one();
        Square{copy, along, other, x0, x1, a2, a1}.one_by_one();
    }
};

/// The output's x and `along` (1 or 2) go through small squares, so that the lines of the cache
/// that a column of the input touches are used up before they leave it.
template <std::size_t size>
void copy_squares(const Copy& copy, int along) {
    const Region& part = copy.filled;
    const int other = 3 - along;
    for (std::int64_t o = part.begin[other]; o < part.end[other]; ++o)
        for (std::int64_t a = part.begin[along]; a < part.end[along]; a += kTile)
            for (std::int64_t x = part.begin[0]; x < part.end[0]; x += kTile) {
                const Square<size> square{copy,
                                          along,
                                          o,
                                          x,
                                          std::min(x + kTile, part.end[0]),
                                          a,
                                          std::min(a + kTile, part.end[along])};
                if constexpr (size == 1 || size == 2)
                    if (copy.stride[along] > 0) {
                        square.by_blocks();
                        continue;
                    }
                square.one_by_one();
            }
}

template <std::size_t size>
void copy_filled(const Copy& copy) {
    const Region& part = copy.filled;
    for (int along = 1; along < 3; ++along)
        if (std::abs(copy.stride[along]) == std::int64_t(copy.sample_bytes))
            return copy_squares<size>(copy, along);
    for (std::int64_t z = part.begin[2]; z < part.end[2]; ++z)
        for (std::int64_t y = part.begin[1]; y < part.end[1]; ++y) {
            if (copy.stride[0] == std::int64_t(size))
                std::memcpy(copy.target(part.begin[0], y, z), copy.source(part.begin[0], y, z),
                            size * (part.end[0] - part.begin[0]));
            else
                copy_row<size>(copy, part.begin[0], part.end[0], y, z);
        }
}

/// Sizes that no kernel was made for: colour in odd types.
void copy_any_size(const Copy& copy) {
    const Region& part = copy.filled;
    for (std::int64_t z = part.begin[2]; z < part.end[2]; ++z)
        for (std::int64_t y = part.begin[1]; y < part.end[1]; ++y)
            for (std::int64_t x = part.begin[0]; x < part.end[0]; ++x)
                std::memcpy(copy.target(x, y, z), copy.source(x, y, z), copy.sample_bytes);
}

/// The first sample, then copies of twice as many each time: a call a sample would cost more than
/// the samples that have an input.
void fill(const Copy& copy, std::int64_t begin, std::int64_t end, std::int64_t y, std::int64_t z) {
    if (begin >= end) return;
    std::byte* const row = copy.target(begin, y, z);
    const std::size_t bytes = std::size_t(end - begin) * copy.sample_bytes;
    std::memcpy(row, copy.outside, copy.sample_bytes);
    for (std::size_t done = copy.sample_bytes; done < bytes; done += std::min(done, bytes - done))
        std::memcpy(row + done, row, std::min(done, bytes - done));
}

void fill_outside(const Copy& copy, const Region& region) {
    const Region& part = copy.filled;
    for (std::int64_t z = region.begin[2]; z < region.end[2]; ++z)
        for (std::int64_t y = region.begin[1]; y < region.end[1]; ++y) {
            const bool row_has_input = !part.empty() && z >= part.begin[2] && z < part.end[2] &&
                                       y >= part.begin[1] && y < part.end[1];
            if (row_has_input) {
                fill(copy, region.begin[0], part.begin[0], y, z);
                fill(copy, part.end[0], region.end[0], y, z);
            } else {
                fill(copy, region.begin[0], region.end[0], y, z);
            }
        }
}

}  // namespace

std::optional<AxisPermutation> axis_permutation(const Affine& map) noexcept {
    AxisPermutation found;
    std::array<bool, 3> used{false, false, false};
    for (int row = 0; row < 3; ++row) {
        int column = 0;
        for (int c = 1; c < 3; ++c)
            if (std::abs(map[4 * row + c]) > std::abs(map[4 * row + column])) column = c;
        for (int c = 0; c < 3; ++c) {
            const double expected = c == column ? 1 : 0;
            if (!(std::abs(std::abs(map[4 * row + c]) - expected) <= kExactEntry)) return {};
        }
        const double shift = std::round(map[4 * row + 3]);
        if (used[column] || !(std::abs(map[4 * row + 3] - shift) <= kExactShift)) return {};
        if (std::abs(shift) > 1e15) return {};  // an index must stay exact
        used[column] = true;
        found.from[row] = column;
        found.sign[row] = map[4 * row + column] < 0 ? -1 : 1;
        found.shift[row] = std::int64_t(shift);
    }
    return found;
}

Affine affine_of(const AxisPermutation& permutation) noexcept {
    Affine map{};
    for (int row = 0; row < 3; ++row) {
        map[4 * row + permutation.from[row]] = permutation.sign[row];
        map[4 * row + 3] = double(permutation.shift[row]);
    }
    return map;
}

AxisPermutation into_place(AxisPermutation permutation, const Extent& in) noexcept {
    for (int i = 0; i < 3; ++i)
        permutation.shift[i] = permutation.sign[i] > 0 ? 0 : in[permutation.from[i]] - 1;
    return permutation;
}

Extent permuted_extent(const AxisPermutation& permutation, const Extent& in) noexcept {
    return {in[permutation.from[0]], in[permutation.from[1]], in[permutation.from[2]]};
}

void copy_permuted(const Grid& in, std::size_t sample_bytes, const AxisPermutation& permutation,
                   const void* outside, void* out, const Region& held, const Region& region) {
    const auto bytes = std::int64_t(sample_bytes);
    const std::array<std::int64_t, 3> strides = {bytes, bytes * in.row_step(),
                                                 bytes * in.slice_step()};
    Copy copy{.in = in.as<std::byte>(),
              .stride = {},
              .out = static_cast<std::byte*>(out),
              .held = held,
              .sample_bytes = sample_bytes,
              .outside = static_cast<const std::byte*>(outside),
              .filled = {}};
    for (int i = 0; i < 3; ++i) {
        const std::int64_t n = in.extent[permutation.from[i]], shift = permutation.shift[i];
        const bool forward = permutation.sign[i] > 0;
        copy.stride[i] = permutation.sign[i] * strides[permutation.from[i]];
        copy.in -= shift * copy.stride[i];
        // in = sign (out - shift) lies in [0, n) for these out:
        const std::int64_t first = forward ? shift : shift - n + 1;
        copy.filled.begin[i] = std::clamp(first, region.begin[i], region.end[i]);
        copy.filled.end[i] = std::clamp(first + n, region.begin[i], region.end[i]);
    }
    fill_outside(copy, region);
    if (copy.filled.empty()) return;
    switch (sample_bytes) {
        case 1:
            return copy_filled<1>(copy);
        case 2:
            return copy_filled<2>(copy);
        case 3:
            return copy_filled<3>(copy);
        case 4:
            return copy_filled<4>(copy);
        case 8:
            return copy_filled<8>(copy);
        default:
            return copy_any_size(copy);
    }
}

}  // namespace edgewise::kernels
