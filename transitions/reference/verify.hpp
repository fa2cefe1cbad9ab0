#pragma once

#include <cstdint>
#include <vector>

#include "transitions/reference/answer.hpp"

namespace edgewise {

/// The error of results against the reference, measured.
struct Verified {
    double nrmse = 0;          // labels: root of the share that differs
    double low = 0, high = 0;  // 95 % interval of nrmse; without sampling both are nrmse
    double max = 0;            // largest difference [value]
    double range = 1;          // the difference that counts as 1 [value]
    std::int64_t samples = 0;  // that were compared
};

/// The range that errors are divided by: of a constant its magnitude, or 1.
double range_between(double low, double high) noexcept;

/// Samples to measure the errors of many results of one request on: as many as there are, or many.
/// Squares of errors have heavy tails: 2048 leave 95 % intervals of 7 % (X-rays of a CT) to 50 %
/// (MIPs of a cube) on either side.
std::int64_t samples_to_compare(const Request& want) noexcept;

/// Bytes that a Verifier needs at most beside samples and results.
/// @param samples  as it is given
double verifier_bytes(const Request& want, const ReferenceField& field, std::int64_t samples,
                      int threads);

/// Compares the frames of a request with the reference, one by one as they come.
///
/// Draws output samples at random over all frames, of those that see the input (with replacement),
/// or takes them all. What the reference has there is worked out once for many results, but of a
/// large output that is taken whole. The reference range is that of the drawn samples joined with
/// the reference at the 32 places where the results are largest and smallest: few draws alone would
/// miss the bright voxel that sets the range of a MIP. Samples of a warp near a value that is not
/// finite do not count. A result that is not finite where the reference is makes every number
/// infinite.
class Verifier {
 public:
    /// @param samples  how many to draw; 0, or as many as there are: all
    /// Request and field must stay alive.
    Verifier(const Request& want, const ReferenceField& field, std::int64_t samples,
             std::uint64_t seed, std::pmr::memory_resource* memory);

    /// Takes one frame's result, of any type. Once a frame, in any order, not at once.
    /// @throws std::invalid_argument where extent or channels are not the request's
    void frame(int frame, const Data& result);
    /// After the last frame. What follows is the first frame of other results of the same request:
    /// the reference of the drawn samples is worked out once.
    Verified finish();

 private:
    struct Extreme {
        float value;
        OutputSample at;
    };

    void draw(std::int64_t samples);
    void draw_all();
    void find_extremes(int frame, const Data& result);
    void compare_all(int frame, const Data& result);
    void compare(std::span<const OutputSample> samples, std::span<const float> delivered,
                 const std::vector<double>& reference);
    void begin_again();
    void take(const std::vector<double>& reference);

    const Request& want_;
    Reference reference_;
    std::uint64_t seed_;
    bool all_ = false, labels_ = false;
    bool remembers_ = true;            // the places and what the reference has there
    std::vector<OutputSample> drawn_;  // in order of frames
    std::vector<float> delivered_;     // [drawn][channels]
    std::vector<double> reference_of_drawn_;
    std::vector<Extreme> largest_, smallest_;
    std::vector<double> squares_;  // one a compared sample, unless all
    double sum_ = 0, largest_difference_ = 0, low_, high_;
    std::int64_t compared_ = 0;
};

}  // namespace edgewise
