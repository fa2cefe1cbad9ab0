#include "engine/engine.hpp"

#include "engine/facts/code_version.hpp"
#include "runtime/kept_arena.hpp"

namespace edgewise {

Engine::Engine(Catalogue edges, Profile machine, std::shared_ptr<FactStore> facts,
               std::string wisdom) {
    Fingerprint code;
    if (facts) {
        add_build(code);
        add_code(code, edges);
    }
    means_ = std::make_shared<const Means>(Means{std::move(edges), std::move(machine),
                                                 std::move(facts), std::move(wisdom), code.text(),
                                                 std::make_shared<Arenas>()});
}

}  // namespace edgewise
