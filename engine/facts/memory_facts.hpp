#pragma once

#include <cstddef>
#include <list>
#include <map>
#include <mutex>

#include "engine/facts/fact_store.hpp"

namespace edgewise {

/// Facts for as long as the process lives. Of more than kMostFacts those go that were kept first.
class MemoryFacts final : public FactStore {
 public:
    static constexpr std::size_t kMostFacts = 1000;

    std::optional<std::string> find(const FactKey& key) const override;
    bool keep(const FactKey& key, const std::string& fact) override;

 private:
    struct Kept {
        std::string of, fact;
        std::list<std::string>::iterator age;
    };
    mutable std::mutex mutex_;
    std::map<std::string, Kept, std::less<>> kept_;  // by kind and place
    std::list<std::string> oldest_first_;
};

}  // namespace edgewise
