#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "engine/request/input_identity.hpp"

namespace edgewise {

/// Facts of one data set that were measured before. Each is a small file of its own in the user's
/// cache folder. So nothing is read that nobody asks for, and writers of different facts do not
/// meet. A file is replaced as a whole. Of two writers of one fact the later one wins, with the
/// same fact. There are at most kMostFiles, and the oldest go first. A file that is damaged, or of
/// data that have changed, counts as none. A folder that cannot be written is no error.
class KnownFacts {
 public:
    static constexpr std::size_t kMostFiles = 1000;
    static constexpr std::size_t kMostBytes = 1 << 16;  // of one file

    /// @param identity  absent: nothing is known, nothing is kept
    /// @param folder    "": the user's
    explicit KnownFacts(std::optional<InputIdentity> identity, std::string folder = "");

    /// @param name  of the fact: letters
    /// @param of    what it depends on in addition to the data
    std::optional<nlohmann::json> find(const std::string& name, const std::string& of = "") const;
    /// @return whether it was kept
    bool keep(const std::string& name, const nlohmann::json& fact,
              const std::string& of = "") const;

 private:
    std::string file_of(const std::string& name, const std::string& of) const;

    std::optional<InputIdentity> identity_;
    std::string folder_;
};

}  // namespace edgewise
