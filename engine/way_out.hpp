#pragma once

#include <optional>
#include <string>
#include <vector>

#include "graph/plan.hpp"

namespace edgewise {

struct Planned;

/// A setting to be given another value, or to be left out.
struct SettingChange {
    SettingName setting;
    std::optional<std::string> value = {};  // as typed, it works; none: left out
    std::string instead = {};               // of this value
};

/// The changes of settings that would make an infeasible request feasible.
struct WayOut {
    /// Each list alone does: the least values, rounded to what works as typed.
    std::vector<std::vector<SettingChange>> budgets;
    /// Each list alone does: the smallest sets of `via` and `without` to leave out.
    std::vector<std::vector<SettingChange>> demands;
    bool then_budgets = false;  // even without these demands a budget must still change
    /// Each set of edges alone would, if they applied.
    std::vector<std::vector<Refusal>> missing;
};

/// Whether predicted errors are those of the data, or guesses from which no advice can follow.
enum class Errors { predicted, guessed };

/// For a request whose planner finds nothing.
WayOut way_out_of(const Planned& planned, Errors errors = Errors::predicted);

/// "; any of these lines makes one fit:\n  max_error=0.0123 instead of 0.005\n ...", or "".
Message text_of(const WayOut& way_out);

/// A time that `max_time` reads as no less than this, and at most 0.1 % more: "12.35ms".
/// @param like  a time as it was typed, whose unit is taken; "": one that suits
std::string time_text(double seconds, const std::string& like = "");
/// The same for `max_error`: an NRMSE, or in percent or dB where `like` is.
std::string error_limit_text(double error, const std::string& like = "");
/// An error in words, in dB or percent where `like` is: "58.9 dB", "0.113 %", "0.00113".
std::string error_words(double error, const std::string& like);
/// The same for `max_memory`; with room for what a process's own pages differ by from run to run.
std::string memory_text(double bytes, const std::string& like = "");

}  // namespace edgewise
