#include "planner/margin.hpp"

#include <algorithm>
#include <cmath>
#include <set>

namespace edgewise {
namespace {

constexpr double kOneDeviation = 0.1587;  // of a normal distribution lies beyond one deviation
constexpr double kRounding = 1e-12;

double normal_tail(double z) { return 0.5 * std::erfc(z / std::sqrt(2.0)); }

/// Budgets and aim by which a plan was chosen: a likeness that nothing has is no budget.
struct Rules {
    Budget budget;
    Minimize aim;
};

Rules rules_of(const Request& want, const Predicted& plan) {
    Rules rules{want.budget, want.minimize};
    if (rules.budget.like && !accurate_enough(plan, rules.budget)) {
        rules.budget.like.reset();
        rules.aim = Minimize::error;
    }
    return rules;
}

/// Edges of a path without their parameters.
std::vector<std::string> edges_of(const Candidate& path) {
    std::vector<std::string> edges;
    for (const std::string& step : path.steps) edges.push_back(step.substr(0, step.find('/')));
    return edges;
}

class Margins {
 public:
    Margins(const Candidates& paths, const Candidate& plan)
        : paths_(paths), plan_(plan), rules_(rules_of(paths.ask().want, plan.real)) {}

    StepMargin step(const std::string& name) const {
        StepMargin margin{.step = name};
        margin.spread = paths_.spread_of(plan_, name);
        const double own = paths_.seconds_in(plan_, name);
        const Candidate* next = nullptr;
        if (!(own > 0)) return margin;
        for (const Candidate& other : paths_.all()) {
            const double saved = own - paths_.seconds_in(other, name);
            if (&other == &plan_ || !(saved > 0) || !takes_over(other)) continue;
            const double factor =
                1 + std::max(0.0, other.choice.seconds - plan_.choice.seconds) / saved;
            if (next && factor >= *margin.factor) continue;
            next = &other;
            margin.factor = factor;
        }
        if (next) margin.instead = next->steps;
        break_time(margin);
        margin.inside = margin.factor && std::log(*margin.factor) <= margin.spread;
        return margin;
    }

    Rival rival(const Candidate& other) const {
        Rival rival{.steps = other.steps, .predicted = other.real};
        rival.seconds = other.real.seconds - plan_.real.seconds;
        rival.bytes = other.real.expected_bytes() - plan_.real.expected_bytes();
        if (other.real.known && plan_.real.known) rival.error = other.real.error - plan_.real.error;
        if (!accurate_enough(other.real, rules_.budget)) rival.breaks.push_back("error");
        if (!fast_enough(other.real, rules_.budget)) rival.breaks.push_back("time");
        if (!small_enough(other.real, rules_.budget)) rival.breaks.push_back("memory");
        const auto [mine, its] = std::mismatch(plan_.steps.begin(), plan_.steps.end(),
                                               other.steps.begin(), other.steps.end());
        if (its != other.steps.end()) {
            rival.differs = *its;
            rival.faster = faster(other, *its);
        }
        rival.chance = chance(other);
        rival.toss_up =
            rules_.aim == Minimize::time && rival.breaks.empty() && rival.chance > kOneDeviation;
        return rival;
    }

    /// The most interesting ones first, each once.
    std::vector<const Candidate*> chosen(std::size_t wanted) const {
        std::vector<const Candidate*> picked;
        const auto pick = [&](const std::function<bool(const Candidate&)>& passes, Minimize aim) {
            const Candidate* best = nullptr;
            for (const Candidate& path : paths_.all())
                if (&path != &plan_ && passes(path) &&
                    std::find(picked.begin(), picked.end(), &path) == picked.end() &&
                    (!best || better(path, *best, aim)))
                    best = &path;
            if (best && picked.size() < wanted) picked.push_back(best);
            return best != nullptr;
        };
        // Paths whose error nobody knows come last: what they lose cannot be told.
        const auto known = [&](const Candidate& path) {
            return path.real.known || !plan_.real.known;
        };
        const auto fits = [&](const Candidate& path) {
            return known(path) && feasible(path.real, rules_.budget);
        };
        const auto any = [](const Candidate&) { return true; };
        const auto edges = edges_of(plan_);
        pick(fits, rules_.aim);
        pick([&](const Candidate& path) { return fits(path) && edges_of(path) != edges; },
             rules_.aim);
        pick([&](const Candidate& path) { return known(path) && !fits(path); }, rules_.aim);
        while (picked.size() < wanted && pick(fits, rules_.aim)) continue;
        while (picked.size() < wanted && pick(known, rules_.aim)) continue;
        while (picked.size() < wanted && pick(any, rules_.aim)) continue;
        std::stable_sort(picked.begin(), picked.end(), [&](const auto* a, const auto* b) {
            if (fits(*a) != fits(*b)) return fits(*a);
            return better(*a, *b, rules_.aim);
        });
        return picked;
    }

