#include "engine/facts/code_version.hpp"

#include <cstdint>
#include <cstring>
#include <fmt/format.h>
#include <functional>
#include <link.h>
#include <string>
#include <sys/stat.h>
#include <typeinfo>

#include "graph/version.hpp"
#include "measure/machine.hpp"

namespace edgewise {
namespace {

/// A program or library in this process, and where in it an address lies.
struct Module {
    std::string build;  // of its file
    std::uintptr_t place = 0;
};

struct Sought {
    std::uintptr_t address;
    Module* found;
};

std::uintptr_t padded(std::uintptr_t bytes) { return (bytes + 3) & ~std::uintptr_t{3}; }

/// The build id that the linker wrote, or "".
std::string build_id_of(const dl_phdr_info& info) {
    for (int i = 0; i < info.dlpi_phnum; ++i) {
        const auto& part = info.dlpi_phdr[i];
        if (part.p_type != PT_NOTE) continue;
        const auto* at = reinterpret_cast<const char*>(info.dlpi_addr + part.p_vaddr);
        const char* const end = at + part.p_memsz;
        while (at + sizeof(ElfW(Nhdr)) <= end) {
            ElfW(Nhdr) note;
            std::memcpy(&note, at, sizeof note);
            const char* const name = at + sizeof note;
            const char* const content = name + padded(note.n_namesz);
            if (content + note.n_descsz > end) break;
            if (note.n_type == NT_GNU_BUILD_ID && note.n_namesz == 4 &&
                std::memcmp(name, "GNU", 4) == 0)
                return {content, note.n_descsz};
            at = content + padded(note.n_descsz);
        }
    }
    return {};
}

/// What tells a file from another, where it has no build id.
std::string status_of(const char* name) {
    struct stat status {};
    if (::stat(*name ? name : "/proc/self/exe", &status) != 0) return name;
    return fmt::format("{} {} {} {}.{:09}", status.st_dev, status.st_ino, status.st_size,
                       status.st_mtim.tv_sec, status.st_mtim.tv_nsec);
}

int look_in(dl_phdr_info* info, std::size_t, void* of) {
    auto& sought = *static_cast<Sought*>(of);
    for (int i = 0; i < info->dlpi_phnum; ++i) {
        const auto& part = info->dlpi_phdr[i];
        const std::uintptr_t begin = info->dlpi_addr + part.p_vaddr;
        if (part.p_type != PT_LOAD || sought.address < begin ||
            sought.address >= begin + part.p_memsz)
            continue;
        const std::string id = build_id_of(*info);
        *sought.found = {id.empty() ? status_of(info->dlpi_name) : id,
                         sought.address - info->dlpi_addr};
        return 1;
    }
    return 0;
}

Module module_of(const void* address) {
    Module found;
    Sought sought{reinterpret_cast<std::uintptr_t>(address), &found};
    dl_iterate_phdr(look_in, &sought);
    return found;
}

template <class R, class... Args>
void add_function(Fingerprint& to, const std::function<R(Args...)>& function) {
    to.add(bool(function));
    if (!function) return;
    // The type of a lambda belongs to the place where it is written.
    const std::type_info& type = function.target_type();
    to.add(type.name());
    const auto* plain = function.template target<R (*)(Args...)>();
    const Module module =
        module_of(plain ? reinterpret_cast<const void*>(*plain) : static_cast<const void*>(&type));
    to.add(module.build).add(module.place);
}

}  // namespace

void add_code(Fingerprint& to, const Catalogue& edges) {
    to.add(edges.size());
    for (const Transition& edge : edges) {
        to.add(edge.name).add(edge.source).add(edge.version).add(edge.joins);
        to.add(edge.attaches).add(edge.any_transform).add(edge.on_demand);
        to.add(edge.plain.has_value()).add(edge.plain ? edge.plain->text() : "");
        for (const auto& [name, domain] : edge.parameters) {
            to.add(name).add(domain.words).add(domain.low).add(domain.high);
            for (const Value& value : domain.tried) to.add(text_of(value));
        }
        for (const Law law : edge.laws) to.add(law);
        add_function(to, edge.offer), add_function(to, edge.error);
        add_function(to, edge.count), add_function(to, edge.model), add_function(to, edge.derives);
        for (const auto& count : edge.shared_counts) add_function(to, std::function(count));
        if (edge.error) continue;
        // Its error is what running it gives.
        add_function(to, edge.work), add_function(to, edge.parts), add_function(to, edge.run);
    }
}

void add_build(Fingerprint& to) {
    static const std::string build = [] {
        const auto* self = reinterpret_cast<const void*>(&add_build);
        return fmt::format("{}|{}|{}", version(), module_of(self).build, cpu_name());
    }();
    to.add(build);
}

}  // namespace edgewise
