// Rows of sums and extremes beside each other: several rows at once give the bits of one by one,
// and nothing is written behind a row.
#include "transitions/kernels/neighbourhood.hpp"

#include <algorithm>
#include <cstring>
#include <gtest/gtest.h>
#include <random>
#include <vector>

namespace edgewise::kernels {
namespace {

constexpr std::size_t kBehind = 64;  // values that may be read, not written

template <class T>
void expect_rows_alike() {
    std::mt19937 random(2);
    for (const std::int64_t kz : {1, 3})
        for (const std::int64_t ky : {1, 2, 3, 4, 7})
            for (const std::int64_t kx : {1, 2, 5})
                for (const std::int64_t rows : {1, 2, 3, 4, 7, 9})
                    for (const std::int64_t n : {1, 7, 24, 25, 50, 131}) {
                        const std::int64_t row = n + kx + 3, slice = row * (rows + ky);
                        std::vector<T> in(std::size_t(slice * kz) + kBehind), weights;
                        for (T& value : in) value = T(random()) / T(1 << 20);
                        for (std::int64_t i = 0; i < kx * ky * kz; ++i)
                            weights.push_back(T(random()) / T(1 << 28) - 3);
                        std::vector<std::ptrdiff_t> places;
                        for (std::int64_t c = 0; c < kz; ++c)
                            for (std::int64_t b = 0; b < ky; ++b)
                                for (std::int64_t a = 0; a < kx; ++a)
                                    places.push_back(a + b * row + c * slice);
                        std::vector<T> one(std::size_t(row * rows) + kBehind, T(-7)), all = one;
                        for (std::int64_t r = 0; r < rows; ++r)
                            sum_row(in.data() + r * row, places.data(), weights.data(),
                                    places.size(), false, one.data() + r * row, n);
                        sum_rows(in.data(), row, slice, {weights.data(), kx, ky, kz}, all.data(),
                                 row, n, rows);
                        ASSERT_EQ(std::memcmp(one.data(), all.data(), one.size() * sizeof(T)), 0)
                            << kx << 'x' << ky << 'x' << kz << ", " << rows << " rows of " << n;
                        for (std::int64_t r = 0; r < rows; ++r)
                            ASSERT_EQ(all[std::size_t(r * row + n)], T(-7));
                    }
}

TEST(Neighbourhood, RowsAtOnceAreRowsOneByOneToTheBit) {
    expect_rows_alike<float>();
    expect_rows_alike<double>();
}

template <class T>
void expect_extremes() {
    std::mt19937 random(3);
    for (const bool least : {false, true})
        for (const std::int64_t n : {1, 3, 31, 64, 129, 300}) {
            std::vector<T> in(std::size_t(n) + 40 + kBehind), out(std::size_t(n) + 8, T(1));
            for (T& value : in) value = T(random() % 100);
            const std::ptrdiff_t places[] = {0, 3, 17, 40};
            std::vector<T> want = out;
            for (std::int64_t i = 0; i < n; ++i) {
                T value = in[std::size_t(i)];
                for (const std::ptrdiff_t place : places) {
                    const T other = in[std::size_t(i + place)];
                    value = least ? std::min(value, other) : std::max(value, other);
                }
                want[std::size_t(i)] = value;
            }
            extreme_row(in.data(), places, 4, least, out.data(), n);
            ASSERT_EQ(out, want);
            // In place, as places lie ahead.
            extreme_row(in.data(), places, 4, least, in.data(), n);
            ASSERT_TRUE(std::equal(want.begin(), want.begin() + n, in.begin()));
        }
}

TEST(Neighbourhood, ExtremesAreExactAndEndWhereTheRowDoes) {
    expect_extremes<std::uint8_t>();
    expect_extremes<std::int16_t>();
    expect_extremes<std::int32_t>();
    expect_extremes<float>();
    expect_extremes<double>();
}

}  // namespace
}  // namespace edgewise::kernels
