#include "engine/pilot.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <malloc.h>
#include <tbb/task_arena.h>

#include "engine/contender.hpp"
#include "engine/growing_verifier.hpp"
#include "engine/paths.hpp"
#include "engine/planned.hpp"
#include "engine/wisdom.hpp"
#include "graph/errors.hpp"
#include "measure/quantiles.hpp"
#include "measure/repeated.hpp"
#include "measure/since.hpp"
#include "measure/watch.hpp"
#include "runtime/runtime.hpp"

namespace edgewise {
namespace {

constexpr std::size_t kMostPaths = 200;
/// A path that would take less of the best one's time is worth it.
constexpr double kWorth = 0.9;
/// Where the error of a path is open, the last reference of the first two numbers of samples takes
/// a seventh of the time at most: there may be a next, which ends in time for runs.
constexpr double kReferences = 7, kReferring = 0.8;
constexpr int kFrames = 12;      // run of a long turntable
constexpr double kTrying = 0.6;  // of the time without references; the rest goes to close paths
/// Predicted errors are upper estimates: 95 % lie within three times the measured one, those of the
/// spectrum farther away.
constexpr double kOverestimate = 4;
constexpr double kHopeless = 3;    // slower than the best by more: stopped
constexpr double kPatience = 0.1;  // [s], never stopped before
constexpr double kTie = 1.03;      // two runs of one path differ by so much
using Clock = std::chrono::steady_clock;

/// The request with a few of its views.
Request with_few_frames(const Request& want, int frames) {
    if (frames >= want.frames) return want;
    Request few = want;
    std::vector<Transform> maps;
    std::vector<Clip> clips;
    for (int i = 0; i < frames; ++i) {
        const auto view = static_cast<int>((2 * i + 1) * std::int64_t{want.frames} / (2 * frames));
        maps.push_back(want.views.at(view));
        if (const Clip* clip = want.clip(view)) clips.push_back(*clip);
    }
    few.clips = std::move(clips);
    few.views = Placement::each(std::move(maps));
    few.frames = frames;
    return few;
}

class Pilot {
 public:
    Pilot(const Planned& planned, Listener& messages, bool all, double limit, double most)
        : planned_(planned),
          answer_(planned.answer),
          messages_(messages),
          all_(all),
          limit_(limit),
          most_seconds_(most),
          want_(with_few_frames(planned.want, kFrames)),
          key_(wisdom_key(planned)),
          wisdom_(planned.query.remembers ? Wisdom::load(planned.engine.wisdom()) : Wisdom()) {
        if (!wisdom_.problem().empty()) messages.warning(wisdom_.problem());
        collect();
    }

    Answer run_all() {
        for (Contender& each : contenders_) {
            if (each.failed || !each.seconds.empty()) continue;
            const bool late = since(begin_) - referring() > kTrying * limit_ || out_of_time();
            if (!each.is_default && (late || !could_win(each))) continue;
            if (!each.known)
                try_first(each);
            else if (keeps_error(each) || each.is_default)
                run_again(each);
        }
        settle_open();
        for (int round = 0; runs_ > 0 && !out_of_time(); ++round)
            if (!run_round(round)) break;
        keep();
        choose();
        return std::move(answer_);
    }

 private:
    /// The default first, then the fastest predicted ones; those that are known bring what they
    /// took. Plans of few frames are looked up by their steps.
    void collect() {
        const Answer& answer = planned_.answer;
        const Wisdom::Paths* known = wisdom_.find(key_);
        const Ask few{want_, planned_.scene};
        const PricedGraph graph(planned_.engine.edges(), few, planned_.sources(),
                                planned_.engine.machine(), planned_.plan_options);
        for (Plan& plan : all_paths(graph.real(), planned_.engine.edges(), few,
                                    planned_.plan_options, 20 * kMostPaths))
            few_.emplace(path_text(plan.texts()), std::move(plan));
        const std::string chosen = answer.plan ? path_text(answer.plan->texts()) : "";
        for (Plan& plan : tried_paths(planned_, kMostPaths, 1).plans) {
            const std::string text = path_text(plan.texts());
            if (!few_.contains(text) || !may_fit(plan)) continue;
            Contender contender;
            contender.is_default = text == chosen;
            if (known)
                if (const auto found = known->find(text); found != known->end()) {
                    contender.known = found->second;
                    contender.seconds = found->second.seconds;
                    contender.failed = found->second.given_up > 0;
                }
            contender.plan = std::move(plan);
            contenders_.push_back(std::move(contender));
        }
        std::stable_partition(contenders_.begin(), contenders_.end(),
                              [](const Contender& each) { return each.is_default; });
    }

