#include "engine/session.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <malloc.h>

#include "engine/file_warnings.hpp"
#include "engine/guesses.hpp"
#include "engine/known_scene.hpp"
#include "engine/measure/machine.hpp"
#include "engine/measure/since.hpp"
#include "engine/only_labels.hpp"
#include "engine/pilot.hpp"
#include "engine/refined_scene.hpp"
#include "engine/request/radon.hpp"
#include "engine/request/resolution.hpp"
#include "engine/result_writer.hpp"
#include "engine/shown.hpp"
#include "graph/errors.hpp"
#include "graph/label_surface.hpp"
#include "graph/transform_graph.hpp"
#include "graph/version.hpp"
#include "io/surface_file.hpp"
#include "planner/cost.hpp"
#include "scene/ring_free.hpp"
#include "scene/scene.hpp"

namespace edgewise {
namespace {

/// What a run needs in addition to counted samples: stacks of threads, the flow graph, buffers of
/// libraries.
constexpr double kReserve = 12 << 20, kReserveAThread = 1 << 20;
/// What it takes of that as a rule: the code of kernels, and what threads touch of their stacks.
constexpr double kGrowth = 1 << 20, kGrowthAThread = 1 << 18;

using Clock = std::chrono::steady_clock;

/// How many memories there are, and who shares one: by default as the machine has them.
void take_ranks(Session& session) {
    Request& want = session.request;
    const RequestSpec& o = session.spec;
    want.ranks = o.ranks.value_or(session.profile.ranks);
    if (want.ranks == 1) return;
    if (session.runs)
        throw RequestError(
            fmt::format("{}: {} ranks: a run is on one rank; `edgewise plan` plans for more",
                        o.ranks ? "--ranks" : "--machine", want.ranks));
}

/// Whether another machine than this one is planned for.
bool is_elsewhere(const Session& session) {
    return session.want().ranks > 1 || (!session.runs && is_of_another(session.profile));
}

/// Who runs the paths: here the cores of this process, elsewhere the processors of a rank.
void take_threads(Session& session) {
    if (session.spec.threads) return;
    session.threads_of_machine = is_elsewhere(session);
    if (session.threads_of_machine) session.request.threads = session.profile.processors;
}

void take_machine(Session& session) {
    take_ranks(session);
    take_threads(session);
    if (session.spec.max_time && !session.explained && session.runs && is_built_in(session.profile))
        session.messages.notice(
            "--max-time: seconds are guesses of the built-in profile; `edgewise calibrate` "
            "measures this machine");
    if (session.want().ranks == 1 && is_of_another(session.profile) &&
        (session.runs || !session.profile.cpu.empty()))
        session.messages.warning(fmt::format(
            "the profile '{}' is of another machine{}", session.profile.name,
            session.profile.cpu.empty() ? "" : fmt::format(" ({})", session.profile.cpu)));
    if (!session.profile.build.empty() && session.profile.build != version())
        session.messages.warning(
            fmt::format("the profile '{}' was measured by version {}, this is {}: calibrate again",
                        session.profile.name, session.profile.build, version()));
}

/// The budget of all samples and scratch: what is allowed less what the process has already.
void open_memory(Session& session) {
    Budget& budget = session.request.budget;
    if (session.want().ranks > 1) {
        // Of a rank of a machine that is elsewhere only its samples are known.
        if (!budget.bytes && session.profile.memory > 0) budget.bytes = session.profile.memory;
        session.memory = std::make_unique<MemoryBudget>(static_cast<std::size_t>(free_memory()));
        return;
    }
    session.peak_before = resident_peak();
    if (is_elsewhere(session) && !budget.bytes && session.profile.memory > 0)
        budget.bytes = session.profile.memory;
    session.resident = resident_now() + kReserve + kReserveAThread * session.want().threads;
    if (!budget.bytes) budget.bytes = resident_now() + free_memory();
    // Samples of the program count once, as the input's.
    const double given = session.given ? double(session.given->samples.bytes()) : 0;
    session.resident -= given;
    constexpr double kMost = 0x1p60;  // the whole address space, and whole numbers hold it
    double left =
        std::clamp(*budget.bytes - session.resident - given, 0.0, kMost);  // see expect_room
    // Samples are looked at here, whatever another machine has room for.
    if (is_elsewhere(session)) left = std::min(left, free_memory());
    session.memory = std::make_unique<MemoryBudget>(static_cast<std::size_t>(left));
    if (session.spec.max_memory)
        session.messages.memory_opened(left + kReserve + 10e6 * session.want().threads);
}

/// Why there is no room for samples, or "".
std::string lack_of_room(const Session& session) {
    const Input& input = *session.input;
    const Budget& budget = session.want().budget;
    if (session.want().ranks == 1 && *budget.bytes <= session.resident)
        return fmt::format(
            "--max-memory {:.3g} MiB: the process takes {:.0f} MiB before it holds any samples",
            *budget.bytes / 0x1p20, session.resident / 0x1p20);
    const auto limit = static_cast<double>(session.memory->limit());
    if (session.given || input.described || input.bytes() <= limit) return {};
    return fmt::format("{}: its samples take {:.0f} MiB, and {:.0f} MiB are left for them{}",
                       input.name, input.bytes() / 0x1p20, limit / 0x1p20,
                       session.spec.max_memory ? " by --max-memory" : " on this machine");
}

/// @param low,high  of the input's values
void take_written(Session& session, double low, double high) {
    Request& want = session.request;
    const Input& input = *session.input;
    if (!session.outputs || want.job == Job::mesh) {
        session.written.tail.table = input.table;
        return;
    }
    session.written = written_of(session.want(), session.spec, session.geometry, input,
                                 *session.outputs, low, high);
    const Tail& tail = session.written.tail;
    want.written.reset();
    if (!want.job->samples || tail.view || session.outputs->none()) return;
    const WrittenAs written{tail.type, tail.values, tail.alpha == store::Alpha::straight,
                            tail.alpha_unit};
    // What filters sum in f64 a file in f32 rounds, and what is moved with all its digits.
    const bool wide = want.job == Job::filter || input.keep == Keep::bits;
    const bool rounds = written.rounds() || (wide && written.type == Type::f32);
    // Places in a table are whole numbers, and none is written.
    if (rounds && !tail.table) want.written = written;
}

/// What a file's type changes is the same whatever path is taken. Where it is no part of the
/// budget, as of a filter that is to be equal but for rounding, paths are compared without it.
void leave_writing_out(Session& session) {
    if (session.request.budget.error_yields) session.request.written.reset();
}

/// What is promised and measured of the path that was chosen is of the file all the same.
void count_writing(Session& session) {
    Request& want = session.request;
    if (!want.budget.error_yields || !session.outputs || session.input->described) return;
    const Statistics& statistics = session.statistics;
    take_written(session, statistics.low, statistics.high);
    if (!want.written || !session.answer || session.drawn == 0) return;
    const double error = rounding_of(session.ask()) / session.scene.range;
    const auto copies = [&](const Step& step) {
        return step.by->error_of(step.offer, session.ask()).copies;
    };
    const auto raise = [&](Plan& plan) {
        // An integer type is that of the samples; f32 may have fewer digits.
        if (want.written->rounds() && std::all_of(plan.steps.begin(), plan.steps.end(), copies))
            return;
        plan.predicted.error = std::hypot(plan.predicted.error, error);
        if (!plan.steps.empty()) plan.steps.back().predicted.error = plan.predicted.error;
    };
    if (session.answer->plan) raise(*session.answer->plan);
    for (std::vector<Plan>* plans : {&session.answer->front, &session.answer->nearest})
        for (Plan& plan : *plans) raise(plan);
}

/// Whether some path that may be chosen brings the samples to where they are wanted and computes
/// none of them anew, whatever their values are.
bool can_be_copied(const Session& session, const Representation& stored) {
    Scene any;
    any.high = std::numeric_limits<double>::infinity();
    any.low = -any.high;
    const Ask ask{session.want(), any};
    const TransformGraph spanned = expand(session.edges, ask, {{stored}}, session.spec.demands);
    const auto arcs = boost::make_iterator_range(boost::edges(spanned.graph));
    return std::any_of(arcs.begin(), arcs.end(), [&](const auto arc) {
        const Arc& what = spanned.graph[arc];
        return spanned.graph[boost::source(arc, spanned.graph)].source >= 0 &&
               spanned.graph[boost::target(arc, spanned.graph)].target &&
               session.edges[static_cast<std::size_t>(what.edge)].error_of(what.offer, ask).copies;
    });
}

/// What the samples have to keep: labels stay apart, and what only moves comes out bit for bit.
void take_exactness(Session& session) {
    Input& input = *session.input;
    const Request& want = session.want();
    const RequestSpec& o = session.spec;
    if (o.labels) input.header.labels = true;
    if (input.described || input.phantom || input.pairs || session.given) return;
    if ((want.job == Job::mesh && o.labels) || shows_labels(want)) {
        input.outside = want.outside;
        take_keep(input, Keep::labels);
    }
    if (want.job == Job::filter) {
        // Integers of 32 bits and f64 keep all their digits, where there is room for them.
        const Type type = input.header.type;
        if (bytes_of(type) >= 4 && type != Type::f32 && !input.premultiplied())
            take_keep(input, Keep::bits);
        if (input.bytes() > static_cast<double>(session.memory->limit()))
            take_keep(input, Keep::values);
        return;
    }
    if (want.job != Job::warp) return;
    const Representation stored = stored_as(input);
    const bool labels = want.field == Field::nearest;
    if (o.labels && o.outside && is_integer(stored.type) &&
        !can_store(stored.type, stored.values, want.outside))
        throw RequestError(fmt::format("--outside {}: labels of type {} cannot say it", *o.outside,
                                       name_of(stored.type)));
    const bool wide = bytes_of(stored.type) >= 4 && stored.type != Type::f32;
    const Tail& tail = session.written.tail;
    const bool kept_by_writing =
        !tail.view && (!input.premultiplied() || tail.alpha == store::Alpha::straight);
    // Memory has no 64-bit integers: labels of such are kept by a table.
    const bool tabled = labels && input.header.integers != store::Wide::no;
    if (kept_by_writing && !tabled && (wide || input.premultiplied()) &&
        can_be_copied(session, stored)) {
        take_keep(input, Keep::bits);
    } else if (labels) {
        input.outside = want.outside;
        take_keep(input, Keep::labels);
    }
    // f64 as it is takes twice the memory of f32.
    if (input.bytes() > static_cast<double>(session.memory->limit()))
        take_keep(input, Keep::values);
    if (input.keep != Keep::bits) return;
    session.request.budget.copied = true;
    take_written(session, 0, 0);
}

/// What hangs on values, of which a composite's transfer function has something to say.
void take_transfer(Session& session, const Statistics& statistics) {
    const Input& input = *session.input;
    Statistics seen = statistics;
    if (session.series) {
        if (const Session* first = session.series->first) {
            take_values_of(first->want(), session.request);
            session.window = first->window;
            session.preset = first->preset;
            return;
        }
        if (session.series->low <= session.series->high)
            seen.low = session.series->low, seen.high = session.series->high;
    }
    Remarks remarks = take_values(session.request, session.window, session.spec, input, seen);
    for (const Message& warning : remarks.warnings) session.messages.warning(warning);
    for (const Message& notice : remarks.notices) session.messages.notice(notice);
    session.preset = std::move(remarks.preset);
}

/// A picture as good as linear interpolation makes it has no rings either.
void take_step(Session& session, const Statistics& statistics) {
    Request& want = session.request;
    if (!want.budget.like || !want.job->of_rays()) return;
    const Data& data = *session.input->data;
    // Of a description nothing is known but the range: edges that take four samples.
    const double slope =
        data.samples.data() ? seen_slope(data, want) : (statistics.high - statistics.low) / 4;
    want.budget.like->step = ring_free_step(want, statistics.low, statistics.high, slope);
}

/// What there is no data of: guesses take the place of measurements.
void take_description(Session& session) {
    Input& input = *session.input;
    input.data = described_data(input);
    const Statistics statistics = described_statistics(*input.described, input.header);
    take_transfer(session, statistics);
    take_step(session, statistics);
    session.scene = described_scene(*input.described, input.header);
    take_written(session, statistics.low, statistics.high);
}

void read_input(Session& session) {
    if (session.input->described) {
        take_description(session);
        return;
    }
    const InState unobserved(session.messages, Listener::State::unobserved);
    Input& input = *session.input;
    std::vector<Message> found;
    if (session.given)
        input.data = session.given;
    else
        found = read_data(input, session.memory.get());
    tell_of_file(session, found);
    if (!session.spec.only_labels.empty())
        if (const std::string missing = keep_labels(input, session.spec.only_labels,
                                                    session.want().outside, session.memory.get());
            !missing.empty())
            session.messages.warning(missing);
    if (!session.spec.remembers) input.identity.reset();
    if (session.announces)
        session.planning = std::make_unique<Announced>(session.messages, "planning");
    auto begin = Clock::now();
    const Statistics& statistics = session.statistics =
        session.given ? statistics_of(*input.data, session.memory.get())
                      : known_statistics(input, session.memory.get());
    session.spent.statistics += since(begin);
    if (statistics.non_finite > 0)
        tell_of_file(session, {fmt::format("{}: {} values are not finite", input.name,
                                           statistics.non_finite)});
    begin = Clock::now();
    if (input.table) session.request.outside = place_in(*input.table, input.outside);
    take_transfer(session, statistics);
    (session.preset ? session.spent.preset : session.spent.statistics) += since(begin);
    begin = Clock::now();
    take_outside(session);
    take_step(session, statistics);
    session.spent.statistics += since(begin);
    // What is written decides about errors.
    if (!input.table) take_written(session, statistics.low, statistics.high);
    look_at_data(session, session.errors == ErrorsWanted::asked);
    if (input.table)
        take_written(session, input.table->values.front(), input.table->values.back());
    else
        take_written(session, statistics.low, statistics.high);
    for (const Message& warning : session.written.warnings) session.messages.warning(warning);
    say_what_fills(session);
}

double frame_bytes(const Request& want) {
    const Extent out = want.output();
    return double(out.x) * double(out.y) * double(out.z) *
           (want.job == Job::render ? want.mode->channels : 1) * sizeof(float);
}

/// Bytes that stay whatever the path: samples, results that wait, and their last form.
double pinned_bytes(const Session& session) {
    const Request& want = session.want();
    const int channels = want.job->samples ? session.input->channels() : 1;
    const double frame = frame_bytes(want) * channels;
    const double written = frame / sizeof(float) * double(bytes_of(session.written.tail.type));
    // Ranks read what they work on, and keep their share of the results.
    if (want.ranks > 1)
        return session.writes_at_once() ? 0 : frame * (want.frames - 1) / want.ranks;
    const double samples = session.input->bytes();
    // The planner counts one result; the others wait in memory as well.
    double pinned = samples + shown_bytes(session);
    if (!session.writes_at_once()) pinned += frame * (want.frames - 1);
    // A single result is finished after the samples are given back, pictures on the way before.
    const bool on_the_way = session.refinement && session.refinement->writes();
    pinned += want.frames > 1 || on_the_way ? written : std::max(0.0, written - samples);
    return pinned;
}

/// What verifying needs in addition to samples and results, when the path has ended.
double verifying_bytes(const Session& session) {
    if (!session.spec.verify || !session.input->data->samples.data()) return 0;
    const ReferenceField field(*session.input->data, session.want().field,
                               session.input->phantom ? &*session.input->phantom : nullptr);
    return verifier_bytes(session.want(), field, static_cast<std::int64_t>(*session.spec.verify),
                          session.want().threads);
}

/// @throws RequestError where there are no samples
void pilot(Session& session) {
    if (!session.input->data->samples.data())
        throw RequestError("--planner: without samples nothing can be measured; only estimate");
    const Answer& answer = *session.answer;
    // As long as a few dozen runs take, within reason.
    constexpr double kRuns = 40, kLeast = 2.5, kMost = 20;
    const double guess = answer.plan ? answer.plan->predicted.seconds : kMost / kRuns;
    const std::optional<double> given = session.spec.planning_time;
    const double limit = given.value_or(std::clamp(kRuns * guess, kLeast, kMost));
    const auto begin = Clock::now();
    try {
        measure_contenders(session, session.spec.planner == Planner::exhaustive, limit,
                           given.value_or(kMost));
    } catch (const std::bad_alloc&) {
        session.messages.warning("--planner: no memory left to measure with; models decide");
    }
    session.spent.pilot += since(begin);
}

/// Before samples are read. Where there is no room for them, how much would do is planned as if
/// they were only described.
void expect_room(Session& session) {
    const std::string lack = lack_of_room(session);
    if (lack.empty()) return;
    Input& input = *session.input;
    if (!input.described)
        input.described = Described{.extent = input.header.extent,
                                    .volume = input.header.volume,
                                    .type = input.header.type,
                                    .spacing = input.header.spacing};
    session.window.reset();  // its percentiles are of samples
    take_description(session);
    prepare_planning(session);
    session.way_out = way_out_of(session, Errors::guessed);
    throw NoPlan(lack + text_of(*session.way_out));
}

/// Why an edge that was asked for cannot serve, or "".
std::string refused_demand(const Session& session) {
    for (const Demand& demand : session.spec.demands.via)
        for (const Refusal& refusal : session.answer->refused)
            if (demand.name == refusal.transition ||
                refusal.transition.starts_with(demand.name + "."))
                return fmt::format("{}: {}", refusal.transition, refusal.reason.marked());
    return {};
}

/// That rounding to the file's type is what breaks an error budget, or "".
std::string rounding_text(const Session& session) {
    const Request& want = session.want();
    if (!want.written || !want.budget.error || !session.spec.max_error) return {};
    const double error = rounding_of(session.ask()) / session.scene.range;
    if (error <= *want.budget.error) return {};
    return fmt::format("; rounding to {} alone makes an error of {:.3g}: {}",
                       name_of(want.written->type), error,
                       want.written->rounds()
                           ? "write f32 (--bits 32 and a format that holds it, as .nrrd or .tif)"
                           : "write all digits (no --bits, and a format that holds the type)");
}

/// Labels that nobody called so: a plan that computes between them makes new ones.
void hint_at_labels(Session& session) {
    const Request& want = session.want();
    const Input& input = *session.input;
    if (want.job != Job::warp || want.field != Field::spline || session.spec.reference ||
        input.phantom || !input.data->samples.data())
        return;
    const auto copies = [&](const Step& step) {
        return step.by->error_of(step.offer, session.ask()).copies;
    };
    const std::vector<Step>& steps = session.answer->plan->steps;
    if (std::all_of(steps.begin(), steps.end(), copies)) return;
    if (looks_like_labels(*input.data, session.scene.commonest))
        session.messages.warning(fmt::format(
            "{} may hold labels (few different values): values between them appear; --labels "
            "makes none",
            input.name));
}

/// What the planner says, with an error budget as it was typed.
std::string problem_text(const Session& session) {
    std::string text = session.answer->problem;
    const std::optional<double>& limit = session.want().budget.error;
    const std::string& typed = session.spec.notation.error;
    if (!limit || typed.empty()) return text;
    const std::string number = fmt::format("an error of {:.3g}", *limit);
    if (const std::size_t at = text.find(number); at != text.npos)
        text.replace(at, number.size(), "an error of " + error_words(*limit, typed));
    return text;
}

std::string nearest_text(const Session& session) {
    std::string text;
    for (const Plan& plan : session.answer->nearest)
        text += fmt::format("\n  {}: {:.3g} s, {:.0f} MiB, error {}", fmt::join(plan.texts(), ", "),
                            plan.predicted.seconds, plan.predicted.bytes / 0x1p20,
                            plan.predicted.known
                                ? error_words(plan.predicted.error, session.spec.notation.error)
                                : "unknown");
    return text.empty() ? text : "; the nearest are" + text;
}

/// Depth is what a viewer does not show to be missing.
void say_what_is_cut_off(Session& session) {
    const Geometry& geometry = session.geometry;
    constexpr double kSeen = 0.5;  // sample
    if (session.want().job != Job::warp || geometry.cut <= kSeen) return;
    session.messages.warning(fmt::format(
        "depth: the moved volume is {:.4g} samples deep, the output {}, so up to {:.4g} at an end "
        "are cut off; --size fit keeps all",
        geometry.depth, geometry.grid.extent.z, geometry.cut));
}

/// Whether the input lies on one side of a plane that rays of a view do not pass: that of the eye,
/// or one through it and a side of the picture.
bool is_out_of_view(const Request& want, int view) {
    const Eye& eye = want.eye.value();
    const Mat4 map = want.views.at(view).matrix();
    const double away = eye.plane - eye.at.z();
    std::array<int, 5> beyond{};
    for (int corner = 0; corner < 8; ++corner) {
        Vec3 p;
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = (corner >> axis & 1) ? static_cast<double>(want.input[axis]) - 0.5 : -0.5;
        p = map.topLeftCorner<3, 3>() * p + map.topRightCorner<3, 1>() - eye.at;
        beyond[4] += p.z() <= 0;
        for (int side = 0; side < 2; ++side) {
            const auto k = static_cast<std::size_t>(2 * side);
            const double low = -0.5 - eye.at[side];
            const double high = static_cast<double>(want.screen[side]) - 0.5 - eye.at[side];
            beyond[k] += p[side] * away < low * p.z();
            beyond[k + 1] += p[side] * away > high * p.z();
        }
    }
    return std::find(beyond.begin(), beyond.end(), 8) != beyond.end();
}

/// An eye that somebody put may look elsewhere, and a picture of nothing does not say why.
void say_what_is_not_seen(Session& session) {
    const Request& want = session.want();
    if (!session.geometry.eye_placed) return;
    for (int view = 0; view < want.frames; ++view)
        if (!is_out_of_view(want, view)) return;
    session.messages.warning(
        fmt::format("--eye: nothing of the volume is in the picture; --look-at {:g},{:g},{:g} is "
                    "its middle",
                    (double(want.input.x) - 1) / 2, (double(want.input.y) - 1) / 2,
                    (double(want.input.z) - 1) / 2));
}

/// Pictures have no spacing that a viewer would heed.
void say_what_is_squeezed(Session& session) {
    const Vec3& spacing = session.geometry.grid.spacing;
    constexpr double kSeen = 1e-3;  // a pixel in a thousand
    if (session.want().job != Job::warp || session.want().axes != 3 || !session.outputs ||
        session.outputs->none() || session.outputs->format().volumes ||
        std::abs(spacing.x() / spacing.y() - 1) <= kSeen)
        return;
    session.messages.warning(fmt::format(
        "the picture's pixels are {:.4g} x {:.4g} {}, and most viewers show them square; "
        "--spacing {:.4g} makes them so",
        spacing.x(), spacing.y(), session.input->header.unit, std::min(spacing.x(), spacing.y())));
}

/// Rays of a picture that is smaller than the volume pass between samples: the brightest may be
/// met by none.
bool say_what_is_missed(Session& session) {
    const Request& want = session.want();
    const bool keeps_one = want.mode->extreme != 0 || want.mode->sampled_every > 0;
    if (want.job != Job::render || !keeps_one) return false;
    // A sample that is interpolated linearly reaches one sample each way: closer rays meet all.
    constexpr double kSeen = 2 - 1e-6;  // [sample]
    double apart = 0;
    for (int view = 0; view < want.frames; ++view) {
        const Mat4 back = want.views.at(view).matrix().inverse();
        for (int axis = 0; axis < 2; ++axis)
            apart = std::max(apart, back.col(axis).head<3>().norm());
    }
    if (!(apart >= kSeen) || !std::isfinite(apart)) return false;
    const auto grown = [&](std::int64_t side) {
        return static_cast<std::int64_t>(std::ceil(static_cast<double>(side) * apart - 1e-6));
    };
    const std::string size =
        fmt::format("--size {}x{}", grown(want.screen.x), grown(want.screen.y));
    const Vec3& spacing = session.geometry.grid.spacing;
    const std::string finer =
        session.spec.geometry.spacing
            ? fmt::format("--spacing {:.4g} {}", spacing.head<2>().minCoeff() / apart, size)
            : size;
    session.messages.warning(
        fmt::format("--mode {}: rays are {:.3g} samples apart, so single {} samples between them "
                    "are not in the picture; {} meets all of them",
                    want.mode->name, apart, want.mode->extreme < 0 ? "dark" : "bright", finer));
    return true;
}

/// A surface that is far from the origin, in a format of 32 bits.
void say_what_is_shifted(Session& session) {
    const Vec3& offset = session.geometry.offset;
    if (session.want().job != Job::mesh || !session.outputs || session.outputs->none() ||
        offset == Vec3::Zero())
        return;
    const store::SurfaceFormat* format = store::surface_format_of(session.outputs->file(0));
    if (!format || format->name != "STL") return;
    session.messages.warning(fmt::format(
        "{}: the numbers of an STL are too short for a surface so far from the origin: {:.17g}, "
        "{:.17g}, {:.17g} is to be added to its places, as its header says; .ply and .obj hold "
        "the places themselves",
        session.outputs->file(0), offset.x(), offset.y(), offset.z()));
}

/// A coarser resolution of the file may hold all that the result can show.
void say_what_is_finer(Session& session) {
    const store::Header& header = session.input->header;
    const Job job = session.want().job;
    if (header.levels.size() < 2 || (job != Job::render && job != Job::warp)) return;
    const Extent& here = header.extent;
    const int coarsest = level_as_fine(header, session.geometry.grid, job);
    if (coarsest == header.level) return;
    const double share =
        static_cast<double>(header.levels[static_cast<std::size_t>(coarsest)].samples()) /
        static_cast<double>(here.samples());
    session.messages.notice(fmt::format(
        "{}: --level {} is as fine as the result's samples, and reads {:.3g} % of what is read now",
        session.input->name, coarsest, 100 * share));
}

/// Pictures on the way need files that one picture can take the place of.
void expect_place_for_pictures(const Session& session) {
    if (session.spec.strict)
        throw RequestError(
            "--strict: writes nothing that breaks a budget, and pictures on the way are written "
            "before that is known; leave out one");
    if (!session.refinement->writes() || !session.outputs || session.outputs->none()) return;
    if (session.outputs->file(0) == "-" || session.outputs->animates(session.want().frames))
        throw RequestError(fmt::format(
            "-o {}: pictures on the way replace one another in a file; name one, with %d for "
            "several views",
            session.spec.out.value_or("-")));
}

/// What f32 takes from f64 on the way into memory, as if all values were as large as the largest.
double lost_in_reading(const Session& session) {
    const Input& input = *session.input;
    if (input.header.type != Type::f64 || input.data->what.type != Type::f32 || input.table ||
        session.given || session.want().field == Field::nearest)
        return 0;
    const Scene& scene = session.scene;
    return std::max(std::abs(scene.low), std::abs(scene.high)) * 0x1p-24 / std::sqrt(3.0);
}

}  // namespace

bool Session::writes_at_once() const noexcept {
    if (want().frames == 1 || spec.strict) return false;
    const bool into_files = outputs && !outputs->none();
    // Frames of an animation are written in order, whichever is there first.
    if (into_files && outputs->animates(want().frames)) return false;
    return !into_files || !written.tail.view || are_known(window, written.tail);
}

std::vector<Source> Session::sources() const {
    const Representation& what = input->data->what;
    if (want().ranks == 1) return {{what, Label{.noise = lost_in_reading(*this)}}};
    Representation on_disk = what;
    on_disk.place = Place::disk;
    const double bytes = what.bytes();
    return {{on_disk}, {what, Label{.peak = bytes, .held = bytes}}};
}

std::shared_ptr<const PricedGraph> Session::graph() const {
    if (answer) return answer->graph;
    return std::make_shared<PricedGraph>(edges, ask(), sources(), profile, plan_options);
}

void look_at_data(Session& session, bool draw) {
    const auto begin = Clock::now();
    const Demands asked = untried(session.spec.demands, session.edges);
    const Input& input = *session.input;
    const Statistics& statistics = session.statistics;
    std::pmr::memory_resource* memory = session.memory.get();
    session.drawn = 1;
    if (draw) {
        session.scene =
            known_scene(session.edges, input, statistics, session.want(), memory, 1, asked);
    } else if (auto kept = kept_scene(input, statistics, session.want(), asked)) {
        session.scene = std::move(*kept);
    } else {
        session.drawn = 0;
        session.scene = unseen_scene(statistics);
        count_scene(session.edges, *input.data, session.want(), session.scene, memory);
    }
    session.spent.preview += since(begin);
}

namespace {

/// Folders of many files take long to look at, so a series does it once.
Input described_input(const Session& session) {
    const RequestSpec& o = session.spec;
    if (session.given && o.input.empty()) return given_input(*session.given, selection_of(o));
    if (!session.series || !session.series->file)
        return inspected(o.input, chosen_selection(o, session.outputs));
    Input input = *session.series->file;
    input.selection.time = o.selection.time;
    return input;
}

}  // namespace

void take_request(Session& session) {
    const RequestSpec& o = session.spec;
    const Request& want = session.want();
    if (o.out)
        session.outputs.emplace(
            *o.out, want.job == Job::mesh ? Outputs::Holds::surface : Outputs::Holds::samples);
    // Where the choice depends on errors as such, they are always wanted.
    if (session.errors == ErrorsWanted::for_choice &&
        // Of results that are to be equal but for rounding it is only to be shown.
        ((want.budget.error && (!want.budget.error_yields || session.plan_options.front)) ||
         want.minimize == Minimize::error || session.spec.planner != Planner::estimate))
        session.errors = ErrorsWanted::asked;
    take_machine(session);
    open_memory(session);
    {
        const InState unobserved(session.messages, Listener::State::unobserved);
        session.input = described_input(session);
    }
    if (session.given) expect_given(*session.given, *session.input);
    for (const auto* demands : {&o.demands.via, &o.demands.without})
        for (const Demand& demand : *demands)
            demand_of(demand.name + demand.with.text(), session.edges);  // refuses unknown names
    if (session.runs && session.input->described)
        throw RequestError(
            fmt::format("{}: a description has no samples to run on; "
                        "`edgewise plan` and `edgewise graph` take it",
                        o.input));
    session.geometry = take_geometry(session.request, o, *session.input, session.outputs);
    if (o.radon)
        if (const Message remark = remark_on_angles(*o.radon); !remark.empty())
            session.messages.warning(remark);
    // Places of 512 samples are then off by 2^-53 512 times that, 2^-22 of a sample.
    constexpr double kIllConditioned = 4e6;
    if (session.geometry.condition > kIllConditioned)
        session.messages.warning(fmt::format(
            "the geometry options make a map of condition {:.3g}: nearly singular, places are "
            "uncertain",
            session.geometry.condition));
    say_what_is_cut_off(session);
    say_what_is_squeezed(session);
    say_what_is_not_seen(session);
    say_what_is_finer(session);
    if (!say_what_is_missed(session)) say_what_is_reduced(session);
    say_what_is_shifted(session);
    say_where_front_is(session);
    if (const std::string left_out = expect_frames(o, session.outputs, session.want().frames);
        !left_out.empty())
        session.messages.warning(left_out);
    if (session.refinement) expect_place_for_pictures(session);
    take_written(session, 0, 0);  // refuses what the format cannot hold before samples are read
    take_exactness(session);
    expect_room(session);
    if (session.messages.stop()) throw Cancelled();
    read_input(session);
}

void prepare_planning(Session& session) {
    leave_writing_out(session);
    session.plan_options.demands = session.spec.demands;
    session.plan_options.pinned = pinned_bytes(session);
    session.plan_options.resident = session.resident;
    if (session.want().ranks > 1) return;
    session.plan_options.after = std::max(verifying_bytes(session), showing_bytes(session));
    // What reading and measuring have left behind counts once, as samples or as `held`.
    session.memory->trim();
    malloc_trim(0);
    session.plan_options.held = std::max(0.0, resident_now() - double(session.memory->used())) +
                                kGrowth + kGrowthAThread * session.want().threads;
}

void forget_errors(Session& session) {
    if (session.errors == ErrorsWanted::asked || !session.answer) return;
    Answer& answer = *session.answer;
    const auto forget = [](Plan& plan) {
        plan.predicted.known = false;
        for (Step& step : plan.steps) step.predicted.known = false;
    };
    if (answer.plan) forget(*answer.plan);
    for (std::vector<Plan>* plans : {&answer.front, &answer.nearest})
        for (Plan& plan : *plans) forget(plan);
}

void make_plan(Session& session) {
    if (session.messages.stop()) throw Cancelled();
    {
        const InState unobserved(session.messages, Listener::State::unobserved);
        ask_planner(session);
    }
    if (session.spec.planner != Planner::estimate) pilot(session);
    count_writing(session);
    session.answer->seconds = session.spent.all();
    session.planning.reset();
    for (const Message& warning : session.answer->warnings) session.messages.warning(warning);
    if (session.answer->plan) {
        hint_at_labels(session);
        return;
    }
    const std::string refused = refused_demand(session);
    session.way_out = way_out_of(session);
    throw NoPlan((refused.empty() ? problem_text(session) : refused) + rounding_text(session) +
                 nearest_text(session) + text_of(*session.way_out));
}

}  // namespace edgewise
