#include "planner/relax.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <set>

namespace edgewise {
namespace {

constexpr std::size_t kMostDemands = 12;
constexpr std::size_t kMostMissing = 3, kMostSets = 8;

/// What a path needs and what it may need, in the order error, seconds, bytes; an unknown error is
/// infinite.
using Three = std::array<double, 3>;
constexpr double kNone = std::numeric_limits<double>::infinity();

Three three_of(const Predicted& p) { return {p.known ? p.error : kNone, p.seconds, p.bytes}; }

Three three_of(const Budget& budget) {
    return {budget.error.value_or(kNone), budget.seconds.value_or(kNone),
            budget.bytes.value_or(kNone)};
}

class Relaxing {
 public:
    Relaxing(const Candidates& paths, const Budget& budget, const Rounding& rounding)
        : limits_(three_of(budget)), round_{&rounding.error, &rounding.seconds, &rounding.bytes} {
        for (const Candidate& path : paths.all())
            if (path.front) taken_.push_back(three_of(path.real));
    }

    std::vector<Relaxed> smallest() const {
        for (int size = 1; size <= 3; ++size) {
            std::vector<Relaxed> found;
            for (const unsigned set : {1u, 2u, 4u, 3u, 5u, 6u, 7u}) {
                if (std::popcount(set) != size || !is_set(set)) continue;
                if (const auto relaxed = relax(set)) found.push_back(*relaxed);
            }
            if (!found.empty()) return found;
        }
        return {};
    }

 private:
    bool is_set(unsigned set) const {
        for (int i = 0; i < 3; ++i)
            if (set >> i & 1 && limits_[i] == kNone) return false;
        return true;
    }

    double rounded(int which, double value) const {
        return std::isinf(value) ? value : (*round_[which])(value);
    }

    /// The least of one resource among paths that keep the other limits.
    double least(int which, const Three& limits) const {
        double least = kNone;
        for (const Three& path : taken_) {
            bool keeps = true;
            for (int i = 0; i < 3; ++i) keeps = keeps && (i == which || path[i] <= limits[i]);
            if (keeps) least = std::min(least, path[which]);
        }
        return least;
    }

    std::optional<Relaxed> relax(unsigned set) const {
        const Three* nearest = nullptr;
        double factor = 0;
        for (const Three& path : taken_) {
            bool keeps = true;
            double log = 0;
            for (int i = 0; i < 3; ++i) {
                if (!(set >> i & 1))
                    keeps = keeps && path[i] <= limits_[i];
                else if (!std::isinf(path[i]))
                    log += std::log(std::max(path[i], 1e-300) / std::max(limits_[i], 1e-300));
                else
                    log += 1e3;  // a limit of its own kind: only where nothing else helps
            }
            if (!keeps || (nearest && factor <= log)) continue;
            nearest = &path;
            factor = log;
        }
        if (!nearest) return std::nullopt;
        return said(set, *nearest);
    }

    /// Rounding one limit may let a path in that needs less of another.
    Relaxed said(unsigned set, const Three& at) const {
        Three limits = limits_;
        for (int i = 0; i < 3; ++i)
            if (set >> i & 1) limits[i] = rounded(i, at[i]);
        for (int again = 0; again < 3; ++again)
            for (int i = 0; i < 3; ++i)
                if (set >> i & 1) limits[i] = rounded(i, least(i, limits));
        Relaxed relaxed;
        if (set & 1) relaxed.error = limits[0];
        if (set & 2) relaxed.seconds = limits[1];
        if (set & 4) relaxed.bytes = limits[2];
        return relaxed;
    }

    const Three limits_;
    const std::array<const std::function<double(double)>*, 3> round_;
    std::vector<Three> taken_;
};

Demands less(const Demands& demands, unsigned set, Dropped& dropped) {
    Demands left;
    for (std::size_t i = 0; i < demands.via.size(); ++i)
        if (set >> i & 1)
            dropped.via.push_back(i);
        else
            left.via.push_back(demands.via[i]);
    for (std::size_t i = 0; i < demands.without.size(); ++i)
        if (set >> (demands.via.size() + i) & 1)
            dropped.without.push_back(i);
        else
            left.without.push_back(demands.without[i]);
    return left;
}

/// Whether the edges that are left join kinds to what is asked for.
class Kinds {
 public:
    Kinds(const Catalogue& catalogue, const Ask& ask, const std::vector<Source>& sources)
        : catalogue_(catalogue), goal_(ask.want.job->target) {
        for (const Source& source : sources) starts_.insert(source.what.kind());
    }