    bool may_fit(const Plan& plan) const {
        const Budget& budget = planned_.want.budget;
        if (budget.bytes && plan.predicted.bytes > *budget.bytes) return false;
        if (!all_ && budget.like && plan.predicted.likeness != Likeness::alike) return false;
        if (all_ || !budget.error || !plan.predicted.known) return true;
        return plan.predicted.error <= kOverestimate * *budget.error;
    }

    bool out_of_time() const { return since(begin_) > limit_; }

    bool keeps_error(const Contender& each) const {
        const Budget& budget = planned_.want.budget;
        if (budget.like && each.plan.predicted.likeness != Likeness::alike) return false;
        if (!budget.error) return true;
        // Half of the way to the end of the interval: a sample may flatter.
        return each.known && 0.5 * (each.known->error + each.known->high) <= *budget.error;
    }

    /// Whether the interval of the measured error holds the budget.
    bool is_open(const Contender& each) const {
        const Budget& budget = planned_.want.budget;
        return budget.error && each.known && each.known->low <= *budget.error &&
               *budget.error <= each.known->high;
    }

    /// What is minimised, as measured; infinite where a budget is broken or nothing is known.
    double cost(const Contender& each) const {
        constexpr double kNever = std::numeric_limits<double>::infinity();
        const Budget& budget = planned_.want.budget;
        if (each.failed || each.seconds.empty() || !keeps_error(each)) return kNever;
        const double seconds = each.belief(level()).seconds;
        if (budget.seconds && seconds > *budget.seconds) return kNever;
        switch (planned_.want.minimize) {
            case Minimize::time:
                return seconds;
            case Minimize::error:
                return each.known->error;
            case Minimize::memory:
                break;
        }
        return each.known->bytes;
    }

    /// Runs over predictions, in the median of what was run: how busy the machine is.
    double level() const {
        std::vector<double> ratios;
        for (const Contender& each : contenders_)
            if (!each.seconds.empty() && each.plan.predicted.seconds > 0)
                ratios.push_back(each.typical() / each.plan.predicted.seconds);
        return ratios.empty() ? 1 : median(ratios);
    }

    const Contender* best() const {
        const Contender* best = nullptr;
        for (const Contender& each : contenders_)
            if (std::isfinite(cost(each)) && (!best || cost(each) < cost(*best))) best = &each;
        return best;
    }

    /// Whether the low end of what is predicted is still below the best that was measured.
    bool could_win(const Contender& each) const {
        const Contender* best = this->best();
        if (!best || all_ || planned_.want.minimize != Minimize::time) return true;
        return level() * each.low() < best->typical();
    }

    /// Seconds of the whole request: frames that were not run take what the others took.
    double whole_seconds(const Plan& few, const Outcome& outcome) const {
        double set_up = 0;
        for (std::size_t k = 0; k < few.steps.size(); ++k)
            if (few.steps[k].runs() == 1 && want_.frames > 1) set_up += outcome.step_seconds[k];
        const double frames = std::max(0.0, outcome.seconds - set_up);
        return set_up + frames * planned_.want.frames / want_.frames;
    }

    /// @param patient  does not give up: verifying takes its own time, and what has run is brief
    const std::atomic<bool>& stop() const { return messages_.stop(); }

    std::optional<Outcome> run_once(Contender& each, bool patient, const Deliver& deliver) {
        ++runs_;
        const Contender* best = this->best();
        const double share = double(want_.frames) / planned_.want.frames;
        const Clock::time_point begin = Clock::now();
        std::optional<Watch> watch;  // its thread would take a processor from a brief run
        if (!each.is_default && !all_ && !patient && best)
            watch.emplace(std::max(kPatience, kHopeless * best->typical() * share), stop());
        RunOptions options;
        options.threads = planned_.engine.machine().processors;
        options.arenas = &planned_.engine.arenas();
        options.memory = planned_.memory.get();
        options.stop = watch ? &watch->flag() : &stop();
        const Plan& plan = few_.at(path_text(each.plan.texts()));
        try {
            Outcome outcome =
                run(plan, {want_, planned_.scene}, planned_.input.data, deliver, options);
            if (outcome.steps == plan.texts()) return outcome;
        } catch (const Cancelled&) {
            if (stop()) throw;
        } catch (const std::exception&) {
            // Out of memory, or a failure of an edge: this path does not win.
        }
        each.failed = true;
        if (!each.known) each.known.emplace();
        each.known->given_up = std::max(1e-9, since(begin));
        return std::nullopt;
    }

