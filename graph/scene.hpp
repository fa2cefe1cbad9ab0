#pragma once

#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "graph/samples.hpp"

namespace edgewise {

/// What was measured of one data set for one request, so that cost and error models need not guess.
struct Scene {
    double low = 0, high = 1, mean = 0;  // over finite values
    double commonest = 0;                // what counts as empty
    std::int64_t non_finite = 0;
    Region occupied{};             // box of the samples that differ from the commonest value
    double occupied_fraction = 1;  // of all samples
    double range = 1;              // of the reference over the result: an error of 1

    /// Facts by name, measured on a preview against the reference; absolute, in values of the
    /// result:
    ///  - "field/FILTER": RMS error of the samples reconstructed by zoh, foh, bspline3, me;
    ///  - "written": RMS of what writing changes of the reference (Request::written);
    ///  - "combined/FILTER": the same as far as a picture combined of warped samples shows it;
    ///  - "sheared/FILTER": RMS error of one pass of shears along slanted lines (foh, bspline3);
    ///  - "picture/FILTER/STEP": RMS error of a picture cast with that hold and step (1, 0.5,
    ///  0.25);
    ///  - "picture/combined": what combining along z adds; "picture/screen/FILTER": with the warp;
    ///  - "picture/shear_warp/FILTER": RMS error of a picture by shear-warp;
    ///  - "picture/ended": root of the share of rays that end early, of composite;
    ///  - "picture/spectrum/WINDOW[/cropped]": RMS error of pictures by slices of a spectrum;
    ///  - "picture/spectrum/ends": what of it comes from the ends of rays;
    ///  - "cast/all", "cast/taken", "cast/bricks": samples a pixel that a ray caster takes;
    ///  - "cast/corrected", "cast/corrected/ends": shares of samples whose opacity it corrects;
    ///  - "gain/blur": error of a combined picture over that of its samples ("combined/...");
    ///  - "gain/noise/FILTER": error of a picture over independent noise of its samples (zoh, foh).
    std::map<std::string, double> facts{};
    /// Errors among the facts are upper estimates. What the draws themselves say of them, without
    /// standard errors.
    std::map<std::string, double> likely{};
    std::int64_t draws = 0;  // clusters of samples that they were measured on; 0: they are guesses
    bool exhausted = false;  // no more is drawn, whatever is asked for
    /// Facts that are missing are made up, each from this number and its name: what holds for many
    /// such scenes does not hang on them.
    std::optional<std::uint64_t> supposed = {};

    std::optional<double> fact(const std::string& name) const {
        if (const auto found = facts.find(name); found != facts.end()) return found->second;
        return supposed ? std::optional(made_up(name)) : std::nullopt;
    }
    /// Whether f32 holds every stored number of samples that were looked at.
    bool fits_f32(Type type, const ValueMap& values) const noexcept {
        if (type == Type::f32 || bytes_of(type) <= 2) return true;
        if (!is_integer(type)) return false;
        constexpr double kWhole = 0x1p24;
        const double a = (low - values.offset) / values.slope;
        const double b = (high - values.offset) / values.slope;
        return std::abs(a) <= kWhole && std::abs(b) <= kWhole;
    }
    /// The same with likely errors in place of upper estimates.
    Scene as_likely() const {
        Scene scene = *this;
        for (const auto& [name, error] : likely) scene.facts[name] = error;
        return scene;
    }

 private:
    double made_up(const std::string& name) const;
};

}  // namespace edgewise
