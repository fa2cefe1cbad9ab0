#pragma once

#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "graph/fact.hpp"
#include "graph/samples.hpp"

namespace edgewise {

/// RMS change of the reference by writing it (Request::written).
inline constexpr Fact kWritten{"written"};
/// Of a job's results: their root mean square; and, as a number, the type of the samples that its
/// edges were run on.
inline constexpr Fact kResultRms{"result/rms"}, kResultType{"result/type"};

/// What was measured of one data set for one request, so that cost and error models need not guess.
struct Scene {
    double low = 0, high = 1, mean = 0;  // over finite values
    double commonest = 0;                // what counts as empty
    std::int64_t non_finite = 0;
    Region occupied{};             // box of the samples that differ from the commonest value
    double occupied_fraction = 1;  // of all samples
    double range = 1;              // of the reference over the result: an error of 1

    /// Facts by name, as edges ask for them: errors that models measured on a preview against the
    /// reference (Transition::model; absolute, in values of the result), what running an edge gave
    /// (fact_of_runs), and what counts ask of the data (Transition::count). Each is declared where
    /// it is measured, and read by that name.
    std::map<std::string, double> facts{};
    /// Errors among the facts are upper estimates. What the draws themselves say of them, without
    /// standard errors.
    std::map<std::string, double> likely{};
    std::int64_t draws = 0;  // clusters of samples that they were measured on; 0: they are guesses
    bool exhausted = false;  // no more is drawn, whatever is asked for
    /// Facts that are missing are made up, each from this number and its name: what holds for many
    /// such scenes does not depend on them.
    std::optional<std::uint64_t> supposed = {};
    /// Where the names of facts that somebody asks for are left; null: nowhere.
    std::set<std::string>* asked = nullptr;

    std::optional<double> fact(const FactName& name) const {
        if (asked) asked->insert(name.text());
        if (const auto found = facts.find(name.text()); found != facts.end()) return found->second;
        return supposed ? std::optional(made_up(name.text())) : std::nullopt;
    }
    /// The same without made-up facts.
    std::optional<double> measured(const FactName& name) const {
        if (asked) asked->insert(name.text());
        const auto found = facts.find(name.text());
        return found == facts.end() ? std::nullopt : std::optional(found->second);
    }
    /// Whether f32 holds every stored number of samples that were read.
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
