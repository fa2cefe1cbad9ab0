#include "engine/run.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fmt/format.h>
#include <map>
#include <mutex>
#include <tbb/task_arena.h>
#include <utility>

#include "engine/filter_result.hpp"
#include "engine/kept_padding.hpp"
#include "engine/refinement.hpp"
#include "engine/result_writer.hpp"
#include "engine/shown.hpp"
#include "graph/errors.hpp"
#include "graph/kinds.hpp"
#include "io/surface_file.hpp"
#include "measure/machine.hpp"
#include "measure/since.hpp"
#include "presentation/depth_coloured.hpp"
#include "request/outputs.hpp"
#include "surface/finish.hpp"
#include "surface/mesh.hpp"
#include "transfer/suited.hpp"

namespace edgewise {
namespace {

using Clock = std::chrono::steady_clock;

/// Takes the pictures on the way for as long as it lives.
class Watching {
 public:
    Watching(Refinement* refinement, FrontWatch taker) : refinement_(refinement) {
        if (refinement_) refinement_->give_to(std::move(taker));
    }
    ~Watching() {
        if (refinement_) refinement_->give_to({});
    }
    Watching(const Watching&) = delete;
    Watching& operator=(const Watching&) = delete;

 private:
    Refinement* refinement_;
};

/// Everything after the planner: runs, keeps or passes on frames, verifies, writes.
class Running {
 public:
    Running(const Planned& planned, std::shared_ptr<const Data> samples, const Sinks& sinks,
            Listener& messages)
        : planned_(planned),
          messages_(messages),
          samples_(std::move(samples)),
          sink_(sinks.frames),
          want_(planned.want),
          writes_(sinks.files && planned.outputs && !planned.outputs->none()) {
        if (planned.as.shows) shown_.emplace(planned, run_.shown.emplace(), messages);
        if (!planned.query.verify) return;
        field_.emplace(*samples_, want_.field,
                       planned.input.phantom ? &*planned.input.phantom : nullptr);
        verifier_.emplace(want_, *field_, static_cast<std::int64_t>(*planned.query.verify),
                          planned.query.seed, planned.memory.get());
    }

    Run run_all() {
        for (int i = 0; i < planned_.query.repeat; ++i) {
            last_ = i + 1 == planned_.query.repeat;
            run_once();
            poll();
        }
        end_run();
        if (!planned_.query.strict) keeps_budgets();
        return std::move(run_);
    }

 private:
    void poll() const {
        if (messages_.stop()) throw Cancelled();
    }

    void run_once() {
        frames_.resize(static_cast<std::size_t>(want_.frames));
        delivering_ = showing_ = 0;
        refined_ = {};
        began_ = Clock::now();
        RunOptions options;
        options.threads = want_.threads;
        options.arenas = &planned_.engine.arenas();
        options.memory = planned_.memory.get();
        options.stop = &messages_.stop();
        options.progress = [&](double share, const std::string& step) {
            messages_.progress(share, step);
        };
        options.replan = [&](const std::string& failed, const std::string&,
                             const std::vector<Representation>& held) {
            return other_plan(failed, held);
        };
        const Deliver deliver = [&](int frame, std::shared_ptr<const Data> result) {
            const auto begin = Clock::now();
            // Waiting for its own tiles, this thread must not begin another frame's step: that
            // would deliver while the first delivery still holds the runtime's lock.
            tbb::this_task_arena::isolate([&] { take(frame, std::move(result)); });
            delivering_ += since(begin);
        };
        const Watching watching(planned_.as.refinement.get(),
                                [this](const FrontPicture& front) { return see(front); });
        const Outcome outcome =
            edgewise::run(*planned_.answer.plan, planned_.ask(), samples_, deliver, options);
        messages_.end_progress();
        note(outcome);
    }

    void note(const Outcome& outcome) {
        Measured& measured = run_.measured;
        // Writing and verifying are no part of the path; other threads went on with it meanwhile.
        const double passing =
            (delivering_ + showing_) / std::max(1, std::min(want_.threads, want_.frames));
        measured.seconds.push_back(std::max(0.0, outcome.seconds - passing));
        measured.steps = outcome.steps;
        measured.step_seconds = outcome.step_seconds;
        for (const Message& warning : outcome.warnings) messages_.warning(warning);
        if (last_) measured.trace = outcome.trace;
        if (planned_.as.refinement) note_pictures();
    }

