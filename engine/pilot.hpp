#pragma once

namespace edgewise {

struct Answer;
class Listener;
struct Planned;

/// Measures the paths that could still win. @return the answer with the best of them
///
/// The path that predictions choose comes first, then the others, fastest predicted first. A path
/// is left out if even the low end of its predicted seconds is beyond the best measured ones, or if
/// its predicted error is too far beyond the budget. Of many frames a few are run. Each path is run
/// and verified once. It is verified on more and more samples while these leave open whether it
/// keeps the budget of error. The close ones then run in rounds, whose order is reversed each time.
/// The results are kept (Wisdom), and known paths run again only where their errors are open. All
/// runs use the profile's processors, so that the choice does not depend on --threads.
///
/// A rival must be faster than the predicted choice by more than what two runs of one path differ
/// by. Otherwise the predicted choice stays.
/// @param all    every path (exhaustive), else only contenders (pilot)
/// @param limit  [s] after which the best path so far is chosen
/// @param most   [s] that the limit grows to, at most, where errors are open and references need a
///               good part of it
Answer measured_answer(const Planned& planned, Listener& messages, bool all, double limit,
                       double most);

}  // namespace edgewise
