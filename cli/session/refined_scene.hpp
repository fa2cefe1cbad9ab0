#pragma once

namespace edgewise::cli {

struct Session;

/// Plans, and draws more of the preview where the choice hangs on chance of the draw.
///
/// Errors are upper estimates, so a path whose error keeps the budget may be left out. Where the
/// errors that the draws themselves say (Scene::likely) would choose a plan cheaper by more than a
/// tenth, the preview is measured again on 4 times the usual draws, then on 16 times (less where a
/// preview takes no more), as long as the two choices differ. Standard errors halve each time. It
/// must be worth it: 1000 runs of a faster plan save more time than drawing takes, which is two
/// seconds of one core at most.
///
/// Where none of the plans of more draws keeps the budgets, that of fewer stays.
/// Where no plan keeps the budgets none is looked for: what would be the least that does
/// (way_out.hpp) is a matter of the usual draws.
///
/// A path is then accepted where the upper estimate of any of at most three previews keeps the
/// budget. Of one the chance that an error above the budget passes is 0.13 % (3 standard errors,
/// light tails), thus of three it is at most 0.4 %.
///
/// Nothing is drawn where a choice by likeness does not hang on it.
///
/// A pilot measures errors itself, and scenes without draws are left as they are. Afterwards
/// `answer`, `scene` and `drawn` are those of the last preview.
void ask_planner(Session& session);

}  // namespace edgewise::cli
