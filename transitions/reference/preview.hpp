#pragma once

#include <cmath>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "transitions/reference/answer.hpp"
#include "transitions/reference/statistics.hpp"

namespace edgewise {

/// Errors measured on a few output samples (graph/scene.hpp lists the facts), and the reference's
/// range over these and over a few chosen because they are likely to be its ends.
struct Preview {
    std::map<std::string, double> facts, likely;
    std::int64_t draws = 0;    // clusters
    bool exhausted = false;    // no more is drawn, whatever is asked for
    double low = 0, high = 0;  // of the reference; low > high: no output sample sees the input
};

/// RMS errors are upper estimates: a plan whose measured error exceeds its prediction is a broken
/// promise. Samples lie in clusters; the mean square is raised by 3 standard errors between
/// clusters, which one-sided holds in 999 of 1000 cases where tails are light, and in most where
/// they are heavy.
class ErrorTally {
 public:
    static constexpr double kStandardErrors = 3;

    void add(double square, double weight) noexcept {
        sum_ += square;
        weight_ += weight;
    }
    /// The next cluster begins.
    void close();
    double rms() const;
    double mean() const;   // square
    double error() const;  // standard error of the mean square

 private:
    double sum_ = 0, weight_ = 0;
    std::vector<double> sums_, weights_;
};

/// A part of a population, and what was drawn of it.
struct Stratum {
    double share = 1;  // of the population
    const ErrorTally& tally;
    bool whole = false;  // the tally holds all of it, so nothing is left to chance
};
/// RMS error of a population.
struct ErrorEstimate {
    double likely = 0;  // what was drawn, each stratum by its share
    double upper = 0;   // the same raised by standard errors
};
ErrorEstimate estimate_of(std::span<const Stratum> strata);

/// Of warps: points.
/// @param times  so many times the usual draws, within what there is
Preview preview_points(const Request& want, const ReferenceField& field,
                       const Statistics& statistics, std::pmr::memory_resource* memory,
                       int times = 1);

/// Of pictures: rays.
Preview preview_rays(const Request& want, const ReferenceField& field, const Statistics& statistics,
                     std::pmr::memory_resource* memory, int times = 1);

}  // namespace edgewise
