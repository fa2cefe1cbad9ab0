#include "cli/calibration.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <set>

#include "cli/machine.hpp"
#include "cli/quantiles.hpp"
#include "cli/session.hpp"
#include "cli/signals.hpp"
#include "graph/errors.hpp"
#include "graph/with_type.hpp"
#include "planner/cost.hpp"

namespace edgewise::cli {
namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// What is timed: a request, with the phantom's samples in another type.
struct Trial {
    Job job;
    std::string input;
    Type type;
    const char* turn;
    const char* mode;              // null: a warp
    const char* size = nullptr;    // of the screen; null: the input's
    const char* frames = nullptr;  // of a turntable; null: one view
};

/// Sizes within the caches and beyond them; volumes that are full and mostly empty, seen along
/// different axes. Those that most requests resemble come first: time may run out.
std::vector<Trial> trials(bool quick) {
    std::vector<Trial> all;
    const auto volume = [&](const char* input, const char* turn, std::vector<Type> types) {
        for (const Type type : types) {
            for (const char* mode : {"mip", "xray", "composite"})
                all.push_back({Job::render, input, type, turn, mode});
            all.push_back({Job::warp, input, type, turn, nullptr});
        }
    };
    const auto image = [&](const char* input, std::vector<Type> types) {
        for (const Type type : types) all.push_back({Job::warp, input, type, "20", nullptr});
    };
    if (quick) {
        volume("phantom:gaussians:80", "20,-15,10", {Type::u8, Type::f32});
        image("phantom:zone-plate:700", {Type::u8, Type::f32});
        return all;
    }
    volume("phantom:gaussians:112", "20,-15,10", {Type::u8, Type::i16, Type::f32});
    image("phantom:zone-plate:900", {Type::u8, Type::f32});
    volume("phantom:noise:48", "10,70,-25", {Type::u8, Type::f32});
    volume("phantom:gaussians:192", "15,40,-5", {Type::u8, Type::i16, Type::f32});
    image("phantom:zone-plate:256", {Type::u8, Type::f32});
    image("phantom:zone-plate:2000", {Type::u8, Type::f32});
    // Few pixels of large data: rays lie far apart. Many frames: threads have more to share.
    for (const Type type : {Type::u8, Type::f32}) {
        for (const char* mode : {"mip", "xray", "composite"})
            all.push_back({Job::render, "phantom:gaussians:192", type, "5,60,10", mode, "112x112"});
        all.push_back(
            {Job::render, "phantom:gaussians:112", type, "20,-15,10", "xray", nullptr, "12"});
    }
    all.push_back({Job::render, "phantom:gaussians:112", Type::u8, "20,-15,10", "mean"});
    all.push_back({Job::render, "phantom:gaussians:112", Type::f32, "20,-15,10", "mean"});
    // What is empty is cropped away.
    all.push_back({Job::render, "phantom:shepp-logan:128", Type::u8, "10,30,20", "mip"});
    all.push_back({Job::render, "phantom:shepp-logan:224", Type::u8, "10,30,20", "xray"});
    all.push_back({Job::render, "phantom:shepp-logan:128", Type::f32, "10,30,20", "xray"});
    all.push_back({Job::warp, "phantom:gaussians:112", Type::u8, "90,0,0", nullptr});
    all.push_back({Job::warp, "phantom:gaussians:112", Type::f32, "90,0,90", nullptr});
    return all;
}

/// Requests unlike the trials, on which the fit is judged.
std::vector<Trial> exams() {
    return {{Job::render, "phantom:marschner-lobb:80", Type::u8, "-35,25,60", "mip"},
            {Job::render, "phantom:sphere:128", Type::u8, "5,-50,15", "xray"},
            {Job::render, "phantom:shepp-logan:96", Type::f32, "-20,15,40", "composite"},
            {Job::warp, "phantom:sphere:96", Type::u8, "12,33,-21", nullptr}};
}

JobOptions options_of(const Trial& trial) {
    JobOptions options;
    options.job = trial.job;
    options.input = trial.input;
    options.geometry.steps = {{"rotate", trial.turn}};
    if (trial.mode) options.mode = trial.mode;
    if (trial.size) options.geometry.size = trial.size;
    if (trial.frames) options.geometry.turntable = trial.frames;
    options.machine = "default";
    options.threads = "1";
    options.quiet = true;
    return options;
}

/// The same values, rounded, in another type.
std::shared_ptr<Data> retyped(const Data& from, Type type, MemoryBudget* memory) {
    Representation what = from.what;
    what.type = type;
    const double top = type == Type::f32 ? 1 : type == Type::u8 ? 255 : 4095;
    what.values = {1 / top, 0};
    auto to = std::make_shared<Data>(Data::make(what, memory));
    with_type(type, [&]<class T>(T) {
        for (std::int64_t i = 0; i < what.samples(); ++i) {
            const double value = top * double(from.as<float>()[i]);
            to->as<T>()[i] = static_cast<T>(is_integer(type) ? std::round(value) : value);
        }
    });
    return to;
}

class Calibration {
 public:
    explicit Calibration(bool quick) : quick_(quick), limit_(quick ? 6 : 48) {
        profile_ = default_profile();
        profile_.processors = usable_cores();
    }

