#include <algorithm>
#include <map>
#include <utility>

#include "runtime/runtime.hpp"

namespace edgewise {
namespace {

/// One run of a step, or one end of it on the time line.
struct Span {
    double begin = 0, end = 0;  // [s]
};
struct End {
    double at = 0;  // [s]
    int step = 0;
    int change = 0;  // of the runs under way: +1 begins, -1 ends
};

std::vector<End> ends_of(const std::vector<Ran>& trace) {
    std::map<std::pair<int, int>, Span> runs;  // by step and view
    for (const Ran& ran : trace) {
        const auto [place, fresh] =
            runs.try_emplace({ran.step, ran.view}, Span{ran.begin, ran.end});
        Span& span = place->second;
        if (fresh) continue;
        span.begin = std::min(span.begin, ran.begin);
        span.end = std::max(span.end, ran.end);
    }
    std::vector<End> ends;
    for (const auto& [run, span] : runs) {
        ends.push_back({span.begin, run.first, 1});
        ends.push_back({span.end, run.first, -1});
    }
    std::sort(ends.begin(), ends.end(), [](const End& a, const End& b) { return a.at < b.at; });
    return ends;
}

}  // namespace

std::vector<double> wall_seconds(const std::vector<Ran>& trace, std::size_t steps) {
    std::vector<double> seconds(steps, 0.0);
    std::vector<int> under_way(steps, 0);
    int all = 0;
    double last = 0;
    for (const End& end : ends_of(trace)) {
        // What lies between two ends is shared by the runs that are under way there.
        for (std::size_t step = 0; all > 0 && step < steps; ++step)
            seconds[step] += (end.at - last) * under_way[step] / all;
        under_way[static_cast<std::size_t>(end.step)] += end.change;
        all += end.change;
        last = end.at;
    }
    return seconds;
}

}  // namespace edgewise
