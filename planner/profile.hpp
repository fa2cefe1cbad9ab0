#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "graph/cost.hpp"

namespace edgewise {

/// A machine as the mixed cost communication machine sees it (MCCM, [W93] 2.2.2): how long a
/// counted unit of work takes, and a fitted factor for each edge whose counts miss something.
struct Profile {
    std::string name = "default";
    std::string cpu;  // of the machine that was measured; empty: none
    int processors = 1;
    double operation = 0.05e-9;  // [s]; operations run in vectors, so far below a cycle
    double streamed = 0.12e-9;   // [s/byte]
    double gather = 0.22e-9;     // [s]
    double local = 0.3e-9;       // [s]
    double global = 1e-9;        // [s], before congestion
    double start = 20e-6;        // [s] once a run of an edge
    double serial = 0.05;        // share of a run that further threads do not speed up
    /// Measured over counted seconds, by "EDGE" or "EDGE/key=value..."; the longest name that fits.
    std::map<std::string, double> factors;

    /// Seconds of one run of an edge.
    double seconds(const std::string& edge, const Work& work, int threads) const;
    /// Seconds of the counted work alone, on one thread.
    double counted(const Work& work) const noexcept;
    double factor(const std::string& edge) const;
};

/// The profile that is used where no machine was measured; its numbers come from one core of a
/// server.
Profile default_profile();
/// @throws InputError naming the file and the field
Profile load_profile(const std::string& file);
nlohmann::json to_json(const Profile& profile);

}  // namespace edgewise
