// The numbers behind multigrid.cpp: grids, and what becomes of them.
//
// A grid of n x n places is two planes, u and g: 4 u less its four neighbours is g, and u is 0 on
// the border. Of the finest one the space is "fine", of coarser ones "down" until u is found, then
// "up".
#pragma once

#include <algorithm>
#include <any>
#include <fmt/format.h>
#include <memory>
#include <memory_resource>
#include <string>
#include <utility>
#include <vector>

#include "graph/transition.hpp"

namespace edgewise::poisson {

using Finer = std::shared_ptr<const Data>;  // what waits beside a coarser grid, as its facet

inline Offer solved(const Representation& grid) {
    Offer offer{.from = grid, .to = grid};
    offer.to.space = grid.space == "fine" ? "smooth" : "up";
    return offer;
}
inline Offer coarser(const Representation& grid) {
    if (grid.extent.x == 3) return Offer::no("3 x 3 places are the coarsest grid");
    Offer offer{.from = grid, .to = grid};
    offer.to.space = "down";
    offer.to.facets = {"finer"};
    offer.to.facet_bytes += grid.bytes();
    offer.to.extent.x = offer.to.extent.y = grid.extent.x / 2 + 1;
    return offer;
}
/// Back from the coarser one. Of the finest grid one more cycle is done then.
inline Offer finer(const Representation& grid) {
    Offer offer{.from = grid, .to = grid};
    offer.to.extent.x = offer.to.extent.y = 2 * grid.extent.x - 1;
    offer.to.facet_bytes -= offer.to.bytes();
    if (offer.to.facet_bytes > 0) return offer;
    offer.to.drop_facets();
    offer.to.space = "fine";
    offer.to.content = std::to_string(std::stoi(grid.content) + 1);
    return offer;
}

/// Of a grid, u alone.
inline Offer answer(const Representation& grid) {
    Offer offer{.from = grid, .to = grid};
    offer.to.space = "grid";
    offer.to.content = "solution";
    offer.to.extent.z = 1;
    return offer;
}

/// An edge that goes on in any cycle: in its kinds {0} is the number of those done, {1} one more.
inline Transition in_cycles(Transition edge, int cycles) {
    const auto joins = std::exchange(edge.joins, {});
    for (int done = 0; done <= cycles; ++done)
        for (const auto& [from, to] : joins)
            edge.joins.push_back({fmt::format(fmt::runtime(from), done),
                                  fmt::format(fmt::runtime(to), done, done + 1)});
    return edge;
}

/// Calls use(i) for all places inside, row by row.
template <class Use>
void each_inside(std::int64_t n, Use&& use) {
    for (std::int64_t y = 1; y < n - 1; ++y)
        for (std::int64_t i = y * n + 1; i < (y + 1) * n - 1; ++i) use(i);
}

inline void gauss_seidel(Data& grid, int sweeps) {
    const std::int64_t n = grid.what.extent.x;
    double* u = grid.as<double>();
    const double* g = u + n * n;
    for (; sweeps > 0; --sweeps)
        each_inside(
            n, [&](auto i) { u[i] = 0.25 * (u[i - n] + u[i + 1] + u[i + n] + g[i] + u[i - 1]); });
}

inline void jacobi(Data& grid, int sweeps) {
    const std::int64_t n = grid.what.extent.x;
    double* u = grid.as<double>();
    const double* g = u + n * n;
    std::vector<double> before(u, u + n * n);
    for (; sweeps > 0; --sweeps) {
        each_inside(n, [&](auto i) {
            u[i] = 0.25 * (before[i - n] + before[i + 1] + before[i + n] + g[i] + before[i - 1]);
        });
        std::copy_n(u, n * n, before.begin());
    }
}

/// Copies a grid with what waits beside it.
inline void copy(const Data& from, Data& to) {
    copy_box(from, to);
    to.facets = from.facets;
}

inline void take_u(const Data& in, Data& out, std::pmr::memory_resource*) {
    std::copy_n(in.as<double>(), out.what.samples(), out.as<double>());
}

/// Smooths, then hands the residual to a coarser grid, which solves for the error of u: its g is
/// the residual, restricted by weights 1 2 1 along both axes, for steps twice as wide.
inline void go_coarser(const Data& in, Data& out, std::pmr::memory_resource* memory) {
    const auto smooth = std::make_shared<Data>(Data::make(in.what, memory));
    copy(in, *smooth);
    gauss_seidel(*smooth, 2);
    const std::int64_t n = in.what.extent.x, coarse = out.what.extent.x;
    const double *u = smooth->as<double>(), *g = u + n * n;
    const auto left = [&](std::int64_t i) {
        return g[i] - 4 * u[i] + u[i - n] + u[i - 1] + u[i + 1] + u[i + n];
    };
    std::fill_n(out.as<double>(), 2 * coarse * coarse, 0.0);
    each_inside(coarse, [&](auto to) {
        const std::int64_t i = 2 * (to / coarse) * n + 2 * (to % coarse);
        const double corners =
            left(i - n - 1) + left(i - n + 1) + left(i + n - 1) + left(i + n + 1);
        const double sides = left(i - n) + left(i - 1) + left(i + 1) + left(i + n);
        out.as<double>()[coarse * coarse + to] = (4 * left(i) + 2 * sides + corners) / 4;
    });
    out.facets["finer"] = Finer(smooth);
}

/// Adds what the coarser grid found, linearly interpolated, and smooths.
inline void go_finer(const Data& in, Data& out, std::pmr::memory_resource*) {
    copy(*std::any_cast<const Finer&>(in.facets.at("finer")), out);
    const std::int64_t n = out.what.extent.x, coarse = in.what.extent.x;
    const double* found = in.as<double>();
    each_inside(n, [&](auto i) {
        const std::int64_t x = i % n, y = i / n;
        const double* above = found + y / 2 * coarse;
        const double* below = found + (y + 1) / 2 * coarse;
        out.as<double>()[i] +=
            (above[x / 2] + above[(x + 1) / 2] + below[x / 2] + below[(x + 1) / 2]) / 4;
    });
    gauss_seidel(out, 1);
}

}  // namespace edgewise::poisson
