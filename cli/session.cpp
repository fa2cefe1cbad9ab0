#include "cli/session.hpp"

#include <fmt/format.h>

#include "cli/errors.hpp"
#include "cli/machine.hpp"
#include "cli/signals.hpp"
#include "graph/errors.hpp"
#include "transitions/catalogue.hpp"
#include "transitions/reference/scene.hpp"

namespace edgewise::cli {
namespace {

/// What a run takes beside counted samples: stacks of threads, the flow graph, buffers of
/// libraries.
constexpr double kReserve = 12 << 20, kReserveAThread = 1 << 20;

/// Everything that is to be written can be, before any work.
void check_outputs(Session& session) {
    const JobOptions& o = session.options;
    if (o.out) session.outputs.emplace(*o.out);
    for (const auto& [option, file] :
         {std::pair{"--json", &o.json}, {"--trace", &o.trace}, {"--flow", &o.flow}})
        if (*file && **file != "-") expect_writable(option, **file);
}

void take_edges(Session& session) {
    session.edges = catalogue();
    for (const std::string& text : session.options.via)
        session.demands.via.push_back(demand_of(text, session.edges));
    for (const std::string& text : session.options.without)
        session.demands.without.push_back(demand_of(text, session.edges));
    session.profile = chosen_profile(session.options.machine);
    if (!session.profile.cpu.empty() && session.profile.cpu != cpu_name())
        session.messages.warning(fmt::format("the profile '{}' is of another machine ({})",
                                             session.profile.name, session.profile.cpu));
}

/// The budget of all samples and scratch: what is allowed less what the process has already.
void open_memory(Session& session) {
    Budget& budget = session.wish.want.budget;
    session.resident = resident_now() + kReserve + kReserveAThread * session.want().threads;
    if (!budget.bytes) budget.bytes = resident_now() + free_memory();
    const double left = *budget.bytes - session.resident;
    if (left <= 0)
        throw NoPlan(fmt::format(
            "--max-memory {:.0f} MiB: the process takes {:.0f} MiB before it holds any samples",
            *budget.bytes / 0x1p20, session.resident / 0x1p20));
    session.memory = std::make_unique<MemoryBudget>(static_cast<std::size_t>(left));
    if (session.wish.memory_given) fence_memory(left + kReserve + 10e6 * session.want().threads);
}

void expect_room_for(const Session& session, const Input& input) {
    const double bytes = input.bytes();
    const auto limit = static_cast<double>(session.memory->limit());
    if (bytes <= limit) return;
    throw NoPlan(fmt::format("{}: its samples take {:.0f} MiB, and {:.0f} MiB are left for them{}",
                             input.name, bytes / 0x1p20, limit / 0x1p20,
                             session.wish.memory_given ? " by --max-memory" : " on this machine"));
}

/// @param low,high  of the input's values
void take_written(Session& session, double low, double high) {
    if (session.outputs)
        session.written =
            written_of(session.wish, session.geometry, *session.input, *session.outputs, low, high);
}

void read_input(Session& session) {
    const EndsAtOnce nothing_to_tidy;
    Input& input = *session.input;
    for (const std::string& warning : read_data(input, session.memory.get()))
        session.messages.warning(warning);
    const Statistics statistics = statistics_of(*input.data, session.memory.get());
    if (statistics.non_finite > 0)
        session.messages.warning(
            fmt::format("{}: {} values are not finite", input.name, statistics.non_finite));
    take_values(session.wish, session.options, *input.data, statistics);
    session.scene = measure_scene(*input.data, session.want(),
                                  input.phantom ? &*input.phantom : nullptr, session.memory.get());
    take_written(session, statistics.low, statistics.high);
    for (const std::string& warning : session.written.warnings) session.messages.warning(warning);
}

double frame_bytes(const Request& want) {
    const Extent out = want.output();
    const bool composite = want.job == Job::render && want.mode == Mode::composite;
    return double(out.x) * double(out.y) * double(out.z) * (composite ? 4 : 1) * sizeof(float);
}

/// Bytes that stay whatever the path: samples, results that wait, and their last form.
double pinned_bytes(const Session& session) {
    const Request& want = session.want();
    const int channels = want.job == Job::warp ? session.input->channels() : 1;
    const double frame = frame_bytes(want) * channels;
    const double written = frame / sizeof(float) * double(bytes_of(session.written.tail.type));
    const double samples = session.input->bytes();
    // The planner counts one result; the others wait beside it.
    double pinned = samples;
    if (!session.writes_at_once()) pinned += frame * (want.frames - 1);
    // A single result is finished after the samples are given back.
    pinned += want.frames > 1 ? written : std::max(0.0, written - samples);
    return pinned;
}

/// Why an edge that was asked for cannot serve, or "".
std::string refused_demand(const Session& session) {
    for (const Demand& demand : session.demands.via)
        for (const Refusal& refusal : session.answer->refused)
            if (demand.name == refusal.transition ||
                refusal.transition.starts_with(demand.name + "."))
                return fmt::format("{}: {}", refusal.transition, refusal.reason);
    return {};
}

std::string nearest_text(const std::vector<Plan>& nearest) {
    std::string text;
    for (const Plan& plan : nearest)
        text += fmt::format(
            "\n  {}: {:.3g} s, {:.0f} MiB, error {}", fmt::join(plan.texts(), ", "),
            plan.predicted.seconds, plan.predicted.bytes / 0x1p20,
            plan.predicted.known ? fmt::format("{:.3g}", plan.predicted.error) : "unknown");
    return text.empty() ? text : "; the nearest are" + text;
}

}  // namespace

bool Session::writes_at_once() const noexcept {
    if (want().frames == 1) return false;
    const bool writes = outputs && !outputs->none();
    return !writes || !written.tail.view || (wish.window && wish.window->values());
}

void take_request(Session& session) {
    const JobOptions& o = session.options;
    session.messages.configure(o.log.value_or("warning"), o.progress.value_or("auto"), o.quiet);
    check_outputs(session);
    session.wish = wish_of(o);
    if (o.transfer) load_transfer(*o.transfer, 1);
    take_edges(session);
    open_memory(session);
    {
        const EndsAtOnce nothing_to_tidy;
        session.input = inspected(o.input, session.wish.selection);
    }
    session.geometry = take_geometry(session.wish.want, o, *session.input);
    if (session.outputs) session.outputs->expect_frames(session.want().frames);
    take_written(session, 0, 0);  // refuses what the format cannot hold before samples are read
    expect_room_for(session, *session.input);
    read_input(session);
}

void make_plan(Session& session) {
    {
        const EndsAtOnce nothing_to_tidy;
        session.plan_options.demands = session.demands;
        session.plan_options.pinned = pinned_bytes(session);
        session.plan_options.resident = session.resident;
        session.answer = plan(session.edges, session.ask(), {{session.input->data->what}},
                              session.profile, session.plan_options);
    }
    for (const std::string& warning : session.answer->warnings) session.messages.warning(warning);
    if (session.answer->plan) return;
    const std::string refused = refused_demand(session);
    throw NoPlan((refused.empty() ? session.answer->problem : refused) +
                 nearest_text(session.answer->nearest));
}

}  // namespace edgewise::cli