    bool joined_without(const std::set<std::string>& refused) const {
        std::set<std::string> reached = starts_;
        for (bool grows = true; grows;) {
            grows = false;
            for (const Transition& edge : catalogue_)
                if (!refused.contains(edge.name))
                    for (const auto& [from, to] : edge.joins)
                        if (any_takes(reached, from)) grows = reached.insert(to).second || grows;
        }
        return std::any_of(reached.begin(), reached.end(), [&](const std::string& kind) {
            return kind.substr(0, kind.find('+')) == goal_;
        });
    }

 private:
    static bool any_takes(const std::set<std::string>& reached, const std::string& join) {
        return std::any_of(reached.begin(), reached.end(),
                           [&](const std::string& kind) { return takes_kind(join, kind); });
    }

    const Catalogue& catalogue_;
    const std::string goal_;
    std::set<std::string> starts_;
};

/// Calls `take` with all sets of `size` of the first `count` numbers, in order.
void each_set(std::size_t count, std::size_t size,
              const std::function<void(const std::vector<std::size_t>&)>& take) {
    std::vector<std::size_t> set(size);
    const std::function<void(std::size_t, std::size_t)> fill = [&](std::size_t at,
                                                                   std::size_t from) {
        if (at == size) return take(set);
        for (std::size_t i = from; i < count; ++i) {
            set[at] = i;
            fill(at + 1, i + 1);
        }
    };
    fill(0, 0);
}

}  // namespace

std::vector<Relaxed> relaxed_budgets(const Candidates& paths, const Budget& budget,
                                     const Rounding& rounding) {
    return Relaxing(paths, budget, rounding).smallest();
}

std::vector<Dropped> demands_to_drop(const Catalogue& catalogue, const Ask& ask,
                                     const std::vector<Source>& sources, const Profile& profile,
                                     const PlanOptions& options, bool budgets) {
    const Demands& demands = options.demands;
    const std::size_t count = demands.via.size() + demands.without.size();
    std::vector<Dropped> found;
    Request want = ask.want;
    if (!budgets) want.budget = {};
    if (count > kMostDemands) return found;
    for (std::size_t size = 1; size <= count && found.empty(); ++size)
        each_set(count, size, [&](const std::vector<std::size_t>& set) {
            unsigned bits = 0;
            for (const std::size_t i : set) bits |= 1u << i;
            Dropped dropped;
            PlanOptions fewer = options;
            fewer.demands = less(demands, bits, dropped);
            if (plan(catalogue, {want, ask.scene}, sources, profile, fewer).plan)
                found.push_back(std::move(dropped));
        });
    return found;
}

std::vector<std::vector<Refusal>> missing_edges(const Catalogue& catalogue, const Ask& ask,
                                                const std::vector<Source>& sources) {
    const TransformGraph spanned = expand(catalogue, ask, sources);
    std::vector<std::vector<Refusal>> found;
    if (!spanned.targets.empty()) return found;
    std::vector<Refusal> asked;
    std::set<std::string> refused;
    for (const Refusal& refusal : spanned.refused)
        if (refusal.asked) {
            asked.push_back(refusal);
            refused.insert(refusal.transition);
        }
    const Kinds kinds(catalogue, ask, sources);
    for (std::size_t size = 1; size <= kMostMissing && found.empty(); ++size)
        each_set(asked.size(), size, [&](const std::vector<std::size_t>& set) {
            std::set<std::string> left = refused;
            std::vector<Refusal> missing;
            for (const std::size_t i : set) {
                left.erase(asked[i].transition);
                missing.push_back(asked[i]);
            }
            if (found.size() < kMostSets && kinds.joined_without(left)) found.push_back(missing);
        });
    return found;
}

}  // namespace edgewise
