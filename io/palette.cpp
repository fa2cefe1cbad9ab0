#include "io/palette.hpp"

#include <algorithm>
#include <unordered_set>
#include <utility>

namespace edgewise::store {
namespace {

constexpr std::size_t kColours = 256;
constexpr int kBits = 5;  // of a channel, in the histogram

std::uint32_t number_of(const std::uint8_t* rgb) {
    return std::uint32_t{rgb[0]} << 16 | std::uint32_t{rgb[1]} << 8 | rgb[2];
}

/// Pixels of like colour.
struct Bin {
    double count = 0;
    std::array<double, 3> sum{};

    double mean(std::size_t c) const { return sum[c] / count; }
};

struct Box {
    std::vector<Bin> bins;
    double count = 0;
    std::array<double, 3> mean{};
    std::size_t widest = 0;  // channel with the largest sum of squares
    double squares = 0;      // about the mean, of that channel

    explicit Box(std::vector<Bin> of) : bins(std::move(of)) {
        std::array<double, 3> sum{}, square{};
        for (const Bin& bin : bins) {
            count += bin.count;
            for (std::size_t c = 0; c < 3; ++c) {
                sum[c] += bin.sum[c];
                square[c] += bin.sum[c] * bin.mean(c);
            }
        }
        for (std::size_t c = 0; c < 3; ++c) {
            mean[c] = sum[c] / count;
            const double about = square[c] - sum[c] * mean[c];
            if (about > squares) squares = about, widest = c;
        }
        if (bins.size() < 2) squares = 0;
    }
    /// Below the mean, and the rest.
    std::pair<std::vector<Bin>, std::vector<Bin>> halves() const {
        std::pair<std::vector<Bin>, std::vector<Bin>> parts;
        for (const Bin& bin : bins)
            (bin.mean(widest) < mean[widest] ? parts.first : parts.second).push_back(bin);
        return parts;
    }
};

std::vector<Bin> histogram_of(std::span<const std::uint8_t> pixels) {
    std::vector<Bin> all(std::size_t{1} << 3 * kBits);
    for (std::size_t i = 0; i < pixels.size(); i += 3) {
        std::size_t at = 0;
        for (std::size_t c = 0; c < 3; ++c) at = at << kBits | pixels[i + c] >> (8 - kBits);
        ++all[at].count;
        for (std::size_t c = 0; c < 3; ++c) all[at].sum[c] += pixels[i + c];
    }
    std::erase_if(all, [](const Bin& bin) { return bin.count == 0; });
    return all;
}

}  // namespace

Palette palette_of(std::span<const std::uint8_t> pixels) {
    Palette palette;
    std::unordered_set<std::uint32_t> seen;
    for (std::size_t i = 0; i < pixels.size() && seen.size() <= kColours; i += 3)
        if (seen.insert(number_of(&pixels[i])).second)
            palette.colours.push_back({pixels[i], pixels[i + 1], pixels[i + 2]});
    if (seen.size() <= kColours) return palette;

    palette.exact = false;
    palette.colours.resize(1);
    std::vector<Box> boxes{Box(histogram_of(pixels))};
    while (boxes.size() + 1 < kColours) {
        const auto worst =
            std::max_element(boxes.begin(), boxes.end(),
                             [](const Box& a, const Box& b) { return a.squares < b.squares; });
        auto [low, high] = worst->halves();
        if (worst->squares <= 0 || low.empty() || high.empty()) break;
        *worst = Box(std::move(low));
        boxes.emplace_back(std::move(high));
    }
    for (const Box& box : boxes) {
        Rgb colour;
        for (std::size_t c = 0; c < 3; ++c)
            colour[c] = static_cast<std::uint8_t>(box.mean[c] + 0.5);
        palette.colours.push_back(colour);
    }
    return palette;
}

Indexed::Indexed(const Palette& palette, std::size_t width) : palette_(palette) {
    for (std::size_t i = 0; i < palette.colours.size(); ++i)
        sorted_.emplace_back(number_of(palette.colours[i].data()), static_cast<std::uint8_t>(i));
    std::sort(sorted_.begin(), sorted_.end());
    if (palette.exact) return;
    near_.assign(std::size_t{1} << 18, -1);
    error_.assign(width + 2, {});
    below_.assign(width + 2, {});
}

std::uint8_t Indexed::nearest(const std::array<int, 3>& colour) {
    std::size_t cell = 0;
    for (const int part : colour) cell = cell << 6 | static_cast<std::size_t>(part) >> 2;
    if (near_[cell] >= 0) return static_cast<std::uint8_t>(near_[cell]);
    int least = 1 << 30;
    for (std::size_t i = 0; i < palette_.colours.size(); ++i) {
        int distance = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const int off = (colour[c] & ~3) + 2 - palette_.colours[i][c];
            distance += off * off;
        }
        if (distance < least) least = distance, near_[cell] = static_cast<std::int16_t>(i);
    }
    return static_cast<std::uint8_t>(near_[cell]);
}

void Indexed::row(std::span<const std::uint8_t> pixels, std::span<std::uint8_t> places) {
    for (std::size_t x = 0; x < places.size(); ++x) {
        const std::uint8_t* pixel = &pixels[3 * x];
        const auto found = std::lower_bound(sorted_.begin(), sorted_.end(),
                                            std::pair(number_of(pixel), std::uint8_t{0}));
        if (found != sorted_.end() && found->first == number_of(pixel)) {
            places[x] = found->second;
            continue;
        }
        std::array<int, 3> wanted;
        for (std::size_t c = 0; c < 3; ++c)
            wanted[c] = std::clamp(pixel[c] + error_[x + 1][c] / 16, 0, 255);
        places[x] = nearest(wanted);
        for (std::size_t c = 0; c < 3; ++c) {
            const int off = wanted[c] - palette_.colours[places[x]][c];
            error_[x + 2][c] += 7 * off;
            below_[x][c] += 3 * off;
            below_[x + 1][c] += 5 * off;
            below_[x + 2][c] += off;
        }
    }
    std::swap(error_, below_);
    std::fill(below_.begin(), below_.end(), std::array<int, 3>{});
}

}  // namespace edgewise::store
