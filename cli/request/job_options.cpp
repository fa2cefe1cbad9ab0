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

void read_budgets(RequestSpec& spec, const JobOptions& o) {
    if (o.max_time) spec.max_time = time_budget(*o.max_time);
    if (o.max_memory) spec.max_memory = memory_budget(*o.max_memory);
    if (o.minimize)
        spec.minimize =
            static_cast<Minimize>(chosen("--minimize", *o.minimize, {"time", "error", "memory"}));
    spec.like_linear = o.max_error == "linear";
    if (o.max_error && !spec.like_linear) spec.max_error = error_budget(*o.max_error);
    spec.notation = {spec.max_error ? *o.max_error : "", o.max_time.value_or(""),
                     o.max_memory.value_or("")};
    if (o.range) spec.range = number_of("--range", *o.range);
    const char* variable = std::getenv("EDGEWISE_THREADS");
    const std::string threads = o.threads ? *o.threads : variable ? variable : "";
    if (!threads.empty())
        spec.threads = static_cast<int>(
            whole_of(o.threads ? "--threads" : "EDGEWISE_THREADS", threads, 1, kMostThreads));
    if (o.ranks) spec.ranks = static_cast<int>(whole_of("--ranks", *o.ranks, 1, kMostRanks));
    if (o.planner)
        spec.planner = static_cast<Planner>(
            chosen("--planner", *o.planner, {"estimate", "pilot", "exhaustive"}));
    if (o.planning_time) spec.planning_time = time_budget(*o.planning_time, "--planning-time");
    spec.strict = o.strict;
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

void read_light(RequestSpec& spec, const JobOptions& o) {
    if (o.shade) spec.shade = shade_of(*o.shade);
    if (o.gradient)
        // Without a scheme the data decide.
        if (const int by = chosen("--gradient", *o.gradient, {"central", "sobel", "auto"}); by < 2)
            spec.gradient = static_cast<GradientScheme>(by);
    for (const std::string& text : o.lights) spec.lights.push_back(light_of(text));
    if (o.material) spec.material = material_of(*o.material);
    if (o.phase) spec.phase = number_of("--phase", *o.phase);
    spec.shadows = o.shadows;
    if (o.occlusion) spec.occlusion = number_of("--ambient-occlusion", *o.occlusion);
    if (o.cue) spec.cue = cue_of(*o.cue);
}

/// Composite with light, and with a preset where no transfer function is given.
constexpr const char* kShaded = "shaded";
bool is_shaded(const JobOptions& o) { return o.mode && same_word(*o.mode, kShaded); }

void read_transfer(RequestSpec& spec, const JobOptions& o) {
    if (o.transfer && o.preset)
        throw RequestError("--preset: is a transfer function; leave out --transfer, or --preset");
    spec.suiting_preset = is_shaded(o) && !o.transfer && !o.preset;
    if (!o.transfer && !o.preset) return;
    const char* option = o.transfer ? "--transfer" : "--preset";
    if (!spec.mode->takes_transfer)
        // The file does not matter, and the request says so.
        spec.transfer.emplace().from = option;
    else
        spec.transfer = o.transfer ? load_transfer(*o.transfer) : preset_or_file(*o.preset);
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

void read_mode(RequestSpec& spec, const JobOptions& o) {
    const bool shaded = is_shaded(o);
    if (o.mode) spec.mode = shaded ? lit_mode() : typed_mode(*o.mode);
    if (shaded) spec.shade = Shade::phong;
    read_light(spec, o);
    spec.keeps_alpha = o.background && same_word(*o.background, "none");
    if (o.background && !spec.keeps_alpha) spec.background = background_of(*o.background);
    if (o.zero) spec.zero = number_of("--zero", *o.zero);
    if (o.isovalue) spec.isovalue = number_of("--isovalue", *o.isovalue);
    if (o.outside) spec.outside = number_of("--outside", *o.outside);
    if (o.window) spec.window = window_of(*o.window);
    if (o.exposure) spec.exposure = number_of("--exposure", *o.exposure);
    if (o.reference)
        spec.reference = static_cast<Field>(
            chosen("--reference", *o.reference, {"spline", "linear", "nearest"}));
    spec.labels = o.labels;
    if (o.only_labels) spec.only_labels = label_list(*o.only_labels);
    const bool isosurface = o.job == Job::mesh && !o.labels;
    if (o.smooth)
        (isosurface ? spec.finish.smooth : spec.smooth) = number_of("--smooth", *o.smooth);
    spec.finish.lids = o.lids;
    spec.finish.largest = o.largest;
    if (o.decimate) spec.finish.decimate = number_of("--decimate", *o.decimate);
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

void read_output(RequestSpec& spec, const JobOptions& o) {
    spec.out = o.out;
    if (o.verify) spec.verify = verify_count(*o.verify);
    if (o.seed) spec.seed = static_cast<std::uint64_t>(whole_of("--seed", *o.seed, 0, INT64_MAX));
    if (o.repeat) spec.repeat = static_cast<int>(whole_of("--repeat", *o.repeat, 1, 1'000'000));
    if (o.fps) spec.fps = number_of("--fps", *o.fps);
    if (o.quality) spec.quality = static_cast<int>(whole_of("--quality", *o.quality, 1, 100));
    if (o.bits) {
        constexpr int kBits[] = {8, 16, 32};
        spec.bits = kBits[chosen("--bits", *o.bits, {"8", "16", "32"})];
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

RequestSpec spec_of(const JobOptions& o, const Catalogue& edges) {
    RequestSpec spec;
    spec.job = o.job;
    spec.input = o.input;
    read_mode(spec, o);
    if (o.job == Job::filter) spec.filter = filter_of(o);
    if (o.job == radon_job()) spec.radon = radon_of(o);
    read_budgets(spec, o);
    read_output(spec, o);
    read_look(spec.look, o);
    spec.selection = selection_of(o.selection);
    if (o.selection.channel && is_channel_name(*o.selection.channel))
        spec.channel_name = *o.selection.channel;
    spec.level_by_result = o.selection.level == kLevelByResult;
    read_transfer(spec, o);
    for (const std::string& text : o.via) spec.demands.via.push_back(demand_of(text, edges, o.job));
    for (const std::string& text : o.without)
        spec.demands.without.push_back(demand_of(text, edges, o.job));
    spec.geometry = geometry_spec(o.geometry);
    if (o.job == Job::warp) {
        if (o.geometry.clip) spec.geometry.crop = numbers_of("--clip", *o.geometry.clip);
    } else {
        spec.clip = clip_spec(o.geometry);
    }
    return spec;
}

}  // namespace edgewise::cli
