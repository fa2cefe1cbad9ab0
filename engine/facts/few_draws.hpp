#pragma once

#include <map>
#include <string>
#include <vector>

namespace edgewise {

/// What a few draws tell of the errors that decide between some paths (Preview::without).
struct FewDraws {
    std::map<std::string, double> likely;
    std::vector<std::map<std::string, double>> without;
};

/// What counts of edges ask of the data (Transition::count).
struct Counts {
    std::map<std::string, double> facts;
};

}  // namespace edgewise
