#include "transitions/project/shear_border.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace edgewise {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
/// A ray in a face of the volume must not be lost to the rounding of its place, as in the kernels.
constexpr double kSlip = 1e-9;

/// Chords so short may be nothing but the rounding of spans, which are f32 [slice].
double least_chord(const kernels::ShearWarp& warp) {
    return 1e-6 * static_cast<double>(warp.volume.extent.z + 1);
}

/// One axis across the slices: pixel p of the image sees slice k at p + shift + k slope.
struct Across {
    double shift, slope, inverse;  // inverse: 1 / slope; 0: the ray runs along the faces
    double last;                   // sample

    Across(double at_slice_0, double shear, std::int64_t samples)
        : shift(at_slice_0),
          slope(shear),
          inverse(shear == 0 ? 0 : 1 / shear),
          last(static_cast<double>(samples - 1)) {}
};

/// Where rays enter and leave the slab between two faces, for the axes of a slice and for slices.
struct Spans {
    std::array<double, 3> low, high;

    std::size_t enters() const {
        return static_cast<std::size_t>(std::max_element(low.begin(), low.end()) - low.begin());
    }
    std::size_t leaves() const {
        return static_cast<std::size_t>(std::min_element(high.begin(), high.end()) - high.begin());
    }
};

struct Columns {
    std::int64_t begin = 0, end = 0;

    bool holds(std::int64_t i) const { return i >= begin && i < end; }
    bool empty() const { return begin >= end; }
};

/// Rows of a picture, each cut into pieces.
///
/// A piece is a convex part of the plane: of rays that miss for one and the same reason, or of
/// places whose four neighbours need no correction for one and the same reason. If both ends of a
/// stretch of a row are in one piece, so is all between them.
class BorderMender {
 public:
    BorderMender(const ShearedImage& image, Read read)
        : image_(image),
          read_(read),
          across_{Across(image.warp.x, image.warp.dx, image.warp.volume.extent.x),
                  Across(image.warp.y, image.warp.dy, image.warp.volume.extent.y)},
          reach_{std::abs(across_[0].inverse), std::abs(across_[1].inverse), 0},
          least_(least_chord(image.warp)) {}

    /// Mends a part of the stretch [from, to), of which `first` is the first pixel.
    void mend_row(std::int64_t y, std::int64_t from, std::int64_t to, const Columns& part,
                  float* first) {
        y_ = static_cast<double>(y);
        part_ = part;
        first_ = first;
        const int begin = mend(from), end = to - from > 1 ? mend(to - 1) : begin;
        between(from, begin, to - 1, end);
    }

 private:
    using Place = std::array<double, 2>;
    static constexpr int kUneven = -1, kMisses = 16;  // pieces; from kMisses on rays miss

    Place place(std::int64_t x) const {
        const auto at = [&](const double* m) {
            return m[0] * static_cast<double>(x) + m[1] * y_ + m[3];
        };
        return {at(image_.to_image.data()), at(image_.to_image.data() + 4)};
    }
    float* pixel(std::int64_t x) const { return first_ + (x - part_.begin) * image_.channels; }
    void miss(std::int64_t from, std::int64_t to) const {
        from = std::clamp(from, part_.begin, part_.end);
        std::fill(pixel(from), pixel(std::clamp(to, from, part_.end)), image_.outside);
    }

    void between(std::int64_t from, int begin, std::int64_t to, int end) {
        if (to - from < 2 || to <= part_.begin || from + 1 >= part_.end) return;
        if (begin == end && begin != kUneven) {
            if (begin >= kMisses) miss(from + 1, to);
            return;
        }
        const std::int64_t middle = from + (to - from) / 2;
        const int piece = mend(middle);
        between(from, begin, middle, piece);
        between(middle, piece, to, end);
    }