    double late() const {
        if (!rules_.budget.seconds) return 0;
        const double spread = plan_.real.spread,
                     ratio = *rules_.budget.seconds / plan_.real.seconds;
        return spread > 0 && ratio > 0 ? normal_tail(std::log(ratio) / spread) : 0;
    }

 private:
    static bool better(const Candidate& a, const Candidate& b, Minimize aim) {
        const double mine = objective(a.real, aim), its = objective(b.real, aim);
        return mine != its ? mine < its : a.real.seconds < b.real.seconds;
    }

    /// Whether seconds alone keep a path from being chosen.
    bool takes_over(const Candidate& other) const {
        return feasible(other.real, rules_.budget) && feasible(other.choice, rules_.budget) &&
               (rules_.aim == Minimize::time ||
                objective(other.choice, rules_.aim) == objective(plan_.choice, rules_.aim));
    }

    /// A plan that would break the budget of seconds before it is beaten loses at that point.
    void break_time(StepMargin& margin) const {
        const auto& limit = rules_.budget.seconds;
        const double own = paths_.seconds_in(plan_, margin.step, true);
        if (!limit || !(own > 0)) return;
        const double factor = 1 + std::max(0.0, *limit - plan_.real.seconds) / own;
        if (margin.factor && *margin.factor < factor * (1 - kRounding)) return;
        margin.factor = factor;
        margin.instead.clear();
        const Candidate* next = nullptr;
        for (const Candidate& other : paths_.all()) {
            Predicted then = other.real;
            const double its = paths_.seconds_in(other, margin.step, true);
            then.seconds += (factor - 1) * its;
            // From this factor on: a path that grows as well and is at the limit is out too.
            const bool fits = feasible(then, rules_.budget) &&
                              (its == 0 || then.seconds < *limit * (1 - kRounding)) &&
                              &other != &plan_;
            if (fits && (!next || better(other, *next, rules_.aim))) next = &other;
        }
        if (next) margin.instead = next->steps;
    }

    /// By how much a step of a rival must get faster, or nothing where that does not help.
    std::optional<double> faster(const Candidate& other, const std::string& step) const {
        if (!accurate_enough(other.real, rules_.budget) || !small_enough(other.real, rules_.budget))
            return std::nullopt;
        const double gap = other.choice.seconds - plan_.choice.seconds;
        const double share = paths_.seconds_in(other, step) - paths_.seconds_in(plan_, step);
        double saved = 0;  // of its seconds
        if (rules_.aim == Minimize::time) {
            if (!(share > 0)) return std::nullopt;
            saved = std::max(0.0, gap) / share;
        } else if (objective(other.choice, rules_.aim) > objective(plan_.choice, rules_.aim)) {
            return std::nullopt;
        }
        if (!fast_enough(other.real, rules_.budget)) {
            const double all = paths_.seconds_in(other, step, true);
            if (!(all > 0)) return std::nullopt;
            saved = std::max(saved, (other.real.seconds - *rules_.budget.seconds) / all);
        }
        if (!(saved < 1)) return std::nullopt;
        return 1 / (1 - saved);
    }

    /// That a rival is the faster one: both log-normal, where they share a step also its error.
    double chance(const Candidate& other) const {
        std::set<std::string> steps(plan_.steps.begin(), plan_.steps.end());
        steps.insert(other.steps.begin(), other.steps.end());
        double variance = 0;
        for (const std::string& step : steps) {
            const double apart = paths_.seconds_in(other, step) - paths_.seconds_in(plan_, step);
            const double spread =
                std::max(paths_.spread_of(other, step), paths_.spread_of(plan_, step));
            variance += std::pow(spread * apart, 2);
        }
        const double a = plan_.choice.seconds, b = other.choice.seconds;
        if (!(a > 0) || !(b > 0)) return b < a ? 1 : b > a ? 0 : 0.5;
        const double deviation = std::sqrt(variance / (a * b)), log = std::log(b / a);
        if (deviation > 0) return normal_tail(log / deviation);
        return log < 0 ? 1 : log > 0 ? 0 : 0.5;
    }

    const Candidates& paths_;
    const Candidate& plan_;
    const Rules rules_;
};

}  // namespace

Margin margin_of(const Candidates& paths, const Plan& plan, std::size_t rivals) {
    Margin margin;
    const Candidate* chosen = paths.find(plan.texts());
    if (!chosen) return margin;
    const Margins margins(paths, *chosen);
    std::set<std::string> seen;
    for (const std::string& step : chosen->steps)
        if (seen.insert(step).second) margin.steps.push_back(margins.step(step));
    for (const Candidate* other : margins.chosen(rivals)) {
        margin.rivals.push_back(margins.rival(*other));
        margin.toss_up = margin.toss_up || margin.rivals.back().toss_up;
    }
    margin.late = margins.late();
    return margin;
}

}  // namespace edgewise
