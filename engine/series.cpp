#include "engine/series.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <fmt/format.h>
#include <limits>

#include "engine/facts/known_scene.hpp"
#include "engine/result_writer.hpp"
#include "graph/errors.hpp"
#include "measure/machine.hpp"
#include "measure/quantiles.hpp"
#include "measure/since.hpp"
#include "request/resolution.hpp"

namespace edgewise {
namespace {

using Clock = std::chrono::steady_clock;

Representation series_picture(const Extent& extent, int channels) {
    Representation what;
    what.space = "screen";
    what.content = "picture";
    what.axes = 2;
    what.extent = {extent.x, extent.y, 1};
    what.channels = channels;
    return what;
}

/// @throws RequestError what has no film over time
void expect_series(const Query& query) {
    if (!query.job->of_rays())
        throw RequestError(
            message("@time(all): of `@command(render)`, not of {}; name one time point",
                    name_of(query.job)));
    if (query.selection.time)
        throw RequestError(message("@time(all): and one time point is selected as well"));
    if (query.ranks.value_or(1) > 1)
        throw RequestError(message("@ranks: the time points of a film are rendered on one rank"));
}

class Playing {
 public:
    Playing(Series& series, const std::function<void(Planned&)>& planned, const FrameSink& sink)
        : series_(series), query_(series.query), planned_(planned), sink_(sink) {}

    void run_all() {
        look();
        take_range();
        plan_first();
        if (planned_) planned_(series_.first->plan());
        if (!series_.runs) return;
        begin_writing();
        for (int time = 0; time < series_.times; ++time) {
            series_.told.frame = time;
            if (time == 0)
                render(series_.first->plan(), 0);
            else
                render_next(time);
        }
        end();
    }

 private:
    void poll() const {
        if (series_.messages.stop()) throw Cancelled();
    }

    /// What the file is and what is to be written, before anything is read or planned.
    void look() {
        expect_series(query_);
        outputs_ = outputs_of(query_);
        writes_ = outputs_ && !outputs_->none();
        const InState unobserved(series_.messages, Listener::State::unobserved);
        file_ = std::make_shared<const Input>(
            inspected(query_.input, chosen_selection(at_time(0), outputs_)));
        const Input& input = *file_;
        if (query_.look.depth_colour)
            throw RequestError(message("@depth_colour: of one time point; name it by @time N"));
        if (input.phantom || input.described || input.pairs)
            throw RequestError(message("@time(all): {} has no time points", query_.input));
        series_.times = series_.told.frames = input.header.times;
        Request want = request_of(query_);
        const Geometry geometry = take_geometry(want, query_, input, outputs_);
        if (want.frames > 1)
            throw RequestError(
                message("@time(all): {} time points, and {} views by @turntable or @path: a film "
                        "shows the one or the other; name one view, or one time point by @time N",
                        series_.times, want.frames));
        extent_ = want.output();
        channels_ = want.mode->channels;
        if (const Message left_out = expect_frames(query_, outputs_, series_.times);
            !left_out.empty())
            series_.messages.warning(left_out);
        want.frames = series_.times;
        if (!writes_) return;
        written_ = written_of(want, query_, geometry, input, *outputs_, 0, 0);
        for (const Message& warning : written_.warnings) series_.messages.warning(warning);
    }

    Query at_time(int time) const {
        Query one = query_;
        one.selection.time = time;
        one.out.reset();
        one.fps.reset();
        one.strict = false;
        // The same for each, whatever the others took: one request, one plan.
        if (query_.max_time) one.max_time = *query_.max_time / series_.times;
        return one;
    }

    /// The range of all time points, read one after another. What is known from an earlier run is
    /// read once less.
    void take_range() {
        low_ = std::numeric_limits<double>::infinity(), high_ = -low_;
        for (int time = 0; time < series_.times; ++time) {
            poll();
            const InState unobserved(series_.messages, Listener::State::unobserved);
            const double left =
                query_.max_memory ? *query_.max_memory - resident_now() : free_memory();
            MemoryBudget memory(static_cast<std::size_t>(std::max(0.0, left)));
            Input input = *file_;
            input.selection.time = time;
            // Too large: the first request says so, with what would do.
            if (input.bytes() > left) return forget_range();
            const auto begin = Clock::now();
            read_data(input, &memory);
            series_.read_seconds += since(begin);
            if (!query_.remembers) input.identity.reset();
            const Statistics found = known_statistics(series_.engine.facts().get(), input, &memory);
            low_ = std::min(low_, found.low), high_ = std::max(high_, found.high);
            input.data.reset();
        }
    }

    void forget_range() { low_ = std::numeric_limits<double>::infinity(), high_ = -low_; }

    Asked asked_at(int time) const {
        return ask(series_.engine, at_time(time), {.runs = series_.runs, .described = file_});
    }

    void plan_first() {
        if (series_.runs) open();
        series_.told.frame = 0;
        Reached& first = series_.first.emplace(asked_at(0));
        first.open_all(series_.told);
        first.look_at(series_.effort, series_.told, InSeries{.low = low_, .high = high_});
        first.price_all(series_.effort, series_.told);
        expect_plan(*first.planned());
    }

    /// The pictures are there from the beginning, so that the budgets of all time points count
    /// them.
    void open() {
        const Representation what = series_picture(extent_, channels_);
        const double bytes = series_.times * what.bytes();
        const double left = query_.max_memory ? *query_.max_memory - resident_now() : free_memory();
        if (bytes > left)
            throw NoPlan(
                message("{}: {} pictures take {:.0f} MiB, and {:.0f} MiB are left for them; a "
                        "smaller @size takes less",
                        query_.max_memory ? setting("max_memory") : "memory", series_.times,
                        bytes / 0x1p20, std::max(0.0, left) / 0x1p20));
        memory_ = std::make_unique<MemoryBudget>(static_cast<std::size_t>(2 * bytes) + kWriting);
        for (int time = 0; time < series_.times; ++time) {
            poll();
            pictures_.push_back(std::make_shared<Data>(Data::make(what, memory_.get())));
            std::fill_n(pictures_.back()->as<float>(),
                        pictures_.back()->samples.bytes() / sizeof(float), 0.0f);
        }
    }

