#include "io/png_data.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <memory>
#include <new>
#include <tbb/parallel_for.h>
#include <vector>
#include <zlib.h>

namespace edgewise::store {
namespace {

using Byte = unsigned char;

constexpr std::size_t kStripe = 256 << 10;  // [byte] of rows, at least one row
constexpr std::size_t kAtOnce = 16;         // stripes in memory
constexpr std::size_t kWindow = 32 << 10;   // of deflate
/// What deflate looks for. Filtered photographs hardly repeat themselves: runs alone take less than
/// half the time of level 3, for 6 % more bytes.
struct Effort {
    int level, strategy;
};
constexpr Effort kRuns{1, Z_RLE}, kMatches{3, Z_FILTERED};
constexpr double kWorth = 1.1;  // bytes by runs over those by matches, from which these pay

enum Filter : Byte { none, sub, up, average, paeth };
constexpr std::size_t kFilters = 5;

/// Of left, above and above left the one that is nearest to left + above - above left.
int predicted(int a, int b, int c) noexcept {
    const int to_a = std::abs(b - c), to_b = std::abs(a - c), to_c = std::abs(a + b - 2 * c);
    const int of_two = to_b <= to_c ? b : c;
    return to_a <= to_b && to_a <= to_c ? a : of_two;
}

/// One row in all ways; `row` and `above` have `pixel` bytes of zeros before them.
void filter_row(const Byte* row, const Byte* above, std::size_t pixel, std::size_t length,
                std::array<std::vector<Byte>, kFilters>& all) {
    const Byte *left = row - pixel, *corner = above - pixel;
    for (std::size_t i = 0; i < length; ++i) all[none][i] = row[i];
    for (std::size_t i = 0; i < length; ++i) all[sub][i] = static_cast<Byte>(row[i] - left[i]);
    for (std::size_t i = 0; i < length; ++i) all[up][i] = static_cast<Byte>(row[i] - above[i]);
    for (std::size_t i = 0; i < length; ++i)
        all[average][i] = static_cast<Byte>(row[i] - (left[i] + above[i]) / 2);
    for (std::size_t i = 0; i < length; ++i)
        all[paeth][i] = static_cast<Byte>(row[i] - predicted(left[i], above[i], corner[i]));
}

std::uint64_t size_of(const std::vector<Byte>& row, std::size_t length) noexcept {
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < length; ++i)
        sum += static_cast<std::uint64_t>(std::abs(static_cast<signed char>(row[i])));
    return sum;
}

/// A row in the order of the file, with zeros before it; of row -1 zeros alone.
void copy_row(const PngRows& rows, std::int64_t y, std::vector<Byte>& to, std::size_t before) {
    if (y < 0) return std::fill(to.begin(), to.end(), Byte{0});
    const auto* from =
        reinterpret_cast<const Byte*>(rows.first) + static_cast<std::size_t>(y) * rows.stride;
    Byte* into = to.data() + before;
    if (rows.bytes == 1) {
        std::copy_n(from, rows.stride, into);
        return;
    }
    const auto* samples = reinterpret_cast<const std::uint16_t*>(from);
    for (std::size_t i = 0; i < rows.stride / 2; ++i) {
        into[2 * i] = static_cast<Byte>(samples[i] >> 8);
        into[2 * i + 1] = static_cast<Byte>(samples[i] & 0xff);
    }
}

struct Stripe {
    std::int64_t begin = 0, end = 0;         // rows
    std::vector<Byte> filtered{}, packed{};  // with a byte before each row that names its filter
    uLong sum = 1;                           // adler32
};

void filter(const PngRows& rows, Stripe& stripe) {
    const std::size_t length = rows.stride;
    const auto pixel = static_cast<std::size_t>(rows.channels * rows.bytes);
    std::vector<Byte> above(pixel + length), row(pixel + length);
    std::array<std::vector<Byte>, kFilters> all;
    for (std::vector<Byte>& each : all) each.resize(length);
    copy_row(rows, stripe.begin - 1, above, pixel);
    stripe.filtered.clear();
    stripe.filtered.reserve(static_cast<std::size_t>(stripe.end - stripe.begin) * (length + 1));
    for (std::int64_t y = stripe.begin; y < stripe.end; ++y) {
        copy_row(rows, y, row, pixel);
        filter_row(row.data() + pixel, above.data() + pixel, pixel, length, all);
        std::size_t best = 0;
        std::uint64_t least = size_of(all[0], length);
        for (std::size_t k = 1; k < kFilters; ++k)
            if (const std::uint64_t size = size_of(all[k], length); size < least)
                least = size, best = k;
        stripe.filtered.push_back(static_cast<Byte>(best));
        stripe.filtered.insert(stripe.filtered.end(), all[best].begin(), all[best].end());
        std::swap(row, above);
    }
    stripe.sum =
        adler32_z(adler32_z(0, nullptr, 0), stripe.filtered.data(), stripe.filtered.size());
}

/// Raw deflate; all but the last end on a byte, so that the next may follow.
void compress(Stripe& stripe, std::span<const Byte> before, bool last, Effort effort) {
    z_stream stream{};
    if (deflateInit2(&stream, effort.level, Z_DEFLATED, -15, 9, effort.strategy) != Z_OK)
        throw std::bad_alloc();
    const auto end = [](z_stream* s) { deflateEnd(s); };
    const std::unique_ptr<z_stream, decltype(end)> ends(&stream, end);
    if (!before.empty())
        deflateSetDictionary(&stream, before.data(), static_cast<uInt>(before.size()));
    // Room for what a flush adds as well.
    stripe.packed.resize(deflateBound(&stream, stripe.filtered.size()) + 64);
    stream.next_in = stripe.filtered.data();
    stream.avail_in = static_cast<uInt>(stripe.filtered.size());
    stream.next_out = stripe.packed.data();
    stream.avail_out = static_cast<uInt>(stripe.packed.size());
    deflate(&stream, last ? Z_FINISH : Z_SYNC_FLUSH);
    stripe.packed.resize(stripe.packed.size() - stream.avail_out);
}

/// By the middle one of some stripes.
Effort effort_for(std::vector<Stripe>& stripes) {
    Stripe& middle = stripes[stripes.size() / 2];
    compress(middle, {}, false, kRuns);
    const auto runs = static_cast<double>(middle.packed.size());
    compress(middle, {}, false, kMatches);
    return runs > kWorth * static_cast<double>(middle.packed.size()) ? kMatches : kRuns;
}

}  // namespace

