#pragma once

#include <memory>
#include <optional>

#include "engine/engine.hpp"
#include "engine/listener.hpp"
#include "engine/refinement.hpp"
#include "engine/written.hpp"
#include "request/input.hpp"
#include "request/make_request.hpp"
#include "request/outputs.hpp"
#include "runtime/memory_budget.hpp"

namespace edgewise {

/// What a request is opened for.
struct Opening {
    bool runs = false;   // here, on one rank, with samples; else it is only planned
    bool shows = false;  // pictures of the result and of its error are made beside it
    /// The samples outlive the runs, so that there can be many; else a run that has all its results
    /// may give them back before it writes.
    bool keeps_samples = false;
    /// The process is somebody else's: budgets of memory count what the request takes, and not what
    /// the process holds besides.
    bool guest = false;
    /// Samples in place of the input's: then none are read. Where the input has no name they are
    /// all that is known of it: samples one unit apart, or as the query's selection says.
    std::shared_ptr<const Data> given = {};
    /// Takes pictures on the way, of edges that have its watch.
    std::shared_ptr<Refinement> refinement = {};
    /// The description of the input, where it is known. Its selection names the time point.
    std::shared_ptr<const Input> described = {};
    /// The same as it was read before, with its samples: they are not read again, unless the
    /// request needs more of their digits.
    std::shared_ptr<const Input> loaded = {};

    /// Bytes of samples that the program holds.
    double held() const noexcept;
};

/// A request as it is asked: its words, and what the graph needs to know of them.
struct Asked {
    Engine engine;
    Query query;
    Opening as;
    Request want;                     // what the graph knows of it: each stage knows more
    bool threads_of_machine = false;  // its threads are the profile's, of one rank
    std::optional<Window> window;     // of the result; nothing where it became a grey ramp
};

/// The first stage of a request: what its words and the file say. There are no samples yet.
struct Opened : Asked {
    explicit Opened(Asked asked) : Asked(std::move(asked)) {}

    /// Of all samples and scratch; before all data, which give their bytes back to it.
    std::shared_ptr<MemoryBudget> memory;
    double resident = 0;     // bytes of the process without `memory`
    double peak_before = 0;  // most bytes that the process ever had until then
    std::optional<Outputs> outputs;
    Input input;
    Geometry geometry;
    Written written;

    /// Frames are written as they come; else they wait until all are there: the default window of
    /// values needs the range of all.
    bool writes_at_once() const noexcept;
};

/// @throws RequestError
Asked ask(const Engine& engine, Query query, Opening as = {});

/// Reads the description of the input and checks what is to be written.
/// @param messages  is told what is wrong with the request or may be
/// @throws RequestError, InputError; ColoursToMerge, see take_geometry
Opened open(Asked asked, Listener& messages);

/// What is written of a request, as far as it is known.
/// @param low,high  of the input's values
void take_written(Opened& opened, double low, double high);

/// Whether another machine than this one is planned for.
bool is_elsewhere(const Asked& asked);

}  // namespace edgewise
