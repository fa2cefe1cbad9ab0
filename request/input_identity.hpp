#pragma once

#include <optional>
#include <string>

namespace edgewise {

struct Input;

/// What tells the samples of an input from others, without reading them.
struct InputIdentity {
    std::string where;  // names and selection: stays when the files change
    std::string what;   // differs when anything does that the samples or facts of them depend on

    friend bool operator==(const InputIdentity&, const InputIdentity&) = default;
};

/// Phantoms are told by their names, files by device, number, size and times (of the last write and
/// of the last change of anything, which no program can set back) of all that samples come from.
/// Absent of descriptions; of what a
/// library reads that does not tell its files; and of files that were changed when they were
/// inspected or up to two seconds earlier: clocks of file systems are coarse, and another change
/// would leave the same times.
std::optional<InputIdentity> identity_of(const Input& input);
/// The same whatever is selected and however it is read.
std::optional<InputIdentity> identity_of_files(const Input& input);
/// By the samples themselves, which are in memory: each is read once.
InputIdentity identity_of_samples(const Input& input);

}  // namespace edgewise
