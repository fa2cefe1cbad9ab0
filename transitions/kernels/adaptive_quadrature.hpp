#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <vector>

#include "transitions/kernels/optics.hpp"
#include "transitions/kernels/ray_cast.hpp"

namespace edgewise::kernels {

/// A transfer function by its pieces between knots, of stored numbers.
class TransferPieces {
 public:
    /// The function on a piece: linear in what a value has above `from`.
    struct Piece {
        double from = 0;
        double opacity = 0, slope = 0;
        std::array<double, 3> color{}, color_slope{};
        double steepest_color = 0;  // the largest |color_slope|
        bool wall = false;          // opaque throughout

        double transparency(double value) const noexcept {
            return 1 - opacity - slope * (value - from);
        }
    };
    /// What values of a range have at least and at most.
    struct Span {
        double thin = 0, dense = 0;  // optical depth per t; infinite where opaque
        std::array<double, 3> low{}, high{};
    };

    explicit TransferPieces(const Optics& optics);

    const std::vector<double>& knots() const noexcept { return knots_; }
    /// Between knot k - 1 and knot k; the first and the last are constant.
    const Piece& piece(std::size_t k) const noexcept { return pieces_[k]; }
    /// The first knot not below a value: the piece that the value is in. At a jump that is the one
    /// before it, as in all casts.
    std::size_t piece_at(double value) const noexcept;
    Span span(double low, double high) const noexcept;
    /// Of a transparency of a unit of length. So that ramps may end in what is opaque, nothing else
    /// is thinner than kThinnest.
    double depth(double transparency) const noexcept;
    double unit() const noexcept { return unit_; }

    static constexpr double kThinnest = 0x1p-24;

 private:
    std::vector<double> knots_;  // ascending
    std::vector<Piece> pieces_;  // one more
    double unit_;
};

/// The least and the largest sample of nodes of 4^3, 16^3 and 64^3 cells. A cell lies between eight
/// samples; those before the first and behind the last samples belong to the outermost nodes.
struct ValueRanges {
    static constexpr int kLevels = 3, kShift = 2;
    struct Range {
        float low = 0, high = 0;  // of the finite values
        bool whole = true;        // all is

        bool known() const noexcept { return whole && low <= high; }
        bool nothing() const noexcept { return low > high; }
    };
    std::array<Extent, kLevels> extent;
    std::array<std::pmr::vector<Range>, kLevels> nodes;

    ValueRanges(const Extent& volume, std::pmr::memory_resource* memory);

    const Range& at(int level, std::int64_t i, std::int64_t j, std::int64_t k) const noexcept {
        const auto l = static_cast<std::size_t>(level);
        return nodes[l][static_cast<std::size_t>((k * extent[l].y + j) * extent[l].x + i)];
    }
};

/// Nodes of 4^3 cells of a layer. Layers may be made in parallel.
void range_layer(const Grid& volume, std::int64_t layer, ValueRanges& ranges);
/// Larger nodes, when all layers are made.
void join_ranges(ValueRanges& ranges);

/// What rays by adaptive quadrature took; of one thread.
struct QuadratureTaken {
    std::int64_t samples = 0;    // places where the transfer function was taken
    std::int64_t cells = 0;      // whose eight samples were read
    std::int64_t stretches = 0;  // taken by the range of their samples alone
    std::int64_t least = 0;      // pieces taken because they were short, whatever their bound
};

/// Composites of the trilinear field, by pieces of rays whose errors have a bound. See
/// project.adaptive_quadrature for what is bounded.
struct AdaptiveQuadrature {
    /// Hold::foh, Combine::over, step 1; without light, edges, cue, table. `optics`, `bound`,
    /// `bricks` and `taken` are not used.
    const RayCast& cast;
    const TransferPieces& transfer;
    const ValueRanges& ranges;
    double tolerance = 0;  // of each channel
    double least = 0;      // pieces that are no longer are not halved [t]
    QuadratureTaken* taken = nullptr;
};

/// As ray_cast().
void adaptive_quadrature(const AdaptiveQuadrature& by, std::int64_t x, std::int64_t y,
                         std::int64_t width, std::int64_t height, float* out,
                         std::ptrdiff_t row_floats);

}  // namespace edgewise::kernels
