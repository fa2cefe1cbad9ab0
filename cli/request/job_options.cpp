#include "cli/request/job_options.hpp"

#include <algorithm>
#include <cstdlib>
#include <fmt/format.h>
#include <limits>

#include "cli/request/channel_words.hpp"
#include "cli/request/filter_words.hpp"
#include "cli/request/radon_words.hpp"
#include "engine/request/geometry.hpp"
#include "engine/request/numbers.hpp"
#include "engine/request/quantities.hpp"
#include "engine/request/windows.hpp"
#include "engine/transfer/load.hpp"
#include "engine/transfer/presets.hpp"
#include "graph/errors.hpp"
#include "graph/words.hpp"

namespace edgewise::cli {
namespace {

WindowEnd window_end(const std::string& text) {
    if (text.empty() || text.back() != '%') return {number_of("--window", text), false};
    const double at = number_of("--window", text.substr(0, text.size() - 1));
    if (at < 0 || at > 100)
        throw RequestError(fmt::format("--window: {} is not from 0% to 100%", text));
    return {at, true};
}

std::array<double, 3> background_of(const std::string& text) {
    const std::vector<double> c =
        split(text, ',').size() == 3 ? numbers_of("--background", text) : std::vector<double>();
    if (c.size() != 3)
        throw RequestError(fmt::format(
            "--background: '{}' given; expected R,G,B, each from 0 to 1, or none", text));
    for (const double part : c)
        if (part < 0 || part > 1)
            throw RequestError(fmt::format("--background: {} is not from 0 to 1", part));
    return {c[0], c[1], c[2]};
}

}  // namespace

namespace {

/// W400L40, in any case and order: width and level. Nothing where the text is none of that kind.
std::optional<Window> width_and_level(const std::string& text) {
    const std::string word = lower(text);
    const std::size_t w = word.find('w'), l = word.find('l');
    if (w == std::string::npos || l == std::string::npos || std::min(w, l) != 0)
        return std::nullopt;
    const auto number = [&](std::size_t at, std::size_t other) {
        const std::size_t end = other > at ? other : word.size();
        return number_of("--window", word.substr(at + 1, end - at - 1));
    };
    const double width = number(w, l), level = number(l, w);
    if (!(width > 0))
        throw RequestError(fmt::format("--window: {}: the width is not greater than 0", text));
    return window_around(level, width);
}

/// "lung, bone, ..."
std::vector<std::string> window_names() {
    std::vector<std::string> names;
    for (const NamedWindow& named : named_windows()) names.emplace_back(named.name);
    return names;
}

}  // namespace

Window window_of(const std::string& text) {
    const auto words = split(text, ',');
    if (words.size() != 2) {
        if (const std::optional<Window> named = window_named(text)) return *named;
        const bool has_number = text.find_first_of("0123456789") != std::string::npos;
        if (has_number)
            if (const std::optional<Window> window = width_and_level(text)) return *window;
        throw RequestError(fmt::format(
            "--window: '{}' given; expected LO,HI in values or percentiles, as 1%,99.5%, or width "
            "and level, as W400L40, or a name; {}",
            text, instead_of(text, window_names())));
    }
    const Window window{window_end(words[0]), window_end(words[1])};
    if (window.low.percentile == window.high.percentile && window.low.at == window.high.at)
        throw RequestError(
            fmt::format("--window: {}: LO and HI are the same; expected two that differ (the "
                        "greater one first inverts)",
                        text));
    return window;
}

std::size_t verify_count(const std::string& text) {
    if (same_word(text, "all")) return 0;
    return static_cast<std::size_t>(whole_of("--verify", text, 1, 1'000'000'000));
}

std::vector<Shade> known_shades() {
    std::vector<Shade> known{Shade::none};
    for (const Mode mode : modes())
        for (const Shade by : mode->shades)
            if (std::find(known.begin(), known.end(), by) == known.end()) known.push_back(by);
    return known;
}

namespace {

constexpr std::int64_t kMostThreads = 1024, kMostRanks = 1 << 24;

/// The place of a word, in any case, in a list. @throws RequestError naming the nearest
int chosen(const char* option, const std::string& word, std::initializer_list<const char*> words) {
    const auto found = std::find_if(words.begin(), words.end(),
                                    [&](const char* name) { return same_word(word, name); });
    if (found != words.end()) return static_cast<int>(found - words.begin());
    throw RequestError(fmt::format("{}: '{}' is not known; {}", option, word,
                                   instead_of(word, {words.begin(), words.end()})));
}

void read_budgets(Query& query, const JobOptions& o) {
    if (o.max_time) query.max_time = time_budget(*o.max_time);
    if (o.max_memory) query.max_memory = memory_budget(*o.max_memory);
    if (o.minimize)
        query.minimize =
            static_cast<Minimize>(chosen("--minimize", *o.minimize, {"time", "error", "memory"}));
    query.like_linear = o.max_error == "linear";
    if (o.max_error && !query.like_linear) query.max_error = error_budget(*o.max_error);
    query.notation = {query.max_error ? *o.max_error : "", o.max_time.value_or(""),
                      o.max_memory.value_or("")};
    if (o.range) query.range = number_of("--range", *o.range);
    const char* variable = std::getenv("EDGEWISE_THREADS");
    const std::string threads = o.threads ? *o.threads : variable ? variable : "";
    if (!threads.empty())
        query.threads = static_cast<int>(
            whole_of(o.threads ? "--threads" : "EDGEWISE_THREADS", threads, 1, kMostThreads));
    if (o.ranks) query.ranks = static_cast<int>(whole_of("--ranks", *o.ranks, 1, kMostRanks));
    if (o.planner)
        query.planner = static_cast<Planner>(
            chosen("--planner", *o.planner, {"estimate", "pilot", "exhaustive"}));
    if (o.planning_time) query.planning_time = time_budget(*o.planning_time, "--planning-time");
    query.strict = o.strict;
}

Light light_of(const std::string& text) {
    if (same_word(text, "head")) return {};
    const std::vector<double> n =
        split(text, ',').size() < 3 ? std::vector<double>() : numbers_of("--light", text);
    if (n.size() != 3 && n.size() != 4)
        throw RequestError(
            fmt::format("--light: '{}' given; expected X,Y,Z or X,Y,Z,I, or head", text));
    return {Vec3(n[0], n[1], n[2]), n.size() == 4 ? n[3] : 1};
}

Material material_of(const std::string& text) {
    const std::vector<double> n = numbers_of("--material", text);
    if (n.size() != 4)
        throw RequestError(fmt::format(
            "--material: '{}' given; expected A,D,S,N: ambient, diffuse, specular and exponent",
            text));
    return {n[0], n[1], n[2], n[3]};
}

DepthCue cue_of(const std::string& text) {
    const auto words = split(text, ',');
    if (words.empty() || words.size() > 2)
        throw RequestError(
            fmt::format("--depth-cue: '{}' given; expected K, K,linear or K,exp", text));
    const bool linear =
        words.size() == 2 && chosen("--depth-cue", std::string(words[1]), {"exp", "linear"}) == 1;
    return {number_of("--depth-cue", std::string(words[0])), linear};
}

/// A rule of light, in any case, that some mode takes.
Shade shade_of(const std::string& word) {
    std::vector<std::string> known;
    for (const Shade by : known_shades()) {
        if (same_word(word, name_of(by))) return by;
        known.emplace_back(name_of(by));
    }
    throw RequestError(
        fmt::format("--shade: '{}' is not known; {}", word, instead_of(word, known)));
}

void read_light(Query& query, const JobOptions& o) {
    if (o.shade) query.shade = shade_of(*o.shade);
    if (o.gradient)
        // Without a scheme the data decide.
        if (const int by = chosen("--gradient", *o.gradient, {"central", "sobel", "auto"}); by < 2)
            query.gradient = static_cast<GradientScheme>(by);
    for (const std::string& text : o.lights) query.lights.push_back(light_of(text));
    if (o.material) query.material = material_of(*o.material);
    if (o.phase) query.phase = number_of("--phase", *o.phase);
    query.shadows = o.shadows;
    if (o.occlusion) query.occlusion = number_of("--ambient-occlusion", *o.occlusion);
    if (o.cue) query.cue = cue_of(*o.cue);
}

/// Composite with light, and with a preset where no transfer function is given.
constexpr const char* kShaded = "shaded";
bool is_shaded(const JobOptions& o) { return o.mode && same_word(*o.mode, kShaded); }

void read_transfer(Query& query, const JobOptions& o) {
    if (o.transfer && o.preset)
        throw RequestError("--preset: is a transfer function; leave out --transfer, or --preset");
    query.suiting_preset = is_shaded(o) && !o.transfer && !o.preset;
    if (!o.transfer && !o.preset) return;
    const char* option = o.transfer ? "--transfer" : "--preset";
    if (!query.mode->takes_transfer)
        // The file does not matter, and the request says so.
        query.transfer.emplace().from = option;
    else
        query.transfer = o.transfer ? load_transfer(*o.transfer) : preset_or_file(*o.preset);
}

/// The first mode that light falls on.
Mode lit_mode() {
    return *std::find_if(modes().begin(), modes().end(),
                         [](Mode mode) { return mode->takes_light() && mode->takes_transfer; });
}

/// A mode of the library; the list of a message has the command's own word too.
Mode typed_mode(const std::string& word) {
    std::vector<std::string> known;
    for (const Mode mode : modes()) {
        if (same_word(word, mode->name)) return mode;
        known.emplace_back(mode->name);
    }
    known.emplace_back(kShaded);
    throw RequestError(
        fmt::format("--mode: no mode is called '{}'; {}", word, instead_of(word, known)));
}

/// "12,13"
std::vector<std::int64_t> label_list(const std::string& text) {
    std::vector<std::int64_t> labels;
    for (const std::string& word : split(text, ','))
        labels.push_back(whole_of("--labels", word, std::numeric_limits<std::int64_t>::min(),
                                  std::numeric_limits<std::int64_t>::max()));
    return labels;
}

void read_mode(Query& query, const JobOptions& o) {
    const bool shaded = is_shaded(o);
    if (o.mode) query.mode = shaded ? lit_mode() : typed_mode(*o.mode);
    if (shaded) query.shade = Shade::phong;
    read_light(query, o);
    query.keeps_alpha = o.background && same_word(*o.background, "none");
    if (o.background && !query.keeps_alpha) query.background = background_of(*o.background);
    if (o.zero) query.zero = number_of("--zero", *o.zero);
    if (o.isovalue) query.isovalue = number_of("--isovalue", *o.isovalue);
    if (o.outside) query.outside = number_of("--outside", *o.outside);
    if (o.window) query.window = window_of(*o.window);
    if (o.exposure) query.exposure = number_of("--exposure", *o.exposure);
    if (o.reference)
        query.reference = static_cast<Field>(
            chosen("--reference", *o.reference, {"spline", "linear", "nearest"}));
    query.labels = o.labels;
    if (o.only_labels) query.only_labels = label_list(*o.only_labels);
    const bool isosurface = o.job == Job::mesh && !o.labels;
    if (o.smooth)
        (isosurface ? query.finish.smooth : query.smooth) = number_of("--smooth", *o.smooth);
    query.finish.lids = o.lids;
    query.finish.largest = o.largest;
    if (o.decimate) query.finish.decimate = number_of("--decimate", *o.decimate);
}

void read_look(LookSpec& look, const JobOptions& o) {
    if (o.colormap) look.colormap = *o.colormap;
    look.legend = o.legend;
    look.scale_bar = o.scale_bar;
    look.depth_colour = o.depth_colour;
    if (!o.montage) return;
    const std::vector<std::string> sides = split(lower(*o.montage), 'x');
    if (sides.size() != 2)
        throw RequestError(
            fmt::format("--montage: '{}' given; expected columns and rows, as 4x3", *o.montage));
    look.montage = {static_cast<int>(whole_of("--montage", sides[0], 1, 1000)),
                    static_cast<int>(whole_of("--montage", sides[1], 1, 1000))};
}

void read_output(Query& query, const JobOptions& o) {
    query.out = o.out;
    if (o.verify) query.verify = verify_count(*o.verify);
    if (o.seed) query.seed = static_cast<std::uint64_t>(whole_of("--seed", *o.seed, 0, INT64_MAX));
    if (o.repeat) query.repeat = static_cast<int>(whole_of("--repeat", *o.repeat, 1, 1'000'000));
    if (o.fps) query.fps = number_of("--fps", *o.fps);
    if (o.quality) query.quality = static_cast<int>(whole_of("--quality", *o.quality, 1, 100));
    if (o.bits) {
        constexpr int kBits[] = {8, 16, 32};
        query.bits = kBits[chosen("--bits", *o.bits, {"8", "16", "32"})];
    }
}

}  // namespace

bool names_all_times(const SelectionWords& words) {
    return words.time && same_word(*words.time, "all");
}

store::Selection selection_of(const SelectionWords& words) {
    constexpr std::int64_t kMost = std::numeric_limits<int>::max();
    store::Selection selection;
    selection.series = words.series;
    if (names_all_times(words))
        throw RequestError(
            "--time all: of `edgewise render`, which makes a film, and of `edgewise filter`, which "
            "writes a series; here expected one number, from 0");
    if (words.time) selection.time = static_cast<int>(whole_of("--time", *words.time, 0, kMost));
    if (words.level && *words.level != kLevelByResult)
        selection.level = static_cast<int>(whole_of("--level", *words.level, 0, kMost));
    if (names_colours(words))
        throw RequestError(
            fmt::format("--channel: '{}' is merged by `edgewise render` alone; here expected one "
                        "number, from 0",
                        *words.channel));
    if (words.channel && !is_channel_name(*words.channel))
        selection.channel = static_cast<int>(whole_of("--channel", *words.channel, 0, kMost));
    if (words.orient) {
        directions_of(*words.orient);
        selection.orient = *words.orient;
    }
    if (words.spacing) selection.spacing = numbers_of("--input-spacing", *words.spacing);
    if (words.unit && words.unit->empty())
        throw RequestError("--input-unit: expected mm, um or nm");
    if (words.unit) selection.unit = *words.unit;
    return selection;
}

Query spec_of(const JobOptions& o, const Catalogue& edges) {
    Query query;
    query.job = o.job;
    query.input = o.input;
    read_mode(query, o);
    if (o.job == Job::filter) query.filter = filter_of(o);
    if (o.job == radon_job()) query.radon = radon_of(o);
    read_budgets(query, o);
    read_output(query, o);
    read_look(query.look, o);
    query.selection = selection_of(o.selection);
    if (o.selection.channel && is_channel_name(*o.selection.channel))
        query.channel_name = *o.selection.channel;
    query.level_by_result = o.selection.level == kLevelByResult;
    read_transfer(query, o);
    for (const std::string& text : o.via)
        query.demands.via.push_back(demand_of(text, edges, o.job));
    for (const std::string& text : o.without)
        query.demands.without.push_back(demand_of(text, edges, o.job));
    query.geometry = geometry_spec(o.geometry);
    if (o.job == Job::warp) {
        if (o.geometry.clip) query.geometry.crop = numbers_of("--clip", *o.geometry.clip);
    } else {
        query.clip = clip_spec(o.geometry);
    }
    return query;
}

}  // namespace edgewise::cli
