#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "planner/profile.hpp"

namespace edgewise {

/// Cores that this process may use: its affinity and the limit of its control group.
int usable_cores();
/// Bytes that the machine, or this process's control group, has free.
double free_memory();
/// Resident bytes now, and the most so far.
double resident_now();
double resident_peak();
/// Bytes of data that the process has allocated, as RLIMIT_DATA counts them.
double data_now();
/// Since the process began: what loading took of the processor, and the time from then on.
double process_seconds();
/// The processor's name, "" where the system does not say.
std::string cpu_name();

/// [byte] of the first, second or third cache for data; nothing where the system does not tell.
std::optional<std::int64_t> cache_bytes(int level);

/// The profile that `calibrate` left in a folder for this processor, else the built-in one
/// with what these edges say of it.
/// @param folder  "": none
/// @throws InputError where it is broken
Profile profile_in(const std::string& folder, const Catalogue& edges);
/// The profile of a file, of `folder`/NAME.json, or of those that come with the library.
/// @throws InputError for a file, RequestError for a name that is not there
Profile profile_named(const std::string& name, const std::string& folder, const Catalogue& edges);

/// Whether a profile is the built-in one: nobody measured this machine.
bool is_built_in(const Profile& profile);
/// Whether a profile is of another machine than this: of other processors, of several memories, or
/// of none that was measured.
bool is_of_another(const Profile& profile);

}  // namespace edgewise
