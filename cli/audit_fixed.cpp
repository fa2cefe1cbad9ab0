#include "cli/audit_fixed.hpp"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "cli/paths.hpp"
#include "cli/quantiles.hpp"

namespace edgewise::cli {
namespace {

using Json = nlohmann::ordered_json;

/// What one path would lose in one request.
double loss_of(const std::string& steps, const AuditedRequest& request, double best, bool& serves) {
    const AuditedPath* most_accurate = nullptr;
    for (const AuditedPath& path : request.paths) {
        if (!path.measured()) continue;
        const bool keeps = keeps_budgets(path, request);
        if (keeps && path_text(path.steps) == steps) {
            serves = true;
            return objective(path, request) / best;
        }
        const bool known = path.error.has_value();
        const auto beats = [&](const AuditedPath& other) {
            return path.error->nrmse < other.error->nrmse;
        };
        if (known && (!most_accurate || beats(*most_accurate))) most_accurate = &path;
    }
    serves = false;
    return most_accurate ? std::max(1.0, objective(*most_accurate, request) / best) : 1;
}

/// The path that loses least over all requests of a family.
Json best_fixed(const std::vector<const AuditedRequest*>& family, std::vector<double>& regrets) {
    std::set<std::string> candidates;
    for (const AuditedRequest* request : family)
        for (const AuditedPath& path : request->paths)
            if (path.measured()) candidates.insert(path_text(path.steps));
    Json best;
    std::vector<double> least;
    for (const std::string& steps : candidates) {
        std::vector<double> losses;
        int served = 0;
        for (const AuditedRequest* request : family) {
            bool serves = false;
            const double value = objective(*judge(*request).best, *request);
            losses.push_back(loss_of(steps, *request, value, serves));
            served += serves;
        }
        const double mean = geometric_mean(losses);
        if (!least.empty() && mean >= geometric_mean(least)) continue;
        least = losses;
        best = {{"steps", steps},
                {"regret_geomean", mean},
                {"requests", family.size()},
                {"serves", served}};
    }
    regrets.insert(regrets.end(), least.begin(), least.end());
    return best;
}

}  // namespace

Json fixed_paths(const std::vector<const AuditedRequest*>& requests) {
    std::map<std::string, std::vector<const AuditedRequest*>> families;
    for (const AuditedRequest* request : requests) families[request->family].push_back(request);
    std::vector<double> regrets;
    Json by_family = Json::object();
    for (const auto& [name, family] : families) by_family[name] = best_fixed(family, regrets);
    return {{"regret_geomean", geometric_mean(regrets)},
            {"regret_median", median(regrets)},
            {"regret_p95", quantile(regrets, 0.95)},
            {"regret_max", quantile(regrets, 1)},
            {"rule",
             "the best single path of each family, chosen afterwards; where it is not there or "
             "breaks a budget, the most accurate path"},
            {"families", by_family}};
}

}  // namespace edgewise::cli
