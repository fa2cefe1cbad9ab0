
#include "settings/jobs.hpp"
#include "settings/readers.hpp"

namespace edgewise {
namespace {

constexpr const char* kBudgets = "Budgets";
constexpr std::int64_t kMostThreads = 1024, kMostRanks = 1 << 24;

/// Its result is that of a formula; else how good it is matters as much as how fast.
bool is_exact(Job job) { return has::filter(job) || has::radon(job); }

/// How a budget was typed, so that messages speak of it in the same unit.
std::string typed_as(const SettingValue& value) { return value.is_text() ? value.text() : ""; }

/// A budget as it was typed, where it still says the same.
template <typename Read>
SettingValue budget_told(const std::optional<double>& budget, const std::string& typed, Read read) {
    return budget && !typed.empty() && read(typed) == *budget ? SettingValue(typed)
                                                              : reads::told(budget);
}

void take_error(Query& query, const SettingValue& value, const Reading& reading) {
    const std::string text = reads::word(value, reading.called());
    query.max_error.reset();
    query.notation.error.clear();
    query.like_linear = text == "linear";
    if (query.like_linear) return;
    query.max_error = error_budget(text);
    query.notation.error = typed_as(value);
}

SettingValue error_of(const Query& query) {
    return query.like_linear ? SettingValue("linear")
                             : budget_told(query.max_error, query.notation.error, error_budget);
}

void take_time(Query& query, const SettingValue& value, const Reading& reading) {
    query.max_time = time_budget(reads::word(value, reading.called()));
    query.notation.seconds = typed_as(value);
}

SettingValue time_told(const Query& query) {
    return budget_told(query.max_time, query.notation.seconds,
                       [](const std::string& text) { return time_budget(text); });
}

void take_memory(Query& query, const SettingValue& value, const Reading& reading) {
    query.max_memory = memory_budget(reads::word(value, reading.called()));
    query.notation.bytes = typed_as(value);
}

SettingValue memory_told(const Query& query) {
    return budget_told(query.max_memory, query.notation.bytes, memory_budget);
}

Message help_of_error(Job job) {
    if (is_exact(job))
        return "NRMSE as 0.01 or 1%, or PSNR as 40dB; default: equal but for rounding";
    return "NRMSE as 0.01 or 1%, or PSNR as 40dB; default linear: as good as linear interpolation";
}

/// Edges by their names.
template <typename Member>
Reader edges(Member which) {
    return {.take =
                [which](Query& query, const SettingValue& value, const Reading& reading) {
                    std::vector<Demand> demands;
                    for (const SettingValue& one : value.values())
                        demands.push_back(demand_of(reads::word(one, reading.called()),
                                                    reading.edges, query.job));
                    query.demands.*which = std::move(demands);
                },
            .tell =
                [which](const Query& query) {
                    SettingValue::List texts;
                    for (const Demand& demand : query.demands.*which)
                        texts.emplace_back(demand.name + demand.with.text());
                    return texts.empty() ? SettingValue() : SettingValue(texts);
                },
            .kind = Reader::Kind::list};
}

}  // namespace

Rows budget_settings() {
    static const std::vector<QuerySetting> rows = grouped(
        kBudgets,
        {{"max_error", "E", help_of_error, has::neither_mesh,
          reads::with_limits({.least = 0, .allowed = {"linear"}}, {take_error, error_of})},
         {"range", "R", "the difference in values that counts as an error of 1", has::neither_mesh,
          reads::number_in(Limits::above(0), &Query::range)},
         {"reference", "FIELD", "what the samples mean: spline, linear or nearest", has::views,
          reads::choice({"spline", "linear", "nearest"}, &Query::reference)},
         {"max_time", "T", "50ms, 2s, 1min", has::any,
          reads::with_limits(Limits::from(0), {take_time, time_told})},
         {"max_memory", "M", "512MiB, 2GB: peak of the process", has::any,
          reads::with_limits(Limits::from(0), {take_memory, memory_told})},
         {"minimize", "WHAT", "time, error or memory", has::neither_mesh,
          reads::choice({"time", "error", "memory"}, &Query::minimize)},
         {"threads", "N", "default: the cores this process may use", has::any,
          reads::whole(1, kMostThreads, &Query::threads)},
         {"ranks", "N", "plan: memories that samples lie in; default: the machine's",
          has::neither_mesh, reads::whole(1, kMostRanks, &Query::ranks)},
         {"planner", "estimate|pilot|exhaustive", "models alone, contenders measured, or all paths",
          has::neither_mesh, reads::choice({"estimate", "pilot", "exhaustive"}, &Query::planner)},
         {"planning_time", "T", "pilot, exhaustive: then the best so far", has::neither_mesh,
          reads::duration(&Query::planning_time)},
         QuerySetting{"strict", "", "a measured budget that is broken: exit 1, no output", has::any,
                      reads::flag(&Query::strict)}
             .of_output(),
         {"via", "NAME[/key=value]...",
          "an edge or a family that must be on the path; filters: zoh nearest, foh linear",
          has::any, edges(&Demands::via)},
         {"without", "NAME[/key=value]...", "an edge or a family that must not", has::any,
          edges(&Demands::without)}});
    return rows;
}

}  // namespace edgewise
