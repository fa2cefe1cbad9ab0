#pragma once

#include <optional>
#include <string>
#include <vector>

#include "graph/errors.hpp"
#include "graph/transition.hpp"
#include "request/geometry.hpp"
#include "request/input.hpp"
#include "request/outputs.hpp"
#include "request/query.hpp"
#include "scene/statistics.hpp"
#include "transfer/robust_window.hpp"

namespace edgewise {

/// A volume whose channels are one colour: several requests render it, one for each (`Merge`).
struct ColoursToMerge : RequestError {
    using RequestError::RequestError;
};

/// What the graph needs to know of a request before its input is looked at: job, mode, budgets.
/// @throws RequestError
Request request_of(const Query& query);

/// What of the file is read, and what stands where nothing was measured.
store::Selection selection_of(const Query& query);

/// How far surfaces of labels are smoothed is a parameter of the edge that makes them.
/// @throws RequestError where there are none
Query with_smoothing(Query query, const Catalogue& edges);

/// Puts the geometry into the request. @throws RequestError, NoPlan
/// @throws ColoursToMerge  a volume of colours, which `Merge` renders
Geometry take_geometry(Request& want, const Query& query, const Input& input,
                       const std::optional<Outputs>& outputs);

/// The transfer function that is taken: of a preset, or of a file.
struct TakenPreset {
    Message name;       // of the preset, or as messages call the file
    bool file = false;  // it is a file's
    std::string kind;  // of data, for which it was chosen: "an MR of a head"; "": somebody named it
    ValueWindow window;                // the values that it is spread over
    std::optional<double> noise = {};  // of an MR: its standard deviation over the window's width
    bool smooths = false;              // gradients, because of it
};

/// What is to be said of a request: what may be wrong with it, and what is worth knowing.
struct Remarks {
    std::vector<Message> warnings = {}, notices = {};
    std::optional<TakenPreset> preset = {};
};

/// Puts in what hangs on values: what a MIP's misses show, an X-ray's zero, a composite's transfer
/// function and the material that comes with it.
/// @param window  is taken away where the transfer function runs over it
/// @param input   with its samples
/// @param is_viewed  somebody sees the result through a window; else none is looked for
/// @throws RequestError
Remarks take_values(Request& want, std::optional<Window>& window, const Query& query,
                    const Input& input, const Statistics& statistics, bool is_viewed = true);

/// The same as of another request of one kind.
void take_values_of(const Request& from, Request& want);

/// What part of the smallest spacing a grey ramp's opacities are for: 1, and 2, 4, 8 or 16 for
/// sparse volumes, whose light would hardly be seen: as large as makes the mean a 16th of the ramp.
/// @param share  of the ramp that the mean of the values lies at, 0..1
int ramp_part(double share) noexcept;

/// A grey ramp: opacity 0 to 0.05 per `unit` of length between two values.
Transfer grey_ramp(double low, double high, double unit);

}  // namespace edgewise
