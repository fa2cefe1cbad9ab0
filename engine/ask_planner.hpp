#pragma once

namespace edgewise {

struct Planned;

/// Plans: chooses by what is known, judges whether a preview, or a larger one, can pay, and draws
/// it; until the answer stays.
///
/// With the default budget (Budget::like) and nobody asking for errors, no preview is drawn if the
/// fastest path is as good whatever a preview would show. Nor is it drawn if the fastest path saves
/// less, over the runs asked for, than the preview costs by count. Then the fastest path is chosen
/// that is surely as good.
///
/// With a budget of error: errors are upper estimates, so a path that keeps the budget may be left
/// out. The errors that the draws themselves say (Scene::likely) may choose a plan that is cheaper
/// by more than a tenth. Then the preview is measured again on 4 times the usual draws, and on 16
/// times, as long as the two choices differ. Standard errors halve each time. The runs asked for
/// must save more time than the draws cost, and the draws may cost two seconds at most.
///
/// Where none of the plans of more draws keeps the budgets, that of fewer stays.
/// Where no plan keeps the budgets, nothing more is drawn: the least budgets that would do
/// (way_out.hpp) follow from the usual draws.
///
/// A path is then accepted where the upper estimate of any of at most three previews keeps the
/// budget. The chance that an error above the budget passes is 0.13 % for one preview (3 standard
/// errors, light tails), thus at most 0.4 % for three.
///
/// A pilot measures errors itself, and scenes without draws are left as they are.
/// @param planned  without an answer
/// @return the same with it, and with the scene of the last preview
Planned ask_planner(Planned planned);

}  // namespace edgewise
