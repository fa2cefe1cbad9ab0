#pragma once

namespace edgewise::cli {

struct Session;

/// Measures the paths that could still win, and puts the best of them into the answer.
///
/// The path that the models chose comes first, then the others, fastest predicted first; a path is
/// left out when even the low end of its predicted seconds is beyond the best measured ones, or
/// its predicted error too far beyond the budget. Of many frames a few are run. Each path is run
/// and verified once, or on more and more samples while these leave open whether it keeps the
/// budget of error; the close ones run again and again in turn, forwards and backwards. What comes
/// out is kept (Wisdom), and paths that are known are run again only where their errors are open.
/// All runs use the profile's processors, so that the choice does not depend on --threads.
///
/// A rival must be faster than the models' choice by more than what two runs of one path differ
/// by: else that stays.
/// @param all    every path (exhaustive), else only contenders (pilot)
/// @param limit  [s] after which the best so far is taken
/// @param most   [s] that it grows to, at most, where errors are open and references take a good
///               part of it
void measure_contenders(Session& session, bool all, double limit, double most);

}  // namespace edgewise::cli
