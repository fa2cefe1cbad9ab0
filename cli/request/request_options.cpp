#include "cli/request/request_options.hpp"

#include <CLI/CLI.hpp>
#include <map>

#include "cli/request/spoken.hpp"
#include "reference/job_reference.hpp"

namespace edgewise::cli {
namespace {

using Kind = Reader::Kind;
using Words = std::vector<std::string>;

constexpr const char* kBudgets = "Budgets";
constexpr const char* kOutput = "Output";

/// Its words are taken when all are parsed; see take_given.
CLI::Option* add_setting(CLI::App& app, const QuerySetting& row, Job job) {
    const std::string help = spoken(row.help(job));
    if (row.kind() == Kind::flag) return app.add_flag(row.typed(), help);
    CLI::Option* option =
        app.add_option(row.typed(), CLI::callback_t([](const Words&) { return true; }), help)
            ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    if (row.kind() == Kind::bare) return option->expected(0, 0);
    return option->type_name(row.value(job).text());
}

void add_mpr(CLI::App& app, JobOptions& o) {
    add_text(app, "--mpr", o.mpr,
             "in place of a mode: the three planes through this sample of FILE, in one picture")
        ->type_name("X,Y,Z")
        ->group("Looks");
}

void add_machine(CLI::App& app, JobOptions& o) {
    add_text(app, "--machine", o.machine, "profile to predict with (docs/files.md)")
        ->type_name("FILE|NAME")
        ->group(kBudgets);
}

CLI::Option* add_file(CLI::App& app, const char* name, std::optional<std::string>& into,
                      const char* value, const char* help) {
    return add_text(app, name, into, help)->type_name(value)->group(kOutput);
}

/// Files and pages beside the result.
void add_reports(CLI::App& app, JobOptions& o, OutNeeded out) {
    if (o.job == Job::render && out != OutNeeded::absent) {
        app.add_flag("--progressive", o.progressive,
                     "composite: writes OUT again and again on the way, from the front")
            ->group(kOutput);
        add_file(app, "--stop-after", o.stop_after, "T",
                 "composite: what is done from the front by then is the picture");
    }
    add_file(app, "--json", o.json, "FILE|-", "report");
    app.add_option("--explain", CLI::callback_t([&o](const Words& words) {
                       o.explain = true;
                       o.explain_all = words.back() == "all";
                       return words.back().empty() || o.explain_all;
                   }),
                   "the plan and its alternatives; --explain=all: each refusal too")
        ->expected(0, 0)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
        ->group(kOutput);
}

void add_pages_and_messages(CLI::App& app, JobOptions& o, OutNeeded out) {
    if (out == OutNeeded::yes && has_reference(o.job))
        add_file(app, "--report", o.report, "FILE.html",
                 "a page of the run: plan, pictures, error map");
    add_file(app, "--trace", o.trace, "FILE.json", "what ran when, for Chrome's trace viewer");
    add_file(app, "--flow", o.flow, "FILE.dot", "the nodes that run");
    add_file(app, "--progress", o.progress, "WHEN", "auto, always or never");
    app.add_flag("--quiet", o.quiet, "errors only")->group(kOutput);
    add_file(app, "--log", o.log, "LEVEL", "error, warning, info or debug");
}

/// The command's own options stand among the settings where the help has them.
void add_own_before(CLI::App& app, std::string_view setting, JobOptions& o, OutNeeded out) {
    const bool surface = o.job == Job::mesh;
    if (setting == "max_error" && o.job == Job::render) add_mpr(app, o);
    if (setting == (surface ? "strict" : "planner")) add_machine(app, o);
    if (setting == (has_reference(o.job) ? "verify" : "repeat")) add_reports(app, o, out);
}

void add_out(CLI::App& app, const QuerySetting& row, JobOptions& o, OutNeeded out) {
    if (out == OutNeeded::absent) return;
    add_text(app, row.typed(), o.out, spoken(row.help(o.job)))
        ->type_name(row.value(o.job).text())
        ->group(row.group)
        ->required(out == OutNeeded::yes);
}

void add_row(CLI::App& app, const QuerySetting& row, Job job) {
    CLI::Option* option = add_setting(app, row, job);
    if (*row.group) option->group(row.group);
}

}  // namespace

void add_selection(CLI::App& app) {
    for (const QuerySetting& row : selection_settings()) add_row(app, row, Job::render);
}

CLI::Option* add_text(CLI::App& app, const std::string& name, std::optional<std::string>& into,
                      const std::string& help) {
    return app
        .add_option(name, CLI::callback_t([&into](const Words& words) {
                        into = words.back();
                        return true;
                    }),
                    help)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

void add_job_options(CLI::App& app, JobOptions& options, OutNeeded out) {
    app.add_option(
           "FILE", options.input,
           "file, folder, phantom:NAME:N, raw:FILE:WxHxD:TYPE, kspace:FILE:WxHxD or, for plans, "
           "describe:WxHxD:TYPE")
        ->required();
    for (const QuerySetting* row : settings_of(options.job)) {
        add_own_before(app, row->name.name, options, out);
        if (row->name.name == "out")
            add_out(app, *row, options, out);
        else
            add_row(app, *row, options.job);
    }
    add_pages_and_messages(app, options, out);
}

std::vector<std::string> typed_words(const CLI::App& app) {
    std::vector<std::string> words;
    for (const CLI::App* at = &app; at; at = at->get_parent())
        words.insert(words.begin(), at->get_name());
    std::map<const CLI::Option*, std::size_t> taken;
    for (const CLI::Option* option : app.parse_order()) {
        const std::string name = option->get_name();
        const std::string value = option->results().at(taken[option]++);
        if (option->get_positional()) {
            words.push_back(value);
        } else if (option->get_expected_max() > 0) {
            words.insert(words.end(), {name, value});
        } else {
            const bool is_flag = value.empty() || value == "true";
            words.push_back(is_flag ? name : name + "=" + value);
        }
    }
    return words;
}

void take_given(const CLI::App& app, JobOptions& options) {
    std::map<std::string, std::string_view> names;
    for (const QuerySetting* row : settings_of(options.job))
        if (row->name.name != "out") names.emplace(row->typed(), row->name.name);
    std::map<const CLI::Option*, std::size_t> taken;
    for (const CLI::Option* option : app.parse_order()) {
        const std::string& text = option->results().at(taken[option]++);
        if (const auto found = names.find(option->get_name()); found != names.end())
            options.given.push_back({std::string(found->second), text});
    }
}

}  // namespace edgewise::cli
