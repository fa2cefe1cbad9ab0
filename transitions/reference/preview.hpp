#pragma once

#include <map>
#include <string>
#include <vector>

#include "transitions/reference/answer.hpp"
#include "transitions/reference/statistics.hpp"

namespace edgewise {

/// Errors measured on a few output samples (graph/scene.hpp lists the facts), and the reference's
/// range over these and over a few chosen because they are likely to be its ends.
struct Preview {
    std::map<std::string, double> facts;
    double low = 0, high = 0;  // of the reference; low > high: no output sample sees the input
};

/// RMS errors are upper estimates: a plan whose measured error exceeds its prediction is a broken
/// promise. Samples lie in clusters; the mean square is raised by 2 standard errors between
/// clusters, which one-sided holds in 97 of 100 cases where tails are not too heavy.
class ErrorTally {
 public:
    void add(double square, double weight) noexcept {
        sum_ += square;
        weight_ += weight;
    }
    /// The next cluster begins.
    void close();
    double rms() const;
    double upper() const;

 private:
    double sum_ = 0, weight_ = 0;
    std::vector<double> sums_, weights_;
};

/// Of warps: points.
Preview preview_points(const Request& want, const ReferenceField& field,
                       const Statistics& statistics, std::pmr::memory_resource* memory);
/// Of pictures: rays.
Preview preview_rays(const Request& want, const ReferenceField& field,
                     const Statistics& statistics, std::pmr::memory_resource* memory);

}  // namespace edgewise
