#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/request/query.hpp"
#include "graph/data.hpp"
#include "runtime/runtime.hpp"

namespace edgewise {

/// What is timed: a request, with the phantom's samples in another type.
struct Trial {
    Job job;
    std::string input;
    Type type;
    std::vector<double> turn = {};           // [degree]; empty: none
    const char* mode = nullptr;              // null: no picture
    std::int64_t size = 0;                   // of the screen; 0: the input's
    int frames = 0;                          // of a turntable; 0: one view
    const char* edge = nullptr;              // null: all paths; else the cheapest by this edge
    double perspective = 0;                  // [degree] of the view; 0: parallel rays
    bool empty_around = false;               // the phantom fills only the middle of its box
    bool fine = false;                       // also rays with several samples a voxel
    bool lit = false;                        // light falls on the samples
    std::optional<FilterSpec> filter = {};   // of filter jobs
    std::optional<RadonSetting> radon = {};  // of radon jobs
    std::optional<double> isovalue = {};     // of surfaces
    bool labels = false;                     // stored numbers are labels
};

/// Sizes within the caches and beyond; volumes that are full or mostly empty, seen along different
/// axes. What most requests resemble comes first, since time may run out.
std::vector<Trial> trials(bool quick);
/// Requests unlike the trials. The fit is judged on them.
std::vector<Trial> exams();

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
