#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "graph/ray_rule.hpp"
#include "graph/shading.hpp"

namespace edgewise {

struct ModeTraits;
struct Request;

/// What becomes of the samples along a ray. One file a mode and one line in modes/modes.cpp has
/// what it is; kernels, edges, models, the reference and the command read that and know no mode by
/// name, but kernels that were written for one (Combine).
class Mode {
 public:
    explicit constexpr Mode(const ModeTraits& traits) noexcept : traits_(&traits) {}
    const ModeTraits& operator*() const noexcept { return *traits_; }
    const ModeTraits* operator->() const noexcept { return traits_; }
    friend bool operator==(Mode a, Mode b) noexcept { return a.traits_ == b.traits_; }

    // Those that programs ask for often; of all others mode_named().
    static const Mode mip, xray, mean, composite;

 private:
    const ModeTraits* traits_;
};

/// All there are, in the order in which they are listed.
const std::vector<Mode>& modes();
/// The mode of a name, in any case. @throws RequestError for a name that none has
Mode mode_named(std::string_view name);
std::string_view name_of(Mode mode) noexcept;

/// Loops over samples of a ray that a mode has kernels for: the largest, the integral, the mean,
/// front-to-back compositing, the first place at a level. All others go through their RayRule.
enum class Combine { max, sum, mean, over, hit, other };

/// A ray between its samples, by t.
struct AlongRay {
    std::function<double(double)> value;  // of the field; NaN where it is absent
    std::function<Lit(double)> lit;
};

/// A stretch of a view ray, combined in f64: front and back join associatively (Lemma 4.1), so
/// that stretches may be worked out in any order. References and models add these up; they share
/// no code with the kernels.
struct Stretch {
    double length = 0;              // where the field is present [unit]
    std::array<double, 6> state{};  // the mode's own

    static Stretch empty(Mode mode) noexcept;
    /// Adds values that hold for lengths [unit], one after another; those that are not finite are
    /// passed over.
    void add(std::span<const double> values, const double* pieces, const Request& want) noexcept;
    void add(double value, double piece, const Request& want) noexcept {
        add({&value, 1}, &piece, want);
    }
    /// The same of one sample that light falls on.
    /// @param lit  asked where the sample is seen
    void add_lit(double value, double piece, const std::function<Lit()>& lit, const Request& want);
    /// The same of a mode that ends at its first hit. Samples come in order; the first and the last
    /// of a ray, of length 0, are where it enters and leaves.
    /// @param t  where the sample is
    void follow(double t, double value, double piece, const AlongRay& along, const Request& want);
    /// What lies behind this stretch.
    void append(const Stretch& behind, Mode mode) noexcept;
    /// One value, or red, green, blue, opacity, premultiplied and without background.
    void result(const Request& want, double* values) const noexcept;

    /// Calls use(value, piece) for each value that is finite, and adds up their lengths.
    template <class Use>
    void each_finite(std::span<const double> values, const double* pieces, Use&& use) noexcept {
        double covered = length;
        for (std::size_t i = 0; i < values.size(); ++i) {
            if (!std::isfinite(values[i])) continue;
            use(values[i], pieces[i]);
            covered += pieces[i];
        }
        length = covered;
    }
};

/// What decides which of two answers a ray of a mode with a level gets.
struct Threshold {
    /// How far its decisive value lies beyond the level [value]: below 0 it does not reach it.
    /// Not finite where the ray has no value.
    double (*margin)(const Stretch& stretch, const Request& want);
    /// The same ray with the other answer; null: what it would be is not known.
    void (*flip)(Stretch& stretch);
};

struct ModeTraits {
    std::string_view name = {};
    std::string_view help = {};  // one line; settings as in message()

    // Its loops in f32.
    Combine combine = Combine::other;
    const RayRule* rule = nullptr;  // of Combine::other
    /// The kernels get the values with the other sign, and their result gets it back: so the least
    /// is the largest.
    bool negated = false;

