#include "cli/request/told_once.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "engine/facts/folder_facts.hpp"
#include "graph/fingerprint.hpp"
#include "graph/version.hpp"
#include "request/input_identity.hpp"

namespace edgewise::cli {
namespace {

using Json = nlohmann::json;

std::vector<std::string> texts_in(const std::optional<std::string>& kept) {
    std::vector<std::string> texts;
    if (!kept) return texts;
    for (const Json& text : Json::parse(*kept, nullptr, false))
        if (text.is_string()) texts.push_back(text.get<std::string>());
    return texts;
}

/// Names are bytes, and what is no UTF-8 becomes U+FFFD in JSON.
std::string as_kept(const Message& warning) {
    return Json::parse(Json(warning.marked()).dump(-1, ' ', false, Json::error_handler_t::replace));
}

}  // namespace

ToldOnce::Sorted ToldOnce::sort(const Input& file, const std::vector<Message>& warnings) const {
    Sorted sorted;
    FolderFacts folder(folder_);
    const std::optional<InputIdentity> identity = identity_of_files(file);
    FactKey key;
    if (identity) {
        Fingerprint of;
        of.add(version()).add(identity->what);
        key = {"told", identity->where, identity->where, of.text()};
    }
    std::vector<std::string> told;
    if (identity) told = texts_in(folder.find(key));
    const std::size_t before = told.size();
    for (const Message& warning : warnings) {
        const std::string text = as_kept(warning);
        const bool known = std::find(told.begin(), told.end(), text) != told.end();
        (known ? sorted.told : sorted.untold).push_back(warning);
        if (!known) told.push_back(text);
    }
    if (identity && told.size() > before)
        sorted.first = folder.keep(key, Json(told).dump()) && before == 0;
    return sorted;
}

}  // namespace edgewise::cli