    Profile measure(Messages& messages) {
        const std::vector<Trial> all = trials(quick_);
        begin_ = Clock::now();
        std::vector<Case> cases(all.size());
        for (int pass = 0; pass < kPasses; ++pass)
            for (std::size_t i = 0; i < all.size(); ++i) {
                messages.progress(since(begin_) / limit_,
                                  fmt::format("{} {} {}", name_of(all[i].job),
                                              all[i].mode ? all[i].mode : "", all[i].input));
                // What a trial leaves of its time goes to those that follow.
                const double left = limit_ * (pass == 0 ? kFirstPass : 1) - since(begin_);
                end_ = since(begin_) + left / static_cast<double>(all.size() - i);
                if (pass == 0)
                    begin_case(cases[i], all[i]);
                else
                    repeat_case(cases[i]);
            }
        for (const Case& each : cases) keep(each);
        fit();
        if (!quick_)
            for (const Trial& exam : exams()) judge(exam);
        messages.end_progress();
        return finished();
    }

 private:
    static constexpr int kPasses = 3, kFewRuns = 2, kMostRuns = 7;
    static constexpr double kFirstPass = 0.65;  // of the time
    static constexpr double kEnough = 0.02;     // [s]; of a longer run there is one a pass

    /// A session with the phantom's samples in the trial's type.
    struct Prepared {
        explicit Prepared(const Trial& trial) : options(options_of(trial)), session(options) {
            session.errors = false;
            take_request(session);
            session.input->data = retyped(*session.input->data, trial.type, session.memory.get());
        }
        std::vector<Plan> paths(const Profile& profile) {
            const std::vector<Source> sources{{session.input->data->what}};
            const TransformGraph spanned = expand(session.edges, session.ask(), sources);
            return all_paths(spanned, session.edges, session.ask(), sources, profile,
                             session.plan_options, 1000);
        }
        JobOptions options;
        Session session;
    };

    /// A path, and what its steps took: [s], the least of the passes, each the median of its runs.
    /// Whatever else keeps a machine busy only makes runs longer, and seldom stays for two passes.
    struct TimedPath {
        Plan plan;
        std::vector<double> alone, together;  // on one thread, on all
        int runs = 0;
    };

    struct Case {
        std::unique_ptr<Prepared> prepared;
        std::vector<TimedPath> paths;  // the cheap ones first
    };

    std::string name(const Case& of, const Step& step) const {
        return timing_name(*step.by, step.offer, of.prepared->session.want(), step.work);
    }

    void begin_case(Case& one, const Trial& trial) {
        one.prepared = std::make_unique<Prepared>(trial);
        std::vector<Plan> plans = one.prepared->paths(profile_);
        // The dear ones may find their steps already timed.
        std::stable_sort(plans.begin(), plans.end(), [](const Plan& a, const Plan& b) {
            return a.predicted.seconds < b.predicted.seconds;
        });
        std::set<std::string> seen;  // at this size
        for (Plan& plan : plans) {
            std::set<std::string> names;
            for (const Step& step : plan.steps) names.insert(name(one, step));
            if (std::includes(seen.begin(), seen.end(), names.begin(), names.end())) continue;
            // The cheapest few are timed even where the time is used up.
            if (since(begin_) > end_ && seen.size() >= 4) break;
            TimedPath path{.plan = std::move(plan), .alone = {}, .together = {}};
            if (!time(one, path)) continue;
            one.paths.push_back(std::move(path));
            seen.merge(names);
        }
        one.prepared->session.memory->trim();
    }

    void repeat_case(Case& one) {
        for (TimedPath& path : one.paths)
            if (since(begin_) < end_) time(one, path);
        one.prepared->session.memory->trim();
    }

    /// One thread first, then all: a worker that slept through a run of one thread starts on the
    /// core of its master, and is moved only after some milliseconds.
    /// @return false where a step failed
    bool time(Case& one, TimedPath& path) {
        if (stop_flag()) throw Cancelled();
        const int processors = profile_.processors;
        const std::vector<double> alone = runs_of(one, path, 1);
        const std::vector<double> together =
            processors > 1 && !alone.empty() ? runs_of(one, path, processors) : alone;
        if (alone.empty() || together.empty()) return false;
        const auto least = [](std::vector<double>& into, const std::vector<double>& seconds) {
            if (into.empty()) into = seconds;
            for (std::size_t k = 0; k < into.size(); ++k) into[k] = std::min(into[k], seconds[k]);
        };
        least(path.alone, alone);
        least(path.together, together);
        return true;
    }

