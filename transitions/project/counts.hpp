#pragma once

namespace edgewise {

// What compositing W samples of a ray takes ([W93] Appendix B, TABLE 32 to 37), with I the
// intensity premultiplied by its opacity (EQ 83) and t = 1 - opacity (EQ 88). Trees pair neighbours
// until one is left; an odd one is left over at the front or at the back.

enum class Compositing { back_to_front, front_to_back, tree_from_back, tree_from_front, sum };

/// Composites that also need a new transparency: all but those whose result is the last of a ray.
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

}  // namespace edgewise
