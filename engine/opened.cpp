#include "engine/opened.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

#include "engine/remarks.hpp"
#include "engine/result_writer.hpp"
#include "graph/errors.hpp"
#include "graph/filtering.hpp"
#include "graph/kinds.hpp"
#include "graph/label_surface.hpp"
#include "graph/transform_graph.hpp"
#include "graph/version.hpp"
#include "measure/machine.hpp"
#include "planner/cost.hpp"
#include "request/radon.hpp"
#include "request/resolution.hpp"

namespace edgewise {
namespace {

/// What a run needs in addition to counted samples: stacks of threads, the flow graph, buffers of
/// libraries.
constexpr double kReserve = 12 << 20, kReserveAThread = 1 << 20;

/// How many memories there are, and who shares one: by default as the machine has them. Who runs
/// the paths: here the cores of this process, elsewhere the processors of a rank.
void take_machine(Asked& asked) {
    asked.want.ranks = asked.query.ranks.value_or(asked.engine.machine().ranks);
    if (asked.query.threads) return;
    asked.threads_of_machine = is_elsewhere(asked);
    if (asked.threads_of_machine) asked.want.threads = asked.engine.machine().processors;
}

/// @throws RequestError
void expect_one_rank(const Asked& asked) {
    if (asked.as.runs && asked.want.ranks > 1)
        throw RequestError(
            message("{}: {} ranks: a run is on one rank; `@command(plan)` plans for more",
                    asked.query.ranks ? setting("ranks") : setting("machine"), asked.want.ranks));
}

void say_whose_machine(const Asked& asked, Listener& messages) {
    const Profile& machine = asked.engine.machine();
    if (asked.want.ranks == 1 && is_of_another(machine) && (asked.as.runs || !machine.cpu.empty()))
        messages.warning(fmt::format("the profile '{}' is of another machine{}", machine.name,
                                     machine.cpu.empty() ? "" : fmt::format(" ({})", machine.cpu)));
    if (!machine.build.empty() && machine.build != version())
        messages.warning(
            fmt::format("the profile '{}' was measured by version {}, this is {}: calibrate again",
                        machine.name, machine.build, version()));
}

/// The budget of all samples and scratch: what is allowed less what the process has already.
void open_memory(Opened& opened, Listener& messages) {
    Budget& budget = opened.want.budget;
    if (opened.want.ranks > 1) {
        // Of a rank of a machine that is elsewhere only its samples are known.
        if (!budget.bytes && opened.engine.machine().memory > 0)
            budget.bytes = opened.engine.machine().memory;
        opened.memory = std::make_shared<MemoryBudget>(static_cast<std::size_t>(free_memory()));
        return;
    }
    opened.peak_before = resident_peak();
    if (is_elsewhere(opened) && !budget.bytes && opened.engine.machine().memory > 0)
        budget.bytes = opened.engine.machine().memory;
    const double held = opened.as.guest ? 0 : resident_now();
    opened.resident = held + kReserve + kReserveAThread * opened.want.threads;
    if (!budget.bytes) budget.bytes = held + free_memory();
    // Samples of the program count once, as the input's.
    const double given = opened.as.held();
    if (!opened.as.guest) opened.resident -= given;
    constexpr double kMost = 0x1p60;  // the whole address space, and whole numbers hold it
    double left =
        std::clamp(*budget.bytes - opened.resident - given, 0.0, kMost);  // see expect_room
    // Samples are looked at here, whatever another machine has room for.
    if (is_elsewhere(opened)) left = std::min(left, free_memory());
    opened.memory = std::make_shared<MemoryBudget>(static_cast<std::size_t>(left));
    if (opened.query.max_memory)
        messages.memory_opened(left + kReserve + 10e6 * opened.want.threads);
}

/// Whether some path that may be chosen brings the samples to where they are wanted and computes
/// none of them anew, whatever their values are.
bool can_be_copied(const Opened& opened, const Representation& stored) {
    Scene any;
    any.high = std::numeric_limits<double>::infinity();
    any.low = -any.high;
    const Ask ask{opened.want, any};
    const TransformGraph spanned =
        expand(opened.engine.edges(), ask, {{stored}}, opened.query.demands);
    const auto arcs = boost::make_iterator_range(boost::edges(spanned.graph));
    return std::any_of(arcs.begin(), arcs.end(), [&](const auto arc) {
        const Arc& what = spanned.graph[arc];
        return spanned.graph[boost::source(arc, spanned.graph)].source >= 0 &&
               spanned.graph[boost::target(arc, spanned.graph)].target &&
               opened.engine.edges()[static_cast<std::size_t>(what.edge)]
                   .error_of(what.offer, ask)
                   .copies;
    });
}

/// What the samples have to keep: labels stay apart, and what only moves comes out bit for bit.
void take_exactness(Opened& opened) {
    Input& input = opened.input;
    const Request& want = opened.want;
    const Query& o = opened.query;
    if (o.labels) input.header.labels = true;
    if (input.described || input.phantom || input.pairs || opened.as.given) return;
    if ((makes_surface(want.job) && o.labels) || shows_labels(want)) {
        input.outside = want.outside;
        take_keep(input, Keep::labels);
    }
    if (want.job == Job::filter) {
        // Integers of 32 bits and f64 keep all their digits, where there is room for them.
        const Type type = input.header.type;
        if (bytes_of(type) >= 4 && type != Type::f32 && !input.premultiplied())
            take_keep(input, Keep::bits);
        if (input.bytes() > static_cast<double>(opened.memory->limit()))
            take_keep(input, Keep::values);
        return;
    }
    if (!want.job->of_points()) return;
    const Representation stored = stored_as(input);
    const bool labels = want.field == Field::nearest;
    if (o.labels && o.outside && is_integer(stored.type) &&
        !can_store(stored.type, stored.values, want.outside))
        throw RequestError(message("@outside({}): labels of type {} cannot say it", *o.outside,
                                   name_of(stored.type)));
    const bool wide = bytes_of(stored.type) >= 4 && stored.type != Type::f32;
    const Tail& tail = opened.written.tail;
    const bool kept_by_writing =
        !tail.view && (!input.premultiplied() || tail.alpha == store::Alpha::straight);
    // Memory has no 64-bit integers: labels of such are kept by a table.
    const bool tabled = labels && input.header.integers != store::Wide::no;
    if (kept_by_writing && !tabled && (wide || input.premultiplied()) &&
        can_be_copied(opened, stored)) {
        take_keep(input, Keep::bits);
    } else if (labels) {
        input.outside = want.outside;
        take_keep(input, Keep::labels);
    }
    // f64 as it is takes twice the memory of f32.
    if (input.bytes() > static_cast<double>(opened.memory->limit())) take_keep(input, Keep::values);
    if (input.keep != Keep::bits) return;
    opened.want.budget.copied = true;
    take_written(opened, 0, 0);
}

/// Pictures on the way need files that one picture can take the place of.
void expect_place_for_pictures(const Opened& opened) {
    if (opened.query.strict)
        throw RequestError(
            message("@strict: writes nothing that breaks a budget, and pictures on the way are "
                    "written before that is known; leave out one"));
    if (!opened.as.refinement->writes() || !opened.outputs || opened.outputs->none()) return;
    if (opened.outputs->file(0) == "-" || opened.outputs->animates(opened.want.frames))
        throw RequestError(message(
            "@out({}): pictures on the way replace one another in a file; name one, with %d for "
            "several views",
            opened.query.out.value_or("-")));
}

/// Folders of many files take long to look at, so a series does it once.
Input described_input(const Opened& opened) {
    const Query& o = opened.query;
    if (opened.as.given && o.input.empty()) return given_input(*opened.as.given, selection_of(o));
    if (!opened.as.described) return inspected(o.input, chosen_selection(o, opened.outputs));
    Input input = *opened.as.described;
    input.selection.time = o.selection.time;
    return input;
}

/// @throws RequestError names of edges that there are not
void expect_demands(const Asked& asked) {
    for (const auto* demands : {&asked.query.demands.via, &asked.query.demands.without})
        for (const Demand& demand : *demands)
            demand_of(demand.name + demand.with.text(), asked.engine.edges());
}

void say_how_sure_places_are(const Opened& opened, Listener& messages) {
    if (opened.query.radon)
        if (const Message remark = remark_on_angles(*opened.query.radon); !remark.empty())
            messages.warning(remark);
    // Places of 512 samples are then off by 2^-53 512 times that, 2^-22 of a sample.
    constexpr double kIllConditioned = 4e6;
    if (opened.geometry.condition > kIllConditioned)
        messages.warning(fmt::format(
            "the geometry options make a map of condition {:.3g}: nearly singular, places are "
            "uncertain",
            opened.geometry.condition));
}

}  // namespace

double Opening::held() const noexcept {
    const Data* const data = given ? given.get() : loaded ? loaded->data.get() : nullptr;
    return data ? static_cast<double>(data->samples.bytes()) : 0;
}

bool is_elsewhere(const Asked& asked) {
    return asked.want.ranks > 1 || (!asked.as.runs && is_of_another(asked.engine.machine()));
}

/// @param low,high  of the input's values
void take_written(Opened& opened, double low, double high) {
    Request& want = opened.want;
    const Input& input = opened.input;
    if (!opened.outputs || makes_surface(want.job)) {
        opened.written.tail.table = input.table;
        return;
    }
    opened.written =
        written_of(opened.want, opened.query, opened.geometry, input, *opened.outputs, low, high);
    const Tail& tail = opened.written.tail;
    want.written.reset();
    if (!want.job->samples || tail.view || opened.outputs->none()) return;
    const WrittenAs written{tail.type, tail.values, tail.alpha == store::Alpha::straight,
                            tail.alpha_unit};
    // What filters sum in f64 a file in f32 rounds, and what is moved with all its digits.
    const bool wide = want.setting.as<Filtering>() || input.keep == Keep::bits;
    const bool rounds = written.rounds() || (wide && written.type == Type::f32);
    // Places in a table are whole numbers, and none is written.
    if (rounds && !tail.table) want.written = written;
}

bool Opened::writes_at_once() const noexcept {
    if (want.frames == 1 || query.strict) return false;
    const bool into_files = outputs && !outputs->none();
    // Frames of an animation are written in order, whichever is there first.
    if (into_files && outputs->animates(want.frames)) return false;
    return !into_files || !written.tail.view || are_known(window, written.tail);
}

Asked ask(const Engine& engine, Query query, Opening as) {
    query = with_smoothing(std::move(query), engine.edges());
    Request want = request_of(query);
    std::optional<Window> window = query.window;
    Asked asked{engine, std::move(query), std::move(as), std::move(want), false, std::move(window)};
    take_machine(asked);
    return asked;
}

Opened open(Asked asked, Listener& messages) {
    Opened opened(std::move(asked));
    const Query& o = opened.query;
    opened.outputs = outputs_of(o);
    expect_one_rank(opened);
    say_whose_machine(opened, messages);
    open_memory(opened, messages);
    {
        const InState unobserved(messages, Listener::State::unobserved);
        opened.input = described_input(opened);
    }
    if (opened.as.given) expect_given(*opened.as.given, opened.input);
    expect_demands(opened);
    if (opened.as.runs && opened.input.described)
        throw RequestError(
            message("{}: a description has no samples to run on; `@command(plan)` and "
                    "`@command(graph)` take it",
                    o.input));
    opened.geometry = take_geometry(opened.want, o, opened.input, opened.outputs);
    say_how_sure_places_are(opened, messages);
    say_what_is_open(opened, messages);
    if (const Message left_out = expect_frames(o, opened.outputs, opened.want.frames);
        !left_out.empty())
        messages.warning(left_out);
    if (opened.as.refinement) expect_place_for_pictures(opened);
    take_written(opened, 0, 0);  // refuses what the format cannot hold before samples are read
    take_exactness(opened);
    return opened;
}

}  // namespace edgewise
