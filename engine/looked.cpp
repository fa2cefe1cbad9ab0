#include "engine/looked.hpp"

#include <chrono>
#include <cmath>
#include <fmt/format.h>
#include <utility>

#include "engine/facts/known_scene.hpp"
#include "engine/guesses.hpp"
#include "engine/only_labels.hpp"
#include "engine/planned.hpp"
#include "measure/since.hpp"
#include "planner/cost.hpp"
#include "scene/ring_free.hpp"
#include "scene/scene.hpp"

namespace edgewise {
namespace {

using Clock = std::chrono::steady_clock;

/// Whether the samples that a program has read are those that the request needs.
bool is_loaded(const Opened& opened) {
    const Input *const loaded = opened.as.loaded.get(), &needed = opened.input;
    return loaded && loaded->keep == needed.keep && loaded->selection == needed.selection;
}

/// Why there is no room for samples, or "".
Message lack_of_room(const Opened& opened) {
    const Input& input = opened.input;
    const Budget& budget = opened.want.budget;
    if (opened.want.ranks == 1 && *budget.bytes <= opened.resident)
        return message(
            "@max_memory({:.3g} MiB): the process takes {:.0f} MiB before it holds any samples",
            *budget.bytes / 0x1p20, opened.resident / 0x1p20);
    const auto limit = static_cast<double>(opened.memory->limit());
    if (opened.as.given || is_loaded(opened) || input.described || input.bytes() <= limit)
        return {};
    return message("{}: its samples take {:.0f} MiB, and {:.0f} MiB are left for them{}",
                   input.name, input.bytes() / 0x1p20, limit / 0x1p20,
                   opened.query.max_memory ? message(" by @max_memory") : " on this machine");
}

/// Before samples are read. Where there is no room for them, how much would do is planned as if
/// they were only described.
void expect_room(const Opened& opened) {
    const Message lack = lack_of_room(opened);
    if (lack.empty()) return;
    const Planned planned = unplanned(described(opened), {});
    WayOut ways = way_out_of(planned, Errors::guessed);
    const Message text = message("{}{}", lack, text_of(ways));
    throw Infeasible(text, std::move(ways));
}

/// What hangs on values, of which a composite's transfer function has something to say.
void take_transfer(Looked& looked, const Statistics& statistics,
                   const std::optional<InSeries>& series, Listener* messages) {
    Statistics seen = statistics;
    if (series) {
        if (const Looked* first = series->first) {
            take_values_of(first->want, looked.want);
            looked.window = first->window;
            looked.preset = first->preset;
            return;
        }
        if (series->low <= series->high) seen.low = series->low, seen.high = series->high;
    }
    const bool nowhere = looked.outputs && looked.outputs->none();
    const bool is_viewed = looked.as.shows || !(nowhere || looked.as.guest);
    Remarks remarks =
        take_values(looked.want, looked.window, looked.query, looked.input, seen, is_viewed);
    for (const Message& warning : remarks.warnings)
        if (messages) messages->warning(warning);
    for (const Message& notice : remarks.notices)
        if (messages) messages->notice(notice);
    looked.preset = std::move(remarks.preset);
}

/// A picture as good as linear interpolation makes it has no rings either.
void take_step(Looked& looked, const Statistics& statistics) {
    Request& want = looked.want;
    if (!want.budget.like || !want.job->of_rays()) return;
    const Data& data = *looked.input.data;
    // Of a description nothing is known but the range: edges that take four samples.
    const double slope = data.samples.data() ? known_slope(looked.engine, looked.input, want)
                                             : (statistics.high - statistics.low) / 4;
    want.budget.like->step = ring_free_step(want, statistics.low, statistics.high, slope);
}

/// What there is no data of: guesses take the place of measurements.
void take_description(Looked& looked, const std::optional<InSeries>& series, Listener* messages) {
    Input& input = looked.input;
    input.data = described_data(input);
    looked.stored = input.data->what;
    const Statistics statistics = described_statistics(*input.described, input.header);
    take_transfer(looked, statistics, series, messages);
    take_step(looked, statistics);
    looked.scene = looked.guessed = described_scene(*input.described, input.header);
    take_written(looked, statistics.low, statistics.high);
}

/// What f32 takes from f64 on the way into memory, as if all values were as large as the largest.
double lost_in_reading(const Looked& looked) {
    const Input& input = looked.input;
    if (input.header.type != Type::f64 || looked.stored.type != Type::f32 || input.table ||
        looked.as.given || looked.want.field == Field::nearest)
        return 0;
    const Scene& scene = looked.scene;
    return std::max(std::abs(scene.low), std::abs(scene.high)) * 0x1p-24 / std::sqrt(3.0);
}

/// The samples' values, and what hangs on them.
void take_statistics(Looked& looked, const std::optional<InSeries>& series, Listener& messages) {
    Input& input = looked.input;
    auto begin = Clock::now();
    looked.statistics = known_statistics(looked.engine.facts().get(), input, looked.memory.get());
    looked.spent.statistics += since(begin);
    const Statistics& statistics = looked.statistics;
    if (statistics.non_finite > 0)
        messages.file_warnings(input, {fmt::format("{}: {} values are not finite", input.name,
                                                   statistics.non_finite)});
    begin = Clock::now();
    if (input.table) looked.want.outside = place_in(*input.table, input.outside);
    take_transfer(looked, statistics, series, &messages);
    const bool on_every_path = looked.preset || looked.window;
    (on_every_path ? looked.spent.preset : looked.spent.statistics) += since(begin);
    begin = Clock::now();
    take_outside(looked);
    take_step(looked, statistics);
    looked.spent.statistics += since(begin);
}

/// Whether a preview is drawn at once: where the choice depends on errors as such, they are always
/// wanted.
bool draws_at_once(const Looked& looked, const Effort& effort) {
    return errors_of(looked, effort) == ErrorsWanted::asked;
}

}  // namespace

ErrorsWanted errors_of(const Asked& asked, const Effort& effort) {
    if (effort.errors != ErrorsWanted::for_choice) return effort.errors;
    const Budget& budget = asked.want.budget;
    // Of results that are to be equal but for rounding it is only to be shown.
    const bool decides = budget.error && !budget.error_yields;
    return decides || asked.want.minimize == Minimize::error ||
                   asked.query.planner != Planner::estimate
               ? ErrorsWanted::asked
               : ErrorsWanted::for_choice;
}

std::vector<Source> Looked::sources() const {
    const Representation& what = stored;
    if (want.ranks == 1) return {{what, Label{.noise = lost_in_reading(*this)}}};
    Representation on_disk = what;
    on_disk.place = Place::disk;
    const double bytes = what.bytes();
    return {{on_disk}, {what, Label{.peak = bytes, .held = bytes}}};
}

void look_at_data(Looked& looked, int times) {
    const auto begin = Clock::now();
    const Demands asked = untried(looked.query.demands, looked.engine.edges());
    const Input& input = looked.input;
    const Statistics& statistics = looked.statistics;
    std::pmr::memory_resource* memory = looked.memory.get();
    looked.drawn = times;
    looked.guessed = unseen_scene(statistics);
    const Measuring measuring{looked.engine,           input,       statistics,
                              looked.guessed,          looked.want, asked,
                              looked.query.max_memory, memory};
    looked.guessed.facts = known_counts(measuring).facts;
    looked.scene = times == 0 ? looked.guessed : known_scene(measuring, times);
    looked.spent.preview += since(begin);
}

Looked described(const Opened& opened) {
    Looked looked(opened);
    Input& input = looked.input;
    if (!input.described)
        input.described = Described{.extent = input.header.extent,
                                    .volume = input.header.volume,
                                    .type = input.header.type,
                                    .spacing = input.header.spacing};
    looked.window.reset();  // its percentiles are of samples
    take_description(looked, {}, nullptr);
    return looked;
}

Input read(const Opened& opened, Listener& messages) {
    expect_room(opened);
    if (messages.stop()) throw Cancelled();
    Input input = opened.input;
    if (input.described) return input;
    const InState unobserved(messages, Listener::State::unobserved);
    std::vector<Message> found;
    if (opened.as.given)
        input.data = opened.as.given;
    else if (is_loaded(opened))
        input = *opened.as.loaded;
    else
        found = read_data(input, opened.memory.get());
    messages.file_warnings(input, found);
    if (!opened.query.only_labels.empty())
        if (const Message missing = keep_labels(input, opened.query.only_labels,
                                                opened.want.outside, opened.memory.get());
            !missing.empty())
            messages.warning(missing);
    // Where memory is limited nothing is kept beside the samples: whether it is there already would
    // decide which paths fit.
    if (!opened.query.max_memory) {
        Data kept = Data::sharing(*input.data, input.data->what);
        kept.worked_out = std::make_shared<WorkedOut>(opened.memory);
        input.data = std::make_shared<const Data>(std::move(kept));
    }
    if (!opened.query.remembers || !opened.engine.facts())
        input.identity.reset();
    else if (opened.as.given)
        input.identity = identity_of_samples(input);
    return input;
}

Looked look(const Opened& opened, Input input, const Effort& effort, Listener& messages,
            const std::optional<InSeries>& series) {
    Looked looked(opened);
    looked.input = std::move(input);
    if (looked.input.described) {
        take_description(looked, series, &messages);
        return looked;
    }
    const InState unobserved(messages, Listener::State::unobserved);
    messages.begins(Listener::State::planning);
    looked.stored = looked.input.data->what;
    take_statistics(looked, series, messages);
    // What is written decides about errors.
    const Statistics& statistics = looked.statistics;
    const LabelTable* table = looked.input.table.get();
    if (!table) take_written(looked, statistics.low, statistics.high);
    look_at_data(looked, draws_at_once(looked, effort) ? 1 : 0);
    if (table)
        take_written(looked, table->values.front(), table->values.back());
    else
        take_written(looked, statistics.low, statistics.high);
    for (const Message& warning : looked.written.warnings) messages.warning(warning);
    say_what_fills(looked, messages);
    return looked;
}

}  // namespace edgewise