    void note_pictures() {
        if (refined_.pictures.empty())
            throw RunError(
                "pictures on the way: the path makes none; its last edge has to show them, as "
                "watched() asks of it");
        std::map<int, FrontSeen> last;  // by view
        for (const FrontSeen& seen : refined_.pictures) last[seen.view] = seen;
        for (const auto& [view, seen] : last) {
            if (seen.slices == seen.depth) continue;
            refined_.stopped = true;
            messages_.warning(fmt::format(
                "{}stopped after {:.3g} s at {} of {} slices: what lies behind changes a pixel by "
                "{:.3g} at most, by {:.3g} on average, of light of 1",
                want_.frames > 1 ? fmt::format("view {}: ", view) : "", seen.seconds, seen.slices,
                seen.depth, seen.bound.most, seen.bound.mean));
        }
        run_.measured.refined = std::move(refined_);
    }

    /// A picture on the way. Views that run side by side wait for each other.
    bool see(const FrontPicture& front) {
        const std::lock_guard lock(seeing_);
        const auto begin = Clock::now();
        FrontSeen seen{front.view, front.slices, front.depth, since(began_), {}};
        const bool whole = front.slices == front.depth;
        if (!whole) seen.bound = front_bound_of(front.picture, most_light_of(want_.shading));
        refined_.pictures.push_back(seen);
        if (whole) return true;
        const std::optional<double> limit = planned_.as.refinement->stop_after();
        const bool stops = limit && seen.seconds >= *limit;
        // Waiting for its own tiles, this thread must not begin another view's step, which would
        // come here again.
        if (!stops && last_ && writes_ && planned_.as.refinement->writes())
            tbb::this_task_arena::isolate([&] { write_front(front); });
        showing_ += since(begin);
        return !stops;
    }

    /// As if it were the result.
    void write_front(const FrontPicture& front) {
        // Nothing but a view of the samples: they are the edge's.
        const std::shared_ptr<const Data> one[] = {
            std::shared_ptr<const Data>(&front.picture, [](const Data*) {})};
        const Tail& tail = planned_.written.tail;
        const Shades levels = tail.view ? shades_of(one, planned_.window, tail) : Shades{};
        const Array samples = finished(front.picture, tail, levels, planned_.memory.get());
        store::write(planned_.outputs->file(front.view), planned_.written.header, samples.data(),
                     {planned_.query.quality});
    }

    std::optional<Plan> other_plan(const std::string& failed,
                                   const std::vector<Representation>& held) {
        PlanOptions options = planned_.plan_options;
        options.demands = planned_.query.demands;
        options.demands.without.push_back(demand_of(failed, planned_.engine.edges()));
        without_.push_back(options.demands.without.back());
        options.demands.without.insert(options.demands.without.end(), without_.begin(),
                                       without_.end());
        std::vector<Source> sources;
        for (const Representation& what : held) sources.push_back({what});
        return plan(planned_.engine.edges(), planned_.ask(), sources, planned_.engine.machine(),
                    options)
            .plan;
    }

    /// One frame of a run; of several runs the last is kept, so that earlier ones leave no results
    /// beside the next.
    void take(int frame, std::shared_ptr<const Data> result) {
        if (!last_) return;
        if (sink_) sink_(frame, *result);
        if (!planned_.writes_at_once()) {
            if (writes_ || verifier_ || (shown_ && frame == 0) || makes_surface(want_.job))
                frames_[static_cast<std::size_t>(frame)] = std::move(result);
            return;
        }
        if (verifier_) verifier_->frame(frame, *result);
        const bool shows = shown_ && frame == 0;
        if (!writes_ && !shows) return;
        const std::shared_ptr<const Data> one[] = {std::move(result)};
        const Shades levels = shades_of(one, planned_.window, planned_.written.tail);
        if (shows) shown_->take(*one[0], levels);
        if (writes_) write(frame, *one[0], levels);
    }

    bool shows_depth() const { return planned_.query.look.depth_colour; }
    /// How deep all views are, in units of screen space.
    double scene_depth() const { return static_cast<double>(planned_.geometry.grid.extent.z); }

    Array samples_to_write(int frame, const Data& result, const Shades& levels) const {
        if (!shows_depth())
            return written_samples(result, planned_.written, levels, planned_.memory.get());
        return depth_coloured(result, planned_.written.tail, levels, *planned_.written.colours,
                              want_, *samples_, frame, scene_depth(), planned_.memory.get());
    }

