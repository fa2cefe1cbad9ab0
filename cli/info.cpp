#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <fmt/format.h>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/request/errors.hpp"
#include "cli/request/request_options.hpp"
#include "cli/request/spoken.hpp"
#include "cli/request/user_folders.hpp"
#include "cli/session/report.hpp"
#include "cli/verbs/verbs.hpp"
#include "engine/facts/known_scene.hpp"
#include "graph/errors.hpp"
#include "io/channel_colours.hpp"
#include "measure/machine.hpp"
#include "request/input.hpp"
#include "request/outputs.hpp"
#include "runtime/memory_budget.hpp"
#include "scene/histogram.hpp"
#include "scene/statistics.hpp"
#include "settings/selection.hpp"

namespace edgewise::cli {
namespace {

using Json = nlohmann::ordered_json;

struct InfoOptions {
    std::string file;
    JobOptions asked;
    std::optional<std::string> json;
    bool quiet = false;
};

/// What is measured of samples; only this verb asks for histogram and spectrum.
struct OfSamples {
    Statistics statistics;
    Histogram histogram;
    RadialPower spectrum;
    std::optional<double> dynamic_range;  // [dB]; none where nothing varies
};

struct Facts {
    Input input;
    std::optional<OfSamples> measured;  // absent where something had to be selected first
    std::vector<store::Series> series;
    std::vector<std::string> channel_names;  // by number, "": none; empty: the file names none
    std::vector<Message> warnings;
};

template <class T>
Json axes_of(const T& values, int axes) {
    Json json = Json::array();
    for (int k = 0; k < axes; ++k) json.push_back(values[static_cast<std::size_t>(k)]);
    return json;
}

Json extent_of(const Extent& extent, int axes) {
    Json json = Json::array();
    for (int k = 0; k < axes; ++k) json.push_back(extent[k]);
    return json;
}

Json json_of(const Histogram& histogram) {
    return {{"low", histogram.low},
            {"high", histogram.high},
            {"counts", histogram.counts},
            {"samples", histogram.looked_at}};
}

Json json_of(const RadialPower& spectrum) {
    return {{"frequency", spectrum.frequency}, {"power", spectrum.power},
            {"share", spectrum.share},         {"bricks", spectrum.bricks},
            {"empty", spectrum.empty},         {"samples", spectrum.samples}};
}

/// The range over what cannot be told from noise: what is there at the highest frequencies, taken
/// as white, and at least the rounding of integers (uniform: a step over the root of 12).
std::optional<double> dynamic_range_of(const OfSamples& of, const Representation& what) {
    const double rounding =
        is_integer(what.type) ? std::abs(what.values.slope) / std::sqrt(12.0) : 0;
    const double range = of.statistics.high - of.statistics.low;
    const double floor = std::max(of.spectrum.white(), rounding);
    if (!(range > 0 && floor > 0)) return std::nullopt;
    return 20 * std::log10(range / floor);
}

/// Bars of how often values occur, from the least to the greatest, by the logarithm of the count.
std::string bars_of(const Histogram& histogram) {
    constexpr std::size_t kBars = 48;
    constexpr std::array<const char*, 9> kHeights = {" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
    const std::size_t bins = histogram.counts.size(), bars = std::min(kBars, bins);
    std::vector<double> heights(bars);
    for (std::size_t i = 0; i < bins; ++i)
        heights[i * bars / bins] += static_cast<double>(histogram.counts[i]);
    double most = 0;
    for (double& height : heights) most = std::max(most, height = std::log1p(height));
    std::string text;
    for (const double height : heights)
        text += kHeights[most > 0 ? static_cast<std::size_t>(std::ceil(8 * height / most)) : 0];
    return text;
}

/// The value that a share of all values is below, from a histogram.
double quantile_of(const Histogram& histogram, double share, bool integers) {
    double all = 0, below = 0;
    for (const std::int64_t count : histogram.counts) all += static_cast<double>(count);
    const auto bins = static_cast<double>(histogram.counts.size());
    const double width = (histogram.high - histogram.low) / std::max(1.0, bins);
    double value = histogram.low;
    for (std::size_t i = 0; i < histogram.counts.size() && below < share * all; ++i) {
        const auto count = static_cast<double>(histogram.counts[i]);
        if (count > 0)
            value = histogram.low +
                    width * (static_cast<double>(i) + std::min(1.0, (share * all - below) / count));
        below += count;
    }
    return integers ? std::round(value) + 0.0 : value;
}

/// Spacing with its unit: below a tenth of a millimetre in micrometres.
std::string spacing_text(const store::Header& header, int axes) {
    const bool small =
        header.unit == "mm" &&
        *std::max_element(header.spacing.begin(), header.spacing.begin() + axes) < 0.1;
    std::string text;
    for (int k = 0; k < axes; ++k)
        text += fmt::format("{}{:.6g}", k ? " x " : "",
                            header.spacing[static_cast<std::size_t>(k)] * (small ? 1000 : 1));
    return text + " " + (small ? "um" : header.unit.empty() ? "(no unit)" : header.unit);
}

Json json_of(const Facts& facts) {
    const store::Header& header = facts.input.header;
    const int axes = header.volume ? 3 : 2;
    Json json = {{"schema", 1},
                 {"file", facts.input.name},
                 {"kind", header.volume ? "volume" : "image"},
                 {"extent", extent_of(header.extent, axes)},
                 {"channels", header.channels},
                 {"channel_names", facts.channel_names},
                 {"colour", header.colour},
                 {"times", header.times},
                 {"spacing", axes_of(header.spacing, axes)},
                 {"unit", header.unit.empty() ? Json() : Json(header.unit)},
                 {"origin", axes_of(header.origin, axes)}};
    json["direction"] = Json::array();
    for (int k = 0; k < axes; ++k)
        json["direction"].push_back(axes_of(header.direction[static_cast<std::size_t>(k)], axes));
    json["orientation"] = header.orientation.empty() ? Json() : Json(header.orientation);
    json["type"] = name_of(header.type);
    json["value_unit"] = header.value_unit.empty() ? Json() : Json(header.value_unit);
    const bool there = facts.measured.has_value();
    const Statistics s = there ? facts.measured->statistics : Statistics{};
    json["range"] = there ? Json{s.low, s.high} : Json();
    json["mean"] = there ? Json(s.mean) : Json();
    json["non_finite"] = there ? Json(s.non_finite) : Json();
    json["occupied_box"] =
        there ? Json{axes_of(s.occupied.begin, axes), axes_of(s.occupied.end, axes)} : Json();
    json["occupied_fraction"] = there ? Json(s.occupied_fraction) : Json();
    json["bytes"] = there ? Json(facts.input.bytes()) : Json();
    json["histogram"] = there ? json_of(facts.measured->histogram) : Json();
    json["spectrum"] = there ? json_of(facts.measured->spectrum) : Json();
    const auto range = there ? facts.measured->dynamic_range : std::nullopt;
    json["dynamic_range"] = range ? Json(*range) : Json();
    json["format"] = header.format;
    json["level"] = header.level;
    json["levels"] = Json::array();
    for (const Extent& level : header.levels) json["levels"].push_back(extent_of(level, axes));
    json["warnings"] = spoken(facts.warnings);
    json["series"] = Json::array();
    for (const store::Series& series : facts.series)
        json["series"].push_back(
            {{"uid", series.uid}, {"text", series.text}, {"files", series.files}});
    return json;
}

/// Where no channel has a name there are none.
std::vector<std::string> channel_names_of(const Input& input, const std::string& file) {
    if (input.phantom || input.pairs) return {};
    std::vector<std::string> names = store::channel_names(file, input.selection);
    names.resize(static_cast<std::size_t>(input.header.channels));
    const bool none = std::all_of(names.begin(), names.end(),
                                  [](const std::string& name) { return name.empty(); });
    return none ? std::vector<std::string>() : names;
}

/// "0 DAPI, 1 GFP, 3 Cy5": by which number and which name --channel takes them.
std::string names_text(const std::vector<std::string>& names) {
    std::vector<std::string> said;
    for (std::size_t i = 0; i < names.size(); ++i)
        if (!names[i].empty()) said.push_back(fmt::format("{} {}", i, names[i]));
    return fmt::format("{}", fmt::join(said, ", "));
}

std::string text_of_facts(const Facts& facts) {
    const store::Header& h = facts.input.header;
    const int axes = h.volume ? 3 : 2;
    std::string text =
        fmt::format("{}: {} ({})\n", facts.input.name, h.volume ? "volume" : "image", h.format);
    const auto line = [&](const char* key, const std::string& value) {
        text += fmt::format("  {:<12} {}\n", key, value);
    };
    const char* alpha = h.alpha == store::Alpha::none ? "" : " with alpha";
    line("extent",
         text_of(h.extent, axes) +
             fmt::format(", {} channel{}{}, {} time{}", h.channels, h.channels > 1 ? "s" : "",
                         h.colour ? fmt::format(" that are colours{}", alpha) : "", h.times,
                         h.times > 1 ? "s" : ""));
    if (!facts.channel_names.empty()) line("channels", names_text(facts.channel_names));
    for (std::size_t i = 0; i < h.levels.size() && h.levels.size() > 1; ++i)
        line("level", fmt::format("{}: {}{}", i, text_of(h.levels[i], axes),
                                  static_cast<int>(i) == h.level ? " (this)" : ""));
    if (!h.modality.empty()) line("modality", h.modality);
    line("spacing", spacing_text(h, axes));
    line("orientation", h.orientation.empty() ? "not said" : h.orientation);
    line("type", std::string(name_of(h.type)) +
                     (h.values.identity() ? ""
                                          : fmt::format(", value = {:.6g} x stored + {:.6g}",
                                                        h.values.slope, h.values.offset)));
    if (facts.measured) {
        const Statistics& s = facts.measured->statistics;
        const std::string unit = h.value_unit.empty() ? "" : " " + h.value_unit;
        line("range", fmt::format("{:.6g} to {:.6g}{}, mean {:.6g}", s.low, s.high, unit, s.mean));
        if (s.non_finite) line("not finite", fmt::format("{} values", s.non_finite));
        line("occupied", fmt::format("{:.1f} % of the samples", s.occupied_fraction * 100));
        const Histogram& histogram = facts.measured->histogram;
        const bool integers = is_integer(h.type) && h.values.identity();
        const auto quantile = [&](double share) { return quantile_of(histogram, share, integers); };
        if (histogram.counts.size() > 1)
            line("histogram",
                 fmt::format(
                     "{} (logarithmic; 1 % below {:.4g}, half below {:.4g}, 99 % below {:.4g})",
                     bars_of(histogram), quantile(0.01), quantile(0.5), quantile(0.99)));
        line("memory", fmt::format("{:.1f} MiB", facts.input.bytes() / 0x1p20));
    } else {
        if (h.times > 1) line("note", "several time points: --time N, from 0, says which");
        if (h.channels > 4) line("note", "many channels: --channel N, from 0, says which");
    }
    for (std::size_t i = 0; i < facts.series.size() && facts.series.size() > 1; ++i)
        line("series", fmt::format("{}: {} ({}, {} files)", i, facts.series[i].uid,
                                   facts.series[i].text, facts.series[i].files));
    for (const Message& warning : facts.warnings) line("warning", spoken(warning));
    return text;
}

/// The first of several series that can be read. @throws InputError that of the first, where none
/// can
Input first_of(const std::vector<store::Series>& series, const std::string& file,
               store::Selection selection, std::vector<Message>& unreadable) {
    std::exception_ptr first;
    for (const store::Series& one : series) try {
            selection.series = one.uid;
            return inspected(file, selection);
        } catch (const InputError& error) {
            if (!first) first = std::current_exception();
            unreadable.push_back(message("series {}: {}", one.uid, error.message()));
        }
    std::rethrow_exception(first);
}

/// Several series: their list is the answer, the first stands for all.
Facts gathered(const InfoOptions& options, MemoryBudget& memory) {
    Facts facts;
    if (options.asked.text("level") == kLevelByResult)
        throw RequestError("--level auto: info makes no picture to choose one by; name a number");
    store::Selection selection = selection_of(options.asked);
    selection.memory_limit = memory.limit();
    selection.padding = store::Padding::smallest;
    constexpr std::string_view kNoPaths[] = {"phantom:", "raw:", "kspace:"};
    if (std::none_of(std::begin(kNoPaths), std::end(kNoPaths),
                     [&](std::string_view start) { return options.file.starts_with(start); }))
        facts.series = store::list_series(options.file);
    std::vector<Message> unreadable;
    facts.input = facts.series.size() > 1 && !selection.series
                      ? first_of(facts.series, options.file, selection, unreadable)
                      : inspected(options.file, selection);
    facts.channel_names = channel_names_of(facts.input, options.file);
    facts.warnings = facts.input.header.warnings;
    facts.warnings.insert(facts.warnings.end(), unreadable.begin(), unreadable.end());
    const store::Header& header = facts.input.header;
    // What has to be chosen first is listed, and no error.
    if (header.times > 1 && !selection.time) return facts;
    if (header.channels > 4 && !selection.channel) return facts;
    facts.warnings = read_data(facts.input, &memory);
    facts.warnings.insert(facts.warnings.end(), unreadable.begin(), unreadable.end());
    OfSamples& measured = facts.measured.emplace();
    const std::shared_ptr<FactStore> store = user_facts();
    measured.statistics = known_statistics(store.get(), facts.input, &memory);
    measured.histogram = known_histogram(store.get(), facts.input, measured.statistics);
    measured.spectrum = known_spectrum(store.get(), facts.input, measured.statistics, &memory);
    measured.dynamic_range = dynamic_range_of(measured, facts.input.data->what);
    return facts;
}

int do_info(const InfoOptions& options) {
    return guarded_with_json(options.json, [&] {
        if (options.json && *options.json != "-") expect_writable("--json", *options.json);
        MemoryBudget memory(static_cast<std::size_t>(free_memory()));
        const Facts facts = gathered(options, memory);
        if (options.json) write_text(*options.json, text_of(json_of(facts)));
        if (options.json != "-") write_text("-", text_of_facts(facts));
        return static_cast<int>(kDone);
    });
}

}  // namespace

Verb add_info(CLI::App& main) {
    CLI::App* app = main.add_subcommand("info", "what is in a file");
    auto options = std::make_shared<InfoOptions>();
    app->add_option("FILE", options->file, "file, folder, phantom:NAME:N, raw:... or kspace:...")
        ->required();
    add_selection(*app);
    add_text(*app, "--json", options->json, "report, to FILE or - for standard output");
    app->add_flag("--quiet", options->quiet, "errors only; what is in the file is the output");
    return {app, [app, options] {
                take_given(*app, options->asked);
                return do_info(*options);
            }};
}

}  // namespace edgewise::cli
