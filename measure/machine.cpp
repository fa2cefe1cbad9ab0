#include "measure/machine.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <sched.h>
#include <sstream>
#include <sys/resource.h>
#include <unistd.h>

#include "graph/errors.hpp"
#include "planner/machines.hpp"

namespace edgewise {
namespace {

namespace fs = std::filesystem;

double processor_seconds() {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

const std::chrono::steady_clock::time_point kLoaded = std::chrono::steady_clock::now();
const double kLoading = processor_seconds();

std::string first_line(const std::string& file) {
    std::ifstream stream(file);
    std::string line;
    std::getline(stream, line);
    return line;
}

/// The line of a "Key: value" file that starts with `key`, without the key.
std::string field_of(const std::string& file, const std::string& key) {
    std::ifstream stream(file);
    for (std::string line; std::getline(stream, line);)
        if (line.starts_with(key)) return line.substr(key.size());
    return {};
}

/// A "Key:  123 kB" line in bytes, or nothing.
std::optional<double> kilobytes_of(const char* file, const char* key) {
    const std::string text = field_of(file, key);
    if (text.empty()) return std::nullopt;
    return std::strtod(text.c_str(), nullptr) * 1024;
}

/// Folders of this process's control group, the innermost first; version 2 and, for memory and cpu,
/// version 1.
std::vector<std::string> group_folders(const std::string& controller) {
    std::vector<std::string> folders;
    std::ifstream stream("/proc/self/cgroup");
    for (std::string line; std::getline(stream, line);) {
        const std::size_t first = line.find(':'), second = line.find(':', first + 1);
        if (second == std::string::npos) continue;
        const std::string names = line.substr(first + 1, second - first - 1);
        const bool unified = names.empty();
        if (!unified && ("," + names + ",").find("," + controller + ",") == std::string::npos)
            continue;
        const std::string root = unified ? "/sys/fs/cgroup" : "/sys/fs/cgroup/" + controller;
        for (fs::path at = line.substr(second + 1); !at.empty(); at = at.parent_path()) {
            folders.push_back(root + at.string());
            if (at == at.parent_path()) break;
        }
    }
    return folders;
}

std::optional<double> number_in(const std::string& file) {
    const std::string line = first_line(file);
    if (line.empty() || line.starts_with("max")) return std::nullopt;
    return std::strtod(line.c_str(), nullptr);
}

/// Memory that stays until the control group is at its limit.
std::optional<double> group_free() {
    std::optional<double> least;
    for (const std::string& folder : group_folders("memory")) {
        auto limit = number_in(folder + "/memory.max");
        auto used = number_in(folder + "/memory.current");
        if (!limit) {
            limit = number_in(folder + "/memory.limit_in_bytes");
            used = number_in(folder + "/memory.usage_in_bytes");
        }
        if (!limit) continue;
        // Pages of files are given back by the system when memory is short.
        const std::string cached = field_of(folder + "/memory.stat", "inactive_file ");
        const double free = *limit - used.value_or(0) + std::strtod(cached.c_str(), nullptr);
        least = std::min(least.value_or(free), free);
    }
    return least;
}

/// What the limits of this process leave (`ulimit -v`, `ulimit -d`).
std::optional<double> limits_free() {
    struct Limit {
        decltype(RLIMIT_AS) what;
        const char* used;
    };
    std::optional<double> least;
    for (const Limit& row : {Limit{RLIMIT_AS, "VmSize:"}, Limit{RLIMIT_DATA, "VmData:"}}) {
        rlimit limit{};
        if (getrlimit(row.what, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) continue;
        const double used = kilobytes_of("/proc/self/status", row.used).value_or(0);
        const double free = static_cast<double>(limit.rlim_cur) - used;
        least = std::min(least.value_or(free), free);
    }
    return least;
}

std::optional<double> group_cores() {
    std::optional<double> least;
    for (const std::string& folder : group_folders("cpu")) {
        double quota = -1, period = 0;
        std::istringstream(first_line(folder + "/cpu.max")) >> quota >> period;
        if (period <= 0) {
            quota = number_in(folder + "/cpu.cfs_quota_us").value_or(-1);
            period = number_in(folder + "/cpu.cfs_period_us").value_or(0);
        }
        if (quota > 0 && period > 0)
            least = std::min(least.value_or(quota / period), quota / period);
    }
    return least;
}

std::optional<Profile> calibrated(const std::string& folder) {
    const std::string file = folder + "/machine.json";
    std::error_code none;
    if (folder.empty() || !fs::exists(file, none)) return std::nullopt;
    Profile profile = load_profile(file);
    if (profile.cpu != cpu_name()) return std::nullopt;
    return profile;
}

}  // namespace

double process_seconds() {
    return kLoading +
           std::chrono::duration<double>(std::chrono::steady_clock::now() - kLoaded).count();
}

bool is_built_in(const Profile& profile) {
    return profile.cpu.empty() && profile.name == Profile{}.name;
}

bool is_of_another(const Profile& profile) {
    if (is_built_in(profile)) return false;
    return profile.ranks > 1 || profile.cpu.empty() || profile.cpu != cpu_name();
}

int usable_cores() {
    cpu_set_t set;
    CPU_ZERO(&set);
    int cores = sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1;
    if (const auto quota = group_cores()) cores = std::min(cores, int(std::ceil(*quota)));
    return std::max(cores, 1);
}

double free_memory() {
    const double machine = kilobytes_of("/proc/meminfo", "MemAvailable:").value_or(1 << 30);
    const double group = group_free().value_or(machine), limits = limits_free().value_or(machine);
    return std::max(0.0, std::min({machine, group, limits}));
}

double resident_now() { return kilobytes_of("/proc/self/status", "VmRSS:").value_or(0); }
double data_now() { return kilobytes_of("/proc/self/status", "VmData:").value_or(0); }

double resident_peak() { return kilobytes_of("/proc/self/status", "VmHWM:").value_or(0); }

std::string cpu_name() {
    const std::string field = field_of("/proc/cpuinfo", "model name");
    const std::size_t colon = field.find(": ");
    return colon == std::string::npos ? "" : field.substr(colon + 2);
}

std::optional<std::int64_t> cache_bytes([[maybe_unused]] int level) {
    long bytes = 0;
#ifdef _SC_LEVEL1_DCACHE_SIZE
    bytes = sysconf(level == 1   ? _SC_LEVEL1_DCACHE_SIZE
                    : level == 2 ? _SC_LEVEL2_CACHE_SIZE
                                 : _SC_LEVEL3_CACHE_SIZE);
#endif
    return bytes > 0 ? std::optional<std::int64_t>(bytes) : std::nullopt;
}

Profile profile_in(const std::string& folder, const Catalogue& edges) {
    return calibrated(folder).value_or(default_profile(edges));
}

Profile profile_named(const std::string& name, const std::string& folder, const Catalogue& edges) {
    if (name == "default") return default_profile(edges);
    std::error_code none;
    if (fs::is_regular_file(name, none)) return load_profile(name);
    if (!folder.empty() && fs::exists(folder + "/" + name + ".json", none))
        return load_profile(folder + "/" + name + ".json");
    if (auto bundled = bundled_profile(name)) return *bundled;
    throw RequestError(message(
        "@machine: '{}' is neither a file nor a profile; `@command(list machines)` shows them",
        name));
}

}  // namespace edgewise
