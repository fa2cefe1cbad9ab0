#include "cli/audit/audit.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <fmt/format.h>
#include <memory>
#include <nlohmann/json.hpp>
#include <sys/resource.h>

#include "cli/audit/audit_requests.hpp"
#include "cli/request/errors.hpp"
#include "cli/request/job_options.hpp"
#include "cli/request/messages.hpp"
#include "cli/request/request_options.hpp"
#include "cli/request/user_folders.hpp"
#include "cli/session/report.hpp"
#include "cli/session/typed_request.hpp"
#include "cli/signals/signals.hpp"
#include "cli/verbs/verbs.hpp"
#include "graph/errors.hpp"
#include "graph/version.hpp"
#include "measure/machine.hpp"
#include "request/numbers.hpp"
#include "request/outputs.hpp"
#include "settings/output.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise::cli {
namespace {

using Clock = std::chrono::steady_clock;

struct AuditOptions {
    std::string requests;
    std::optional<std::string> out, limit, repeat, verify, seed, threads, machine, planner;
    std::optional<std::string> json, progress, log;
    bool quiet = false;
};

PathSettings settings_of(const AuditOptions& options) {
    PathSettings settings;
    if (options.limit)
        settings.limit = static_cast<std::size_t>(whole_of("--limit", *options.limit, 1, 1 << 20));
    if (options.repeat)
        settings.repeat = static_cast<int>(whole_of(setting("repeat"), *options.repeat, 1, 10'000));
    if (options.verify) settings.samples = static_cast<std::int64_t>(verify_count(*options.verify));
    if (options.seed)
        settings.seed =
            static_cast<std::uint64_t>(whole_of(setting("seed"), *options.seed, 0, INT64_MAX));
    return settings;
}

std::string duration_text(double seconds) {
    if (seconds < 90) return fmt::format("{:.0f} s", seconds);
    return fmt::format("{:.0f} min", seconds / 60);
}

/// A memory budget fences the whole process in; the next request must not inherit it.
class OwnLimits {
 public:
    OwnLimits() { getrlimit(RLIMIT_DATA, &before_); }
    ~OwnLimits() { setrlimit(RLIMIT_DATA, &before_); }
    OwnLimits(const OwnLimits&) = delete;
    OwnLimits& operator=(const OwnLimits&) = delete;

 private:
    rlimit before_{};
};

/// All requests, one after the other; a failure of one is part of the answer.
class Audit {
 public:
    Audit(const AuditOptions& options, Messages& messages)
        : options_(options), messages_(messages), settings_(settings_of(options)) {}

    void run(const std::vector<AuditRequest>& requests) {
        const InState collecting(messages_, Listener::State::collecting);
        const auto begin = Clock::now();
        for (const AuditRequest& request : requests) {
            const auto seconds = [&] {
                return std::chrono::duration<double>(Clock::now() - begin).count();
            };
            const auto done = static_cast<double>(done_.size());
            const auto all = static_cast<double>(requests.size());
            const double left = done > 0 ? seconds() / done * (all - done) : 0;
            const std::string where =
                fmt::format("request {} of {}{}", done_.size() + 1, requests.size(),
                            done > 0 ? ", " + duration_text(left) + " left" : "");
            messages_.progress(done / all, where);
            const double before = seconds();
            serve(request);
            if (stop_flag()) return;
            messages_.step_done(where + ": " + fmt::format("{}", fmt::join(request.args, " ")),
                                seconds() - before);
        }
        messages_.end_progress();
    }

    nlohmann::ordered_json report() const {
        nlohmann::ordered_json json = {{"schema", 1}, {"version", version()}};
        json["settings"] = {
            {"limit", settings_.limit},
            {"repeat", settings_.repeat},
            {"verify", settings_.samples ? nlohmann::ordered_json(*settings_.samples)
                                         : nlohmann::ordered_json()},
            {"seed", settings_.seed}};
        if (stop_flag()) json["interrupted"] = true;
        json["requests"] = nlohmann::ordered_json::array();
        for (const AuditedRequest& request : done_)
            json["requests"].push_back(audit_entry(request));
        json["summary"] = audit_summary(done_);
        return json;
    }

    int code() const {
        int code = stop_flag() ? signal_exit_code() : 0;
        for (const AuditedRequest& request : done_) code = std::max(code, request.code);
        return code;
    }

 private:
    void serve(const AuditRequest& asked) {
        AuditedRequest failed;
        failed.asked = asked;
        failed.code = ending_of(
            [&] {
                JobOptions options = job_options_of(asked);
                if (!options.machine) options.machine = options_.machine;
                for (const auto& [setting, text] :
                     {std::pair{"threads", options_.threads}, {"planner", options_.planner}})
                    if (text && !options.has(setting)) options.put(setting, *text);
                const Catalogue edges = catalogue();
                const Query query = spec_of(options, edges);
                // Each is warned of by itself.
                Messages messages;
                configure(messages, options);
                const OwnLimits restored;
                AuditedRequest request;
                static_cast<Audited&>(request) =
                    audited(query, user_engine(edges, chosen_profile(options.machine, edges)),
                            settings_, messages);
                request.asked = asked;
                done_.push_back(std::move(request));
            },
            failed.message);
        if (failed.code == 0 || stop_flag()) return;
        messages_.warning(fmt::format("request {}: {}", done_.size() + 1, failed.message));
        done_.push_back(std::move(failed));
    }

    const AuditOptions& options_;
    Messages& messages_;
    PathSettings settings_;
    std::vector<AuditedRequest> done_;
};

int do_audit(const AuditOptions& options) {
    return guarded_with_json(options.json, [&] {
        Messages messages;
        messages.configure(options.log.value_or("warning"), options.progress.value_or("auto"),
                           options.quiet);
        if (options.out) expect_writable("-o", *options.out);
        if (options.json && *options.json != "-") expect_writable("--json", *options.json);
        Audit audit(options, messages);
        audit.run(load_audit_requests(options.requests));
        messages.end_progress();
        const std::string text = text_of(audit.report());
        if (options.out) write_text(*options.out, text);
        if (options.json) write_text(*options.json, text);
        return audit.code();
    });
}

}  // namespace

Verb add_audit(CLI::App& main) {
    CLI::App* app = main.add_subcommand(
        "audit", "the planner against the truth: every path of each request, run and compared");
    auto options = std::make_shared<AuditOptions>();
    app->add_option("REQUESTS", options->requests,
                    "{\"requests\": [{\"args\": [\"render\", ...]}]}")
        ->required()
        ->type_name("FILE.json");
    const auto text = [&](const char* name, std::optional<std::string>& into, const char* value,
                          const char* help) {
        return add_text(*app, name, into, help)->type_name(value);
    };
    text("-o", options->out, "OUT.json", "what came out, or -")->required();
    text("--limit", options->limit, "N", "paths a request at most; default 200");
    text("--repeat", options->repeat, "N", "runs of every path that could win; default 5");
    text(
        "--verify", options->verify, "N|all",
        "samples that errors are measured on; default: all, of large outputs 16384 pixels, or 2^19 "
        "samples of a warp");
    text("--seed", options->seed, "S", "of these samples and of the paths; default 1");
    text("--threads", options->threads, "N", "of requests that do not say it");
    text("--machine", options->machine, "FILE|NAME", "of requests that do not say it");
    text("--planner", options->planner, "NAME", "of requests that do not say it");
    text("--json", options->json, "FILE|-", "the same once more");
    text("--progress", options->progress, "WHEN", "auto, always or never");
    text("--log", options->log, "LEVEL", "error, warning, info or debug");
    app->add_flag("--quiet", options->quiet, "errors only");
    return {app, [options] { return do_audit(*options); }};
}

}  // namespace edgewise::cli
