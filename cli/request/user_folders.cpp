#include "cli/request/user_folders.hpp"

#include <cstdlib>

#include "engine/facts/folder_facts.hpp"
#include "measure/machine.hpp"

namespace edgewise::cli {
namespace {

/// The folder that a variable names, else that one in the home.
std::string home_folder(const char* variable, const char* in_home) {
    if (const char* folder = std::getenv(variable); folder && *folder)
        return std::string(folder) + "/edgewise";
    if (const char* home = std::getenv("HOME"); home && *home)
        return std::string(home) + in_home + "/edgewise";
    return {};
}

/// "" where there is no folder.
std::string in_cache(const char* name) {
    const std::string folder = cache_folder();
    return folder.empty() ? folder : folder + "/" + name;
}

}  // namespace

std::string config_folder() { return home_folder("XDG_CONFIG_HOME", "/.config"); }
std::string cache_folder() { return home_folder("XDG_CACHE_HOME", "/.cache"); }

Profile chosen_profile(const std::optional<std::string>& machine, const Catalogue& edges) {
    const char* variable = std::getenv("EDGEWISE_MACHINE");
    const std::string name = machine ? *machine : variable ? variable : "";
    return name.empty() ? profile_in(config_folder(), edges)
                        : profile_named(name, config_folder(), edges);
}

std::shared_ptr<FactStore> user_facts() {
    return std::make_shared<FolderFacts>(in_cache("scenes"));
}

Engine user_engine(Catalogue edges, Profile machine) {
    return {std::move(edges), std::move(machine), user_facts(), in_cache("wisdom.json")};
}

}  // namespace edgewise::cli
