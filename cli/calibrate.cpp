#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fmt/format.h>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "cli/errors.hpp"
#include "cli/machine.hpp"
#include "cli/outputs.hpp"
#include "cli/report.hpp"
#include "cli/request_options.hpp"
#include "cli/session.hpp"
#include "cli/signals.hpp"
#include "cli/verbs.hpp"
#include "graph/errors.hpp"

namespace edgewise::cli {
namespace {

struct CalibrateOptions {
    bool quick = false, quiet = false;
    std::optional<std::string> out, json;
};

using Clock = std::chrono::steady_clock;

/// Between them these pass through every edge, on volumes within the caches and beyond them, one
/// that is full and one that is mostly empty.
std::vector<JobOptions> requests(bool quick) {
    const std::string full = quick ? "phantom:noise:64" : "phantom:noise:88";
    const std::string hollow = "phantom:gaussians:160";
    const std::string image = quick ? "phantom:zone-plate:512" : "phantom:zone-plate:1400";
    std::vector<JobOptions> all;
    const auto add = [&](Job job, const std::string& input, const std::string& turn,
                         const char* mode, const char* views) {
        JobOptions options;
        options.job = job;
        options.input = input;
        options.geometry.steps = {{"rotate", turn}};
        if (mode) options.mode = mode;
        if (views) options.geometry.turntable = views;
        options.machine = "default";
        options.threads = "1";
        all.push_back(options);
    };
    for (const std::string& volume : {full, hollow}) {
        if (quick && volume == hollow) continue;
        add(Job::warp, volume, "20,-15,10", nullptr, nullptr);
        add(Job::warp, volume, "90,0,0", nullptr, nullptr);
        for (const char* mode : {"mip", "xray", "mean", "composite"})
            add(Job::render, volume, "20,-15,10", mode, nullptr);
    }
    add(Job::warp, image, "20", nullptr, nullptr);
    add(Job::render, full, "0,0,0", "xray", "4");
    return all;
}

/// The value that a share of the others lies below.
double quantile(std::vector<double> values, double share) {
    const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size()));
    std::nth_element(values.begin(), values.begin() + rank, values.end());
    return values[static_cast<std::size_t>(rank)];
}

/// Runs paths until every edge with every tried parameter has been timed on every type of sample.
class Calibration {
 public:
    explicit Calibration(bool quick) : quick_(quick), seconds_(quick ? 5 : 22) {
        profile_ = default_profile();
        profile_.name = quick ? "this machine (quick)" : "this machine";
        profile_.cpu = cpu_name();
        profile_.processors = usable_cores();
    }

    Profile measure(Messages& messages) {
        const std::vector<JobOptions> all = requests(quick_);
        const Clock::time_point begin = Clock::now();
        for (std::size_t i = 0; i < all.size(); ++i) {
            const double share = static_cast<double>(i + 1) / static_cast<double>(all.size());
            messages.progress(share,
                              std::string(name_of(all[i].job)) + " " + all[i].mode.value_or(""));
            // What a request leaves of its time goes to those that follow.
            end_ = begin + std::chrono::duration_cast<Clock::duration>(
                               std::chrono::duration<double>(seconds_ * share));
            serve(all[i]);
        }
        messages.end_progress();
        for (const auto& [edge, ratios] : ratios_) profile_.factors[edge] = quantile(ratios, 0.5);
        // Whatever else keeps the cores busy makes this larger, never smaller.
        if (!serial_.empty()) profile_.serial = quantile(serial_, 0.25);
        return profile_;
    }

 private:
    void serve(const JobOptions& options) {
        Session session(options);
        take_request(session);
        const std::vector<Source> sources{{session.input->data->what}};
        const TransformGraph spanned = expand(session.edges, session.ask(), sources);
        std::vector<Plan> plans = all_paths(spanned, session.edges, session.ask(), sources,
                                            profile_, session.plan_options, 1000);
        // The cheap ones first: the dear ones may find their steps already timed.
        std::stable_sort(plans.begin(), plans.end(), [](const Plan& a, const Plan& b) {
            return a.predicted.seconds < b.predicted.seconds;
        });
        std::set<std::string> timed;
        for (const Plan& plan : plans) {
            if (std::all_of(plan.steps.begin(), plan.steps.end(),
                            [&](const Step& step) { return timed.contains(read_by(step)); }))
                continue;
            // The cheapest few are timed even where set-up has used the time up.
            if (Clock::now() > end_ && timed.size() >= 8) return;
            if (stop_flag()) throw Cancelled();
            time(session, plan);
            for (const Step& step : plan.steps) timed.insert(read_by(step));
        }
    }

