#pragma once

#include <memory>
#include <optional>
#include <string>

#include "planner/search.hpp"

namespace edgewise {

/// The plain path of a request: one edge with a filter and its ordinary parameters.
struct PlainWay {
    std::string step;   // as `--via` takes it
    double likely = 0;  // RMSE of its result [values]
};

/// What Budget::like demands of the paths of one graph.
struct Alike {
    /// With likely errors in place of upper estimates; arcs that read by a barred filter, or at a
    /// longer step, are barred.
    Priced likely;
    std::optional<PlainWay> plain;
    double most = 0;  // likely RMSE that is as good [values]
};

/// The plain path of a likeness, by its filter and its step, from any of the sources, or nothing
/// where no edge offers one.
std::optional<PlainWay> plain_way(const Catalogue& catalogue, const Ask& ask,
                                  const std::vector<Source>& sources, const Like& like);

/// Where no edge offers the plain path, the paths that are not barred are compared with the most
/// accurate one of them.
std::shared_ptr<const Alike> alike_of(const Priced& priced, const Catalogue& catalogue,
                                      const Ask& ask, const Like& like);

/// How a route is compared; alike where nothing is asked for.
Likeness likeness_of(const Route& route, const Priced& priced);

/// Routes that no other dominates. Where Budget::like is set, also those that no other dominates
/// among the paths that are not barred, since a path by nearest samples may beat all of these.
std::vector<Route> routes_to_choose_from(const Priced& priced);

/// NRMSE that a plan is likely to have, by which it is compared, where an upper estimate is told.
/// Absent: unknown.
std::optional<double> likely_error(const Plan& plan, const Ask& ask,
                                   const std::vector<Source>& sources);

/// Whether a plan is as good as `like` asks, whatever the facts are that the scene does not have.
/// Then they need not be measured. It is tried on scenes with made-up facts.
bool alike_unseen(const Plan& plan, const Catalogue& catalogue, const Ask& ask,
                  const std::vector<Source>& sources, const Like& like);

}  // namespace edgewise