    /// The first run warms up only; short ones are run more often. @return the median of each
    /// step's seconds; empty: it failed
    std::vector<double> runs_of(Case& one, TimedPath& path, int threads) {
        std::vector<std::vector<double>> seconds(path.plan.steps.size());
        double spent = 0;
        for (int i = 0; i <= kMostRuns && (i <= kFewRuns || spent < kEnough); ++i) {
            const Outcome outcome = once(one.prepared->session, path.plan, threads);
            if (outcome.steps != path.plan.texts()) return {};
            if (i == 0) continue;
            ++path.runs;
            spent += outcome.seconds;
            for (std::size_t k = 0; k < seconds.size(); ++k)
                seconds[k].push_back(outcome.step_seconds[k]);
            if (outcome.seconds > kEnough) break;
        }
        std::vector<double> medians;
        for (const std::vector<double>& step : seconds) medians.push_back(median(step));
        return medians;
    }

    void keep(const Case& one) {
        for (const TimedPath& path : one.paths)
            for (std::size_t k = 0; k < path.plan.steps.size(); ++k) {
                const Step& step = path.plan.steps[k];
                timed_[name(one, step)].push_back({.counted = profile_.counted(step.work),
                                                   .alone = path.alone[k] / step.runs(),
                                                   .together = path.together[k] / step.runs(),
                                                   .runs = path.runs,
                                                   .frames = step.runs()});
            }
    }

    /// How far the fit is from paths that it has not seen, on all processors.
    void judge(const Trial& exam) {
        constexpr double kMost = 0.1;
        Prepared prepared(exam);
        for (const Plan& plan : prepared.paths(profile_)) {
            double predicted = 0;
            for (const Step& step : plan.steps)
                predicted +=
                    step.runs() * profile_
                                      .seconds(timing_name(*step.by, step.offer,
                                                           prepared.session.want(), step.work),
                                               step.work, profile_.processors)
                                      .seconds;
            if (predicted > kMost) continue;
            if (stop_flag()) throw Cancelled();
            std::vector<double> seconds;
            for (int i = 0; i < 4; ++i)
                seconds.push_back(once(prepared.session, plan, profile_.processors).seconds);
            seconds.erase(seconds.begin());
            missed_.push_back(std::log(median(seconds) / predicted));
        }
    }

    static Outcome once(Session& session, const Plan& plan, int threads) {
        RunOptions options;
        options.threads = threads;
        options.memory = session.memory.get();
        options.stop = &stop_flag();
        return run(
            plan, session.ask(), session.input->data,
            [](int, const std::shared_ptr<const Data>&) {}, options);
    }

    void fit() {
        profile_.rates = rates_of(timed_);
        std::vector<double> shared;
        for (const auto& [name, curve] : profile_.rates.measured())
            for (const Rate& rate : curve) shared.push_back(rate.shared);
        const double each = 1.0 / profile_.processors;
        if (profile_.processors > 1 && !shared.empty())
            profile_.serial = std::clamp((median(shared) - each) / (1 - each), 0.0, 1.0);
    }

    Profile finished() {
        profile_.name = quick_ ? "this machine (quick)" : "this machine";
        profile_.cpu = cpu_name();
        profile_.build = EDGEWISE_VERSION;
        profile_.when = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
        if (!missed_.empty()) {
            for (double& miss : missed_) miss = std::abs(miss);
            // The median of a normal distribution's absolute value is 0.6745 of its deviation.
            profile_.spread = std::clamp(median(missed_) / 0.6745, 0.02, 2.0);
        }
        profile_.provenance = {
            {"rates", "measured; phantoms of 48^3 to 192^3 and 256^2 to 2000^2 samples"},
            {"serial", "derived from rates"},
            {"spread",
             fmt::format("measured on {} paths that the rates have not seen", missed_.size())},
            {"factors", "guessed: of another machine; where rates have no name"},
            {"operation", "guessed: of another machine; rates refer to it"},
            {"streamed", "guessed: of another machine; rates refer to it"},
            {"gather", "guessed: of another machine; rates refer to it"},
            {"start", "guessed: of another machine"}};
        return profile_;
    }

    bool quick_;
    double limit_, end_ = 0;  // [s] since the begin: of everything, of the trial at hand
    Clock::time_point begin_;
    Profile profile_;
    std::map<std::string, std::vector<Timed>> timed_;
    std::vector<double> missed_;  // logarithms of measured over predicted
};

}  // namespace

Profile measured_profile(bool quick, Messages& messages) {
    return Calibration(quick).measure(messages);
}

}  // namespace edgewise::cli