    /// An edge with its parameters and the type of sample that it reads.
    static std::string read_by(const Step& step) {
        return step.text() + " " + std::string(name_of(step.offer.from.type));
    }

    void time(Session& session, const Plan& plan) {
        std::vector<std::vector<double>> seconds(plan.steps.size());
        std::vector<double> whole;
        for (int i = 0; i < (quick_ ? 2 : 4) && (i == 0 || Clock::now() < end_); ++i) {
            const Outcome outcome = once(session, plan, 1);
            if (outcome.steps != plan.texts()) return;  // a step failed: its time says nothing
            whole.push_back(outcome.seconds);
            for (std::size_t k = 0; k < plan.steps.size(); ++k)
                seconds[k].push_back(outcome.step_seconds[k]);
            if (i > 0 && outcome.seconds > 0.15) break;  // long enough to be its own mean
        }
        for (std::size_t k = 0; k < plan.steps.size(); ++k) {
            const Step& step = plan.steps[k];
            const double runs = step.runs(), counted = profile_.counted(step.work);
            // The least of few: what disturbs a run only makes it longer.
            const double least = *std::min_element(seconds[k].begin(), seconds[k].end()) / runs;
            if (counted > 0)
                take_ratio(
                    step.text(),
                    std::clamp(std::max(least - profile_.start, least / 4) / counted, 1e-3, 1e3));
        }
        take_serial(session, plan, *std::min_element(whole.begin(), whole.end()));
    }

    /// Counts for the edge with all its parameters, with only the first ones, and with none: the
    /// shorter names serve parameters that were not tried.
    void take_ratio(std::string edge, double ratio) {
        for (;; edge.resize(edge.rfind('/'))) {
            ratios_[edge].push_back(ratio);
            if (edge.find('/') == std::string::npos) return;
        }
    }

    /// The share that threads do not speed up, from plans that take long enough to tell.
    void take_serial(Session& session, const Plan& plan, double alone) {
        const double cores = profile_.processors;
        if (cores < 2 || alone < 5e-3 || alone > 0.5 || serial_.size() >= 16) return;
        // Side by side, so that both meet the same load.
        alone = std::min(alone, once(session, plan, 1).seconds);
        const double together = std::min(once(session, plan, profile_.processors).seconds,
                                         once(session, plan, profile_.processors).seconds);
        serial_.push_back(std::clamp((together / alone - 1 / cores) / (1 - 1 / cores), 0.0, 1.0));
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

    bool quick_;
    double seconds_;         // for everything
    Clock::time_point end_;  // of the request at hand
    Profile profile_;
    std::map<std::string, std::vector<double>> ratios_;
    std::vector<double> serial_;
};

std::string profile_file(const CalibrateOptions& options) {
    if (options.out) return *options.out;
    const std::string folder = config_folder();
    if (folder.empty())
        throw RequestError("calibrate: there is no home to write the profile to; say -o FILE");
    std::error_code none;  // what goes wrong shows when the folder is looked at
    std::filesystem::create_directories(folder, none);
    return folder + "/machine.json";
}

int do_calibrate(const CalibrateOptions& options) {
    return guarded_with_json(options.json, [&] {
        const std::string file = profile_file(options);
        if (file != "-") expect_writable("-o", file);
        if (options.json && *options.json != "-") expect_writable("--json", *options.json);
        Messages messages;
        if (options.quiet) messages.configure("error", "never", true);
        const Profile profile = Calibration(options.quick).measure(messages);
        const std::string text = to_json(profile).dump(2) + "\n";
        write_text(file, text);
        if (options.json) write_text(*options.json, text);
        if (file != "-" && !options.quiet)
            fmt::print(stderr, "edgewise: {} measured, written to {}\n", profile.cpu, file);
        return static_cast<int>(kDone);
    });
}

}  // namespace

Verb add_calibrate(CLI::App& main) {
    CLI::App* app = main.add_subcommand("calibrate", "measure this machine");
    auto options = std::make_shared<CalibrateOptions>();
    app->add_flag("--quick", options->quick, "in seconds, less exact");
    add_text(*app, "-o", options->out, "default: where the other verbs look for it")
        ->type_name("FILE");
    add_text(*app, "--json", options->json, "the profile as well, to FILE or -");
    app->add_flag("--quiet", options->quiet, "errors only");
    return {app, [options] { return do_calibrate(*options); }};
}

}  // namespace edgewise::cli