    int mend(std::int64_t x) {
        const Place p = place(x);
        const int piece = this->piece(p);
        if (piece >= kMisses) miss(x, x + 1);
        if (piece == kUneven && part_.holds(x)) correct(p, pixel(x));
        return piece;
    }

    /// @return 0, or the piece of rays that miss beside an axis which they run along
    int spans_at(const Place& p, Spans& spans, bool& beside) const {
        spans.low[2] = -0.5;
        spans.high[2] = static_cast<double>(image_.warp.volume.extent.z) - 0.5;
        beside = false;
        for (int a = 0; a < 2; ++a) {
            const Across& axis = across_[a];
            const double at = p[a] + axis.shift, low = -0.5 - kSlip, high = axis.last + 0.5 + kSlip;
            if (axis.slope == 0) {
                if (at < low || at > high) return kMisses + 2 * a + (at < low ? 0 : 1);
                beside = beside || at < 0 || at > axis.last;
                spans.low[a] = -kInfinite, spans.high[a] = kInfinite;
                continue;
            }
            const double one = (low - at) * axis.inverse, other = (high - at) * axis.inverse;
            spans.low[a] = std::min(one, other), spans.high[a] = std::max(one, other);
        }
        return 0;
    }

    int piece(const Place& p) const {
        constexpr int kMissesAlong = kMisses + 4;
        Spans spans;
        bool beside;
        if (const int misses = spans_at(p, spans, beside)) return misses;
        const std::size_t in = spans.enters(), out = spans.leaves();
        const int faces = static_cast<int>(3 * in + out);
        if (spans.high[out] <= spans.low[in]) return kMissesAlong + faces;
        if (read_ == Read::continued) return 0;
        if (beside) return kUneven;
        const bool sums = image_.mode->lengthen != nullptr;
        if (sums && read_ == Read::bilinear) return linear(spans, in, out) ? faces : kUneven;
        return covered(spans) ? 0 : kUneven;
    }

    /// Whether the rays of all four neighbours meet the volume. They lie less than a pixel away
    /// along either axis, by which an end moves by `reach`.
    bool covered(const Spans& spans) const {
        for (std::size_t in = 0; in < 3; ++in)
            for (std::size_t out = 0; out < 3; ++out) {
                const double moves = in == out ? 0 : reach_[in] + reach_[out];
                if (!(spans.high[out] - spans.low[in] >= moves + least_)) return false;
            }
        return true;
    }

    /// Whether the rays of all four neighbours enter and leave by the same faces.
    bool linear(const Spans& spans, std::size_t in, std::size_t out) const {
        for (std::size_t a = 0; a < 3; ++a) {
            if (a != in && !(spans.low[in] - spans.low[a] >= reach_[a] + reach_[in])) return false;
            if (a != out && !(spans.high[a] - spans.high[out] >= reach_[a] + reach_[out]))
                return false;
        }
        const double moves = in == out ? 0 : reach_[in] + reach_[out];
        return spans.high[out] - spans.low[in] >= moves + least_;
    }

    /// A pixel of the image beside a place, and what a bilinear picture makes of it.
    struct Corner {
        std::int64_t column, line;
        double weight;
    };
    /// The four around a place, the nearest first.
    static std::array<Corner, 4> corners(const Place& p) {
        const double i = std::floor(p[0]), j = std::floor(p[1]);
        const std::array<double, 2> f = {p[0] - i, p[1] - j};
        std::array<Corner, 4> all;
        for (int k = 0; k < 4; ++k) {
            const int right = (k & 1) ^ (f[0] < 0.5 ? 0 : 1),
                      below = (k >> 1) ^ (f[1] < 0.5 ? 0 : 1);
            all[static_cast<std::size_t>(k)] = {
                static_cast<std::int64_t>(i) + right, static_cast<std::int64_t>(j) + below,
                (right ? f[0] : 1 - f[0]) * (below ? f[1] : 1 - f[1])};
        }
        if (all[1].weight < all[2].weight) std::swap(all[1], all[2]);
        return all;
    }

