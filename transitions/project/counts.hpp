#pragma once

namespace edgewise {

// What compositing W samples of a ray takes ([W93] Appendix B, TABLE 32 to 37), with I the
// intensity premultiplied by its opacity (EQ 83) and t = 1 - opacity (EQ 88). Trees pair neighbours
// until one is left; an odd one is left over at the front or at the back.

enum class Compositing { back_to_front, front_to_back, tree_from_back, tree_from_front, sum };

/// Composites that also need a new transparency: all but those whose result is the last of a ray.
/// One sample has none, where TABLE 35 says W - 2.
/// EQ 89 has the sum for tree_from_front, but subtracts it: from i = 1 on it is the answer itself.
double transparency_updates(Compositing how, int samples) noexcept;

/// TABLE 33: composites of intensities, whatever the order.
constexpr double composites(int samples) noexcept { return samples - 1; }

/// TABLE 36: W products to premultiply, one a composite, one an update.
double multiplications(Compositing how, int samples) noexcept;
/// TABLE 37, with transparencies: W - 1 to make them, one a composite.
double additions(int samples) noexcept;
/// TABLE 37, with opacities. An update takes one more where 1 - opacity is kept from its composite,
/// else two: the thesis keeps it in the trees and not front to back.
double additions_with_opacity(Compositing how, int samples, bool kept) noexcept;

/// Multiplications and additions of one ray.
struct Counts {
    double multiplications = 0, additions = 0;

    double sum() const noexcept { return multiplications + additions; }
    friend bool operator==(const Counts&, const Counts&) = default;
};

/// Intensities that one transparency belongs to: red, green, blue.
inline constexpr int kColors = 3;

/// All of TABLE 36 and 37, with transparencies. What is done to an intensity, EQ 83 and 86, is done
/// to each of `colors`; EQ 87 and 88 once. One colour: the tables.
///
/// Errata, with L = ceil(log2 W) and P the number of ones in the binary W - 1:
///  - EQ 89 (updates of binary_tree_front_to_back) starts its sum at i = 0 and takes it from W - 1,
///    which is negative for every W > 2. The sum from i = 1 is the number itself, W - 1 - P. That
///    is a closed form, which section 2.5 says there is none of.
///  - TABLE 35 to 37 have for it what holds for the next power of two, with "<" in place of "<=":
///    2^L - W - L + P more than there are.
///  - TABLE 37, opacity, front_to_back: 4W - 6 takes two additions an update, the rows of the trees
///    one. With 1 - opacity kept as there it is 3W - 4 (section 2.3 says so): W - 2 less. TABLE 34
///    has two additions too.
Counts counts_of(Compositing how, int samples, int colors = 1) noexcept;
/// Of these EQ 83 and 88 alone, TABLE 32: W products a colour, W - 1 transparencies (the one at the
/// back is needed for no intensity).
Counts initial_counts(int samples, int colors = 1) noexcept;
/// What the opacity of the whole ray takes beyond them, which Appendix B does not ask for: updates
/// of the composites that have none, and one subtraction.
Counts opacity_counts(Compositing how, int samples) noexcept;

}  // namespace edgewise
