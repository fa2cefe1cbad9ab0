#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/opened.hpp"
#include "scene/statistics.hpp"

namespace edgewise {

struct Looked;

/// When errors are measured on a preview: never, so that they are guessed; where a choice depends
/// on them; or because somebody wants to know them.
enum class ErrorsWanted { never, for_choice, asked };

/// How much of a plan is worked out.
struct Effort {
    ErrorsWanted errors = ErrorsWanted::asked;
    bool front = true;  // all paths that no other beats
    /// See PlanOptions.
    std::optional<std::uint64_t> random_costs = {};
};

/// What a time point takes from a series, so that its picture can be held against the others'.
struct InSeries {
    double low = 0, high = 0;       // of the values of all of them
    const Looked* first = nullptr;  // that what hangs on values is taken from; null: it is this
};

/// What choosing took [s]. `preset` is what a preset or a window needs of the values, whatever path
/// is taken.
struct Spent {
    double statistics = 0, preset = 0, preview = 0, search = 0, pilot = 0;

    double all() const noexcept { return statistics + preset + preview + search + pilot; }
};

/// The second stage: the samples are there, and what errors and ray casts depend on is measured.
struct Looked : Opened {
    explicit Looked(const Opened& opened) : Opened(opened) {}

    Representation stored;              // of the samples, also when they were given back
    Statistics statistics;              // of the samples, where there are any
    std::optional<TakenPreset> preset;  // of modes with a transfer function, where there is one
    Scene scene;
    /// The same without its preview. A path that needs no preview to be chosen is chosen by it,
    /// whether or not errors are measured to be shown.
    Scene guessed;
    int drawn = 1;  // so many times the usual draws of its preview; 0: none, errors are guesses
    Spent spent;

    Ask ask() const noexcept { return {want, scene}; }
    /// Where a path may start: at the samples in memory; where there are ranks, also at the samples
    /// on disk, of which every rank reads its share.
    std::vector<Source> sources() const;
};

/// Whether errors are measured: where the choice depends on them as such they are always wanted.
ErrorsWanted errors_of(const Asked& asked, const Effort& effort);

/// Reads the samples. @return what the file is, with its samples; of a description without
/// @throws InputError, RequestError, std::bad_alloc; Infeasible where there is no room for them
Input read(const Opened& opened, Listener& messages);

/// Looks at the samples. What is known of the data from an earlier run is not measured again.
/// @param input  as read() has it
/// @throws RequestError
Looked look(const Opened& opened, Input input, const Effort& effort, Listener& messages,
            const std::optional<InSeries>& series = {});

/// Measures what errors and ray casts depend on.
/// @param times  so many times the usual draws of a preview; 0: none, errors are guesses
void look_at_data(Looked& looked, int times);

/// A description in place of samples that are too many.
Looked described(const Opened& opened);

}  // namespace edgewise
