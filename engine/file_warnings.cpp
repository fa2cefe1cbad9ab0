#include "engine/file_warnings.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "engine/known_facts.hpp"
#include "engine/opened.hpp"

namespace edgewise {
namespace {

constexpr const char* kTold = "told";

std::vector<std::string> told_of(const KnownFacts& facts) {
    std::vector<std::string> told;
    const auto found = facts.find(kTold);
    if (!found || !found->is_array()) return told;
    for (const nlohmann::json& text : *found)
        if (text.is_string()) told.push_back(text.get<std::string>());
    return told;
}

}  // namespace

void tell_of_file(const Opened& opened, const Input& input, const std::vector<Message>& warnings,
                  Listener& messages) {
    if (warnings.empty()) return;
    if (!messages.tells_once()) {
        for (const Message& warning : warnings) messages.warning(warning);
        return;
    }
    // Samples that a request has read in a way of its own are of the same file.
    const bool keeps = opened.query.remembers && !opened.as.given;
    const KnownFacts facts(keeps ? identity_of_files(input) : std::nullopt);
    std::vector<std::string> told = told_of(facts);
    const std::size_t before = told.size();
    for (const Message& warning : warnings) {
        // As it is kept: names are bytes, and what is no UTF-8 becomes U+FFFD in JSON.
        const std::string kept = nlohmann::json::parse(
            nlohmann::json(warning.marked())
                .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
        if (std::find(told.begin(), told.end(), kept) != told.end()) {
            messages.known_warning(warning);
        } else {
            messages.warning(warning);
            told.push_back(kept);
        }
    }
    if (told.size() > before && facts.keep(kTold, told) && before == 0)
        messages.notice(message(
            "later commands leave out what is said of {}; `@command(info)` lists it", input.name));
}

}  // namespace edgewise
