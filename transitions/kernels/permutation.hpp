#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "graph/samples.hpp"
#include "transitions/kernels/columns.hpp"
#include "transitions/kernels/grid.hpp"
#include "transitions/kernels/shears.hpp"

namespace edgewise::kernels {

/// What an object site sends to its screen site: its own sample (me), or the input reconstructed
/// where T^-1 puts the screen site, from the nearest sample (zoh) or linearly (foh).
enum class Send { me, zoh, foh };

/// The forward permutation warp: one object site, one screen site, one value sent.
///
/// Walks the sites of the object box, widened by the displacement of the rule so that every screen
/// site that sees the input has its object site, and writes the value into a screen array that was
/// filled with the value for outside. No site is written twice, so regions may run at the same
/// time. Frames  indices with centres at integers, object and screen Border  that of BackwardWarp:
/// the input reaches half a sample beyond the outermost centres, and
///         the nearest sample continues there
/// Place   T^-1 M x = x + sum of rounding errors times constants, so the inverse is never applied
/// Source  [W93] FIGURE 28 to 30, EQ 22, Theorem 3.1
class PermutationWarp {
 public:
    /// `object` must stay alive. `to_screen` maps object sites to screen sites.
    PermutationWarp(const Grid& object, const ShearChain& to_screen, Send send,
                    const Extent& screen);
    /// The same for a box of the screen, and samples of that box alone.
    PermutationWarp(const Grid& object, const ShearChain& to_screen, Send send,
                    const Extent& screen, const Region& box);

    /// The box of object sites that may have something to send.
    Region sites() const noexcept;
    /// The box of samples that these read.
    Region reads() const noexcept;
    /// Sends from a part of sites(). `screen` is [extent of the box] with the channels of the input
    /// interleaved, filled with the value for outside.
    void operator()(const Region& sites, float* screen) const noexcept;

    /// What every row needs, prepared once.
    struct Plan {
        Grid object;
        ShearChain chain;
        Send send = Send::foh;
        Extent screen;
        Region box;                                          // of the screen: what is written
        std::array<std::int64_t, 3> halo{};                  // sites beyond the outermost centres
        std::array<double, 3> reach{};                       // |M x - T x| on the screen
        std::array<double, 3> along_x{};                     // T of one step along an object row
        std::array<std::array<double, 3>, 5> error_moves{};  // of the object point, for each shear
        bool lanes = true;  // type, channels and strides that vector gathers can take
    };

    /// The sites of an object row that may reach the screen, and its coordinates behind the exact
    /// permutation: start + x * step.
    struct Row {
        std::int64_t y = 0, z = 0;
        Columns sites;
        std::array<double, 3> start{}, step{};
    };

 private:
    Row row_at(std::int64_t y, std::int64_t z, Columns sites) const noexcept;
    Plan plan_;
};

/// A part of sites() whose objects and screen sites both stay in the second-level cache.
Extent preferred_sites(const Extent& object) noexcept;

void permute_simd(const PermutationWarp::Plan&, std::span<const PermutationWarp::Row> rows,
                  float* screen) noexcept;

}  // namespace edgewise::kernels
