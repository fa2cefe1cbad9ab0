#pragma once

#include <memory>
#include <string>
#include <utility>

#include "engine/facts/fact_store.hpp"
#include "graph/transition.hpp"
#include "planner/profile.hpp"

namespace edgewise {

class Arenas;

/// What all requests are planned with: the edges that paths are made of, and the machine whose
/// seconds are predicted; and where facts of data are kept, if anywhere. A value that never changes
/// and is cheap to copy; threads share it.
class Engine {
 public:
    /// @param facts   null: what is measured of data is forgotten
    /// @param wisdom  file of what pilots measured of paths (wisdom.hpp); "": it is forgotten
    Engine(Catalogue edges, Profile machine, std::shared_ptr<FactStore> facts = nullptr,
           std::string wisdom = {});

    const Catalogue& edges() const noexcept { return means_->edges; }
    const Profile& machine() const noexcept { return means_->machine; }
    const std::shared_ptr<FactStore>& facts() const noexcept { return means_->facts; }
    const std::string& wisdom() const noexcept { return means_->wisdom; }
    /// Fingerprint of the code that measures scenes: this build's and the edges' (add_code()).
    const std::string& code() const noexcept { return means_->code; }
    /// Where the threads of this engine's runs wait (runtime/kept_arena.hpp).
    Arenas& arenas() const noexcept { return *means_->arenas; }

 private:
    struct Means {
        Catalogue edges;
        Profile machine;
        std::shared_ptr<FactStore> facts;
        std::string wisdom, code;
        std::shared_ptr<Arenas> arenas;
    };
    std::shared_ptr<const Means> means_;
};

}  // namespace edgewise
