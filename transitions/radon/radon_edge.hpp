#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "graph/radon.hpp"
#include "graph/transition.hpp"
#include "transitions/kernels/pmr_block.hpp"

namespace edgewise {

/// One slice of the samples as f32, with a frame of zeros one sample wide: there the field ends.
class RadonPlane {
 public:
    RadonPlane(const Data& in, std::int64_t slice, std::pmr::memory_resource* memory);

    /// Sample (0, 0); rows and columns -1 and n may be read.
    const float* samples() const noexcept { return samples_; }
    const float* row(std::int64_t y) const noexcept { return samples_ + y * step_; }
    std::int64_t row_step() const noexcept { return step_; }
    /// No sample is NaN or infinite.
    bool finite() const noexcept { return finite_; }

    static double bytes(const Extent& input) noexcept;

 private:
    std::int64_t step_;
    kernels::Block<float> block_;
    const float* samples_;
    bool finite_ = true;
};

/// A weight below this comes from rounding: no line is spoilt by a sample that it only touches.
constexpr double kTouched = 1e-9;

/// What an algorithm is asked about.
struct RadonAsk {
    const RadonSetting& setting;
    RadonLines lines;
    const Scene& scene;
    const Parameters& with;

    /// The largest magnitude of a value.
    double magnitude() const noexcept;
    /// What rounding results to f32 adds to the mean along the diagonal: as the results are, where
    /// they were drawn, else a bound.
    double rounding() const noexcept;
    /// Samples of all slices, for each angle.
    double visits() const noexcept;
};

/// One slice to work off.
struct RadonRun {
    const RadonSetting& setting;
    const RadonLines& lines;
    const RadonPlane& plane;
    float* out;  // [angle, offset]
    const Parameters& with;
    Context& context;

    float* row(int k) const noexcept { return out + k * lines.offsets; }
};

/// Work for each angle, in parallel; by one thread each, so that bytes do not depend on their
/// number.
void for_each_angle(const RadonRun& run, const std::function<void(int k)>& body);

/// How a slice is worked out. An edge is made of it by radon_edge().
struct RadonAlgorithm {
    std::string name = {};    // "radon.backward"
    std::string source = {};  // where algorithm and counts come from
    RadonSetting::To to = RadonSetting::To::sinogram;
    std::string not_the_other = {};  // why it does not make what `to` is not, if that needs a word
    std::map<std::string, Domain> parameters = {};
    /// Why it cannot serve, or "". Absent: it can.
    std::function<std::string(const RadonAsk&)> refused = {};
    /// Operations, scratch, and workspace beside the plane; radon_edge() knows the rest.
    std::function<Work(const RadonAsk&)> work = {};
    /// Of the mean along a line as long as the diagonal [value].
    std::function<Error(const RadonAsk&)> error = {};
    std::function<void(const Data& input, const RadonSetting&,
                       std::map<std::string, double>& facts)>
        count = {};
    std::function<void(const RadonRun&)> run = {};
    std::function<std::vector<Trial>()> trials = {};  // see Transition
    std::map<std::string, double> factors = {};       // likewise
};

/// An edge of the radon job.
///
/// Edge    object/scalar -> hough/scalar
/// Shape   [angles, offsets] f32, of volumes one a slice; see RadonLines
/// Needs   samples as they were read, of one channel, in memory, row by row
/// Error   counted as that of the mean along a line as long as the field's diagonal: an NRMSE of
///         1 is the range of the samples times the diagonal. What running it gave, where that was
///         measured (scene/measured_results.hpp)
Transition radon_edge(const RadonAlgorithm& algorithm);

/// Lines of few angles, as all take the same (Transition::trials).
std::vector<Trial> line_trials(RadonSetting::To to);

}  // namespace edgewise
