#include <algorithm>

#include "evaluation/audit/audit.hpp"
#include "measure/quantiles.hpp"

namespace edgewise {
namespace {

/// Least error that ratios tell apart: below it is the rounding of f32.
constexpr double kLeastError = 1e-6;

bool accurate(const MeasuredPath& path, const Audited& request) {
    // What it is compared with is drawn by the preview, not measured here.
    if (request.budget.like && path.predicted.likeness != Likeness::alike) return false;
    if (!request.budget.error) return true;
    if (!path.error) return false;
    // Without sampling the interval is the error itself.
    return (path.chosen ? path.error->low : path.error->nrmse) <= *request.budget.error;
}

bool small(const MeasuredPath& path, const Audited& request) {
    return !request.budget.bytes ||
           std::max(path.bytes, path.resident_bytes.value_or(0)) <= *request.budget.bytes;
}

bool in_time(const MeasuredPath& path, const Audited& request) {
    return !request.budget.seconds || path.typical() <= *request.budget.seconds;
}

/// The budgets other than that of the error.
bool fits(const MeasuredPath& path, const Audited& request) {
    // The fastest that keeps the others is the one that time could be asked of.
    return small(path, request) && (request.minimize == Minimize::time || in_time(path, request));
}

/// What there is to compare with where no path keeps the error budget.
std::vector<const MeasuredPath*> most_accurate(const Audited& request) {
    const MeasuredPath* least = nullptr;
    for (const MeasuredPath& path : request.paths)
        if (path.measured() && path.error && fits(path, request) &&
            (!least || path.error->nrmse < least->error->nrmse))
            least = &path;
    std::vector<const MeasuredPath*> equals;
    for (const MeasuredPath& path : request.paths)
        if (least && path.measured() && path.error && fits(path, request) &&
            path.error->low <= least->error->high)
            equals.push_back(&path);
    return equals;
}

}  // namespace

const MeasuredPath& Audited::chosen() const {
    return *std::find_if(paths.begin(), paths.end(),
                         [](const MeasuredPath& path) { return path.chosen; });
}

bool keeps_budgets(const MeasuredPath& path, const Audited& request) {
    return path.measured() && accurate(path, request) && fits(path, request);
}

double objective(const MeasuredPath& path, const Audited& request) {
    switch (request.minimize) {
        case Minimize::time:
            return path.typical();
        case Minimize::memory:
            return path.bytes;
        case Minimize::error:
            break;
    }
    return std::max(path.error ? path.error->nrmse : 0.0, kLeastError);
}

std::optional<double> value_of(const Audited& request) {
    if (!request.plain || !request.plain->measured()) return std::nullopt;
    const double choosing = request.planning_seconds - request.shared_seconds;
    return request.plain->typical() / (choosing + request.chosen().typical());
}

Verdict judge(const Audited& request) {
    const MeasuredPath& chosen = request.chosen();
    std::vector<const MeasuredPath*> rivals;
    for (const MeasuredPath& path : request.paths)
        if (keeps_budgets(path, request)) rivals.push_back(&path);
    Verdict verdict;
    if (rivals.empty()) rivals = most_accurate(request);
    if (rivals.empty()) rivals.push_back(&chosen);
    verdict.best = *std::min_element(rivals.begin(), rivals.end(),
                                     [&](const MeasuredPath* a, const MeasuredPath* b) {
                                         return objective(*a, request) < objective(*b, request);
                                     });
    verdict.regret = objective(chosen, request) / objective(*verdict.best, request);
    const Budget& budget = request.budget;
    // A likeness is a wish: where no plan has it the most accurate one was chosen.
    verdict.error_kept = budget.like || accurate(chosen, request);
    verdict.bytes_kept = small(chosen, request);
    verdict.seconds_kept = in_time(chosen, request);
    return verdict;
}

}  // namespace edgewise
