#include "engine/way_out.hpp"

#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "engine/planned.hpp"
#include "engine/rivals.hpp"
#include "planner/relax.hpp"
#include "request/quantities.hpp"

namespace edgewise {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kDigits = 4;               // so rounding adds at most 0.1 %
constexpr double kPages = 1.5 * 0x1p20;  // resident bytes that two runs of a command differ by

/// What follows the number of a budget as it was typed.
std::string unit_of(const std::string& typed) {
    return typed.substr(typed.find_last_of("0123456789.") + 1);
}

/// The least number of four digits that `read` takes as no less than `value`.
template <class Read>
std::string rounded_up(double value, const std::string& unit, const Read& read) {
    if (!(value > 0)) return "0" + unit;
    const double step = std::pow(10.0, std::floor(std::log10(value)) - (kDigits - 1));
    for (double count = std::ceil(value / step - 1e-6);; ++count) {
        // No powers of ten: bytes are written out.
        const std::string text = value >= 1e5
                                     ? fmt::format("{:.0f}{}", count * step, unit)
                                     : fmt::format("{:.{}g}{}", count * step, kDigits + 1, unit);
        if (read(text)) return text;
    }
}

/// The largest number of decibels, with two places, that `read` takes as no less than `error`.
template <class Read>
std::string decibels(double error, const std::string& unit, const Read& read) {
    for (double count = std::floor(-2000 * std::log10(error) + 1e-6);; --count) {
        const std::string text = fmt::format("{:g}{}", count / 100, unit);
        if (read(text)) return text;
    }
}

/// The first number of a unit's that is too long to be read at a glance.
constexpr double kLong = 1e4;

std::string text_of(const Demand& demand) { return demand.name + demand.with.text(); }

/// A budget as it was typed, or in words of its own where a program gave it.
template <class Text>
std::string given(const std::optional<double>& value, const std::string& typed, const Text& text) {
    if (!typed.empty() || !value) return typed;
    return text(*value);
}

std::vector<SettingChange> changes_of(const Relaxed& relaxed, const Planned& planned) {
    std::vector<SettingChange> changes;
    const Query& o = planned.query;
    const Notation& as = o.notation;
    const std::string error = o.like_linear
                                  ? "linear"
                                  : given(o.max_error, unit_of(as.error).empty() ? "" : as.error,
                                          [](double e) { return error_limit_text(e); });
    if (relaxed.error && std::isinf(*relaxed.error))
        changes.push_back({.setting = "max_error", .instead = error});
    else if (relaxed.error)
        changes.push_back({"max_error", error_limit_text(*relaxed.error, as.error), error});
    if (relaxed.seconds)
        changes.push_back(
            {"max_time", time_text(*relaxed.seconds, as.seconds),
             given(o.max_time, as.seconds, [](double seconds) { return time_text(seconds); })});
    if (relaxed.bytes) {
        const auto mebibytes = [](double bytes) {
            return fmt::format("{:.6g}MiB", bytes / 0x1p20);
        };
        changes.push_back({"max_memory", memory_text(*relaxed.bytes - kPages, as.bytes),
                           o.max_memory
                               ? given(o.max_memory, as.bytes, mebibytes)
                               : fmt::format("the {:.0f} MiB there are",
                                             planned.want.budget.bytes.value_or(0) / 0x1p20)});
    }
    return changes;
}

std::vector<SettingChange> changes_of(const Dropped& dropped, const Demands& demands) {
    std::vector<SettingChange> changes;
    for (const std::size_t i : dropped.via)
        changes.push_back({.setting = "via", .instead = text_of(demands.via[i])});
    for (const std::size_t i : dropped.without)
        changes.push_back({.setting = "without", .instead = text_of(demands.without[i])});
    return changes;
}

Rounding rounding(const Notation& as) {
    return {[as](double error) { return error_budget(error_limit_text(error, as.error)); },
            [as](double seconds) { return time_budget(time_text(seconds, as.seconds)); },
            [as](double bytes) { return memory_budget(memory_text(bytes, as.bytes)) + kPages; }};
}

Message text_of(const std::vector<SettingChange>& changes) {
    std::vector<std::string> parts;
    for (const SettingChange& change : changes)
        parts.push_back((change.value
                             ? message("{} instead of {}", setting(change.setting, *change.value),
                                       change.instead)
                             : message("no {}", setting(change.setting, change.instead)))
                            .marked());
    return fmt::format("\n  {}", fmt::join(parts, " and "));
}

}  // namespace