    /// With its error; the time of this run warms up only, and stands alone where it is long.
    void try_first(Contender& each) {
        verify(each);
        // Where it keeps its budget few of those that follow need be run. Faster ones may follow
        // the default.
        while (is_worth_a_look(each) &&
               !(each.is_default && each.known->samples >= GrowingVerifier::kSecond) &&
               look_closer(each)) {
        }
        if (each.failed) return;
        if (keeps_error(each) || each.is_default) run_again(each);
        messages_.progress(std::min(1.0, since(begin_) / limit_), path_text(each.plan.texts()));
    }

    /// Whether more samples may show that a path keeps its budget that would win then.
    bool is_worth_a_look(const Contender& each) const {
        if (each.failed || !is_open(each)) return false;
        const Contender* best = this->best();
        if (each.known->samples < GrowingVerifier::kSecond) return !best || could_win(each);
        return !keeps_error(each) &&
               (!best || level() * each.plan.predicted.seconds < kWorth * best->typical());
    }

    /// Measures its error on more samples, and from now on all, if there is time for that.
    bool look_closer(Contender& each) {
        GrowingVerifier& errors = this->errors();
        while (static_cast<double>(errors.samples()) <= each.known->samples) {
            const double then = since(begin_) + errors.seconds_to_grow();
            if (!errors.can_grow() || then > kReferring * limit_) return false;
            errors.grow();
        }
        verify(each);
        return true;
    }

    /// On which side of its budget the error of a path lies that would win: some became worth it
    /// when what seemed better was run, some were known from other budgets. That comes before
    /// timing the close ones again.
    void settle_open() {
        for (Contender& each : contenders_) {
            bool looked = false;
            while (is_worth_a_look(each) && look_closer(each)) looked = true;
            if (looked && !each.failed && keeps_error(each)) run_again(each);
        }
    }

    GrowingVerifier& errors() {
        if (!errors_) {
            const Input& input = planned_.input;
            field_.emplace(*input.data, want_.field, input.phantom ? &*input.phantom : nullptr);
            errors_.emplace(want_, *field_, planned_.memory.get());
        }
        return *errors_;
    }
    double referring() const { return errors_ ? errors_->seconds() : 0; }

    /// Runs it once and compares that with the reference.
    void verify(Contender& each) {
        try {
            return compare(each);
        } catch (const std::bad_alloc&) {
            if (!errors().shrink()) throw;
            if (each.known) return;  // what fewer samples told must do
        }
        verify(each);
    }

    void compare(Contender& each) {
        GrowingVerifier& errors = this->errors();
        errors.begin();
        planned_.memory->reset_peak();
        const Deliver deliver = [&](int frame, const std::shared_ptr<const Data>& result) {
            // Waiting for its own tiles, this thread must not begin another frame's step.
            tbb::this_task_arena::isolate([&] { errors.frame(frame, *result); });
        };
        const auto outcome = run_once(each, true, deliver);
        const Verified error = errors.finish();
        if (!outcome) return;
        each.known = Learned{.seconds = {},
                             .error = error.nrmse,
                             .low = error.low,
                             .high = error.high,
                             .samples = double(errors.samples()),
                             .bytes = planned_.resident + double(outcome->peak)};
        if (is_open(each))
            limit_ =
                std::max(limit_, std::min(kReferences * errors.early_seconds(), most_seconds_));
    }

    /// Where another path ran before, a short one runs twice, and the second run counts.
    void run_again(Contender& each) {
        const Deliver nothing = [](int, const std::shared_ptr<const Data>&) {};
        const Plan& few = few_.at(path_text(each.plan.texts()));
        const bool timed = !each.seconds.empty();
        if (last_ != &each && needs_warming(timed ? each.least() : each.plan.predicted.seconds) &&
            !run_once(each, timed, nothing))
            return;
        last_ = &each;
        // Whatever the time, what is known to keep its budgets has a run that counts.
        if (timed && out_of_time()) return;
        if (const auto outcome = run_once(each, timed, nothing))
            each.seconds.push_back(whole_seconds(few, *outcome));
    }

