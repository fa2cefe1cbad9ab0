#include "cli/chart/chart_sweep.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <map>

#include "graph/errors.hpp"
#include "request/input.hpp"
#include "request/numbers.hpp"

namespace edgewise::cli {
namespace {

constexpr double kMostValues = 1000;

using Words = std::vector<std::string>;

/// Options that are one number, and the settings that they are.
const std::map<std::string, std::string>& plain_options() {
    static const std::map<std::string, std::string> options = {
        {"frames", "turntable"},  {"turntable", "turntable"},   {"perspective", "perspective"},
        {"zoom", "zoom"},         {"threads", "threads"},       {"max-error", "max_error"},
        {"max-time", "max_time"}, {"max-memory", "max_memory"}, {"range", "range"},
        {"zero", "zero"},         {"outside", "outside"},       {"time", "time"},
        {"channel", "channel"}};
    return options;
}

/// Options of one number an axis, and what the others are where nobody says.
const std::map<std::string, const char*>& axis_options() {
    static const std::map<std::string, const char*> options = {{"rotate", "0"},    {"scale", "1"},
                                                               {"translate", "0"}, {"spacing", ""},
                                                               {"about", ""},      {"size", ""}};
    return options;
}

std::string known_options() {
    Words names;
    for (const auto& [name, place] : plain_options()) names.push_back(name);
    for (const auto& [name, rest] : axis_options()) names.push_back(name + "[.x|.y|.z]");
    std::sort(names.begin(), names.end());
    return fmt::format("{}", fmt::join(names, ", "));
}

std::size_t axes_of(const JobOptions& options) {
    return inspected(options.input, selection_of(options)).header.volume ? 3 : 2;
}

/// All parts alike: "64x64", "1.5".
std::string whole_text(const JobOptions& options, const std::string& name,
                       const std::string& value) {
    if (name != "size") return value;
    const bool cube = options.job->of_points() && axes_of(options) == 3;
    return cube ? fmt::format("{0}x{0}x{0}", value) : fmt::format("{0}x{0}", value);
}

std::string part_text(const JobOptions& options, const std::string& name, std::size_t axis,
                      const std::string& value) {
    const bool picture = name == "size" && options.job->of_rays();
    const std::size_t axes = picture ? 2 : axes_of(options);
    if (name == "rotate" && axes == 2 && axis == 2) return value;
    if (axis >= axes || (name == "rotate" && axes == 2))
        throw RequestError(fmt::format("--sweep {}: there are {} axes", name, axes));
    const char separator = name == "size" ? 'x' : ',';
    const auto there = options.text(name);
    Words parts = there ? split(*there, separator) : Words(axes, axis_options().at(name));
    if (there && parts.size() == 1) parts.resize(axes, parts[0]);
    if (parts.size() != axes || parts[0].empty())
        throw RequestError(fmt::format(
            "--sweep {}: the other axes are not known; give --{} for all of them too", name, name));
    parts[axis] = value;
    return fmt::format("{}", fmt::join(parts, std::string(1, separator)));
}

}  // namespace

JobOptions Sweep::at(const JobOptions& options, double value) const {
    JobOptions changed = options;
    const std::string text = fmt::format("{}", value);
    if (const auto plain = plain_options().find(option); plain != plain_options().end()) {
        changed.put(plain->second, text);
        return changed;
    }
    const std::size_t dot = option.find('.');
    const std::string name = option.substr(0, dot);
    changed.put(name, dot == std::string::npos
                          ? whole_text(options, name, text)
                          : part_text(options, name,
                                      static_cast<std::size_t>(option[dot + 1] - 'x'), text));
    return changed;
}

Sweep sweep_of(const std::string& text) {
    const auto refuse = [&](const std::string& what) {
        throw RequestError(fmt::format("--sweep {}: {}", text, what));
    };
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos) refuse("expected OPTION=FROM:TO:STEP");
    Sweep sweep;
    sweep.option =
        text.substr(text.starts_with("--") ? 2 : 0, equals - (text.starts_with("--") ? 2 : 0));
    const std::size_t dot = sweep.option.find('.');
    const std::string axis = dot == std::string::npos ? "x" : sweep.option.substr(dot + 1);
    const bool plain = plain_options().contains(sweep.option);
    if (!plain && (!axis_options().contains(sweep.option.substr(0, dot)) ||
                   (axis != "x" && axis != "y" && axis != "z")))
        refuse("there is no such number to sweep; there are " + known_options());
    const Words ends = split(std::string_view(text).substr(equals + 1), ':');
    if (ends.size() != 3) refuse("expected OPTION=FROM:TO:STEP");
    const double from = number_of("--sweep", ends[0]), to = number_of("--sweep", ends[1]),
                 step = number_of("--sweep", ends[2]);
    if (step == 0 || (to - from) / step < 0) refuse("STEP does not lead from FROM to TO");
    // TO is reached although steps of 0.1 are not exact.
    const double count = std::floor((to - from) / step + 1e-9) + 1;
    if (count > kMostValues) refuse(fmt::format("{} values are beyond {}", count, kMostValues));
    for (int i = 0; i < count; ++i) {
        // 0.1 * 3 is written as 0.3: nobody meant more than twelve digits.
        sweep.values.push_back(std::stod(fmt::format("{:.12g}", from + i * step)));
    }
    return sweep;
}

}  // namespace edgewise::cli
