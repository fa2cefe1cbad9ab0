#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

namespace edgewise {

struct Looked;

/// What was measured of one path of one request.
struct Learned {
    std::vector<double> seconds;          // of runs, all frames; none: its error broke the budget
    double given_up = 0;                  // [s] after which it was stopped: too slow, or it failed
    double error = 0, low = 0, high = 0;  // NRMSE and its 95 % interval
    double samples = 0;                   // that these were asked to be measured on
    double bytes = 0;                     // peak, as counted
};

/// What pilots measured, kept from run to run in a file (Engine::wisdom): by request, then by path
/// ("STEP > STEP"). The file is readable and can be merged: two writers lose nothing but the older
/// of two measurements of one path. A home that cannot be written is no error.
class Wisdom {
 public:
    using Paths = std::map<std::string, Learned>;

    /// Reads the file; one that is broken is left alone, and said in `problem`.
    /// @param file  "": nothing is known, and nothing is kept
    static Wisdom load(const std::string& file);

    const Paths* find(const std::string& request) const;
    /// Joins what was learned to the file as it is now.
    /// @param about  what a reader is shown of the request
    void keep(const std::string& request, const std::string& about, const Paths& learned) const;
    const std::string& problem() const noexcept { return problem_; }

 private:
    std::string file_, problem_;
    std::map<std::string, Paths> requests_;
};

/// What a measurement depends on: machine, build, processors, the samples themselves, and all of
/// the request except its budgets, its threads and where results go. 32 hexadecimal digits; ""
/// where the request has what cannot be told from other things (Fingerprint).
std::string wisdom_key(const Looked& looked);

}  // namespace edgewise