    /// How long the ray of a pixel of the image is inside the volume [slice]; 0: it has no value.
    double length_of(const Corner& corner) const {
        if (corner.weight == 0 || corner.column < 0 || corner.line < 0 ||
            corner.column >= image_.extent.x || corner.line >= image_.extent.y)
            return 0;
        float low, high;
        kernels::shear_spans(image_.warp, corner.column, corner.line, 1, 1, &low, &high, 1);
        const double length = static_cast<double>(high) - static_cast<double>(low);
        return length > least_ ? length : 0;
    }

    double chord_of(const Place& p) const {
        Spans spans;
        bool beside;
        spans_at(p, spans, beside);
        return spans.high[spans.leaves()] - spans.low[spans.enters()];
    }

    /// One pixel of rays that meet the volume, from those of its neighbours that do.
    void correct(const Place& p, float* out) const {
        double weight = 0, length = 0;
        std::array<double, 4> sum{};
        bool nearest_of_all = true;
        for (const Corner& corner : corners(p)) {
            const double inside = length_of(corner);
            if (inside > 0) {
                weight += corner.weight;
                length += corner.weight * inside;
                const float* value = image_.at(corner.column, corner.line);
                for (int c = 0; c < image_.channels; ++c)
                    sum[c] += corner.weight * static_cast<double>(value[c]);
                if (read_ == Read::nearest) break;
            }
            nearest_of_all = false;
        }
        if (weight == 0) return;
        // The nearest pixel of all is read as it is.
        const bool as_it_is = read_ == Read::nearest && nearest_of_all;
        finish(sum, weight, as_it_is ? 1 : chord_of(p) * weight / length, out);
    }

    /// @param share  the length of the ray, of that which its neighbours have on the average
    void finish(std::array<double, 4> sum, double weight, double share, float* out) const {
        for (double& value : sum) value /= weight;
        if (image_.mode->lengthen) image_.mode->lengthen(share, sum);
        for (int c = 0; c < image_.channels; ++c) out[c] = static_cast<float>(sum[c]);
    }

    const ShearedImage& image_;
    Read read_;
    std::array<Across, 2> across_;
    std::array<double, 3> reach_;
    double least_;
    double y_ = 0;
    Columns part_;
    float* first_ = nullptr;
};

using Rows = std::pmr::vector<Columns>;

/// The pixels of each row whose rays meet the volume.
Rows covered_rows(const ShearedImage& image, std::pmr::memory_resource* memory) {
    const kernels::ShearWarp& warp = image.warp;
    const Extent& n = warp.volume.extent;
    const double least = least_chord(warp);
    Rows rows(static_cast<std::size_t>(image.extent.y), memory);
    for (std::int64_t j = 0; j < image.extent.y; ++j) {
        double low = -0.5, high = static_cast<double>(n.z) - 0.5;
        const double at = static_cast<double>(j) + warp.y, last = static_cast<double>(n.y) - 0.5;
        if (warp.dy == 0) {
            if (at < -0.5 || at > last) continue;
        } else {
            const double one = (-0.5 - at) / warp.dy, other = (last - at) / warp.dy;
            low = std::max(low, std::min(one, other)), high = std::min(high, std::max(one, other));
        }
        low += least, high -= least;
        if (!(low < high)) continue;
        const double near = low * warp.dx, far = high * warp.dx;
        const double left = -0.5 - warp.x - std::max(near, far);
        const double right = static_cast<double>(n.x) - 0.5 - warp.x - std::min(near, far);
        const auto begin = static_cast<std::int64_t>(std::ceil(left));
        const auto end = static_cast<std::int64_t>(std::floor(right)) + 1;
        rows[static_cast<std::size_t>(j)] = {std::max<std::int64_t>(begin, 0),
                                             std::min(end, image.extent.x)};
    }
    return rows;
}

