#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "reference/answer.hpp"
#include "reference/interval.hpp"
#include "reference/written.hpp"

namespace edgewise {

/// The error of results against the reference, measured.
struct Verified {
    double nrmse = 0;          // labels: root of the share that differs
    double low = 0, high = 0;  // 95 % interval of nrmse; without sampling both are nrmse
    double max = 0;            // largest difference [value]
    double range = 1;          // the difference that counts as 1 [value]
    std::int64_t samples = 0;  // that were compared
    /// `high`, and of modes with a threshold as many jumps as no draw may have met.
    double at_most = 0;
};

/// Samples to measure the errors of many results of one request on: as many as there are, or many.
std::int64_t samples_to_compare(const Request& want) noexcept;

/// Bytes that a Verifier needs at most beside samples and results.
/// @param samples  as it is given
double verifier_bytes(const Request& want, const ReferenceField& field, std::int64_t samples,
                      int threads);

/// Compares the frames of a request with the reference, one by one as they come, as they are
/// written.
///
/// Of the output samples that see the input all are compared, where there are at most kWorthAll
/// times as many as asked for. Else they are drawn in two phases (Cochran, *Sampling Techniques*,
/// 1977, 12.9; Saerndal, Swensson, Wretman 1992, ch. 9), each once:
///  - many more than asked for are looked at: a cheap guess of the reference says how far off the
///    first result may be there. They are spread evenly; what lies around the largest and smallest
///    results is looked at in any case, or a single peak would be missed;
///  - of these as many are compared as were asked for, half of them drawn evenly, half in
///    proportion to how far off they may be.
/// Each counts by the inverse of how likely it was to be drawn (Horvitz, Thompson 1952), so the
/// guess makes the estimate surer, and never wrong.
///
/// What the reference has at the samples is worked out once for many results, but of a large output
/// that is taken whole. The reference range is that of the compared samples joined with the
/// reference at the 32 places where the results are largest and smallest, and where the guess is:
/// few draws alone would miss the bright voxel that sets the range of a MIP. Samples of a warp near
/// a value that is not finite do not count. A result that is not finite where the reference is
/// makes every number infinite.
class Verifier {
 public:
    static constexpr std::int64_t kWorthAll = 4;

    /// @param samples  how many to draw; 0, or as many as there are: all
    /// Request and field must stay alive.
    Verifier(const Request& want, const ReferenceField& field, std::int64_t samples,
             std::uint64_t seed, std::pmr::memory_resource* memory);

    /// Whether nothing is left to chance.
    bool all() const noexcept { return all_; }
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
    /// A sample of the first phase, whose error is estimated.
    struct Looked {
        OutputSample at;
        double weight = 0;        // the share of all that it stands for
        bool is_certain = false;  // it was chosen in any case, and stands for itself
    };
    /// What lies around an extreme of the first result, as delivered there.
    struct Nearby {
        OutputSample of, at;
        std::vector<double> values;
    };
    struct Draw {
        std::size_t looked = 0;
        double weight = 0;   // the share of all that it stands for
        double missing = 0;  // probability that a sample of the first phase was not drawn
    };
    /// Sums over what was compared; weights add up to 1.
    struct Compared {
        std::vector<Part> parts;  // where not all are compared
        double sum = 0;           // of weighted squares
        double left_out = 0;      // weights where there is no reference
        double squares = 0, largest_square = 0, largest_difference = 0;
        double low = std::numeric_limits<double>::infinity(), high = -low;
        std::int64_t samples = 0, differ = 0;
    };

    bool counts(const OutputSample& at) const;
    bool is_drawn() const noexcept { return !draws_.empty(); }
    void look_evenly(std::int64_t samples);
    void weigh_evenly();
    void look_around_extremes();
    void draw();
    void draw_all();
    std::vector<double> guesses() const;
    std::vector<double> roughness(const std::vector<double>& guesses) const;
    void add_extremes_of(const std::vector<double>& guesses);

    void take_looked(int frame, const Data& result);
    void find_extremes(int frame, const Data& result);
    void keep_nearby(int frame, const Data& result);
    void compare_whole(int frame, const Data& result);
    std::vector<double> written_reference(std::span<const OutputSample> samples) const;
    void copy_written(const Data& result, std::int64_t place, double* values) const;
    void compare(const double* delivered, const double* expected, const Draw& draw);
    void take_range(const std::vector<double>& reference);
    Interval interval(double mean) const;
    double share_unseen() const;
    void begin_again();

    const Request& want_;
    Reference reference_;
    std::size_t channels_;  // written
    std::uint64_t seed_;
    std::int64_t wanted_ = 0;
    bool all_ = false, labels_ = false;
    bool remembers_ = true;  // the places and what the reference has there
    double population_ = 0;  // samples that see the input, about
    bool looked_at_all_ = false;
    std::vector<Looked> looked_;     // in order of frames
    std::vector<double> delivered_;  // [looked][channels]
    std::vector<Draw> draws_;
    std::vector<double> reference_of_drawn_;     // [draw][channels]
    std::vector<double> reference_of_extremes_;  // of the guess
    std::vector<Extreme> largest_, smallest_;
    std::vector<Nearby> nearby_;
    Compared compared_;
};

}  // namespace edgewise
