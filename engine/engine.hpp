#pragma once

#include <memory>
#include <utility>

#include "graph/transition.hpp"
#include "planner/profile.hpp"

namespace edgewise {

/// What all requests are planned with: the edges that paths are made of, and the machine whose
/// seconds are predicted. A value that never changes and is cheap to copy; threads share it.
class Engine {
 public:
    Engine(Catalogue edges, Profile machine)
        : means_(std::make_shared<const Means>(Means{std::move(edges), std::move(machine)})) {}

    const Catalogue& edges() const noexcept { return means_->edges; }
    const Profile& machine() const noexcept { return means_->machine; }

 private:
    struct Means {
        Catalogue edges;
        Profile machine;
    };
    std::shared_ptr<const Means> means_;
};

}  // namespace edgewise
