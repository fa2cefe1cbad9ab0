#include <CLI/CLI.hpp>
#include <cstdio>
#include <fmt/format.h>
#include <tbb/task_arena.h>
#include <vector>

#include "cli/machine/machine.hpp"
#include "cli/machine/signals.hpp"
#include "cli/request/errors.hpp"
#include "cli/request/outputs.hpp"
#include "cli/session/report.hpp"
#include "cli/verbs/verbs.hpp"
#include "graph/errors.hpp"
#include "runtime/one_thread_a_core.hpp"

namespace edgewise::cli {
namespace {

/// The parser of the verb that the command line got into.
const CLI::App& innermost(const CLI::App& app) {
    const auto inner = app.get_subcommands();
    return inner.empty() ? app : innermost(*inner.back());
}

std::string known_options(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::Option* option : app.get_options())
        if (!option->get_positional()) names.push_back(option->get_name());
    return fmt::format("{}", fmt::join(names, " "));
}

std::string known_verbs(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::App* verb : app.get_subcommands({})) names.push_back(verb->get_name());
    return fmt::format("{}", fmt::join(names, ", "));
}

/// What is wrong with the command line, and what there is instead.
std::string problem_of(const CLI::App& main, const CLI::ParseError& error) {
    const CLI::App& app = innermost(main);
    const std::string where = &app == &main ? "" : app.get_name() + ": ";
    const std::vector<std::string> extra = app.remaining();
    if (extra.empty()) return where + error.what();
    const bool option = extra[0].starts_with("-");
    if (!option && !app.get_subcommands({}).empty())
        return fmt::format("{}there is no verb '{}'; there are {}", where, extra[0],
                           known_verbs(app));
    return option ? fmt::format("{}there is no option {}; there are {}", where, extra[0],
                                known_options(app))
                  : fmt::format("{}'{}' is one argument too many", where, extra[0]);
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
    main.set_version_flag("--version", "edgewise " EDGEWISE_VERSION);
    main.require_subcommand(1);
    const Verb verbs[] = {add_info(main),  add_warp(main),   add_render(main),    add_plan(main),
                          add_graph(main), add_list(main),   add_calibrate(main), add_compare(main),
                          add_audit(main), add_advise(main), add_chart(main)};
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
