#include "cli/calibration.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <map>
#include <set>

#include "cli/input.hpp"
#include "cli/machine.hpp"
#include "cli/machine_probe.hpp"
#include "cli/quantiles.hpp"
#include "cli/session.hpp"
#include "cli/signals.hpp"
#include "cli/stolen_time.hpp"
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
    // Small data: steps take as long as they start.
    for (const Type type : {Type::u8, Type::f32}) {
        all.push_back({Job::render, "phantom:shepp-logan:64", type, "10,30,20", "xray"});
        all.push_back({Job::warp, "phantom:shepp-logan:64", type, "10,30,20", nullptr});
    }
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

/// The samples that trials share.
class Phantoms {
 public:
    std::shared_ptr<const Data> of(const Trial& trial) {
        std::shared_ptr<const Data>& data = made_[{trial.input, trial.type}];
        if (!data)
            data = trial.type == Type::f32 ? formula(trial.input)
                                           : retyped(*formula(trial.input), trial.type, &memory_);
        return data;
    }

 private:
    std::shared_ptr<const Data> formula(const std::string& name) {
        std::shared_ptr<const Data>& data = made_[{name, Type::f32}];
        if (!data) {
            Input input = inspected(name, {});
            read_data(input, &memory_);
            data = input.data;
        }
        return data;
    }
    MemoryBudget memory_{std::size_t{1} << 46};
    std::map<std::pair<std::string, Type>, std::shared_ptr<const Data>> made_;
};

/// Standard error of the log of a median of runs.
double median_error(const std::vector<double>& seconds) {
    constexpr double kOneRun = 0.2;  // what single runs scatter by on a shared machine
    const double runs = static_cast<double>(seconds.size());
    std::vector<double> away;
    for (const double one : seconds) away.push_back(std::abs(std::log(one / median(seconds))));
    // Normal distributions: deviation 1.4826 of the median distance, of a median 1.2533 of a mean.
    const double scatter = runs < 4 ? kOneRun : 1.4826 * median(away);
    return 1.2533 * scatter / std::sqrt(runs);
}

class Calibration {
 public:
    explicit Calibration(bool quick) : quick_(quick), limit_(quick ? 6 : 50) {
        profile_ = default_profile();
        profile_.processors = usable_cores();
        probe_machine(profile_, quick);  // first: rates refer to it
    }

    Profile measure(Messages& messages) {
        const std::vector<Trial> all = trials(quick_);
        begin_ = Clock::now();
        std::vector<Case> cases(all.size());
        for (std::size_t i = 0; i < all.size(); ++i) {
            show(messages, all[i]);
            // What a trial leaves of its time goes to those that follow.
            const double left = kFirstRound * limit_ - since(begin_);
            end_ = since(begin_) + left / static_cast<double>(all.size() - i);
            begin_case(cases[i], all[i]);
        }
        for (int round = 1; round < kMostRounds && since(begin_) < limit_; ++round)
            for (std::size_t i = 0; i < all.size(); ++i) {
                const std::size_t k = round % 2 ? all.size() - 1 - i : i;
                show(messages, all[k]);
                repeat_case(cases[k], round);
            }
        for (const Case& each : cases) keep(each);
        fit();
        if (!quick_)
            for (const Trial& exam : exams()) judge(exam);
        messages.end_progress();
        if (2 * static_cast<int>(disturbed_.size()) > visits_)
            messages.warning(
                "other guests of this machine's host held its processors most of the time: what "
                "was "
                "measured is slow; calibrate again in a better minute");
        return finished();
    }

 private:
    static constexpr int kMostRounds = 25;
    static constexpr double kFirstRound = 0.3;  // of the time, at most
    static constexpr double kShort = 0.05;      // [s]; a longer run needs no warm caches
    static constexpr double kLong = 0.02;       // [s]

    /// A session with the phantom's samples in the trial's type.
    struct Prepared {
        Prepared(const Trial& trial, Phantoms& phantoms)
            : options(options_of(trial)), session(options) {
            session.errors = false;
            session.given = phantoms.of(trial);
            take_request(session);
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

    /// What the steps of a path took in runs that are seconds apart: a core that is shared with
    /// others (a hyperthread's sibling, another machine's guest) is slow for tenths of a second, so
    /// runs one after the other all meet the same state.
    struct Runs {
        std::vector<std::vector<double>> seconds;  // [step][run]
        std::vector<int> visit;                    // of each run

        /// Those of visits that the host left alone, if there are enough.
        std::vector<double> of(std::size_t step, const std::set<int>& disturbed) const {
            constexpr std::size_t kEnough = 3;
            std::vector<double> calm;
            for (std::size_t i = 0; i < visit.size(); ++i)
                if (!disturbed.contains(visit[i])) calm.push_back(seconds[step][i]);
            return calm.size() >= kEnough ? calm : seconds[step];
        }
    };

    struct TimedPath {
        Plan plan;
        Runs alone, together;  // on one thread, on all
        double longest = 0;    // of all runs
    };

    struct Case {
        std::unique_ptr<Prepared> prepared;
        std::vector<TimedPath> paths;  // the cheap ones first
    };

    void show(Messages& messages, const Trial& trial) const {
        messages.progress(
            since(begin_) / limit_,
            fmt::format("{} {} {}", name_of(trial.job), trial.mode ? trial.mode : "", trial.input));
    }

    std::string name(const Case& of, const Step& step) const {
        return timing_name(*step.by, step.offer, of.prepared->session.want(), step.work);
    }

    void begin_case(Case& one, const Trial& trial) {
        const Visit visit(*this);
        one.prepared = std::make_unique<Prepared>(trial, phantoms_);
        std::vector<Plan> plans = one.prepared->paths(default_profile());
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
            for (Runs* runs : {&path.alone, &path.together})
                runs->seconds.resize(path.plan.steps.size());
            if (!time(one, path, profile_.processors)) continue;
            one.paths.push_back(std::move(path));
            seen.merge(names);
        }
        if (profile_.processors > 1)
            for (TimedPath& path : one.paths) time(one, path, 1);
        one.prepared->session.memory->trim();
    }

