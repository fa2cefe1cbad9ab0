#pragma once

#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace edgewise {

/// Seconds of one run on one thread, by the machine's numbers alone. `apart` are the seconds of
/// cache-line misses, for which loops wait: a faster kernel does not shorten them.
struct Counted {
    double seconds = 0, apart = 0;

    // Implicit, because most counts have no line misses.
    Counted(double all = 0, double of_these = 0) noexcept : seconds(all), apart(of_these) {}
    /// The share of one, where so many share it evenly.
    Counted operator/(double parts) const noexcept { return {seconds / parts, apart / parts}; }
};

/// What an edge took at one size, against what was counted.
struct Rate {
    double counted = 0;  // [s] of one run on one thread, by the machine's numbers alone
    double apart = 0;    // of these [s]: line misses, see Counted
    double ratio = 1;    // measured over counted seconds
    double shared = 1;   // seconds with all processors over seconds with one
    double spread = 0;   // of the ratio, between requests and runs: standard deviation of its log
    int runs = 0;        // that were timed
    int frames = 1;      // of each run, made side by side: then `shared` is that of all frames
};

/// Measured seconds of loops on one thread: all seconds less those of line misses, and no less than
/// a tenth of all. Where line misses explain nearly everything the difference says little.
double seconds_of_loops(const Rate& rate) noexcept;

/// One timed step.
struct Timed {
    double counted = 0, apart = 0;   // [s] of one frame, see Counted
    double alone = 0, together = 0;  // [s] of one frame: one thread, all processors
    double spread = 0;               // of the log of `alone`: standard error
    int runs = 0;
    int frames = 1;
};

/// Measured over counted seconds, by name and size: no count knows vector units and what a compiler
/// made of a kernel. Names are "EDGE/key=value.../VARIANT KIND TYPE". A name that was not measured
/// borrows from the names of its edge that share the most parts with it; among those that share
/// equally many, from those that share the earlier parts.
class Rates {
 public:
    using Curves = std::map<std::string, std::vector<Rate>>;

    Rates();
    /// Measured over counted seconds of loops is one factor for each edge, its parameters and a
    /// kind, whatever the type and the size: the median of measured factors, without line misses.
    /// So short or sparse rays are predicted from long and dense ones. What the factor leaves
    /// unexplained is a curve over size for each name. Sizes within a third of each other count as
    /// one size, whose rate is their median: a single bad run moves nothing.
    explicit Rates(Curves measured);

    bool empty() const noexcept { return measured_.empty(); }
    /// The rate at so many counted seconds. Line misses are added as counted. Between sizes the
    /// logarithms are interpolated. Beyond the last size the curve stays as it is there, except for
    /// the set-up of a run, which is the same for all sizes.
    ///
    /// What all processors gain in a single run is the name's own where it was timed and the run is
    /// no shorter than the shortest one timed. Else it is the median over the edge's parameters,
    /// kinds and types at about the seconds of all `runs`: it depends on the edge and on how long
    /// it runs, since waking threads takes a fixed time.
    /// @return ratio 0 where nothing was measured under any part of the name
    Rate at(const std::string& name, const Counted& counted, int runs = 1) const;
    /// As measured, by name, sorted by size.
    const Curves& measured() const noexcept { return measured_; }

 private:
    /// What an edge's runs gained from all processors, by their seconds on one.
    struct Sharing {
        double alone = 0, shared = 1;
    };
    using Shared = std::map<std::string, std::vector<Sharing>>;
    static Shared shared_of(const Curves& curves);
    double shared_at(const std::string& name, double alone) const;
    /// What a name stands for is worked out once. Copies share it.
    struct Resolved;
    struct Memo;
    std::shared_ptr<const Resolved> resolved(const std::string& name) const;
    std::vector<Rate> nearest(const std::string& name) const;
    /// The factor of loops of a name, or the median over the names that are most like it.
    double pace_of(const std::string& name) const;

    Curves measured_;
    // On one thread, measured over expected seconds: the factor of loops times their counted
    // seconds, plus line misses. About equal sizes are joined.
    Curves left_;
    std::map<std::string, double> paces_;  // factors of loops, by name without the type
    Shared shared_;                        // by name of the edge, sorted by seconds
    std::shared_ptr<Memo> memo_;
};

/// What was timed, by name.
Rates rates_of(const std::map<std::string, std::vector<Timed>>& timed);

nlohmann::json to_json(const Rates& rates);
/// @throws InputError naming the field; `file` is what messages call the text
Rates rates_of(const nlohmann::json& json, const std::string& file);

}  // namespace edgewise
