#include "cli/audit/audit_fixed.hpp"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "engine/paths.hpp"
#include "measure/quantiles.hpp"

namespace edgewise::cli {
namespace {

using Json = nlohmann::ordered_json;

/// What one path would lose in one request.
double loss_of(const std::string& steps, const AuditedRequest& request, double best, bool& serves) {
    const MeasuredPath* most_accurate = nullptr;
    for (const MeasuredPath& path : request.paths) {
        if (!path.measured()) continue;
        const bool keeps = keeps_budgets(path, request);
        if (keeps && path_text(path.steps) == steps) {
            serves = true;
            return objective(path, request) / best;
        }
        const bool known = path.error.has_value();
        const auto beats = [&](const MeasuredPath& other) {
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
        for (const MeasuredPath& path : request->paths)
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

/// What a library always does, and to which families.
struct Rule {
    const char *library, *text;
    std::string path;
    const char* families;  // their names begin so
};

Json followed(const Rule& rule, const std::vector<const AuditedRequest*>& requests) {
    std::vector<double> losses;
    int served = 0;
    for (const AuditedRequest* request : requests) {
        if (!request->family.starts_with(rule.families)) continue;
        bool serves = false;
        losses.push_back(
            loss_of(rule.path, *request, objective(*judge(*request).best, *request), serves));
        served += serves;
    }
    Json json = {{"library", rule.library},
                 {"rule", rule.text},
                 {"steps", rule.path},
                 {"requests", losses.size()},
                 {"serves", served}};
    for (const char* key : {"regret_geomean", "regret_median", "regret_p95", "regret_max"})
        json[key] = nullptr;
    if (losses.empty()) return json;
    json["regret_geomean"] = geometric_mean(losses);
    json["regret_median"] = median(losses);
    json["regret_p95"] = quantile(losses, 0.95);
    json["regret_max"] = quantile(losses, 1);
    return json;
}

}  // namespace

Json rules_of_others(const std::vector<const AuditedRequest*>& requests) {
    const Rule rules[] = {
        {"SciPy", "ndimage.affine_transform: always a cubic B-spline, prefiltered",
         path_text({"filter.prefilter", "warp.backward/filter=bspline3"}), "warp"},
        {"OpenCV", "warpAffine: always linear", path_text({"warp.backward/filter=foh"}), "warp 2D"},
        {"VTK", "volume mappers as its examples set them up: trilinear, a sample every spacing",
         path_text({"project.ray_cast/filter=foh/step=1"}), "render"}};
    Json json = Json::array();
    for (const Rule& rule : rules) json.push_back(followed(rule, requests));
    return json;
}

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
