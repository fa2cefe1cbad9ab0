// Poisson's equation on a square: smoothing alone, or V-cycles by way of coarser grids. A vertex's
// content is the number of cycles done. Finer grids lie beside coarser ones, as a facet.
//
//   fine/0 --jacobi, gauss_seidel--> smooth/0 --answer--> grid/solution <--answer-- fine/1, ...
//      \--coarser--> down/0+finer --> ... --solve--> up/0+finer --> ... --finer-----^
#include "own_graph.hpp"
#include "poisson.hpp"
#include "transitions/catalogue.hpp"

using namespace edgewise;

constexpr JobTraits kSolve{.name = "solve", .target = "grid/solution"};
constexpr int kSide = 65, kPlaces = kSide * kSide;
constexpr int kCycles = 8;  // at most
/// What is left of an error: after smoothing alone, and after a cycle, since each of its three
/// sweeps halves what coarser grids do not see (Brandt 1977).
constexpr double kLeft = 1e-4, kCycleLeaves = 0.125;
constexpr double kUpdate = 64;  // one waits for the one before: as many operations in vectors

auto places(double operations) {
    return [=](const Offer& offer) {
        const auto samples = double(std::max(offer.from.samples(), offer.to.samples()));
        return Work{.operations = operations * samples / 2};
    };
}
auto leaves(double gain) {  // of the error on the finest grid
    return [=](const Offer& offer) { return Error{.gain = offer.to.facets.empty() ? gain : 1}; };
}

/// @param power  of cos(pi h), by which a sweep shrinks errors
Transition relaxation(const std::string& name, const std::string& from, const std::string& to,
                      double power, double operations, void (*sweep)(Data&, int)) {
    const auto sweeps = [=](const Representation& grid) {
        const double rate = power * std::log(std::cos(M_PI / double(grid.extent.x - 1)));
        return std::ceil(std::log(kLeft) / rate);
    };
    return edge_of(
        name, {{from, to}}, poisson::solved,
        [=](const Offer& offer) { return places(operations * sweeps(offer.from))(offer); },
        leaves(kLeft),
        [=](const Data& in, Data& out, auto*) {
            poisson::copy(in, out);
            sweep(out, int(sweeps(in.what)));
        });
}

int main() {
    Catalogue edges = catalogue();
    for (const Transition& edge :
         {relaxation("smoothing.jacobi", "fine/{0}", "smooth/{0}", 1, 20, poisson::jacobi),
          relaxation("smoothing.gauss_seidel", "fine/{0}", "smooth/{0}", 2, kUpdate,
                     poisson::gauss_seidel),
          edge_of("multigrid.coarser",
                  {{"fine/{0}", "down/{0}+finer"}, {"down/{0}+finer", "down/{0}+finer"}},
                  poisson::coarser, places(2 * kUpdate + 20), leaves(1), poisson::go_coarser),
          relaxation("multigrid.solve", "down/{0}+finer", "up/{0}+finer", 2, kUpdate,
                     poisson::gauss_seidel),
          edge_of("multigrid.finer",
                  {{"up/{0}+finer", "up/{0}+finer"}, {"up/{0}+finer", "fine/{1}"}}, poisson::finer,
                  places(kUpdate + 20), leaves(kCycleLeaves), poisson::go_finer),
          edge_of("grid.answer", {{"fine/{0}", "grid/solution"}, {"smooth/{0}", "grid/solution"}},
                  poisson::answer, places(1), leaves(1), poisson::take_u)})
        edges.push_back(poisson::in_cycles(edge, kCycles));

    MemoryBudget memory(std::size_t{64} << 20);
    const auto problem = data_of({"fine", "0", {kSide, kSide, 2}, Type::f64}, memory);
    std::vector<double> u(kPlaces);
    std::fill_n(problem->as<double>(), 2 * kPlaces, 0.0);
    for (int i = 0; i < kPlaces; ++i)
        for (const int waves : {1, 9}) {  // eigenvectors: g is a multiple of u
            const double step = M_PI * waves / (kSide - 1);
            const double wave = std::sin(step * (i % kSide)) * std::sin(step * (i / kSide)) / waves;
            u[i] += wave;
            problem->as<double>()[kPlaces + i] += (4 - 4 * std::cos(step)) * wave;
        }
    const Label start{.bias = 0.51};  // RMS of u: the start is 0
    return !are_right({edges, Job(kSolve), problem, u, kLeft, memory, start},
                      {{}, {"smoothing.jacobi"}, {"smoothing.gauss_seidel"}});
}
