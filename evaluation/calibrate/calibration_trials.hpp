#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "graph/data.hpp"
#include "graph/transition.hpp"
#include "graph/trial.hpp"
#include "request/query.hpp"
#include "runtime/runtime.hpp"

namespace edgewise {

/// What is timed: a trial, by all paths, or the cheapest path by an edge.
struct EdgeTrial {
    Trial trial;
    std::string edge;  // "": all paths

    friend bool operator==(const EdgeTrial&, const EdgeTrial&) = default;
};

/// The trials of a catalogue's edges that belong to one part of calibrating, each once, in the
/// order in which they run.
std::vector<EdgeTrial> trials_of(const Catalogue& edges, Trial::Part part);

Query spec_of(const Trial& trial);

/// The samples that trials share.
class Phantoms {
 public:
    std::shared_ptr<const Data> of(const Trial& trial);

 private:
    std::shared_ptr<const Data> whole(const Trial& trial);
    std::shared_ptr<const Data> formula(const std::string& name);

    MemoryBudget memory_{std::size_t{1} << 46};
    std::map<std::pair<std::string, Type>, std::shared_ptr<const Data>> made_;
};

}  // namespace edgewise