std::string error_limit_text(double error, const std::string& like) {
    const auto enough = [&](const std::string& text) { return error_budget(text) >= error; };
    const std::string unit = unit_of(like);
    if (unit == "%") return rounded_up(100 * error, unit, enough);
    if (!unit.empty() && error > 0) return decibels(error, unit, enough);
    return rounded_up(error, "", enough);
}

std::string error_words(double error, const std::string& like) {
    const std::string unit = unit_of(like);
    if (unit == "%") return fmt::format("{:.3g} %", 100 * error);
    if (!unit.empty() && error > 0) return fmt::format("{:.1f} dB", -20 * std::log10(error));
    return fmt::format("{:.3g}", error);
}

std::string time_text(double seconds, const std::string& like) {
    const auto enough = [&](const std::string& text) { return time_budget(text) >= seconds; };
    if (!like.empty()) {
        const std::string unit = unit_of(like);
        const double count = seconds / time_budget("1" + unit);
        if (count < kLong) return rounded_up(count, unit, enough);
    }
    if (seconds < 1e-3) return rounded_up(seconds * 1e6, "us", enough);
    if (seconds < 1) return rounded_up(seconds * 1e3, "ms", enough);
    return rounded_up(seconds, "s", enough);
}

std::string memory_text(double bytes, const std::string& like) {
    const double most = bytes + kPages;
    const auto enough = [&](const std::string& text) { return memory_budget(text) >= most; };
    if (!like.empty()) {
        const std::string unit = unit_of(like);
        const double count = most / memory_budget("1" + unit);
        // Whoever typed bytes reads long numbers.
        if (count < kLong || unit.empty()) return rounded_up(count, unit, enough);
    }
    return rounded_up(most / 0x1p20, "MiB", enough);
}

WayOut way_out_of(const Planned& planned, Errors errors) {
    WayOut way_out;
    const auto drop = [&](bool budgets) {
        for (const Dropped& dropped :
             demands_to_drop(planned.engine.edges(), planned.ask(), planned.sources(),
                             planned.engine.machine(), planned.plan_options, budgets))
            way_out.demands.push_back(changes_of(dropped, planned.query.demands));
    };
    const auto paths = candidates_of(planned);
    Budget budget = planned.want.budget;
    if (errors == Errors::guessed) budget.error.reset();
    for (const Relaxed& relaxed : relaxed_budgets(*paths, budget, rounding(planned.query.notation)))
        way_out.budgets.push_back(changes_of(relaxed, planned));
    if (errors == Errors::guessed) return way_out;
    drop(true);
    if (!paths->all().empty()) return way_out;
    if (way_out.demands.empty()) {
        drop(false);
        way_out.then_budgets = !way_out.demands.empty();
    }
    if (way_out.demands.empty())
        way_out.missing = missing_edges(planned.engine.edges(), planned.ask(), planned.sources());
    return way_out;
}

Message text_of(const WayOut& way_out) {
    std::string text;
    for (const auto& changes : way_out.budgets) text += text_of(changes).marked();
    for (const auto& changes : way_out.demands) text += text_of(changes).marked();
    if (way_out.then_budgets) text += "\n  and a larger budget";
    if (!text.empty()) text = "; any of these lines makes one fit:" + text;
    for (const auto& set : way_out.missing) {
        text += "\n  there would be a path, were there not ";
        std::vector<std::string> parts;
        for (const Refusal& refusal : set)
            parts.push_back(
                fmt::format("{} refused: {}", refusal.transition, refusal.reason.marked()));
        text += fmt::format("{}", fmt::join(parts, ", and "));
    }
    return text;
}

}  // namespace edgewise
