// What choosing costs, by its parts, in one process and without kept facts: medians of so many
// requests that are prepared anew, for each mode and number of frames.
//
//     build/release/bin/choosing_benchmark FILE [PREPARED [PROFILE_FOLDER [MODE FRAMES MAX_ERROR]]]
//
// `looked` is all that is measured of the data for the choice, `search` expanding, pricing and
// searching the graph. Statistics and a preset are what a path needs too.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <edgewise/edgewise.hpp>
#include <vector>

using namespace edgewise;

namespace {

double median(std::vector<double> values) {
    std::nth_element(values.begin(),
                     values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    return values[values.size() / 2];
}

Query query_of_row(const char* mode, double frames, double size, const char* max_error) {
    std::vector<Given> given = {{"mode", std::string(mode)}, {"rotate", "20,30,0"}};
    if (frames > 1) given.push_back({"turntable", frames});
    given.push_back({"size", size});
    if (*max_error) given.push_back({"max_error", std::string(max_error)});
    return query_of(Job::render, given);
}

}  // namespace

int main(int count, char** words) {
    if (count < 2) {
        std::fprintf(
            stderr,
            "usage: choosing_benchmark FILE [PREPARED [PROFILE_FOLDER [MODE FRAMES MAX_ERROR]]]\n");
        return 2;
    }
    const int times = count > 2 ? std::atoi(words[2]) : 15;
    const Engine whole = default_engine(count > 3 ? words[3] : "");
    const Engine engine(whole.edges(), whole.machine());  // keeps no facts
    const std::shared_ptr<const Data> samples = Volume::read(words[1]).samples();
    std::printf("%-10s %6s %9s | %10s %8s %8s %8s  [ms] | %s\n", "mode", "frames", "max_error",
                "statistics", "preset", "looked", "search", "vertices, edges, path");
    for (const char* max_error : {"", "0.01"})
        for (const char* mode : {"mip", "composite", "mean", "xray"})
            for (const double frames : {1.0, 24.0, 120.0}) {
                if (count > 6 && (std::string(words[4]) != mode || std::atof(words[5]) != frames ||
                                  std::string(words[6]) != max_error))
                    continue;
                std::vector<double> statistics, preset, looked, search;
                std::string path;
                int vertices = 0, edges = 0;
                for (int i = 0; i < times; ++i) {
                    Query query = query_of_row(mode, frames, 384, max_error);
                    query.input = words[1];
                    const Prepared plan =
                        prepare(engine, query, samples,
                                {.errors = ErrorsWanted::for_choice, .front = false});
                    const Planned& planned = plan.planned();
                    statistics.push_back(1e3 * planned.spent.statistics);
                    preset.push_back(1e3 * planned.spent.preset);
                    looked.push_back(1e3 * planned.spent.preview);
                    search.push_back(1e3 * planned.spent.search);
                    vertices = planned.answer.vertices, edges = planned.answer.edges;
                    path.clear();
                    for (const std::string& step : plan.plan().texts()) path += " " + step;
                }
                std::printf("%-10s %6.0f %9s | %10.2f %8.2f %8.2f %8.2f       | %d, %d,%s\n", mode,
                            frames, max_error, median(statistics), median(preset), median(looked),
                            median(search), vertices, edges, path.c_str());
            }
}
