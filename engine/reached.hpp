#pragma once

#include <optional>
#include <utility>
#include <variant>

#include "engine/run.hpp"

namespace edgewise {

/// How far a request has come, for who reports it: its last stage, and what came out.
class Reached {
 public:
    Reached() = default;
    explicit Reached(Asked asked) : stage_(std::move(asked)) {}

    /// The stages that it has reached; null: not yet.
    const Asked* asked() const noexcept {
        return opened() ? opened() : std::get_if<Asked>(&stage_);
    }
    const Opened* opened() const noexcept {
        return looked() ? looked() : std::get_if<Opened>(&stage_);
    }
    const Looked* looked() const noexcept {
        return planned() ? planned() : std::get_if<Looked>(&stage_);
    }
    const Planned* planned() const noexcept { return std::get_if<Planned>(&stage_); }
    Planned& plan() { return std::get<Planned>(stage_); }

    /// open(); then read() and look(); then price().
    /// @throws what these throw; what was reached before stays
    void open_all(Listener& messages);
    void look_at(const Effort& effort, Listener& messages, const std::optional<InSeries>& in = {});
    void price_all(const Effort& effort, Listener& messages);
    /// All of these. @throws Infeasible where there is no plan
    void prepare(const Effort& effort, Listener& messages);
    /// Runs the plan with the samples, which are given back.
    void run_all(const Sinks& sinks, Listener& messages) {
        run = run_once(plan(), sinks, messages);
    }

    std::optional<Run> run;
    std::optional<WayOut> way_out;  // where it was found to be infeasible

 private:
    std::variant<std::monostate, Asked, Opened, Looked, Planned> stage_;
};

}  // namespace edgewise
