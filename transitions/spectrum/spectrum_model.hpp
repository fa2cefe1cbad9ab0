#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "scene/model.hpp"
#include "transitions/kernels/kaiser_bessel.hpp"

namespace edgewise {

/// What a slice of the volume's spectrum gets wrong along one ray of an X-ray, mean or radiograph,
/// worked out where it arises, in object space and without a spectrum. Errors are integrals along
/// the ray [value x unit].
///
/// - *Ghosts.* A spectrum read between its samples is that of a volume repeated a period away and
///   faded by the window: a sample at x, in periods from the middle, appears once more at x + m
///   with the weight W(x + m) / W(x), W the window's transform. What of these repetitions lies on
///   the pixel's line, or on that of the same pixel periods of the picture away, is added up.
/// - *Faces.* The slice knows samples that are the commonest value beyond the box, while the field
///   that is asked for stays as it is at the outermost centres and ends at a face. The difference
///   is added up along the line as far as it is near a face.
///
/// - *Tables.* Taps are told from a table by linear interpolation, which fades what is far from the
///   middle by (pi x h)^2 / 3 more along each axis, h being the table's step.
/// - *Rounding.* Of a spectrum in f32 it is white, in proportion to the weighted samples.
/// - *Cutoff.* The slice knows nothing beyond 3/4 of a cycle a sample: its steps ring a little, and
///   detail of rays along an axis loses a little.
///
/// Left out: frequencies beyond the picture's band. Parallel rays,
/// finite samples. Sources: Malzbender 1993; Jackson et al. 1991.
class SpectrumRays {
 public:
    /// Windows that are always measured: those that are planned with unless a path asks for
    /// others.
    static const std::vector<kernels::KaiserBessel>& tried();
    /// At most so many windows at once.
    static constexpr std::size_t kWindows = 2;
    struct Ghosts {
        std::array<double, kWindows> seen{};
        /// Of rays along an axis, the part that comes turned by a quarter of each wave along the
        /// picture's rows: only its size is known here.
        std::array<double, kWindows> turned{};
        /// Variance by the spectrum's rounding.
        std::array<double, kWindows> noise{};
    };

    /// @param box      the samples that are transformed; the others have the commonest value
    /// @param windows  of one padding
    /// Request and input must stay alive.
    SpectrumRays(const Request& want, const Data& input, const Statistics& statistics,
                 const Region& box, std::vector<kernels::KaiserBessel> windows);

    const std::vector<kernels::KaiserBessel>& windows() const noexcept { return windows_; }

    double faces(const RaySpan& ray) const;
    /// Of a ray along an axis: what samples inside lose beyond the frequencies that the slice
    /// knows. Such a ray meets the same fraction of a sample all along, so that nothing averages
    /// out; of others the preview's own pictures tell.
    std::optional<double> beyond(const RaySpan& ray) const;
    /// By window, in a pixel.
    Ghosts ghosts(int view, double x, double y) const;

 private:
    static constexpr int kRepetitions = 3;  // on either side

    struct Line {
        Vec3 origin, direction;
    };
    struct Weights {
        double period = 1;                                     // of the padded volume [voxel]
        std::vector<std::array<double, kWindows>> of, turned;  // [repetition][sample of the box]
        /// What tables of taps make less of a sample, and what its share in the spectrum is over
        /// that of one in the middle.
        std::vector<std::array<double, kWindows>> table, grown;
    };
    struct Stretch1d {
        double low, high;
    };
    Weights weights_along(int axis) const;
    void add_ghost(const Line& line, int axis, int repetition, Ghosts& sum) const;
    /// What becomes of the samples on the pixel's own line: by tables of taps along the axes that
    /// are given, and by rounding.
    void add_itself(const Line& line, const std::array<bool, 3>& between, Ghosts& sum) const;
    template <class Body>
    void each_sample(const Line& line, const Body& body) const;
    /// What a sample has above the commonest value.
    double sample(const std::array<std::int64_t, 3>& at) const;
    /// What a sample weighs at a distance, as the slice has it.
    double weight_at(double u) const;
    /// What the slice has more than the field at a place inside, since it knows no samples outside:
    /// along one axis through `at`, and all in all.
    double wrong_along(int axis, const Vec3& p, std::array<std::int64_t, 3> at) const;
    double wrong_inside(const Vec3& p) const;
    /// What it has at a place outside, where the field has ended.
    double spilled_outside(const Vec3& p) const;
    double step_at(double u) const;
    /// How much more of a sample at a distance u than the field has of it.
    double lost_at(double u) const;
    /// Sum over a line along an axis of the samples' differences from the commonest value.
    double line_sum(int axis, std::array<std::int64_t, 3> at) const;
    double faces_between(const RaySpan& ray, double from, double to, bool inside) const;
    /// Where a line lies in the box, widened on all sides; high < low: nowhere.
    Stretch1d within(const Line& line, const Region& box, double wider) const;

    const Request& want_;
    const Data& input_;
    std::vector<kernels::KaiserBessel> windows_;
    double empty_;
    Region box_;
    int reach_;                       // samples from a face in which its error counts
    std::vector<Mat4> to_input_;      // one a view
    std::array<double, 2> period_{};  // of the picture [pixel]
    std::vector<double> step_;        // the slice's, through samples: by distance from the last 1
    std::vector<double> lost_;        // by which that is more than the field's
    std::array<Weights, 3> weights_;
    std::array<double, kWindows> read_{};  // variance of reading white noise in the spectrum
};

/// Pictures by slices of a spectrum: facts as fact_of_spectrum() names them, one a window and box
/// that is transformed, and kSpectrumEnds. Null where a spectrum gives no such picture.
std::shared_ptr<const Model> spectrum_model(const ModelSetting& setting);

}  // namespace edgewise