    /// All paths on all threads, then, in every other round, all of them on one: a thread that
    /// wakes for every second run is slower than those of a machine at work.
    void repeat_case(Case& one, int round) {
        const Visit visit(*this);
        repeat_paths(one, round, profile_.processors);
        if (profile_.processors > 1 && round % 2 == 0) repeat_paths(one, round / 2, 1);
        one.prepared->session.memory->trim();
    }

    /// Long runs are fewer: their own length is a mean over what the machine does.
    void repeat_paths(Case& one, int round, int threads) {
        for (std::size_t i = 0; i < one.paths.size(); ++i) {
            TimedPath& path = one.paths[round % 2 ? one.paths.size() - 1 - i : i];
            const bool due = path.longest < kLong || round % 2 == 0;
            if (due && since(begin_) < limit_) time(one, path, threads);
        }
    }

    /// One run. Another path ran before, in blocks of other sizes: a short run counts when warm.
    /// @return false where a step failed
    bool time(Case& one, TimedPath& path, int threads) {
        if (stop_flag()) throw Cancelled();
        if (path.longest < kShort)
            if (once(one.prepared->session, path.plan, threads).steps != path.plan.texts())
                return false;
        add(once(one.prepared->session, path.plan, threads), path,
            threads == 1 ? path.alone : path.together);
        return true;
    }

    void add(const Outcome& outcome, TimedPath& path, Runs& into) const {
        path.longest = std::max(path.longest, outcome.seconds);
        into.visit.push_back(visits_);
        for (std::size_t k = 0; k < into.seconds.size(); ++k)
            into.seconds[k].push_back(outcome.step_seconds[k]);
    }

    /// The runs of one case, one after the other; remembers whether the host let it have its
    /// processors.
    class Visit {
     public:
        explicit Visit(Calibration& of) : of_(of) {}
        ~Visit() {
            if (!watch_.calm()) of_.disturbed_.insert(of_.visits_);
            ++of_.visits_;
        }
        Visit(const Visit&) = delete;
        Visit& operator=(const Visit&) = delete;

     private:
        Calibration& of_;
        StolenTime watch_;
    };

    void keep(const Case& one) {
        for (const TimedPath& path : one.paths)
            for (std::size_t k = 0; k < path.plan.steps.size(); ++k) {
                const Step& step = path.plan.steps[k];
                const std::vector<double> alone = path.alone.of(k, disturbed_);
                const std::vector<double> together =
                    profile_.processors > 1 ? path.together.of(k, disturbed_) : alone;
                timed_[name(one, step)].push_back({.counted = profile_.counted(step.work),
                                                   .alone = median(alone) / step.runs(),
                                                   .together = median(together) / step.runs(),
                                                   .spread = median_error(alone),
                                                   .runs = static_cast<int>(alone.size()),
                                                   .frames = step.runs()});
            }
    }

    /// How far the fit is from paths that it has not seen, on all processors.
    void judge(const Trial& exam) {
        constexpr double kMost = 0.03;
        Prepared prepared(exam, phantoms_);
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
        rebase_factors(profile_);
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
            // Of a normal distribution 90 % lie within 1.645 deviations; the tails are longer, and
            // intervals of 90 % are what the spread is for.
            profile_.spread = std::clamp(quantile(missed_, 0.9) / 1.645, 0.02, 2.0);
        }
        profile_.provenance.insert(
            {{"rates",
              fmt::format("measured; phantoms of 48^3 to 192^3 and 256^2 to 2000^2 samples; "
                          "{} visits, {} of them disturbed by the host",
                          visits_, disturbed_.size())},
             {"serial", "derived from rates"},
             {"spread",
              fmt::format("measured on {} paths that the rates have not seen", missed_.size())},
             {"factors",
              "guessed: of another machine, scaled to the rates; where these have no name"}});
        return profile_;
    }

    bool quick_;
    double limit_, end_ = 0;  // [s] since the begin: of everything, of the trial at hand
    Clock::time_point begin_;
    Phantoms phantoms_;  // outlives the cases, which measure() holds
    Profile profile_;
    std::map<std::string, std::vector<Timed>> timed_;
    int visits_ = 0;
    std::set<int> disturbed_;     // visits
    std::vector<double> missed_;  // logarithms of measured over predicted
};

}  // namespace

Profile measured_profile(bool quick, Messages& messages) {
    return Calibration(quick).measure(messages);
}

}  // namespace edgewise::cli
