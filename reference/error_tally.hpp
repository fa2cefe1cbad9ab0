#pragma once

#include <span>
#include <vector>

namespace edgewise {

/// What is known of a cheap guess of a unit's square, over many more units than are measured.
struct Auxiliary {
    double mean = 0, variance = 0;  // variance: of that mean; 0 where every unit was looked at

    /// @param of  evenly drawn units, of a population of so many
    static Auxiliary over(std::span<const double> of, double population);
};

/// Mean square of a population, and the variance of this estimate.
struct MeanSquare {
    double mean = 0, variance = 0;
};

/// RMS errors are upper estimates: a plan whose measured error exceeds its prediction is a broken
/// promise. Samples lie in clusters; the mean square is raised by 3 standard errors between
/// clusters, which one-sided holds in 999 of 1000 cases where tails are light, and in most where
/// they are heavy.
///
/// Squares of errors have heavy tails, and so a hundred clusters alone leave a standard error of a
/// fifth. Where each has an auxiliary that was looked at in some thousands of units, only what its
/// regression leaves is left to the clusters (double sampling: Cochran, *Sampling Techniques*,
/// 1977, 12.6). Clusters' leverage on the slope counts against them (HC3: MacKinnon, White 1985),
/// or those that carry it would seem to have no error.
class ErrorTally {
 public:
    static constexpr double kStandardErrors = 3;

    void add(double square, double weight, double auxiliary = 0) noexcept {
        open_.square += square * weight;
        open_.auxiliary += auxiliary * weight;
        open_.weight += weight;
    }
    /// The next cluster begins. What was sure to be drawn leaves nothing to chance (Horvitz,
    /// Thompson 1952). @param chance  that this one was drawn of its population
    void close(double chance = 0);
    /// The clusters of another, behind its own.
    void append(const ErrorTally& other);
    /// Of the clusters alone.
    MeanSquare plain() const;
    /// With the auxiliary where the estimate's variance is less so.
    MeanSquare regressed(const Auxiliary& auxiliary) const;

 private:
    struct Cluster {
        double square = 0, auxiliary = 0, weight = 0;  // weighted sums
        double missing = 1;                            // how likely it was not drawn
    };
    Cluster sum() const;
    Cluster open_;
    std::vector<Cluster> clusters_;
};

/// A part of a population, and what was drawn of it.
struct Stratum {
    double share = 1;  // of the population
    const ErrorTally& tally;
    bool whole = false;  // the tally holds all of it, so nothing is left to chance
    Auxiliary auxiliary{};
};
/// RMS error of a population.
struct ErrorEstimate {
    double likely = 0;  // what was drawn, each stratum by its share
    double upper = 0;   // the same raised by standard errors
};
/// @param more  variance of the mean square, beside that of the draws
ErrorEstimate estimate_of(std::span<const Stratum> strata, double more = 0);

}  // namespace edgewise
