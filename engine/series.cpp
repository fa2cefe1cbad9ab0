#include "engine/series.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <fmt/format.h>
#include <limits>

#include "engine/known_scene.hpp"
#include "engine/measure/machine.hpp"
#include "engine/measure/quantiles.hpp"
#include "engine/measure/since.hpp"
#include "engine/request/resolution.hpp"
#include "engine/result_writer.hpp"
#include "graph/errors.hpp"

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
void expect_series(const RequestSpec& spec) {
    if (spec.job != Job::render)
        throw RequestError(fmt::format(
            "--time all: of `edgewise render`, not of {}; name one time point", name_of(spec.job)));
    if (spec.selection.time)
        throw RequestError("--time all: and one time point is selected as well");
    if (spec.ranks.value_or(1) > 1)
        throw RequestError("--ranks: the time points of a film are rendered on one rank");
}

class Playing {
 public:
    Playing(Series& series, const std::function<void(Session&)>& planned, const FrameSink& sink)
        : series_(series), spec_(series.spec), planned_(planned), sink_(sink) {}

    void run_all() {
        look();
        take_range();
        plan_first();
        if (planned_) planned_(*series_.first);
        if (!series_.runs) return;
        begin_writing();
        for (int time = 0; time < series_.times; ++time) {
            series_.told.frame = time;
            if (time == 0)
                render(*series_.first, 0);
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
        expect_series(spec_);
        if (spec_.out) outputs_.emplace(*spec_.out);
        writes_ = outputs_ && !outputs_->none();
        const InState unobserved(series_.messages, Listener::State::unobserved);
        file_ = inspected(spec_.input, chosen_selection(at_time(0), outputs_));
        const Input& input = *file_;
        if (spec_.look.depth_colour)
            throw RequestError("--depth-colour: of one time point; name it by --time N");
        if (input.phantom || input.described || input.pairs)
            throw RequestError(fmt::format("--time all: {} has no time points", spec_.input));
        series_.times = series_.told.frames = input.header.times;
        Request want = request_of(spec_);
        const Geometry geometry = take_geometry(want, spec_, input, outputs_);
        if (want.frames > 1)
            throw RequestError(fmt::format(
                "--time all: {} time points, and {} views by --turntable or --path: a film shows "
                "the one or the other; name one view, or one time point by --time N",
                series_.times, want.frames));
        extent_ = want.output();
        channels_ = want.mode->channels;
        if (const std::string left_out = expect_frames(spec_, outputs_, series_.times);
            !left_out.empty())
            series_.messages.warning(left_out);
        want.frames = series_.times;
        if (!writes_) return;
        written_ = written_of(want, spec_, geometry, input, *outputs_, 0, 0);
        for (const Message& warning : written_.warnings) series_.messages.warning(warning);
    }

    RequestSpec at_time(int time) const {
        RequestSpec one = spec_;
        one.selection.time = time;
        one.out.reset();
        one.fps.reset();
        one.strict = false;
        // The same for each, whatever the others took: one request, one plan.
        if (spec_.max_time) one.max_time = *spec_.max_time / series_.times;
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
                spec_.max_memory ? *spec_.max_memory - resident_now() : free_memory();
            MemoryBudget memory(static_cast<std::size_t>(std::max(0.0, left)));
            Input input = *file_;
            input.selection.time = time;
            // Too large: the first session says so, with what would do.
            if (input.bytes() > left) return forget_range();
            const auto begin = Clock::now();
            read_data(input, &memory);
            series_.read_seconds += since(begin);
            if (!spec_.remembers) input.identity.reset();
            const Statistics found = known_statistics(input, &memory);
            low_ = std::min(low_, found.low), high_ = std::max(high_, found.high);
            input.data.reset();
        }
    }

    void forget_range() { low_ = std::numeric_limits<double>::infinity(), high_ = -low_; }

    std::unique_ptr<Session> session_at(int time) {
        auto session =
            std::make_unique<Session>(at_time(time), series_.edges, series_.profile, series_.told);
        session->runs = series_.runs;
        session->series = {.low = low_,
                           .high = high_,
                           .first = time == 0 ? nullptr : series_.first.get(),
                           .file = &*file_};
        return session;
    }

