#include "cli/request/programs.hpp"

#include <algorithm>
#include <cstdlib>
#include <fmt/format.h>
#include <string_view>
#include <sys/stat.h>
#include <unistd.h>

#include "graph/errors.hpp"

namespace edgewise::cli {

std::string program_on_path(const std::string& name) {
    const char* path = std::getenv("PATH");
    std::string_view rest = path ? path : "/usr/bin:/bin";
    while (!rest.empty()) {
        const std::string folder(rest.substr(0, rest.find(':')));
        rest.remove_prefix(std::min(rest.size(), folder.size() + 1));
        if (folder.empty()) continue;  // a shell would look here, of all places
        const std::string file = folder + "/" + name;
        struct stat status {};
        if (::stat(file.c_str(), &status) == 0 && S_ISREG(status.st_mode) &&
            ::access(file.c_str(), X_OK) == 0)
            return file;
    }
    return {};
}

std::string film_encoder() { return program_on_path("ffmpeg"); }

std::string installed_program(const std::string& name, const std::string& package) {
    std::string file = program_on_path(name);
    if (file.empty())
        throw RunError(
            fmt::format("{} is not installed; it is in the Debian package {}", name, package));
    return file;
}

}  // namespace edgewise::cli
