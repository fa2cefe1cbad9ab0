#include "cli/chart/chart.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fmt/format.h>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include "charts/csv.hpp"
#include "charts/gnuplot.hpp"
#include "charts/page.hpp"
#include "cli/chart/chart_sweep.hpp"
#include "cli/request/job_options.hpp"
#include "cli/request/messages.hpp"
#include "cli/request/programs.hpp"
#include "cli/request/request_options.hpp"
#include "cli/request/user_folders.hpp"
#include "cli/session/report.hpp"
#include "cli/session/typed_request.hpp"
#include "cli/signals/signals.hpp"
#include "cli/verbs/verbs.hpp"
#include "graph/errors.hpp"
#include "graph/kinds.hpp"
#include "measure/machine.hpp"
#include "measure/since.hpp"
#include "request/numbers.hpp"
#include "request/outputs.hpp"
#include "request/quantities.hpp"
#include "settings/output.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise::cli {
namespace {

using Clock = std::chrono::steady_clock;
using Words = std::vector<std::string>;

constexpr const char* kEndings[] = {".html", ".svg", ".png", ".csv", ".json"};
constexpr std::size_t kLimit = 100, kSweepLimit = 16;  // paths

struct ChartOptions {
    JobOptions job;
    bool turns = true;  // the job has options of the geometry
    Words out, peers;
    std::optional<std::string> limit, sweep;
};

std::string ending_of_file(const std::string& file) {
    return std::filesystem::path(file).extension().string();
}

/// Everything that is to be written can be, before any work.
void check_outputs(const ChartOptions& options) {
    for (const std::string& file : options.out) {
        const std::string ending = ending_of_file(file);
        if (std::find(std::begin(kEndings), std::end(kEndings), ending) == std::end(kEndings))
            throw RequestError(fmt::format("-o {}: no chart has this ending; known endings: {}",
                                           file, fmt::join(kEndings, " ")));
        expect_writable("-o", file);
        if ((ending == ".svg" || ending == ".png") && program_on_path("gnuplot").empty())
            throw RunError(fmt::format(
                "-o {}: gnuplot draws it and is not installed; it is in the Debian package "
                "gnuplot-nox",
                file));
    }
    const auto& json = options.job.json;
    if (json && *json != "-") expect_writable("--json", *json);
}

charts::Peer peer_of(const std::string& text) {
    const Words words = split(text, ',');
    if (words.size() != 3 || words[0].empty())
        throw RequestError(fmt::format("--peer {}: expected NAME,SECONDS,ERROR", text));
    charts::Peer peer{words[0], time_budget(words[1]), 0};
    peer.error = words[2] == "0" ? 0 : error_budget(words[2]);
    if (!(peer.seconds > 0))
        throw RequestError(fmt::format("--peer {}: expected a time above 0", text));
    return peer;
}

ChartSettings settings_of(const ChartOptions& options, const std::string& title) {
    ChartSettings settings;
    settings.title = title;
    settings.runs.paths.limit = options.sweep ? kSweepLimit : kLimit;
    if (options.limit)
        settings.runs.paths.limit =
            static_cast<std::size_t>(whole_of("--limit", *options.limit, 1, 1 << 20));
    const JobOptions& job = options.job;
    const auto repeat = job.text("repeat"), verify = job.text("verify"), seed = job.text("seed");
    settings.runs.repeat_given = repeat.has_value();
    if (repeat)
        settings.runs.paths.repeat =
            static_cast<int>(whole_of(setting("repeat"), *repeat, 1, 10'000));
    if (verify) settings.runs.paths.samples = static_cast<std::int64_t>(verify_count(*verify));
    if (seed)
        settings.runs.paths.seed =
            static_cast<std::uint64_t>(whole_of(setting("seed"), *seed, 0, INT64_MAX));
    for (const std::string& peer : options.peers) settings.peers.push_back(peer_of(peer));
    settings.runs.pictures =
        !options.sweep && std::any_of(options.out.begin(), options.out.end(), [](const auto& file) {
            return ending_of_file(file) == ".html";
        });
    return settings;
}

/// The request of a chart is not run for its own sake: what says what to write of it goes.
JobOptions request_of(const JobOptions& job) {
    JobOptions request = job;
    for (const char* setting : {"verify", "repeat", "seed"}) request.drop(setting);
    request.json.reset();
    request.trace.reset();
    request.flow.reset();
    request.explain = false;
    return request;
}

/// Share done and time left, of all requests of a sweep together.
class Progress {
 public:
    Progress(Messages& messages, std::size_t requests) : messages_(messages), requests_(requests) {}

    /// @param what  the next request, "" where there is only one
    void next(const std::string& what) {
        what_ = what;
        began_ = Clock::now();
    }
    void done() {
        messages_.step_done(what_ + "all paths", since(began_));
        ++before_;
    }
    void operator()(double share, const std::string& what) {
        const double all = (double(before_) + std::clamp(share, 0.0, 1.0)) / double(requests_);
        const double seconds = since(begin_);
        std::string text = what_ + what;
        // The first paths say little about the others.
        if (all > 0.02 && seconds > 1)
            text += fmt::format(", {:.0f} s left", seconds / all * (1 - all));
        messages_.progress(all, text);
    }

 private:
    Messages& messages_;
    std::size_t requests_, before_ = 0;
    std::string what_;
    Clock::time_point begin_ = Clock::now(), began_ = begin_;
};
ChartedRequest charted_request(const JobOptions& options, const ChartSettings& settings,
                               const Engine& engine, const ChartProgress& progress) {
    Messages messages;
    configure(messages, options);
    const Query query = spec_of(options, engine.edges());
    ChartedRequest request;
    ChartedRuns runs = settings.runs;
    runs.planned = [&](const Planned& planned) {
        request.request = request_json(planned);
        if (query.max_memory) request.request["budget"]["bytes"] = *query.max_memory;
    };
    static_cast<Charted&>(request) = charted(query, engine, runs, progress, messages);
    return request;
}

/// The paths of all values of a sweep that are most often worth having, and whatever was chosen.
std::set<std::string> swept_paths(const Sweep& sweep, const JobOptions& request,
                                  const PathSettings& settings, const Engine& engine) {
    std::map<std::string, std::pair<int, int>> votes;  // wanted, there
    std::vector<std::string> order;
    std::set<std::string> paths;
    const auto vote = [&](const std::string& path, int wanted, int there) {
        if (!votes.contains(path)) order.push_back(path);
        votes[path].first += wanted;
        votes[path].second += there;
    };
    for (const double value : sweep.values) {
        Messages messages;
        configure(messages, request);
        const Charting charting = charting_of(spec_of(sweep.at(request, value), engine.edges()),
                                              engine, settings, messages);
        for (const std::string& path : charting.paths) vote(path, 0, 1);
        for (const std::string& path : charting.wanted) vote(path, 1, 0);
        if (!charting.chosen.empty()) paths.insert(charting.chosen);
    }
    std::stable_sort(order.begin(), order.end(), [&](const std::string& a, const std::string& b) {
        return votes[a] > votes[b];
    });
    for (auto path = order.begin(); path != order.end() && paths.size() < settings.limit; ++path)
        paths.insert(*path);
    return paths;
}

std::vector<ChartedRequest> run_sweep(const Sweep& sweep, const JobOptions& request,
                                      ChartSettings settings, const Engine& engine,
                                      Messages& messages) {
    messages.progress(0, "planning every value");
    settings.runs.only = swept_paths(sweep, request, settings.runs.paths, engine);
    Progress progress(messages, sweep.values.size());
    std::vector<ChartedRequest> all;
    const InState collecting(messages, Listener::State::collecting);
    for (const double value : sweep.values) {
        if (stop_flag()) break;
        progress.next(fmt::format("{}={:.6g} ", sweep.option, value));
        all.push_back(
            charted_request(sweep.at(request, value), settings, engine, std::ref(progress)));
        all.back().at = value;
        progress.done();
    }
    if (stop_flag() && !all.empty()) all.back().interrupted = true;
    return all;
}

void write_all(const ChartOptions& options, const ChartSettings& settings,
               const std::vector<ChartedRequest>& requests, const std::string& swept) {
    const charts::Table table = table_of(requests, settings, swept);
    const nlohmann::ordered_json document = document_of(requests, settings, table);
    const auto& pictures = requests.front().pictures;
    for (const std::string& file : options.out) {
        const std::string ending = ending_of_file(file);
        if (ending == ".json") write_text(file, text_of(document));
        if (ending == ".csv") write_text(file, charts::to_csv(table));
        if (ending == ".svg" || ending == ".png")
            write_text(
                file,
                charts::drawn(table, ending == ".svg" ? charts::Picture::svg : charts::Picture::png,
                              installed_program("gnuplot", "gnuplot-nox")));
        if (ending == ".html")
            write_text(file, charts::page_of(table, document, pictures ? &*pictures : nullptr));
    }
    if (options.job.json) write_text(*options.job.json, text_of(document));
}

/// A chart of nothing would only look as if there were none.
void expect_results(const std::vector<ChartedRequest>& requests) {
    for (const ChartedRequest& request : requests)
        for (const MeasuredPath& path : request.paths)
            if (path.measured()) return;
    if (stop_flag()) throw Cancelled();
    for (const ChartedRequest& request : requests)
        for (const MeasuredPath& path : request.paths)
            throw RunError(
                message("no path has a result: {}: {}", path_text(path.steps), path.failure));
    throw RunError("there is no path");
}

/// What is swept is an option of the job: else all values would give the same paths.
void expect_swept(const ChartOptions& options, const Sweep& sweep) {
    static const std::set<std::string> of_any = {"threads",    "max-error", "max-time",
                                                 "max-memory", "time",      "channel"};
    if (options.turns || of_any.contains(sweep.option)) return;
    throw RequestError(fmt::format("--sweep {}: {} has no such option; expected {}", sweep.option,
                                   name_of(options.job.job), fmt::join(of_any, ", ")));
}

int do_chart(const ChartOptions& options, const std::string& title) {
    return guarded_with_json(options.job.json, [&] {
        const JobOptions& job = options.job;
        Messages messages;
        configure(messages, job);
        check_outputs(options);
        const ChartSettings settings = settings_of(options, title);
        const JobOptions request = request_of(job);
        const Catalogue edges = catalogue();
        const Engine engine = user_engine(edges, chosen_profile(job.machine, edges));
        std::vector<ChartedRequest> requests;
        std::string swept;
        if (options.sweep) {
            const Sweep sweep = sweep_of(*options.sweep);
            expect_swept(options, sweep);
            swept = sweep.option;
            requests = run_sweep(sweep, request, settings, engine, messages);
        } else {
            Progress progress(messages, 1);
            progress.next("");
            requests.push_back(charted_request(request, settings, engine, std::ref(progress)));
            progress.done();
        }
        messages.end_progress();
        expect_results(requests);
        write_all(options, settings, requests, swept);
        return stop_flag() ? signal_exit_code() : 0;
    });
}

/// The request as it was typed, without what does not change it.
std::string title_of(const CLI::App& app, const JobOptions& job) {
    static const std::set<std::string> left_out = {"-o",       "--json",  "--peer",     "--limit",
                                                   "--seed",   "--quiet", "--progress", "--log",
                                                   "--repeat", "--verify"};
    std::string title = app.get_name() + " " + std::filesystem::path(job.input).filename().string();
    std::map<const CLI::Option*, std::size_t> taken;
    for (const CLI::Option* option : app.parse_order()) {
        const std::string name = option->get_name();
        if (option->get_positional() || left_out.contains(name)) continue;
        const auto& results = option->results();
        const std::size_t place = taken[option]++;
        title += " " + name;
        if (option->get_expected_max() > 0 && place < results.size()) title += " " + results[place];
    }
    return title;
}

void add_words(CLI::App& app, const char* name, Words& into, const char* type, const char* help) {
    app.add_option(name, CLI::callback_t([&into](const Words& words) {
                       into = words;
                       return true;
                   }),
                   help)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
        ->type_name(type)
        ->group("Chart");
}

Verb add_chart_of(CLI::App& parent, Job job) {
    const std::string name(name_of(job));
    CLI::App* app = parent.add_subcommand(name, "of a " + name);
    auto options = std::make_shared<ChartOptions>();
    options->job.job = job;
    add_job_options(*app, options->job, OutNeeded::absent);
    options->turns = app->get_option_no_throw("--rotate") != nullptr;
    add_words(*app, "-o", options->out, "FILE",
              "chart, by its ending: .html .svg .png .csv .json; may be repeated");
    app->get_option("-o")->required();
    add_text(*app, "--limit", options->limit, "paths at most; default 100, of a sweep 16")
        ->type_name("N")
        ->group("Chart");
    add_text(*app, "--sweep", options->sweep,
             "the request at each value of a numeric option, as rotate.z=0:90:5")
        ->type_name("OPTION[.x|.y|.z]=FROM:TO:STEP")
        ->group("Chart");
    add_words(*app, "--peer", options->peers, "NAME,SECONDS,ERROR",
              "a mark of another program; may be repeated");
    return {app, [app, options] {
                take_given(*app, options->job);
                return do_chart(*options, title_of(*app, options->job));
            }};
}

}  // namespace

Verb add_chart(CLI::App& main) {
    CLI::App* app =
        main.add_subcommand("chart", "every path of a request, run and drawn: speed against error");
    app->require_subcommand(1);
    std::vector<Verb> all;
    for (const Job job : jobs())
        if (is_charted(job)) all.push_back(add_chart_of(*app, job));
    return {app, [all] {
                return std::ranges::find_if(all,
                                            [](const Verb& verb) { return verb.app->parsed(); })
                    ->run();
            }};
}

}  // namespace edgewise::cli
