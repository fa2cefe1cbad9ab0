#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace edgewise {

/// Seconds of one run on one thread by the machine's numbers alone, and what of them is no matter
/// of how fast a kernel's loops are: setting rays up, lines that loops wait for.
struct Counted {
    double seconds = 0, apart = 0;

    // Implicit, as most are loops alone.
    Counted(double all = 0, double of_these = 0) noexcept : seconds(all), apart(of_these) {}
    /// Of one of so many that share it evenly.
    Counted operator/(double parts) const noexcept { return {seconds / parts, apart / parts}; }
};

/// What an edge took at one size, against what was counted.
struct Rate {
    double counted = 0;  // [s] of one run on one thread, by the machine's numbers alone
    double apart = 0;    // of these [s], see Counted
    double ratio = 1;    // measured over counted seconds
    double shared = 1;   // seconds with all processors over seconds with one
    double spread = 0;   // of the ratio, between requests and runs: standard deviation of its log
    int runs = 0;        // that were timed
    int frames = 1;      // of each, side by side: then `shared` is that of all of them
};

/// [s] on one thread beyond what is apart. Where that explains nearly all, or more, little follows
/// for loops: they take a tenth.
double seconds_of_loops(const Rate& rate) noexcept;

/// One timed step.
struct Timed {
    double counted = 0, apart = 0;   // [s] of one frame, see Counted
    double alone = 0, together = 0;  // [s] of one frame: one thread, all processors
    double spread = 0;               // of the log of `alone`: standard error
    int runs = 0;
    int frames = 1;
};

/// Seconds over counted seconds by name and size, as calibrated: no count knows caches, vector
/// units and what a compiler made of a kernel. Names are "EDGE/key=value.../WAY KIND TYPE"; one
/// that was not measured is served by those of its edge that share the most parts with it, of as
/// many the earlier parts.
class Rates {
 public:
    using Curves = std::map<std::string, std::vector<Rate>>;

    Rates() = default;
    /// What counts for loops takes is of one edge, its parameters and a kind one factor, whatever
    /// the type and the size: the median of what was measured beyond the seconds apart. So requests
    /// whose rays are short or far apart are served by those of long ones. What is left is a curve
    /// for each name. Sizes within a third of each other are one: its rate is their median, so that
    /// a single bad one moves nothing.
    explicit Rates(Curves measured);

    bool empty() const noexcept { return measured_.empty(); }
    /// At so many counted seconds, those apart taken as they are: between sizes by the logarithms
    /// of both; beyond them as at the last size, but for the set-up of a run, which is the same for
    /// all. What several processors bring to a single run under a measured name is the name's own,
    /// where it is no shorter than those timed: then its seconds on all of them are those that were
    /// timed. Else it is a matter of the edge and of how long it runs (waking threads takes a fixed
    /// time, parts that do not divide a fixed share): the median over the edge's parameters, kinds
    /// and types at about the seconds of all `runs`.
    /// @return ratio 0 where nothing was measured under any part of the name
    Rate at(const std::string& name, const Counted& counted, int runs = 1) const;
    /// As measured, by name, sorted by size.
    const Curves& measured() const noexcept { return measured_; }

 private:
    /// What an edge's runs gained from all processors, by what they take on one.
    struct Sharing {
        double alone = 0, shared = 1;
    };
    using Shared = std::map<std::string, std::vector<Sharing>>;
    static Shared shared_of(const Curves& curves);
    double shared_at(const std::string& name, double alone) const;
    /// What follows has for `counted` the seconds that are expected where nothing is left of them.
    Rate alone_at(const std::string& name, double expected) const;
    std::vector<Rate> nearest(const std::string& name) const;
    /// Seconds of loops over counted ones: of those names that are most like one.
    double pace_of(const std::string& name) const;

    Curves measured_;
    Curves left_;                          // over expected seconds, those of about one size joined
    std::map<std::string, double> paces_;  // of loops, by name without the type
    Shared shared_;                        // by name of the edge, sorted by seconds
};

/// What was timed, by name.
Rates rates_of(const std::map<std::string, std::vector<Timed>>& timed);

nlohmann::json to_json(const Rates& rates);
/// @throws InputError naming the field; `file` is what messages call the text
Rates rates_of(const nlohmann::json& json, const std::string& file);

}  // namespace edgewise