    void write(int frame, const Data& result, const Shades& levels) {
        poll();
        const auto begin = Clock::now();
        if (const auto cut = cut_off_text(want_, result, planned_.written.tail))
            messages_.warning(*cut);
        Array samples = samples_to_write(frame, result, levels);
        const std::string kept =
            keep_padding(want_, planned_.input, planned_.written.tail, samples);
        if (!kept.empty()) messages_.warning(kept);
        if (!writer_)
            writer_.emplace(*planned_.outputs, planned_.written, planned_.query, want_.frames,
                            messages_.stop());
        if (want_.job->of_rays()) writer_->surround(want_.mode->light_left ? 1 : want_.miss);
        if (shows_depth()) writer_->explain_depth(scene_depth() * planned_.geometry.unit);
        for (std::string& file : writer_->write(frame, samples.data(), levels))
            run_.files.push_back(std::move(file));
        run_.measured.write_seconds += since(begin);
    }

    /// What waited until all frames were there.
    void end_run() {
        if (!planned_.writes_at_once()) {
            for (std::size_t i = 0; verifier_ && i < frames_.size(); ++i) {
                verifier_->frame(static_cast<int>(i), *frames_[i]);
                poll();
            }
        }
        if (verifier_) {
            Verified& error = run_.measured.error.emplace(verifier_->finish());
            error.high = error.at_most;
        }
        verifier_.reset();
        planned_.memory->trim();
        if (planned_.query.strict && !keeps_budgets())
            throw RunError(message("@strict: a budget is broken; nothing is written"));
        const bool waited = !planned_.writes_at_once();
        if (makes_surface(want_.job)) {
            end_mesh();
            return;
        }
        const Shades levels = waited && (writes_ || shown_) ? default_levels() : Shades{};
        show(levels);
        if (!waited || !writes_) return;
        // From here on nobody reads the samples: their bytes are the last form's.
        field_.reset();
        if (!shows_depth()) samples_.reset();
        for (std::size_t i = 0; i < frames_.size(); ++i) {
            write(static_cast<int>(i), *frames_[i], levels);
            frames_[i].reset();
        }
        samples_.reset();
    }

    std::shared_ptr<const surface::Mesh> finished_mesh(
        std::shared_ptr<const surface::Mesh> mesh) const {
        const SurfaceFinish& finish = planned_.query.finish;
        std::pmr::memory_resource* memory = planned_.memory.get();
        if (!finish.largest && !finish.smooth && !finish.decimate) return mesh;
        // What the steps take beside the meshes counts as well.
        const Array room(static_cast<std::size_t>(surface::finishing_bytes(
                             double(mesh->positions().size()), double(mesh->triangles().size()))),
                         memory);
        if (finish.largest)
            mesh = std::make_shared<surface::Mesh>(surface::largest_part(*mesh, memory));
        if (finish.smooth)
            mesh =
                std::make_shared<surface::Mesh>(surface::smoothed(*mesh, *finish.smooth, memory));
        if (finish.decimate)
            mesh = std::make_shared<surface::Mesh>(
                surface::decimated(*mesh, *finish.decimate, memory));
        return mesh;
    }

    /// A surface is finished as the request says, measured and written.
    void end_mesh() {
        const std::shared_ptr<const surface::Mesh> made = surface::mesh_in(*frames_[0]);
        if (!made) throw RunError("the path has made no surface");
        const std::shared_ptr<const surface::Mesh> mesh = finished_mesh(made);
        run_.surface = surface::measures_of(*mesh, planned_.memory.get());
        if (!writes_) return;
        poll();
        const auto begin = Clock::now();
        const std::vector<store::SurfaceLabel> labels = labels_of(*mesh);
        const auto& segments = planned_.input.header.segments;
        const store::Header& header = planned_.input.header;
        const std::string file = planned_.outputs->file(0);
        store::write_surface(
            file, {.positions = mesh->positions(),
                   .normals = mesh->normals(),
                   .triangles = mesh->triangles(),
                   .groups = mesh->groups(),
                   .labels = labels,
                   .coloured = !labels.empty() && std::any_of(segments.begin(), segments.end(),
                                                              [](const store::Segment& segment) {
                                                                  return segment.color.has_value();
                                                              }),
                   .unit = header.unit,
                   .anatomical = header.anatomical,
                   .offset = {planned_.geometry.offset.x(), planned_.geometry.offset.y(),
                              planned_.geometry.offset.z()}});
        run_.measured.write_seconds += since(begin);
        run_.files.push_back(file);
    }

