#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "graph/cost.hpp"
#include "planner/levels.hpp"
#include "planner/message_costs.hpp"
#include "planner/rates.hpp"

namespace edgewise {

class Catalogue;  // graph/transition.hpp

/// Predicted seconds, and how far the truth may be from them: standard deviation of the log.
struct Seconds {
    double seconds = 0, spread = 0;
};

/// A machine as the mixed cost communication machine sees it (MCCM, [W93] 2.2.2): how long a
/// counted unit of work takes, and a fitted factor for each edge whose counts miss something.
struct Profile {
    std::string name = "default";
    std::string cpu;     // of the machine that was measured; empty: none
    std::string build;   // version of the program that measured
    std::string when;    // UTC, "2026-11-21T20:15:00Z"
    int processors = 1;  // that share one memory
    int ranks = 1;       // memories, each with so many processors; 1: a machine of shared memory
    double memory = 0;   // [byte] of one rank; 0: not known
    double operation = 0.033e-9;  // [s]; operations run in vectors, so far below a cycle
    double streamed = 0.045e-9;   // [s/byte]; where there are levels, these go before it
    double gather = 0.2e-9;       // [s]; likewise
    double local = 0.3e-9;        // [s]
    double global = 1e-9;         // [s], before congestion
    double congestion = 1;        // N: how many times that where accesses meet
    double latency = 0;           // [s] once a message, below the first of `messages`
    double byte = 0;              // [s/byte] in messages, likewise
    double start = 10e-6;         // [s] once a run of an edge
    double serial = 0.05;         // share of a run that further threads do not speed up
    double spread = 0.35;         // of predicted seconds, at least: standard deviation of the log
    Levels levels;                // of memory; empty: `streamed` and `gather` hold for all sizes
    MessageCosts messages;        // by size; empty: `latency` and `byte` hold for all sizes
    /// Measured over counted seconds of loops, by "EDGE" or "EDGE/key=value..."; the longest name
    /// that fits, else "*".
    std::map<std::string, double> factors;
    /// The same measured here by size, kind and type of sample; these go before `factors`.
    Rates rates;
    /// Where a number comes from, by its name above: "measured", "fitted", "derived" or "guessed",
    /// then from what.
    std::map<std::string, std::string> provenance;
    /// Of measured numbers, by their name above: standard deviation of the log.
    std::map<std::string, double> spreads;

    /// Seconds of one run of an edge, of `runs` that may overlap; all but its messages is shared by
    /// `among` ranks.
    /// @param edge  "EDGE/key=value.../VARIANT KIND TYPE", as in Rates; parts may be missing
    Seconds seconds(const std::string& edge, const Work& work, int threads, int among = 1,
                    int runs = 1) const;
    /// Seconds of the counted work alone, on one thread.
    Counted counted(const Work& work) const noexcept;
    double factor(const std::string& edge) const;
};

/// The profile that is used where no machine was measured: numbers of one core of a server with
/// AVX-512, and the factors that edges have there (Transition::factors).
Profile default_profile(const Catalogue& edges);
/// @throws InputError naming the file and the field
Profile load_profile(const std::string& file);
/// The same of a text. @param file  what messages call it
Profile parse_profile(const std::string& text, const std::string& file);
nlohmann::json to_json(const Profile& profile);

}  // namespace edgewise
