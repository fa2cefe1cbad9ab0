#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "cli/request/job_options.hpp"
#include "graph/data.hpp"
#include "runtime/runtime.hpp"

namespace edgewise::cli {

/// What is timed: a request, with the phantom's samples in another type.
struct Trial {
    Job job;
    std::string input;
    Type type;
    const char* turn;
    const char* mode;                   // null: a warp
    const char* size = nullptr;         // of the screen; null: the input's
    const char* frames = nullptr;       // of a turntable; null: one view
    const char* edge = nullptr;         // null: all paths; else the cheapest by this edge
    const char* perspective = nullptr;  // [degree] of the view; null: parallel rays
    bool empty_around = false;          // the phantom fills only the middle of its box
    bool fine = false;                  // also rays with several samples a voxel
};

/// Sizes within the caches and beyond; volumes that are full or mostly empty, seen along different
/// axes. What most requests resemble comes first, since time may run out.
std::vector<Trial> trials(bool quick);
/// Requests unlike the trials. The fit is judged on them.
std::vector<Trial> exams();

JobOptions options_of(const Trial& trial);

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

}  // namespace edgewise::cli
