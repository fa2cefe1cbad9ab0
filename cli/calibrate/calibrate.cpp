#include <CLI/CLI.hpp>
#include <filesystem>
#include <fmt/format.h>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/request/errors.hpp"
#include "cli/request/messages.hpp"
#include "cli/request/request_options.hpp"
#include "cli/request/user_folders.hpp"
#include "cli/session/report.hpp"
#include "cli/verbs/verbs.hpp"
#include "evaluation/calibrate/calibration.hpp"
#include "graph/errors.hpp"
#include "measure/machine.hpp"
#include "request/outputs.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise::cli {
namespace {

struct CalibrateOptions {
    bool quick = false, quiet = false;
    std::optional<std::string> out, json;
};

std::string profile_file(const CalibrateOptions& options) {
    if (options.out) return *options.out;
    const std::string folder = config_folder();
    if (folder.empty())
        throw RequestError("calibrate: there is no home to write the profile to; say -o FILE");
    std::error_code none;  // errors show when the folder is used
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
        const Profile profile = measured_profile(catalogue(), options.quick, messages);
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