    void plan_first() {
        if (series_.runs) open();
        series_.told.frame = 0;
        series_.first = session_at(0);
        Session& session = *series_.first;
        session.announces = series_.announces;
        session.errors = series_.errors;
        session.explained = series_.explained;
        session.plan_options.front = series_.front;
        take_request(session);
        make_plan(session);
    }

    /// The pictures are there from the beginning, so that the budgets of all time points count
    /// them.
    void open() {
        const Representation what = series_picture(extent_, channels_);
        const double bytes = series_.times * what.bytes();
        const double left = spec_.max_memory ? *spec_.max_memory - resident_now() : free_memory();
        if (bytes > left)
            throw NoPlan(fmt::format(
                "{}: {} pictures take {:.0f} MiB, and {:.0f} MiB are left for them; a smaller "
                "--size takes less",
                spec_.max_memory ? "--max-memory" : "memory", series_.times, bytes / 0x1p20,
                std::max(0.0, left) / 0x1p20));
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
        const std::unique_ptr<Session> session = session_at(time);
        session->errors = ErrorsWanted::never;
        session->explained = true;  // notices of the machine are told once
        take_request(*session);
        const Session& first = *series_.first;
        if (session->input->data->what.text() != first.input->data->what.text())
            throw InputError(fmt::format("{}: time point {} is {}, and the first is {}",
                                         spec_.input, time, session->input->data->what.text(),
                                         first.input->data->what.text()));
        session->plan_options = first.plan_options;
        session->answer = first.answer;
        render(*session, time);
    }

    void render(Session& session, int time) {
        // All of them together are held against it, when all have run.
        session.request.budget.seconds.reset();
        Data& picture = *pictures_[static_cast<std::size_t>(time)];
        edgewise::perform(session, [&](int, const Data& result) {
            std::memcpy(picture.as<float>(), result.as<float>(), picture.samples.bytes());
            if (sink_) sink_(time, picture);
        });
        add(session, time);
        // One time point at a time: the next needs the room. What the samples were stays known.
        auto without = std::make_shared<Data>();
        without->what = session.input->data->what;
        session.input->data = without;
        session.memory->trim();
        if (at_once_) write(time, session.window);
    }

    void add(const Session& session, int time) {
        const Measured& one = *session.measured;
        series_.read_seconds += session.input->read_seconds;
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
        writer_.emplace(*outputs_, written_, spec_, series_.times, series_.messages.stop());
        at_once_ = !spec_.strict && are_known(series_.first->window, written_.tail);
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
        const Request& want = series_.first->want();
        writer_->surround(want.mode->light_left ? 1 : want.miss);
        for (std::string& file : writer_->write(time, samples.data(), shades))
            series_.files.push_back(std::move(file));
        picture.reset();
        write_seconds_ += since(begin);
    }

    void end() {
        judge();
        if (spec_.strict && series_.measured->kept == false)
            throw RunError("--strict: a budget is broken; nothing is written");
        if (writer_ && !at_once_) {
            const std::vector<std::shared_ptr<const Data>> all(pictures_.begin(), pictures_.end());
            const Shades shades = shades_of(all, series_.first->window, written_.tail);
            for (int time = 0; time < series_.times; ++time) write(time, shades);
        }
        series_.measured->write_seconds = write_seconds_;
    }

    void judge() {
        Measured& all = *series_.measured;
        const double took = median(all.seconds);
        if (!spec_.max_time || took <= *spec_.max_time) return;
        all.kept = false;
        series_.messages.warning(
            fmt::format("time: {:.3g} s of all time points is beyond the budget of {:.3g} s", took,
                        *spec_.max_time));
    }

    static constexpr std::size_t kWriting = 16 << 20;  // beside the pictures, for small ones

    Series& series_;
    const RequestSpec& spec_;
    const std::function<void(Session&)>& planned_;
    const FrameSink& sink_;
    std::optional<Input> file_;  // as any time point is described
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

void perform(Series& series, const std::function<void(Session&)>& planned, const FrameSink& sink) {
    series.first.reset();
    series.files.clear();
    series.measured.reset();
    series.read_seconds = 0;
    Playing(series, planned, sink).run_all();
}

Predicted predicted_of(const Series& series) {
    Predicted all = series.first->answer->plan->predicted;
    all.seconds *= series.times;
    return all;
}

}  // namespace edgewise
