// Salt and pepper are taken out of an image: opened, then closed by a box, so eroded, dilated twice
// and eroded. Boxes add up (Minkowski): eroding by one and then by another is eroding by their sum.
// So a vertex says through how much of its stage's box the image has gone.
//
//   image/0:0,0 --direct---------------------------> image/1:0,0 --> ... --> image/cleaned
//     |    \-----line_x--> image/0:3,0 --line_y--------^
//     \--step--> image/0:1,1 --step--> image/0:2,2 --step
#include <map>

#include "own_graph.hpp"
#include "transitions/catalogue.hpp"

using namespace edgewise;

constexpr JobTraits kClean{.name = "clean", .target = "image/cleaned"};
constexpr int kSide = 512, kStages = 4, kReach = 3;  // of the box, to each side

std::string content(int stage, int x, int y) {
    if (x == kReach && y == kReach) return content(stage + 1, 0, 0);
    const std::string reached = std::to_string(x) + "," + std::to_string(y);
    return stage == kStages ? "cleaned" : std::to_string(stage) + ":" + reached;
}

/// The least or the largest value around each sample. What lies beyond the image does not count.
void filter(bool erodes, int reach_x, int reach_y, const float* in, float* out) {
    std::fill_n(out, kSide * kSide, erodes ? INFINITY : -INFINITY);
    for (int y = 0; y < kSide; ++y)
        for (int j = std::max(0, y - reach_y); j <= std::min(kSide - 1, y + reach_y); ++j)
            for (int i = -reach_x; i <= reach_x; ++i)
                for (int x = std::max(0, -i); x < std::min(kSide, kSide - i); ++x) {
                    const float a = out[y * kSide + x], b = in[j * kSide + x + i];
                    out[y * kSide + x] = erodes ? std::min(a, b) : std::max(a, b);
                }
}

/// Filters by a box that reaches so far.
Transition by_box(const std::string& name, int x, int y) {
    Transition edge{.name = "morphology." + name, .error = exact};
    std::map<std::string, std::string> leads;
    for (int stage = 0; stage < kStages; ++stage)
        for (int i = 0; i + x <= kReach; ++i)
            for (int j = 0; j + y <= kReach; ++j)
                leads[content(stage, i, j)] = content(stage, i + x, j + y);
    for (const auto& [from, to] : leads) edge.joins.push_back({"image/" + from, "image/" + to});
    edge.offer = [leads](const Representation& from, auto&&...) {
        Offer offer{.from = from, .to = from};
        offer.to.content = leads.at(from.content);
        return offer;
    };
    edge.work = [=](const Offer& offer, auto&&...) {  // a comparison for each place of the box
        return Work{.operations = (2.0 * x + 1) * (2.0 * y + 1) * kSide * kSide,
                    .streamed = offer.from.bytes() + offer.to.bytes()};
    };
    edge.run = [=](const Offer& offer, const Ask&, const Data& in, Data& out, auto&&...) {
        const bool erodes = offer.from.content[0] == '0' || offer.from.content[0] == '3';
        filter(erodes, x, y, in.as<float>(), out.as<float>());
    };
    return edge;
}

int main() {
    Catalogue edges = catalogue();
    for (const Transition& edge : {by_box("direct", 3, 3), by_box("line_x", 3, 0),
                                   by_box("line_y", 0, 3), by_box("step", 1, 1)})
        edges.push_back(edge);

    MemoryBudget memory(std::size_t{64} << 20);
    const auto noisy = data_of({"image", content(0, 0, 0), {kSide, kSide, 1}}, memory);
    std::vector<double> clean;
    for (int i = 0; i < kSide * kSide; ++i) {
        const int x = i % kSide, y = i / kSide;
        clean.push_back((x / 64 * 5 + y / 64 * 3) % 7);  // squares, much larger than the box
        const int noise = x % 16 == 8 && y % 16 == 8 ? (x + y) / 16 % 2 * 20 - 10 : 0;
        noisy->as<float>()[i] = float(clean.back() + noise);
    }
    return !are_right(
        {edges, Job(kClean), noisy, clean, 0, memory},
        {{}, {"morphology.direct", 4}, {"morphology.line_x", 4}, {"morphology.step", 12}});
}
