// What the examples with a graph of their own share: plain edges, and a path that is planned, run,
// printed and checked.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "planner/planner.hpp"
#include "planner/profile.hpp"
#include "runtime/runtime.hpp"

namespace edgewise {

/// What data are, of one kind and size.
struct Kind {
    std::string space, content;
    Extent extent;
    Type type = Type::f32;

    Representation what() const {
        Representation what;
        what.space = space;
        what.content = content;
        what.extent = extent;
        what.type = type;
        return what;
    }
};

/// Such data, not yet filled in.
inline std::shared_ptr<Data> data_of(const Kind& kind, MemoryBudget& memory) {
    return std::make_shared<Data>(Data::make(kind.what(), &memory));
}

using Kernel = std::function<void(const Data& in, Data& out, std::pmr::memory_resource*)>;

/// An edge that does not look at what is asked for.
inline Transition edge_of(const std::string& name,
                          const std::vector<std::pair<std::string, std::string>>& joins,
                          const std::function<Offer(const Representation&)>& offer,
                          const std::function<Work(const Offer&)>& work,
                          const std::function<Error(const Offer&)>& error, const Kernel& run) {
    Transition edge{.name = name, .joins = joins};
    edge.offer = [offer](const Representation& from, const Ask&, const Parameters&) {
        return offer(from);
    };
    edge.work = [work](const Offer& made, const Ask&, int) { return work(made); };
    edge.error = [error](const Offer& made, const Ask&) { return error(made); };
    edge.run = [run](const Offer&, const Ask&, const Data& in, Data& out, const Region&,
                     Context& context) { run(in, out, context.memory); };
    return edge;
}

/// An edge that always makes the same by the same work.
inline Transition plain_edge(const std::string& name, const std::string& from, const Kind& made,
                             const Work& work, const Error& error, const Kernel& run) {
    return edge_of(
        name, {{from, made.what().kind()}},
        [made](const Representation& what) { return Offer{.from = what, .to = made.what()}; },
        [work](const Offer&) { return work; }, [error](const Offer&) { return error; }, run);
}

/// What a program asks for, and the answer that it knows.
struct Question {
    const Catalogue& edges;
    Job job;
    std::shared_ptr<const Data> input;
    std::vector<double> answer;
    double within;  // RMS of result - answer: as promised by the plan, and as measured
    MemoryBudget& memory;
    Label start = {};  // the error that the input has already
};

/// What a path is demanded to use, so many times; nothing: the planner is free.
struct Via {
    std::string edge = {};
    int times = 1;
};

/// " 3 x morphology.step ...": each step once, in the order of its first run.
inline std::string counted_steps(const std::vector<std::string>& steps) {
    std::vector<std::pair<std::string, int>> counts;
    for (const std::string& step : steps) {
        auto same = std::find_if(counts.begin(), counts.end(),
                                 [&](const auto& entry) { return entry.first == step; });
        if (same == counts.end()) same = counts.insert(same, {step, 0});
        ++same->second;
    }
    std::string text;
    for (const auto& [step, count] : counts) text += " " + std::to_string(count) + " x " + step;
    return text;
}

/// Plans a path and runs it. @return whether its result is as close to the answer as was stated
inline bool is_right(const Question& question, const Via& via) {
    PlanOptions options;
    if (!via.edge.empty())
        options.demands.via.assign(std::size_t(via.times), demand_of(via.edge, question.edges));
    Request want;
    want.job = question.job;
    want.budget.error = question.within;
    const Scene scene;  // its range is 1: an RMS is an NRMSE
    const Ask ask{want, scene};
    const Answer found = plan(question.edges, ask, {{question.input->what, question.start}},
                              default_profile(question.edges), options);
    if (!found.plan) return std::puts(found.problem.c_str()), false;

    std::shared_ptr<const Data> result;
    double seconds = INFINITY, squares = 0;
    for (int repeated = 0; repeated < 3; ++repeated)  // the first run finds cold caches
        seconds = std::min(seconds, run(*found.plan, ask, question.input,
                                        [&](int, auto made) { result = std::move(made); },
                                        {.memory = &question.memory})
                                        .seconds);
    for (std::size_t i = 0; i < question.answer.size(); ++i) {
        const bool f64 = result->what.type == Type::f64;
        const double value = f64 ? result->as<double>()[i] : result->as<float>()[i];
        squares += std::pow(value - question.answer[i], 2);
    }
    const double error = std::sqrt(squares / static_cast<double>(question.answer.size()));
    const Predicted& predicted = found.plan->predicted;
    std::printf(
        "%s%s\n    %.1e s (predicted %.1e), error %.1e (predicted %.1e)\n",
        via.edge.empty() ? "chosen: " : "demanded:", counted_steps(found.plan->texts()).c_str(),
        seconds, predicted.seconds, error, predicted.error);
    return error <= question.within;
}

/// Whether the results of all these paths are right.
inline bool are_right(const Question& question, const std::vector<Via>& paths) {
    bool right = true;
    for (const Via& via : paths) right = is_right(question, via) && right;
    return right;
}

}  // namespace edgewise