void compress_png(const PngRows& rows,
                  const std::function<void(std::span<const std::byte>)>& take) {
    const auto each =
        std::max<std::int64_t>(1, static_cast<std::int64_t>(kStripe / (rows.stride + 1)));
    uLong sum = adler32(0, nullptr, 0);
    std::vector<Byte> window;  // the end of what was compressed before
    std::vector<Stripe> stripes;
    for (std::int64_t begin = 0; begin < rows.height;) {
        stripes.clear();
        for (; begin < rows.height && stripes.size() < kAtOnce; begin += each)
            stripes.push_back({.begin = begin, .end = std::min(begin + each, rows.height)});
        tbb::parallel_for(std::size_t{0}, stripes.size(),
                          [&](std::size_t i) { filter(rows, stripes[i]); });
        const auto tail = [](const std::vector<Byte>& bytes) {
            const std::size_t kept = std::min(kWindow, bytes.size());
            return std::span(bytes).last(kept);
        };
        const Effort effort = effort_for(stripes);
        tbb::parallel_for(std::size_t{0}, stripes.size(), [&](std::size_t i) {
            const bool last = stripes[i].end == rows.height;
            compress(stripes[i], i > 0 ? tail(stripes[i - 1].filtered) : std::span(window), last,
                     effort);
        });
        for (Stripe& stripe : stripes) {
            sum = adler32_combine(sum, stripe.sum, static_cast<z_off_t>(stripe.filtered.size()));
            if (stripe.begin == 0)  // a window of 32 KiB, no dictionary, a fast level
                stripe.packed.insert(stripe.packed.begin(), {0x78, 0x5e});
            if (stripe.end == rows.height)
                for (int shift = 24; shift >= 0; shift -= 8)
                    stripe.packed.push_back(static_cast<Byte>(sum >> shift & 0xff));
            take(std::as_bytes(std::span(stripe.packed)));
        }
        const auto kept = tail(stripes.back().filtered);
        window.assign(kept.begin(), kept.end());
    }
}

}  // namespace edgewise::store