    /// Labels as files name them: the surface knows their places where there is a table.
    std::vector<store::SurfaceLabel> labels_of(const surface::Mesh& mesh) const {
        const Segments segments(planned_.input);
        const LabelTable* table = planned_.input.table.get();
        std::vector<store::SurfaceLabel> labels;
        for (std::size_t i = 0; i < mesh.labels.size(); ++i) {
            const double value = mesh.labels[i];
            const auto place = static_cast<std::size_t>(value);
            store::SurfaceLabel label;
            label.value = table ? table->values[place] : value;
            label.id = table ? table->text(place) : fmt::format("{}", value);
            label.exact = !table || table->bits.empty() || std::abs(table->values[place]) < 0x1p53;
            label.color = label_color(i);
            if (const store::Segment* segment = segments.of(value)) {
                label.name = segment->name;
                label.color = segment->color.value_or(label.color);
            }
            labels.push_back(std::move(label));
        }
        return labels;
    }

    /// While there are samples to compare with.
    void show(const Shades& levels) {
        if (!shown_) return;
        if (!planned_.writes_at_once()) shown_->take(*frames_[0], levels);
        shown_->compare(*samples_);
        planned_.memory->trim();
    }

    Shades default_levels() const {
        const Tail& tail = planned_.written.tail;
        if (!tail.view) return {};
        const store::Header& header = planned_.input.header;
        const bool photograph = want_.job->samples && !header.volume && !is_integer(header.type);
        if (photograph && !planned_.window) return {0, 1};
        return shades_of(frames_, planned_.window, tail);
    }

    /// Whether what was measured may keep the budgets that were given; a warning says which it does
    /// not.
    bool keeps_budgets() {
        Measured& measured = run_.measured;
        // What the process once held before the request is not the request's.
        measured.bytes = resident_peak();
        if (measured.bytes <= planned_.peak_before)
            measured.bytes = std::min(
                measured.bytes, planned_.resident + static_cast<double>(planned_.memory->peak()));
        const Budget& budget = want_.budget;
        const auto broken = [&](const char* what, double value, double limit, const char* unit) {
            if (value <= limit) return;
            measured.kept = false;
            messages_.warning(fmt::format("{} {:.3g}{} is beyond the budget of {:.3g}{}", what,
                                          value, unit, limit, unit));
        };
        std::vector<double> seconds = measured.seconds;
        std::nth_element(seconds.begin(), seconds.begin() + seconds.size() / 2, seconds.end());
        if (budget.seconds) broken("time:", seconds[seconds.size() / 2], *budget.seconds, " s");
        if (planned_.query.max_memory)
            broken("memory:", measured.bytes / 0x1p20, *budget.bytes / 0x1p20, " MiB");
        if (measured.error && budget.error && !budget.error_yields) judge_error(*budget.error);
        return measured.kept != false;
    }

    /// An interval on one side of the budget judges it; one that straddles it leaves it open.
    void judge_error(double budget) {
        Measured& measured = run_.measured;
        const Verified& error = *measured.error;
        if (error.high <= budget) return;
        const auto words = [&](double value) {
            return error_words(value, planned_.query.notation.error);
        };
        const std::string interval = fmt::format("error: {} (95 %: {} to {})", words(error.nrmse),
                                                 words(error.low), words(error.high));
        if (error.low > budget) {
            measured.kept = false;
            messages_.warning(
                fmt::format("{} is beyond the budget of {}", interval, words(budget)));
            return;
        }
        if (measured.kept == true) measured.kept.reset();
        messages_.warning(
            message("{} leaves open whether the budget of {} is kept; @verify(all) decides",
                    interval, words(budget)));
    }

    const Planned& planned_;
    Listener& messages_;
    std::shared_ptr<const Data> samples_;
    const FrameSink& sink_;
    const Request& want_;
    const bool writes_;
    Run run_;
    bool last_ = true;
    double delivering_ = 0, showing_ = 0;
    Clock::time_point began_{};
    std::mutex seeing_;
    Refined refined_;
    std::vector<std::shared_ptr<const Data>> frames_;
    std::vector<Demand> without_;
    std::optional<ReferenceField> field_;
    std::optional<Verifier> verifier_;
    std::optional<ShownResult> shown_;
    std::optional<ResultWriter> writer_;
};

}  // namespace

Run run(const Planned& planned, std::shared_ptr<const Data> samples, const Sinks& sinks,
        Listener& messages) {
    if (!planned.answer.plan) throw RequestError("run: there is no plan");
    if (planned.want.ranks > 1) throw RequestError("run: a run is on one rank");
    if (!samples || !samples->samples.data())
        throw RequestError(
            "run: there are no samples: they are described only, or were given back "
            "when the last result was written");
    return Running(planned, std::move(samples), sinks, messages).run_all();
}

Run run_once(Planned& planned, const Sinks& sinks, Listener& messages) {
    if (planned.as.keeps_samples) return run(planned, planned.input.data, sinks, messages);
    return run(planned, std::exchange(planned.input.data, nullptr), sinks, messages);
}

}  // namespace edgewise
