#include "engine/facts/memory_facts.hpp"

namespace edgewise {
namespace {

std::string slot_of(const FactKey& key) { return key.kind + "|" + key.place; }

}  // namespace

std::optional<std::string> MemoryFacts::find(const FactKey& key) const {
    const std::lock_guard lock(mutex_);
    const auto found = kept_.find(slot_of(key));
    if (found == kept_.end() || found->second.of != key.of) return std::nullopt;
    return found->second.fact;
}

bool MemoryFacts::keep(const FactKey& key, const std::string& fact) {
    const std::lock_guard lock(mutex_);
    const std::string slot = slot_of(key);
    if (const auto found = kept_.find(slot); found != kept_.end()) {
        oldest_first_.erase(found->second.age);
        kept_.erase(found);
    }
    while (kept_.size() >= kMostFacts) {
        kept_.erase(oldest_first_.front());
        oldest_first_.pop_front();
    }
    oldest_first_.push_back(slot);
    kept_[slot] = {key.of, fact, std::prev(oldest_first_.end())};
    return true;
}

}  // namespace edgewise
