#include "graph/trial.hpp"

#include <algorithm>

namespace edgewise {

void join(std::vector<Trial>& all, const std::vector<Trial>& more) {
    for (const Trial& trial : more)
        if (std::find(all.begin(), all.end(), trial) == all.end()) all.push_back(trial);
}

}  // namespace edgewise