    /// The close ones once more; the order turns round every time, so that no place in it wins.
    /// @return whether there was a choice to be made
    bool run_round(int round) {
        const Contender* best = this->best();
        if (!best) return false;
        std::vector<Contender*> again;
        int close = 0;
        for (Contender& each : contenders_) {
            if (!std::isfinite(cost(each)) || !each.is_close_to(*best)) continue;
            ++close;
            if (!each.is_sure()) again.push_back(&each);
        }
        if (again.empty() || (close == 1 && best->is_timed())) return false;
        if (round % 2) std::reverse(again.begin(), again.end());
        for (Contender* each : again) {
            if (out_of_time()) break;
            run_again(*each);
        }
        return true;
    }

    void keep() const {
        if (runs_ == 0 || !planned_.query.remembers) return;
        Wisdom::Paths learned;
        for (const Contender& each : contenders_)
            if (each.known) {
                Learned& path = learned[path_text(each.plan.texts())] = *each.known;
                path.seconds = each.seconds;
            }
        wisdom_.keep(
            key_,
            fmt::format("{} {} {} to {}", name_of(planned_.want.job), planned_.query.input,
                        planned_.input.data->what.text(), text_of(planned_.want.screen, 3)),
            learned);
    }

    /// The best measured path, with what is believed after its runs instead of what was predicted.
    void choose() {
        messages_.end_progress();
        const Contender* chosen = best();
        for (const Contender& each : contenders_)
            if (each.is_default && chosen && std::isfinite(cost(each)) &&
                cost(each) <= kTie * cost(*chosen))
                chosen = &each;
        if (!chosen) return nothing_keeps();
        answer_.plan = measured_plan(*chosen);
        time_plain();
        answer_.problem.clear();
        answer_.nearest.clear();
        answer_.warnings.clear();
    }

    Plan measured_plan(const Contender& chosen) const {
        Plan plan = chosen.plan;
        const Belief belief = chosen.belief(level());
        const double factor =
            plan.predicted.seconds > 0 ? belief.seconds / plan.predicted.seconds : 1;
        for (Step& step : plan.steps) {
            step.seconds *= factor;
            step.predicted.seconds *= factor;
        }
        plan.predicted.seconds = plan.label.seconds = belief.seconds;
        plan.predicted.spread = belief.spread;
        plan.predicted.error = chosen.known->high;
        plan.predicted.known = true;
        return plan;
    }

    /// What the plain path takes, told as the plan is: as measured, else as predicted for a machine
    /// that is as busy.
    void time_plain() {
        if (!answer_.plain || !answer_.plain->seconds) return;
        for (const Contender& each : contenders_)
            if (path_text(each.plan.texts()) == answer_.plain->step && !each.seconds.empty()) {
                answer_.plain->seconds = each.belief(level()).seconds;
                return;
            }
        *answer_.plain->seconds *= level();
    }

    /// A likeness is a wish: the most accurate measured path. A demand is not met.
    void nothing_keeps() {
        const Contender* accurate = nullptr;
        for (const Contender& each : contenders_)
            if (each.known && !each.failed && !each.seconds.empty() &&
                (!accurate || each.known->error < accurate->known->error))
                accurate = &each;
        if (!accurate) return;  // out of time before anything was known: as the models have it
        if (planned_.want.budget.like) {
            answer_.plan = measured_plan(*accurate);
            return time_plain();
        }
        answer_.plan.reset();
        answer_.nearest = {measured_plan(*accurate)};
        answer_.problem = "no measured plan keeps the budgets";
    }

    const Planned& planned_;
    Answer answer_;
    Listener& messages_;
    bool all_;
    double limit_;
    const double most_seconds_;
    const Clock::time_point begin_ = Clock::now();
    const Request want_;                   // with few frames
    std::optional<ReferenceField> field_;  // made when something is verified
    std::optional<GrowingVerifier> errors_;
    std::string key_;
    Wisdom wisdom_;
    std::map<std::string, Plan> few_;  // paths of the request with few frames
    std::vector<Contender> contenders_;
    const Contender* last_ = nullptr;  // that ran
    int runs_ = 0;
};

}  // namespace

Answer measured_answer(const Planned& planned, Listener& messages, bool all, double limit,
                       double most) {
    Answer answer = Pilot(planned, messages, all, limit, most).run_all();
    malloc_trim(0);  // what verifying took is no part of the run
    return answer;
}

}  // namespace edgewise
