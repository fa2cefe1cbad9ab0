#include <CLI/CLI.hpp>
#include <cstdio>
#include <fmt/format.h>
#include <tbb/task_arena.h>
#include <vector>

#include "cli/request/daily_help.hpp"
#include "cli/request/errors.hpp"
#include "cli/request/filter_words.hpp"
#include "cli/session/report.hpp"
#include "cli/signals/signals.hpp"
#include "cli/verbs/verbs.hpp"
#include "graph/errors.hpp"
#include "graph/version.hpp"
#include "graph/words.hpp"
#include "measure/machine.hpp"
#include "request/outputs.hpp"
#include "runtime/one_thread_a_core.hpp"

namespace edgewise::cli {
namespace {

/// The parser of the verb that the command line got into.
const CLI::App& innermost(const CLI::App& app) {
    const auto inner = app.get_subcommands();
    return inner.empty() ? app : innermost(*inner.back());
}

std::vector<std::string> option_names(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::Option* option : app.get_options())
        if (!option->get_positional()) names.push_back(option->get_name());
    return names;
}

std::vector<std::string> verb_names(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::App* verb : app.get_subcommands({})) names.push_back(verb->get_name());
    return names;
}

/// The other verbs beside this one that do have an option, or "".
std::string verbs_with(const CLI::App& app, const std::string& option) {
    std::vector<std::string> others;
    if (const CLI::App* parent = app.get_parent())
        for (const CLI::App* verb : parent->get_subcommands({}))
            if (verb != &app && verb->get_option_no_throw(option))
                others.push_back(verb->get_name());
    return fmt::format("{}", fmt::join(others, " and "));
}

/// What to say of an option that a verb does not have.
/// @param next  the word behind it that belongs to nothing, or ""
std::string no_option(const CLI::App& app, const std::string& typed, const std::string& next) {
    const std::size_t equals = typed.find('=');
    const std::string option = typed.substr(0, equals);
    if (app.get_name() == name_of(Job::filter)) {
        const std::string value = equals == std::string::npos ? next : typed.substr(equals + 1);
        if (const std::string meant = meant_by_filter_option(option, value); !meant.empty())
            return fmt::format("there is no option {}; it is edgewise filter FILE -o OUT {}",
                               option, meant);
    }
    const std::string help = fmt::format("`edgewise {} --help-all` shows all", app.get_name());
    const std::string others = verbs_with(app, option);
    return fmt::format(
        "there is no option {}; {}", option,
        others.empty() ? instead_of(option, option_names(app), help) : "it is one of " + others);
}

/// What is wrong with the command line, and what was meant or there is instead.
std::string problem_of(const CLI::App& main, const CLI::ParseError& error) {
    const CLI::App& app = innermost(main);
    const std::string where = &app == &main ? "" : app.get_name() + ": ";
    const std::vector<std::string> extra = app.remaining();
    if (extra.empty()) return where + error.what();
    if (extra[0].starts_with("-"))
        return where + no_option(app, extra[0], extra.size() > 1 ? extra[1] : "");
    if (!app.get_subcommands({}).empty()) {
        const std::vector<std::string> verbs = verb_names(app);
        return fmt::format(
            "{}there is no verb '{}'; {}", where, extra[0],
            instead_of(extra[0], verbs, fmt::format("expected one of {}", fmt::join(verbs, ", "))));
    }
    return fmt::format("{}'{}' is one argument too many", where, extra[0]);
}

/// A command line that cannot be read may still say where its report goes.
std::optional<std::string> json_of(int count, char** words) {
    std::optional<std::string> file;
    for (int i = 1; i < count; ++i) {
        const std::string word = words[i];
        if (word.starts_with("--json=")) file = word.substr(7);
        if (word == "--json" && i + 1 < count) file = words[i + 1];
    }
    return file;
}

int parse_failed(const CLI::App& main, const CLI::ParseError& error, int count, char** words) {
    const std::string message = problem_of(main, error);
    return guarded_with_json(json_of(count, words), [&]() -> int { throw RequestError(message); });
}

int run(int count, char** words) {
    CLI::App main("The cheapest way from the volume or image you have to the picture you want.",
                  "edgewise");
    main.formatter(daily_help());
    main.set_help_all_flag("--help-all", "all options, in groups");
    main.set_version_flag("--version", "edgewise " + version());
    main.require_subcommand(1);
    main.ignore_case();  // of verbs
    std::vector<Verb> verbs{add_info(main)};
    for (const Verb& job : add_jobs(main)) verbs.push_back(job);
    for (const auto add : {add_plan, add_graph, add_list, add_calibrate, add_compare, add_audit,
                           add_advise, add_chart})
        verbs.push_back(add(main));
    if (count < 2) {
        std::fputs(main.help().c_str(), stderr);
        return kBadRequest;
    }
    try {
        main.parse(count, words);
    } catch (const CLI::Success& shown) {
        return main.exit(shown);  // --help, --version
    } catch (const CLI::ParseError& error) {
        return parse_failed(main, error, count, words);
    }
    tbb::task_arena arena(usable_cores());
    const OneThreadACore cores(arena, usable_cores());
    const OneThreadACore::AtWork all_the_time(cores);
    for (const Verb& verb : verbs)
        if (verb.app->parsed()) return arena.execute(verb.run);
    return kBadRequest;
}

}  // namespace
}  // namespace edgewise::cli

int main(int count, char** words) {
    edgewise::cli::catch_signals();
    return edgewise::cli::run(count, words);
}
