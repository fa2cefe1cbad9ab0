#include "cli/audit/audit_requests.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fmt/format.h>
#include <fstream>
#include <nlohmann/json.hpp>

#include "cli/request/request_options.hpp"
#include "graph/errors.hpp"
#include "graph/kinds.hpp"
#include "graph/words.hpp"

namespace edgewise::cli {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMostBytes = 16 << 20;

[[noreturn]] void refuse(const std::string& file, const std::string& what) {
    throw InputError(fmt::format("{}: {}", file, what));
}

std::string whole(const std::string& file) {
    std::ifstream stream(file, std::ios::binary);
    std::string text;
    char block[1 << 16];
    while (stream.read(block, sizeof block) || stream.gcount() > 0) {
        text.append(block, static_cast<std::size_t>(stream.gcount()));
        if (text.size() > kMostBytes) refuse(file, "is beyond 16 MiB; expected a request file");
    }
    if (!stream.eof()) refuse(file, "cannot be read");
    return text;
}

AuditRequest request_of(const std::string& file, const Json& json, std::size_t place) {
    const std::string where = fmt::format("requests[{}]", place);
    if (!json.is_object()) refuse(file, where + " is no object; expected {\"args\": [...]}");
    for (const auto& [key, value] : json.items())
        if (key != "args" && key != "name" && key != "held_out")
            refuse(file, fmt::format("{}.{} is not known; there are args, name and held_out", where,
                                     key));
    AuditRequest request;
    const auto args = json.find("args");
    if (args == json.end() || !args->is_array() || args->empty())
        refuse(file, where + ".args is missing or no list; expected [\"render\", \"FILE\", ...]");
    for (std::size_t i = 0; i < args->size(); ++i) {
        if (!(*args)[i].is_string())
            refuse(file,
                   fmt::format("{}.args[{}] is {}; expected a text", where, i,
                               (*args)[i].dump(-1, ' ', false, Json::error_handler_t::replace)));
        request.args.push_back((*args)[i].get<std::string>());
    }
    if (const auto name = json.find("name"); name != json.end()) {
        if (!name->is_string()) refuse(file, where + ".name is no text");
        request.name = name->get<std::string>();
    }
    if (const auto held = json.find("held_out"); held != json.end()) {
        if (!held->is_boolean()) refuse(file, where + ".held_out is neither true nor false");
        request.held_out = held->get<bool>();
    }
    return request;
}

}  // namespace

std::vector<AuditRequest> load_audit_requests(const std::string& file) {
    const std::string text = whole(file);
    Json json;
    try {
        json = Json::parse(text);
    } catch (const Json::exception& error) {
        refuse(file, error.what());
    }
    if (!json.is_object() || !json.contains("requests") || !json["requests"].is_array())
        refuse(file,
               "requests is missing or no list; expected {\"requests\": [{\"args\": [...]}]}");
    std::vector<AuditRequest> requests;
    for (const Json& one : json["requests"])
        requests.push_back(request_of(file, one, requests.size()));
    if (requests.empty()) refuse(file, "requests is empty; there is nothing to audit");
    return requests;
}

JobOptions job_options_of(const AuditRequest& request) {
    JobOptions options;
    const std::string& verb = request.args[0];
    const auto job = std::ranges::find_if(jobs(), [&](Job each) { return name_of(each) == verb; });
    if (job == jobs().end() || !is_charted(*job))
        throw RequestError(fmt::format("args[0]: '{}' is no warp, render or filter", verb));
    options.job = *job;
    CLI::App app("", verb);
    add_job_options(app, options, OutNeeded::no);
    try {
        // The parser takes its words from the back.
        app.parse(std::vector<std::string>(request.args.rbegin(), request.args.rend() - 1));
    } catch (const CLI::Success&) {
        throw RequestError("args: help is no request");
    } catch (const CLI::ParseError& error) {
        const std::vector<std::string> extra = app.remaining();
        if (extra.empty()) throw RequestError(fmt::format("args: {}: {}", verb, error.what()));
        std::vector<std::string> names;
        for (const CLI::Option* option : app.get_options()) names.push_back(option->get_name());
        throw RequestError(fmt::format("args: {}: there is no '{}'; {}", verb, extra[0],
                                       instead_of(extra[0].substr(0, extra[0].find('=')), names,
                                                  "`--help` shows all options")));
    }
    take_given(app, options);
    options.drop("verify");
    options.drop("repeat");
    options.out.reset();
    options.json.reset();
    options.trace.reset();
    options.flow.reset();
    options.explain = false;
    // What a request says goes into its entry of the report.
    options.quiet = true;
    return options;
}

}  // namespace edgewise::cli
