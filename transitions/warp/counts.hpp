#pragma once

namespace edgewise {

// What the thesis counts for a sample of a warp on the MCCM ([W93] 3.5 and 3.6, TABLE 5 and 6).
// Filters by their order: 0 nearest, 1 linear, 2 quadratic, 3 cubic. Where the thesis contradicts
// itself these are the counts that its formulas give: 64 points, not 256, for third order in 3D.

/// Multiplications, additions and roundings of equal cost.
struct Operations {
    double multiplications = 0, additions = 0, roundings = 0;

    double sum() const noexcept { return multiplications + additions + roundings; }
    friend Operations operator+(const Operations& a, const Operations& b) noexcept {
        return {a.multiplications + b.multiplications, a.additions + b.additions,
                a.roundings + b.roundings};
    }
    friend Operations operator*(double n, const Operations& a) noexcept {
        return {n * a.multiplications, n * a.additions, n * a.roundings};
    }
};

/// One linear interpolation between two values (EQ 14): I + u' (J - I).
inline constexpr Operations kInterpolation{1, 2, 0};

/// Samples that a filter reads (EQ 21): (order + 1)^axes.
double points(int order, int axes) noexcept;
/// Steps of one sample's interpolations where `processors` share them (EQ 67).
double interpolation_steps(int order, int axes, int processors) noexcept;
/// 1D interpolations of a sample (EQ 16): the steps of one processor.
double interpolations(int order, int axes) noexcept;
/// How many times faster, and how well used, that many processors are (EQ 68, EQ 69).
double interpolation_speedup(int order, int axes, int processors) noexcept;
double interpolation_efficiency(int order, int axes, int processors) noexcept;

/// Counts of one sample; accesses in samples.
struct WarpCounts {
    Operations rule = {};     // M of the thesis: where a sample is sent
    Operations inverse = {};  // T^-1, and a rounding an axis
    Operations filter = {};   // of one channel
    double local = 0;         // L: reads at the rank itself or beside it, of one channel
    double global = 0;        // G, one to one
    double congested = 0;     // G that may meet: N G

    /// As TABLE 6 prints it: a local read is an operation.
    double printed() const noexcept { return (rule + inverse + filter).sum() + local; }
};

/// Permutation warp (EQ 22): rule of 3 shears (2D) or 5 (3D, two axes of freedom).
WarpCounts forward_counts(int order, int axes) noexcept;
/// Backward warp (FIGURE 26, 27): reads every point from where it is.
WarpCounts backward_counts(int order, int axes) noexcept;
/// One pass of shears by linear interpolation: 8 operations, of which one is a local read.
WarpCounts multipass_counts(int passes) noexcept;

}  // namespace edgewise
