#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "cli/audit/audit.hpp"
#include "cli/audit/audit_fixed.hpp"
#include "cli/session/report.hpp"
#include "measure/quantiles.hpp"

namespace edgewise::cli {
namespace {

using Json = nlohmann::ordered_json;
using Requests = std::vector<const AuditedRequest*>;
using Values = std::vector<double>;

/// Below this errors are the rounding of f32, and no ratio of them says anything.
constexpr double kLeastError = 1e-6;

void put_regrets(Json& json, const Requests& requests) {
    Values regrets;
    int violations = 0, error = 0, bytes = 0, seconds = 0;
    double worst = 0;
    for (const AuditedRequest* request : requests) {
        const Verdict verdict = judge(*request);
        regrets.push_back(verdict.regret);
        violations += !verdict.kept();
        error += !verdict.error_kept;
        bytes += !verdict.bytes_kept;
        seconds += !verdict.seconds_kept;
        if (!verdict.error_kept)
            worst = std::max(worst, request->chosen().error->nrmse / *request->budget.error);
    }
    json["regret_median"] = median(regrets);
    json["regret_geomean"] = geometric_mean(regrets);
    json["regret_p95"] = quantile(regrets, 0.95);
    json["regret_max"] = quantile(regrets, 1);
    json["violations"] = violations;
    json["broken"] = {{"error", error},
                      {"error_worst_over_budget", error ? Json(worst) : Json()},
                      {"bytes", bytes},
                      {"seconds", seconds}};
}

Json spread(const Values& ratios) {
    Values logs;
    for (const double ratio : ratios) logs.push_back(std::abs(std::log(ratio)));
    return {{"count", ratios.size()},         {"p05", quantile(ratios, 0.05)},
            {"p25", quantile(ratios, 0.25)},  {"median", median(ratios)},
            {"p75", quantile(ratios, 0.75)},  {"p95", quantile(ratios, 0.95)},
            {"median_abs_log", median(logs)}, {"p90_abs_log", quantile(logs, 0.9)}};
}

/// What choosing is worth, of the requests that have a plain path.
void put_value(Json& json, const Requests& requests) {
    Values values;
    for (const AuditedRequest* request : requests)
        if (const std::optional<double> value = value_of(*request)) values.push_back(*value);
    json["value_requests"] = values.size();
    json["value_geomean"] = values.empty() ? Json() : Json(geometric_mean(values));
    json["value_least"] = values.empty() ? Json() : Json(quantile(values, 0));
}

template <class Take>
void each_path(const Requests& requests, const Take& take) {
    for (const AuditedRequest* request : requests)
        for (const MeasuredPath& path : request->paths)
            if (path.measured()) take(*request, path);
}

void put_times(Json& json, const Requests& requests) {
    Values chosen, all, taus;
    each_path(requests, [&](const AuditedRequest&, const MeasuredPath& path) {
        const double ratio = path.predicted.seconds / path.typical();
        all.push_back(ratio);
        if (path.chosen) chosen.push_back(ratio);
    });
    for (const AuditedRequest* request : requests) {
        Values predicted, measured;
        each_path({request}, [&](const AuditedRequest&, const MeasuredPath& path) {
            predicted.push_back(path.predicted.seconds);
            measured.push_back(path.typical());
        });
        const double tau = kendall_tau(predicted, measured);
        if (predicted.size() > 2 && std::isfinite(tau)) taus.push_back(tau);
    }
    double sum = 0;
    for (const double tau : taus) sum += tau;
    const Json of_chosen = spread(chosen);
    json["time_ratio_median"] = of_chosen["median"];
    json["time_ratio_median_abs_log"] = of_chosen["median_abs_log"];
    json["time_ratio_p90_abs_log"] = of_chosen["p90_abs_log"];
    json["time_ratio"] = of_chosen;
    json["time_ratio_of_paths"] = spread(all);
    json["kendall_tau"] = taus.empty() ? Json() : Json(sum / double(taus.size()));
    json["kendall_tau_least"] = taus.empty() ? Json() : Json(quantile(taus, 0));
}

/// The share of measured medians within the interval that predictions carry, where they do.
void put_coverage(Json& json, const Requests& requests) {
    int with = 0, within = 0, below = 0, chosen = 0, chosen_within = 0;
    each_path(requests, [&](const AuditedRequest&, const MeasuredPath& path) {
        const Json predicted = to_json(path.predicted);
        const Json low = predicted.value("seconds_low", Json());
        const Json high = predicted.value("seconds_high", Json());
        if (!low.is_number() || !high.is_number()) return;
        const double seconds = path.typical();
        const bool inside = low.get<double>() <= seconds && seconds <= high.get<double>();
        ++with;
        within += inside;
        below += seconds < low.get<double>();
        chosen += path.chosen;
        chosen_within += path.chosen && inside;
    });
    if (with == 0) return;
    json["interval"] = {{"paths", with},
                        {"covered", double(within) / with},
                        {"below", double(below) / with},
                        {"chosen_covered", chosen ? Json(double(chosen_within) / chosen) : Json()}};
}

void put_errors(Json& json, const Requests& requests) {
    Values ratios;
    int inside = 0, unknown = 0, below = 0;
    each_path(requests, [&](const AuditedRequest&, const MeasuredPath& path) {
        if (!path.error) return;
        if (!path.predicted.known) {
            ++unknown;
            return;
        }
        const double ratio =
            std::max(path.predicted.error, kLeastError) / std::max(path.error->nrmse, kLeastError);
        ratios.push_back(ratio);
        inside += ratio >= 1 && ratio <= 3;
        below += ratio < 1;
    });
    json["error_ratio"] = spread(ratios);
    const double count = std::max(1.0, double(ratios.size()));
    json["error_ratio"]["within_1_3"] = inside / count;
    json["error_ratio"]["below_1"] = below / count;
    json["error_ratio"]["unknown"] = unknown;
}

/// The expected peak against what the system shows; and the bound that budgets are held against
/// against what was counted, reserves on both sides.
void put_bytes(Json& json, const Requests& requests) {
    Values chosen, all, counted;
    each_path(requests, [&](const AuditedRequest&, const MeasuredPath& path) {
        counted.push_back(path.predicted.bytes / path.bytes);
        const double ratio =
            path.predicted.expected_bytes() / path.resident_bytes.value_or(path.bytes);
        all.push_back(ratio);
        if (path.chosen) chosen.push_back(ratio);
    });
    json["bytes_ratio"] = spread(chosen);
    json["bytes_ratio_of_paths"] = spread(all);
    json["counted_ratio_of_paths"] = spread(counted);
}

void put_counts(Json& json, const Requests& requests, std::size_t asked) {
    std::size_t run = 0, given_up = 0, failed = 0;
    for (const AuditedRequest* request : requests)
        for (const MeasuredPath& path : request->paths) {
            run += path.measured();
            given_up += path.given_up.has_value();
            failed += !path.failure.empty();
        }
    json["requests"] = requests.size();
    json["failed"] = asked - requests.size();
    json["paths"] = run;
    json["paths_cancelled"] = given_up;
    json["paths_failed"] = failed;
}

Json summary_of(const Requests& requests, std::size_t asked) {
    Json json;
    if (!requests.empty()) {
        put_regrets(json, requests);
        put_value(json, requests);
        put_times(json, requests);
        put_coverage(json, requests);
        put_errors(json, requests);
        put_bytes(json, requests);
        json["fixed_path"] = fixed_paths(requests);
        json["others"] = rules_of_others(requests);
        const double fixed = json["fixed_path"]["regret_geomean"].get<double>() - 1;
        const double ours = json["regret_geomean"].get<double>() - 1;
        json["gap_closed"] = fixed > 0 ? Json(1 - ours / fixed) : Json();
    }
    put_counts(json, requests, asked);
    return json;
}

}  // namespace

Json audit_summary(const std::vector<AuditedRequest>& requests) {
    Requests all, held_out;
    std::size_t held_out_asked = 0;
    for (const AuditedRequest& request : requests) {
        held_out_asked += request.asked.held_out;
        if (request.code != 0) continue;
        all.push_back(&request);
        if (request.asked.held_out) held_out.push_back(&request);
    }
    Json json = summary_of(all, requests.size());
    if (held_out_asked > 0) json["held_out"] = summary_of(held_out, held_out_asked);
    return json;
}

}  // namespace edgewise::cli
