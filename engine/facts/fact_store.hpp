#pragma once

#include <optional>
#include <string>

namespace edgewise {

/// What a fact is called in a store. A fact is found again only where all of this is the same.
struct FactKey {
    std::string kind;  // letters: "statistics"
    std::string name;  // of what it is a fact of, for people: the file's
    /// One place in a store, of which the newest fact counts: of a changed file the old fact goes.
    std::string place;
    /// What the fact depends on, as a fingerprint: the samples, the request, the code that
    /// measures.
    std::string of;
};

/// Keeps facts of data that took long to measure, so that nobody measures them twice. It changes no
/// result: a fact that is found is the fact that would be measured, to the last bit. Threads share
/// it. A fact that cannot be kept is no error.
class FactStore {
 public:
    FactStore() = default;
    virtual ~FactStore() = default;
    FactStore(const FactStore&) = delete;
    FactStore& operator=(const FactStore&) = delete;

    /// Its text, as it was kept.
    virtual std::optional<std::string> find(const FactKey& key) const = 0;
    /// @param fact  JSON
    /// @return whether it was kept
    virtual bool keep(const FactKey& key, const std::string& fact) = 0;
};

}  // namespace edgewise
