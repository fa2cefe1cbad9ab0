#pragma once

/// The library, for programs that want pictures, warps, filters and surfaces of volumes:
///
///     Engine engine = default_engine();
///     Query query;
///     query.mode = Mode::mip;
///     query.max_error = 0.02;
///     Prepared plan = prepare(engine, query, Volume::read("ct/"));
///     plan.run({.on_frame = show});
///
/// An engine, a query, a volume and a prepared plan are values: what has been made never changes,
/// copies are cheap, and threads share them.

#include "edgewise/volume.hpp"
#include "engine/prepared.hpp"
#include "graph/errors.hpp"
#include "graph/version.hpp"
#include "planner/profile.hpp"
#include "settings/settings.hpp"
#include "surface/mesh.hpp"
#include "transfer/presets.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {

/// All edges, the profile that `edgewise calibrate` left in a folder for this processor, else the
/// built-in one, and facts of data that are kept for as long as the engine lives.
/// @param folder  ~/.config/edgewise, unless somebody has moved it; "": none. Nothing else is read.
/// @throws InputError for a profile that is broken
Engine default_engine(const std::string& folder = {});

/// A query in which all of this is set, by the names of its settings: settings() lists them.
///
///     query_of(Job::render, {{"mode", "xray"}, {"rotate", "20,0,0"}, {"max_error", 0.02}})
///
/// @throws SettingError, RequestError
Query query_of(Job job, const std::vector<Given>& given);
/// Sets one of them. A step of the geometry is added to those that are there.
/// @throws SettingError, RequestError
void set(Query& query, std::string_view name, const SettingValue& value);

/// The type that values of a result are told in by a rule that hangs on what is asked alone. What a
/// path computes in (Prepared::result()) may be wider, or narrower where that loses nothing, and
/// differs from path to path. Of filters: that of the samples in memory where all results are
/// samples (medians and flat extremes); else f32, of samples of 32-bit integers and f64 f64. Of all
/// else it is the path's. Where stored numbers are not the values themselves, these are f32.
Type result_type(const Prepared& plan);

/// Plans a query for a volume and keeps its samples for the runs. Query::input and selection are
/// the volume's.
/// @throws OutOfLimits for a field that is out of the limits of its setting, RequestError,
///         InputError, Infeasible, Cancelled, std::bad_alloc
Prepared prepare(const Engine& engine, Query query, const Volume& volume);
/// @param messages  is told what may be wrong, and may end it
Prepared prepare(const Engine& engine, Query query, const Volume& volume, Listener& messages);

}  // namespace edgewise
