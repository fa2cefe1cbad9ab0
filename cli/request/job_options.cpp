#include "cli/request/job_options.hpp"

#include <algorithm>
#include <cstdlib>

#include "cli/request/programs.hpp"
#include "graph/words.hpp"
#include "request/numbers.hpp"
#include "settings/selection.hpp"

namespace edgewise::cli {
namespace {

constexpr std::int64_t kMostThreads = 1024;

}  // namespace

std::optional<std::string> JobOptions::text(std::string_view setting) const {
    const auto last = std::find_if(given.rbegin(), given.rend(),
                                   [&](const Given& one) { return one.name == setting; });
    return last == given.rend() ? std::nullopt : std::optional(last->value.text());
}

void JobOptions::put(std::string_view setting, const std::string& text) {
    const auto last = std::find_if(given.rbegin(), given.rend(),
                                   [&](const Given& one) { return one.name == setting; });
    if (last != given.rend())
        last->value = text;
    else
        given.push_back({std::string(setting), text});
}

void JobOptions::drop(std::string_view setting) {
    std::erase_if(given, [&](const Given& one) { return one.name == setting; });
}

Query spec_of(const JobOptions& options, const Catalogue& edges) {
    Query query = query_of(options.job, options.given, edges);
    query.input = options.input;
    query.out = options.out;
    query.film_encoder = film_encoder();
    if (const char* threads = std::getenv("EDGEWISE_THREADS");
        threads && *threads && !query.threads)
        query.threads = static_cast<int>(whole_of("EDGEWISE_THREADS", threads, 1, kMostThreads));
    return query;
}

store::Selection selection_of(const JobOptions& options) {
    std::vector<Given> given;
    std::ranges::copy_if(options.given, std::back_inserter(given), [](const Given& one) {
        return std::ranges::any_of(selection_settings(), [&](const QuerySetting& row) {
            return row.name.name == one.name;
        });
    });
    return query_of(Job::warp, given, {}).selection;
}

bool names_all_times(const JobOptions& options) {
    const std::optional<std::string> time = options.text("time");
    return time && same_word(*time, kAll);
}

}  // namespace edgewise::cli
