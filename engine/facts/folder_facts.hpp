#pragma once

#include <cstddef>

#include "engine/facts/fact_store.hpp"

namespace edgewise {

/// Facts in a folder, from run to run: each is a small file of its own. So nothing is read that
/// nobody asks for, and writers of different facts do not meet. A file is replaced as a whole. Of
/// two writers of one fact the later one wins, with the same fact. There are at most kMostFiles,
/// and the oldest go first. A file that is damaged, or of data that have changed, counts as none. A
/// folder that cannot be written is no error.
class FolderFacts final : public FactStore {
 public:
    static constexpr std::size_t kMostFiles = 1000;
    static constexpr std::size_t kMostBytes = 1 << 16;  // of one file

    /// @param folder  is made where it is not there; "": nothing is kept
    explicit FolderFacts(std::string folder) : folder_(std::move(folder)) {}

    std::optional<std::string> find(const FactKey& key) const override;
    bool keep(const FactKey& key, const std::string& fact) override;

 private:
    std::string file_of(const FactKey& key) const;

    std::string folder_;
};

}  // namespace edgewise