    // Its result.
    int channels = 1;              // that edges deliver
    bool over_background = false;  // of four: premultiplied colours and opacity, written as colours
    enum class Miss { zero, lowest, highest };
    Miss miss = Miss::zero;  // of a ray that meets nothing: 0, or an end of the data's values

    // What it reads of a request.
    bool takes_zero = false;             // Request::zero
    bool takes_transfer = false;         // Request::transfer
    bool takes_level = false;            // Request::surface
    std::span<const Shade> shades = {};  // Request::shading, beside none
    bool takes_light() const noexcept { return !shades.empty(); }
    bool takes_cue = false;     // Request::cue
    Shade shade = Shade::none;  // where the request does not say

    // What algorithms may count on.
    /// It is made of samples so far apart [t], not of the field between them; 0: of the field.
    double sampled_every = 0;
    /// It ends where the field passes the level, between samples.
    bool first_hit = false;
    bool light_left = false;  // the result is transmitted light: negatives show most as white
    int extreme = 0;          // 1, -1: the result is one of the samples, the largest or least
    /// It is one of two answers, or such an answer decides what it is. So its errors are jumps of
    /// few pixels, and how many is told from rays that nearly jump. Null: results go with samples.
    const Threshold* threshold = nullptr;
    bool divides = false;  // by the length inside: short rays have large errors
    /// The size of the numbers whose difference the result is: a difference that is no larger than
    /// their rounding is none. Null: it is no difference.
    double (*cancelled)(const Request& want) = nullptr;
    bool averages = false;  // rounding of samples, by adding up many
    enum class Levels { none, values, opacities };
    Levels skips = Levels::none;  // what tells that a stretch cannot matter: its largest value, or
                                  // its largest opacity
    /// What is left to see behind a stretch, where a ray ends early for lack of it; null: never.
    double (*left)(const Stretch&) = nullptr;
    enum class Slices { none, integral, mean };
    Slices slices = Slices::none;  // the Fourier slice theorem gives it
    /// Why samples of the commonest value may not be left out; empty: they may. Null: they never
    /// may, and `kept` says why.
    std::string (*needs)(const Request& want, double common, double low, double high) = nullptr;
    std::string_view kept = {};
    /// A result of a ray that is longer than another by a factor, from that one's, where it depends
    /// on lengths; else null.
    void (*lengthen)(double factor, std::span<double, 4> values) = nullptr;

    // Its price.
    double operations = 1;           // a sample; of transfers what the ramps take comes on top
    int state_numbers = 1;           // of a ray that ranks send each other
    std::string_view timed_as = {};  // the mode whose measured times are its own; empty: itself

    // Errors where nothing was measured.
    std::array<double, 3> guess{};  // over the range, read by filters of zero, first, third order
    /// How errors of samples pass: blur, or noise that differs by sample.
    /// @param length  of a ray [samples]
    double (*gain)(bool noise, double length, double unit, double range) = nullptr;

    // Its form in f64, see Stretch.
    void (*empty)(Stretch& stretch) = nullptr;  // null: all zero
    void (*add)(Stretch& stretch, std::span<const double> values, const double* pieces,
                const Request& want) = nullptr;
    /// Of modes that take light or a cue, and do not end at a hit: one finite sample, and whether
    /// it is seen (null: always).
    void (*add_lit)(Stretch& stretch, double value, double piece, const std::function<Lit()>& lit,
                    const Request& want) = nullptr;
    bool (*is_seen)(double value, const Request& want) = nullptr;
    /// Of modes that end at their first hit, see Stretch::follow.
    void (*follow)(Stretch& stretch, double t, double value, double piece, const AlongRay& along,
                   const Request& want) = nullptr;
    /// Lengths are added up behind it.
    void (*append)(Stretch& stretch, const Stretch& behind) = nullptr;
    void (*result)(const Stretch& stretch, const Request& want, double* values) = nullptr;
};

/// Gains of an integral over a length: errors of blur are alike along a ray, noise adds up as its
/// root. Measured on a head of 160 samples.
double gain_of_integral(bool noise, double length) noexcept;

}  // namespace edgewise
