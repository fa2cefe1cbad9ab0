// How long planning takes on random graphs, much larger than those that requests span:
//
//   build/release/bin/planning_benchmark [GRAPHS]
//
// Medians over GRAPHS (default 21) random graphs of each size, one thread. Every vertex can be
// reached, and reaches the target; arcs lead anywhere else, back too. Costs are continuous, so no
// two labels tie.
//
//   expand           the graph is spanned: every edge asked where it leads
//   price            every arc asked what it costs
//   one objective    least seconds alone (Dijkstra)
//   three criteria   all paths that no other beats in seconds, bytes and error (label setting)
//   plan             the whole call with a budget of error, as `edgewise plan` makes it
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "planner/choice.hpp"
#include "planner/planner.hpp"
#include "planner/search.hpp"

namespace {

using namespace edgewise;

struct Link {
    int from = 0, to = 0;
    double operations = 0, scratch = 0, bias = 0;
};

struct Net {
    std::vector<std::int64_t> bytes;  // of vertices; the last one is the target
    std::vector<Link> links;
};

Net random_net(int vertices, int edges, std::mt19937& random) {
    const auto below = [&](int n) { return std::uniform_int_distribution<int>(0, n - 1)(random); };
    const auto unit = [&] { return std::uniform_real_distribution<double>(0.01, 1)(random); };
    Net net;
    const auto link = [&](int from, int to) {
        net.links.push_back({from, to, unit(), 1000 * unit(), unit()});
    };
    for (int v = 0; v < vertices; ++v) net.bytes.push_back(100 + below(1000));
    // Each vertex hangs on an earlier one and leads to a later one.
    for (int v = 1; v < vertices; ++v) link(below(v), v);
    for (int v = 1; v + 1 < vertices; ++v) link(v, v + 1 + below(vertices - v - 1));
    while (static_cast<int>(net.links.size()) < edges) {
        const int from = below(vertices - 1), to = below(vertices);
        if (from != to) link(from, to);
    }
    return net;
}

Representation vertex_of(const Net& net, int at) {
    Representation what;
    what.space = at + 1 == static_cast<int>(net.bytes.size()) ? "screen" : "n" + std::to_string(at);
    what.type = Type::u8;
    what.extent = {net.bytes[static_cast<std::size_t>(at)], 1, 1};
    return what;
}

Catalogue catalogue_of(const std::shared_ptr<const Net>& net) {
    Catalogue all;
    for (std::size_t i = 0; i < net->links.size(); ++i) {
        const Link link = net->links[i];
        all.push_back(
            {.name = "net.e" + std::to_string(i),
             .joins = {{vertex_of(*net, link.from).kind(), vertex_of(*net, link.to).kind()}},
             .offer =
                 [net, link](const Representation& from, const Ask&, const Parameters&) {
                     return Offer{.from = from, .to = vertex_of(*net, link.to)};
                 },
             .work =
                 [link](const Offer&, const Ask&, int) {
                     return Work{.operations = link.operations, .workspace = link.scratch};
                 },
             .error = [link](const Offer&, const Ask&) { return Error{.bias = link.bias}; }});
    }
    return all;
}

class Clock {
 public:
    double milliseconds() {
        const auto now = std::chrono::steady_clock::now();
        const double passed = std::chrono::duration<double, std::milli>(now - begin_).count();
        begin_ = now;
        return passed;
    }

 private:
    std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

void measure(int vertices, int edges, int graphs) {
    static const char* const kRows[] = {"expand", "price", "one objective", "three criteria",
                                        "plan"};
    std::map<std::string, std::vector<double>> took;
    std::vector<double> fronts;
    for (int i = 0; i < graphs; ++i) {
        std::mt19937 random(static_cast<unsigned>(i));
        const auto net = std::make_shared<const Net>(random_net(vertices, edges, random));
        const Catalogue catalogue = catalogue_of(net);
        Request want;
        want.job = Job::warp;
        want.budget.error = 2;
        want.threads = 1;
        const Scene scene;
        const Ask ask{want, scene};
        const std::vector<Source> sources{{vertex_of(*net, 0)}};
        Profile profile;
        profile.processors = 1;
        const PlanOptions options;

        Clock clock;
        const TransformGraph spanned = expand(catalogue, ask, sources);
        took["expand"].push_back(clock.milliseconds());
        Priced priced{spanned, sources, {}, 0};
        priced.costs = price(spanned, catalogue, ask, profile, 1, options);
        took["price"].push_back(clock.milliseconds());
        if (!fastest_route(priced)) std::abort();
        took["one objective"].push_back(clock.milliseconds());
        fronts.push_back(static_cast<double>(pareto_routes(priced).size()));
        took["three criteria"].push_back(clock.milliseconds());
        if (!plan(catalogue, ask, sources, profile, options).plan) std::abort();
        took["plan"].push_back(clock.milliseconds());
    }
    std::printf("%d vertices, %d edges; %g paths on the front\n", vertices, edges, median(fronts));
    for (const char* row : kRows) std::printf("  %-16s %9.3f ms\n", row, median(took[row]));
}

}  // namespace

int main(int count, char** arguments) {
    const int graphs = count > 1 ? std::max(1, std::atoi(arguments[1])) : 21;
    measure(50, 200, graphs);
    measure(500, 2500, graphs);
}
