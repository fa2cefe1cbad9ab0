#include "evaluation/calibrate/exam.hpp"

#include <cmath>

#include "evaluation/calibrate/prepared_trial.hpp"
#include "graph/errors.hpp"
#include "measure/repeated.hpp"
#include "planner/cost.hpp"

namespace edgewise {
namespace {

double predicted_seconds(const Plan& plan, const Request& want, const Profile& profile) {
    double sum = 0;
    for (const Step& step : plan.steps) {
        const std::string name = timing_name(*step.by, step.offer, want, step.work);
        sum += step.runs() * profile.seconds(name, step.work, profile.processors).seconds;
    }
    return sum;
}

double measured_seconds(const PreparedTrial& trial, const Plan& plan, int threads) {
    constexpr int kRuns = 5;
    trial.run(plan, threads);  // warm
    std::vector<double> seconds;
    for (int run = 0; run < kRuns; ++run) seconds.push_back(trial.run(plan, threads).seconds);
    return undisturbed(seconds);
}

}  // namespace

std::vector<double> missed_in_exams(const Profile& profile, Phantoms& phantoms,
                                    const Catalogue& edges, Listener& listener) {
    constexpr double kMost = 0.03;
    std::vector<double> missed;
    for (const EdgeTrial& exam : trials_of(edges, Trial::Part::exam)) {
        const PreparedTrial trial(exam.trial, phantoms, edges, listener);
        for (const Plan& plan : trial.paths(profile)) {
            const double predicted = predicted_seconds(plan, trial.looked.want, profile);
            if (predicted > kMost) continue;
            if (listener.stop()) throw Cancelled();
            missed.push_back(
                std::log(measured_seconds(trial, plan, profile.processors) / predicted));
        }
    }
    return missed;
}

}  // namespace edgewise
