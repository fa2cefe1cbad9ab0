#include "transitions/kernels/axis_permutation.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <numeric>
#include <vector>

namespace edgewise::kernels {
namespace {

std::vector<AxisPermutation> all_48() {
    std::vector<AxisPermutation> all;
    std::array<int, 3> order = {0, 1, 2};
    do {
        for (int signs = 0; signs < 8; ++signs)
            all.push_back(
                {order, {signs & 1 ? -1 : 1, signs & 2 ? -1 : 1, signs & 4 ? -1 : 1}, {0, 0, 0}});
    } while (std::next_permutation(order.begin(), order.end()));
    return all;
}

std::vector<std::byte> counted(std::int64_t samples, std::size_t bytes) {
    std::vector<std::byte> data(samples * bytes);
    for (std::size_t i = 0; i < data.size(); ++i) data[i] = std::byte((i * 131 + i / 251) & 255);
    return data;
}

/// Output by output, straight from the definition.
std::vector<std::byte> expected(const std::vector<std::byte>& in, const Extent& from,
                                std::size_t bytes, const AxisPermutation& permutation,
                                const std::vector<std::byte>& outside, const Extent& to) {
    std::vector<std::byte> out(to.samples() * bytes);
    for (std::int64_t z = 0; z < to.z; ++z)
        for (std::int64_t y = 0; y < to.y; ++y)
            for (std::int64_t x = 0; x < to.x; ++x) {
                const std::array<std::int64_t, 3> at = {x, y, z};
                std::array<std::int64_t, 3> source{};
                bool inside = true;
                for (int i = 0; i < 3; ++i) {
                    const int axis = permutation.from[i];
                    source[axis] = permutation.sign[i] * (at[i] - permutation.shift[i]);
                    inside = inside && source[axis] >= 0 && source[axis] < from[axis];
                }
                const std::int64_t index = (source[2] * from.y + source[1]) * from.x + source[0];
                std::memcpy(&out[((z * to.y + y) * to.x + x) * bytes],
                            inside ? &in[index * bytes] : outside.data(), bytes);
            }
    return out;
}

TEST(AxisPermutation, CopiesAll48ByteForByteWithShiftsAndOutside) {
    const Extent from{37, 41, 35}, to{43, 34, 39};
    for (const std::size_t bytes : {1, 2, 3, 4, 8, 12})
        for (AxisPermutation permutation : all_48()) {
            permutation = into_place(permutation, from);
            permutation.shift[0] += 3;
            permutation.shift[1] -= 4;
            const auto in = counted(from.samples(), bytes);
            const std::vector<std::byte> outside(bytes, std::byte(7));
            std::vector<std::byte> out(to.samples() * bytes, std::byte(99));
            // In pieces, as threads would.
            for (std::int64_t z = 0; z < to.z; z += 10)
                for (std::int64_t y = 0; y < to.y; y += 33)
                    copy_permuted(
                        in.data(), from, bytes, permutation, outside.data(), out.data(), to,
                        {{0, y, z}, {to.x, std::min(y + 33, to.y), std::min(z + 10, to.z)}});
            ASSERT_EQ(out, expected(in, from, bytes, permutation, outside, to));
        }
}

TEST(AxisPermutation, NothingOfTheInputInSight) {
    const Extent extent{5, 4, 3};
    const auto in = counted(extent.samples(), 1);
    for (const std::int64_t shift : {-100, 100}) {
        std::vector<std::byte> out(extent.samples());
        const std::byte outside{42};
        copy_permuted(in.data(), extent, 1, {.shift = {0, shift, 0}}, &outside, out.data(), extent,
                      Region::all(extent));
        EXPECT_EQ(out, std::vector<std::byte>(extent.samples(), outside));
    }
}

TEST(AxisPermutation, IntoPlaceCoversTheWholeOutput) {
    const Extent from{7, 3, 5};
    for (const AxisPermutation& permutation : all_48()) {
        const AxisPermutation placed = into_place(permutation, from);
        const Extent to = permuted_extent(placed, from);
        const auto in = std::vector<std::byte>(from.samples(), std::byte(1));
        std::vector<std::byte> out(to.samples());
        const std::byte outside{42};
        copy_permuted(in.data(), from, 1, placed, &outside, out.data(), to, Region::all(to));
        EXPECT_EQ(out, std::vector<std::byte>(to.samples(), std::byte(1)));
    }
}

TEST(AxisPermutation, RecognisesExactMapsOnly) {
    for (AxisPermutation permutation : all_48()) {
        permutation.shift = {-3, 0, 4096};
        EXPECT_EQ(axis_permutation(affine_of(permutation)), permutation);
        for (int entry = 0; entry < 12; ++entry) {
            Affine map = affine_of(permutation);
            map[entry] += entry % 4 == 3 ? 5e-10 : 5e-13;
            EXPECT_EQ(axis_permutation(map), permutation);
            map[entry] += entry % 4 == 3 ? 1e-8 : 1e-11;
            EXPECT_FALSE(axis_permutation(map));
        }
    }
    EXPECT_FALSE(axis_permutation({1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0}));  // an axis used twice
    EXPECT_FALSE(axis_permutation({NAN, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}));
}

}  // namespace
}  // namespace edgewise::kernels
