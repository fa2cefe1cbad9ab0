#pragma once

#include "graph/data.hpp"
#include "graph/transition.hpp"
#include "transitions/filter/neighbourhood.hpp"

namespace edgewise {

/// The second pass of an opening or closing near the borders.
///
/// The first pass reads sample b(p + k) for each result p and place k of the kernel, where b says
/// which sample stands at a place (see bordered()). For the two to be an opening, the second must
/// give each sample q the extreme of all results p that read it: of all p = q' - k for all places
/// q' with b(q') = q. An ordinary pass over results that are mirrored or clamped takes the same
/// ones where the kernel is its own mirror image along each axis (of a clamped border: where all
/// that lies between a place of it and the centre's planes is in it too), and else other ones.
/// Source  J. Serra (ed.), Image Analysis and Mathematical Morphology II, 1988, chapter 1:
/// adjunctions
///
/// @return whether an ordinary pass takes other ones. Of zeros and of a border that repeats: never;
///         zeros are as scipy has them, where neither order nor idempotence hold
bool needs_adjoint(const Neighbourhood& second);

/// Samples that adjoin() works out.
double adjoined_samples(const Neighbourhood& second, const Extent& n);

/// Works out again what lies within the kernel's reach of a border, place by place. A sample that
/// no result reads stays as it was, so that order and idempotence hold for it too.
/// @param input  of the first pass
/// @param in     results of the first pass
/// @param out    of the second, of the same extent; numbers of `in` ordered as they are stored, or
///               values of both
void adjoin(const Neighbourhood& second, const Data& input, const Data& in, Data& out,
            const Context& context);

}  // namespace edgewise