/// The mean of the neighbours that are known: those beside, above and below before those across.
void average_neighbours(const ShearedImage& image, const Rows& known, std::int64_t i,
                        std::int64_t j) {
    for (const bool diagonal : {false, true}) {
        int count = 0;
        std::array<float, 4> sum{};
        for (std::int64_t y = std::max<std::int64_t>(j - 1, 0);
             y <= std::min(j + 1, image.extent.y - 1); ++y)
            for (std::int64_t x = i - 1; x <= i + 1; ++x) {
                const bool across = x != i && y != j;
                if (across != diagonal || !known[static_cast<std::size_t>(y)].holds(x)) continue;
                for (int c = 0; c < image.channels; ++c) sum[c] += image.at(x, y)[c];
                ++count;
            }
        if (count == 0) continue;
        for (int c = 0; c < image.channels; ++c)
            image.at(i, j)[c] = sum[c] / static_cast<float>(count);
        return;
    }
}

/// Adds the pixels around those that are known.
void grow(const ShearedImage& image, Rows& known, std::pmr::memory_resource* memory) {
    Rows grown(known.size(), memory);
    for (std::size_t j = 0; j < known.size(); ++j) {
        Columns& row = grown[j];
        row = {image.extent.x, 0};
        for (std::size_t y = j > 0 ? j - 1 : 0; y < std::min(j + 2, known.size()); ++y) {
            if (known[y].empty()) continue;
            row.begin = std::min(row.begin, std::max<std::int64_t>(known[y].begin - 1, 0));
            row.end = std::max(row.end, std::min(known[y].end + 1, image.extent.x));
        }
        for (std::int64_t i = row.begin; i < row.end; ++i) {
            if (known[j].holds(i)) i = known[j].end;
            if (i < row.end) average_neighbours(image, known, i, static_cast<std::int64_t>(j));
        }
    }
    known = std::move(grown);
}

}  // namespace

void continue_image(const ShearedImage& image, std::pmr::memory_resource* memory) {
    Rows known = covered_rows(image, memory);
    // What lies farther out weighs less than a hundredth in a spline; there rows will do.
    constexpr int kRings = 3;
    for (int ring = 0; ring < kRings; ++ring) grow(image, known, memory);
    const std::int64_t row = image.extent.x * image.channels;
    const auto copy_row = [&](std::int64_t from, std::int64_t to) {
        std::copy_n(image.at(0, from), row, image.at(0, to));
    };
    const auto first = std::find_if(known.begin(), known.end(),
                                    [](const Columns& columns) { return !columns.empty(); });
    if (first == known.end()) return;
    const std::int64_t top = first - known.begin();
    for (std::int64_t j = top; j < image.extent.y; ++j) {
        const Columns& columns = known[static_cast<std::size_t>(j)];
        if (columns.empty()) {
            copy_row(j - 1, j);
            continue;
        }
        for (std::int64_t i = columns.begin - 1; i >= 0; --i)
            std::copy_n(image.at(i + 1, j), image.channels, image.at(i, j));
        for (std::int64_t i = columns.end; i < image.extent.x; ++i)
            std::copy_n(image.at(i - 1, j), image.channels, image.at(i, j));
    }
    for (std::int64_t j = 0; j < top; ++j) copy_row(top, j);
}

void mend_border(const ShearedImage& image, Read read, const kernels::WarpOutput& picture,
                 const Region& part, const Region& tile) {
    const Extent held = picture.held.extent();
    BorderMender border(image, read);
    for (std::int64_t y = part.begin[1]; y < part.end[1]; ++y) {
        float* first = picture.samples + ((y - picture.held.begin[1]) * held.x + part.begin[0] -
                                          picture.held.begin[0]) *
                                             image.channels;
        border.mend_row(y, tile.begin[0], tile.end[0], {part.begin[0], part.end[0]}, first);
    }
}

}  // namespace edgewise