    /// A time point after the first: by its plan, with what it took from all values.
    void render_next(int time) {
        poll();
        const Opened opened = edgewise::open(asked_at(time), series_.told);
        const Planned& first = *series_.first->planned();
        const InSeries in{.low = low_, .high = high_, .first = &first};
        Looked looked = edgewise::look(opened, read(opened, series_.told),
                                       {.errors = ErrorsWanted::never}, series_.told, in);
        if (looked.stored.text() != first.stored.text())
            throw InputError(fmt::format("{}: time point {} is {}, and the first is {}",
                                         query_.input, time, looked.stored.text(),
                                         first.stored.text()));
        Planned planned = follow(std::move(looked), *first.answer.plan, series_.told);
        render(planned, time);
    }

    void render(Planned& planned, int time) {
        // All of them together are held against it, when all have run.
        planned.want.budget.seconds.reset();
        Data& picture = *pictures_[static_cast<std::size_t>(time)];
        const auto take = [&](int, const Data& result) {
            std::memcpy(picture.as<float>(), result.as<float>(), picture.samples.bytes());
            if (sink_) sink_(time, picture);
        };
        // One time point at a time: the next needs the room.
        Run ran = run_once(planned, {.frames = take}, series_.told);
        planned.memory->trim();
        add(ran.measured, planned.input.read_seconds, time);
        if (time == 0) series_.first->run = std::move(ran);
        if (at_once_) write(time, planned.window);
    }

    void add(const Measured& one, double read_seconds, int time) {
        series_.read_seconds += read_seconds;
        if (time == 0) {
            series_.measured = one;
            return;
        }
        Measured& all = *series_.measured;
        for (std::size_t i = 0; i < all.seconds.size(); ++i) all.seconds[i] += one.seconds[i];
        // Failed steps may have been gone round.
        if (one.steps == all.steps)
            for (std::size_t i = 0; i < all.step_seconds.size(); ++i)
                all.step_seconds[i] += one.step_seconds[i];
        all.bytes = std::max(all.bytes, one.bytes);
        if (one.kept == false || (all.kept == true && !one.kept)) all.kept = one.kept;
        if (one.error && (!all.error || one.error->nrmse > all.error->nrmse)) all.error = one.error;
    }

    void begin_writing() {
        if (!writes_) return;
        writer_.emplace(*outputs_, written_, query_, series_.times, series_.messages.stop());
        at_once_ = !query_.strict && are_known(series_.first->planned()->window, written_.tail);
    }

    void write(int time, const std::optional<Window>& window) {
        std::vector<std::shared_ptr<const Data>> one{pictures_[static_cast<std::size_t>(time)]};
        write(time, shades_of(one, window, written_.tail));
    }

    void write(int time, const Shades& shades) {
        poll();
        const auto begin = Clock::now();
        std::shared_ptr<Data>& picture = pictures_[static_cast<std::size_t>(time)];
        const Array samples = written_samples(*picture, written_, shades, memory_.get());
        const Request& want = series_.first->planned()->want;
        writer_->surround(want.mode->light_left ? 1 : want.miss);
        for (std::string& file : writer_->write(time, samples.data(), shades))
            series_.files.push_back(std::move(file));
        picture.reset();
        write_seconds_ += since(begin);
    }

    void end() {
        judge();
        if (query_.strict && series_.measured->kept == false)
            throw RunError(message("@strict: a budget is broken; nothing is written"));
        if (writer_ && !at_once_) {
            const std::vector<std::shared_ptr<const Data>> all(pictures_.begin(), pictures_.end());
            const Shades shades = shades_of(all, series_.first->planned()->window, written_.tail);
            for (int time = 0; time < series_.times; ++time) write(time, shades);
        }
        series_.measured->write_seconds = write_seconds_;
    }

    void judge() {
        Measured& all = *series_.measured;
        const double took = median(all.seconds);
        if (!query_.max_time || took <= *query_.max_time) return;
        all.kept = false;
        series_.messages.warning(
            fmt::format("time: {:.3g} s of all time points is beyond the budget of {:.3g} s", took,
                        *query_.max_time));
    }

    static constexpr std::size_t kWriting = 16 << 20;  // beside the pictures, for small ones

    Series& series_;
    const Query& query_;
    const std::function<void(Planned&)>& planned_;
    const FrameSink& sink_;
    std::shared_ptr<const Input> file_;  // as any time point is described
    std::optional<Outputs> outputs_;
    bool writes_ = false, at_once_ = false;
    Written written_;
    Extent extent_;
    int channels_ = 1;
    double low_ = 0, high_ = 0;             // of all time points
    std::unique_ptr<MemoryBudget> memory_;  // before what gives back to it
    std::vector<std::shared_ptr<Data>> pictures_;
    std::optional<ResultWriter> writer_;
    double write_seconds_ = 0;
};

}  // namespace

void perform(Series& series, const std::function<void(Planned&)>& planned, const FrameSink& sink) {
    series.first.reset();
    series.files.clear();
    series.measured.reset();
    series.read_seconds = 0;
    Playing(series, planned, sink).run_all();
}

Predicted predicted_of(const Series& series) {
    Predicted all = series.first->planned()->answer.plan->predicted;
    all.seconds *= series.times;
    return all;
}

}  // namespace edgewise
