#include "settings/light.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <limits>

#include "graph/words.hpp"
#include "request/windows.hpp"
#include "settings/jobs.hpp"
#include "settings/readers.hpp"
#include "transfer/load.hpp"
#include "transfer/presets.hpp"

namespace edgewise {
namespace {

/// Of mode: composite with light, and with a preset where no transfer function is given.
constexpr const char* kShaded = "shaded";

/// The first mode that light falls on.
Mode lit_mode() {
    return *std::find_if(modes().begin(), modes().end(),
                         [](Mode mode) { return mode->takes_light() && mode->takes_transfer; });
}

std::vector<std::string> mode_words() {
    std::vector<std::string> words;
    for (const Mode mode : modes()) words.emplace_back(mode->name);
    words.emplace_back(kShaded);
    return words;
}

void take_mode(Query& query, const SettingValue& value, const Reading& reading) {
    const std::string word = reads::word(value, reading.called());
    const bool shaded = same_word(word, kShaded);
    query.suiting_preset = shaded && !query.transfer;
    if (shaded) {
        query.mode = lit_mode();
        if (!query.shade) query.shade = Shade::phong;
        return;
    }
    for (const Mode mode : modes())
        if (same_word(word, mode->name)) {
            query.mode = mode;
            return;
        }
    throw RequestError(
        message("@mode: no mode is called '{}'; {}", word, instead_of(word, mode_words())));
}

SettingValue mode_of(const Query& query) {
    return query.suiting_preset ? kShaded : SettingValue(std::string(query.mode->name));
}

/// "mip (default), xray, ..."
Message help_of_mode(Job) {
    std::string help;
    for (const Mode mode : modes())
        help += (help.empty() ? "" : ", ") + std::string(mode->name) +
                (mode == Mode::mip ? " (default)" : "");
    return message("{}; shaded: composite with @shade(phong) and a preset", help);
}

void take_background(Query& query, const SettingValue& value, const Reading&) {
    const std::string text = value.text();
    query.background.reset();
    query.keeps_alpha = same_word(text, "none");
    if (query.keeps_alpha) return;
    const std::vector<double> c = split(text, ',').size() == 3
                                      ? numbers_of(setting("background"), text)
                                      : std::vector<double>();
    if (c.size() != 3)
        throw RequestError(
            message("@background: '{}' given; expected R,G,B, each from 0 to 1, or none", text));
    for (const double part : c)
        if (part < 0 || part > 1)
            throw RequestError(message("@background: {} is not from 0 to 1", part));
    query.background = {c[0], c[1], c[2]};
}

SettingValue background_of(const Query& query) {
    return query.keeps_alpha ? SettingValue("none") : reads::told(query.background);
}

/// Where the mode takes none, the file does not matter, and the request says so.
void take_transfer_of(Query& query, TransferSpec (*load)(const std::string&),
                      const SettingValue& value, const Reading& reading) {
    if (reading.other("transfer") && reading.other("preset"))
        throw RequestError(
            message("@preset: is a transfer function; leave out @transfer, or @preset"));
    query.suiting_preset = false;
    if (query.mode->takes_transfer)
        query.transfer = load(reads::word(value, reading.called()));
    else
        query.transfer.emplace().from = reading.called();
}

void take_transfer(Query& query, const SettingValue& value, const Reading& reading) {
    const auto load = [](const std::string& file) { return load_transfer(file); };
    take_transfer_of(query, load, value, reading);
}

void take_preset(Query& query, const SettingValue& value, const Reading& reading) {
    take_transfer_of(query, preset_or_file, value, reading);
}

/// The file or preset that it is of.
SettingValue source_of(const Query& query, std::string_view field) {
    if (!query.transfer) return {};
    const std::vector<Setting> named = query.transfer->from.settings();
    return named.empty() || named[0].field != field ? SettingValue() : SettingValue(named[0].value);
}

/// None, and the rules of light that some mode takes.
std::vector<Shade> known_shades() {
    std::vector<Shade> known{Shade::none};
    for (const Mode mode : modes())
        for (const Shade by : mode->shades)
            if (std::find(known.begin(), known.end(), by) == known.end()) known.push_back(by);
    return known;
}

std::vector<std::string> shade_words() {
    std::vector<std::string> words;
    for (const Shade by : known_shades()) words.emplace_back(name_of(by));
    return words;
}

void take_shade(Query& query, const SettingValue& value, const Reading& reading) {
    const int place =
        reads::place_of(reads::word(value, reading.called()), reading.called(), shade_words());
    query.shade = known_shades()[static_cast<std::size_t>(place)];
}

SettingValue shade_of(const Query& query) {
    return query.shade ? SettingValue(std::string(name_of(*query.shade))) : SettingValue();
}

/// "none|phong|..."
Message value_of_shade(Job) {
    std::string words;
    for (const Shade by : known_shades())
        words += (words.empty() ? "" : "|") + std::string(name_of(by));
    return words;
}

/// What each mode takes, and what it does unasked.
Message help_of_shade(Job) {
    std::string help = "how light meets samples";
    for (const Mode mode : modes()) {
        if (!mode->takes_light()) continue;
        help += "; " + std::string(mode->name) + ":";
        for (const Shade by : mode->shades)
            help += (by == mode->shades.front() ? " " : ", ") + std::string(name_of(by));
        help += " (default " + std::string(name_of(mode->shade)) + ")";
    }
    return message("{}; @mode(shaded): phong", help);
}

std::vector<std::string> gradient_words() { return {"central", "sobel", "auto"}; }

void take_gradient(Query& query, const SettingValue& value, const Reading& reading) {
    const int by =
        reads::place_of(reads::word(value, reading.called()), reading.called(), gradient_words());
    query.gradient.reset();  // the data decide
    if (by < 2) query.gradient = static_cast<GradientScheme>(by);
}

SettingValue gradient_of(const Query& query) {
    if (!query.gradient) return {};
    return *query.gradient == GradientScheme::sobel ? "sobel" : "central";
}

Light light_of(const SettingValue& value, const Message& called) {
    const std::string text = value.text();
    if (same_word(text, "head")) return {};
    const std::vector<double> n =
        split(text, ',').size() < 3 ? std::vector<double>() : numbers_of(called, text);
    if (n.size() != 3 && n.size() != 4)
        throw RequestError(
            message("{}: '{}' given; expected X,Y,Z or X,Y,Z,I, or head", called, text));
    return {Vec3(n[0], n[1], n[2]), n.size() == 4 ? n[3] : 1};
}

SettingValue light_told(const Light& light) {
    return SettingValue::List{light.towards[0], light.towards[1], light.towards[2],
                              light.intensity};
}

Material material_of(const std::string& text, const Message& called) {
    const std::vector<double> n = numbers_of(called, text);
    if (n.size() != 4)
        throw RequestError(
            message("{}: '{}' given; expected A,D,S,N: ambient, diffuse, specular and exponent",
                    called, text));
    return {n[0], n[1], n[2], n[3]};
}

SettingValue material_told(const Material& m) {
    return SettingValue::List{m.ambient, m.diffuse, m.specular, m.exponent};
}

DepthCue cue_of(const std::string& text, const Message& called) {
    const auto words = split(text, ',');
    if (words.empty() || words.size() > 2)
        throw RequestError(message("{}: '{}' given; expected K, K,linear or K,exp", called, text));
    const bool linear =
        words.size() == 2 && reads::place_of(words[1], called, {"exp", "linear"}) == 1;
    return {number_of(called, words[0]), linear};
}

SettingValue cue_told(const DepthCue& cue) {
    return SettingValue::List{cue.per_length, cue.linear ? "linear" : "exp"};
}

/// True, or the labels that alone count.
void take_labels(Query& query, const SettingValue& value, const Reading& reading) {
    query.only_labels.clear();
    const std::string text = value.text();
    const bool bare = text.empty() || same_word(text, "true") || same_word(text, "false");
    query.labels = !same_word(text, "false");
    if (bare) return;
    for (const std::string& word : split(text, ','))
        query.only_labels.push_back(whole_of(reading.called(), word,
                                             std::numeric_limits<std::int64_t>::min(),
                                             std::numeric_limits<std::int64_t>::max()));
}

SettingValue labels_of(const Query& query) {
    return query.only_labels.empty() ? SettingValue(query.labels)
                                     : SettingValue::of(query.only_labels);
}

WindowEnd window_end(const std::string& text) {
    if (text.empty() || text.back() != '%') return {number_of(setting("window"), text), false};
    const double at = number_of(setting("window"), text.substr(0, text.size() - 1));
    if (at < 0 || at > 100) throw RequestError(message("@window: {} is not from 0% to 100%", text));
    return {at, true};
}

/// W400L40, in any case and order: width and level. Nothing where the text is none of that kind.
std::optional<Window> width_and_level(const std::string& text) {
    const std::string word = lower(text);
    const std::size_t w = word.find('w'), l = word.find('l');
    if (w == std::string::npos || l == std::string::npos || std::min(w, l) != 0)
        return std::nullopt;
    const auto number = [&](std::size_t at, std::size_t other) {
        const std::size_t end = other > at ? other : word.size();
        return number_of(setting("window"), word.substr(at + 1, end - at - 1));
    };
    const double width = number(w, l), level = number(l, w);
    if (!(width > 0))
        throw RequestError(message("@window: {}: the width is not greater than 0", text));
    return window_around(level, width);
}

/// "lung, bone, ..."
std::vector<std::string> window_names() {
    std::vector<std::string> names;
    for (const NamedWindow& named : named_windows()) names.emplace_back(named.name);
    return names;
}

SettingValue end_told(const WindowEnd& end) {
    return end.percentile ? SettingValue(fmt::format("{}%", end.at)) : SettingValue(end.at);
}

SettingValue window_told(const Window& window) {
    if (!window.name.empty()) return window.name;
    return SettingValue::List{end_told(window.low), end_told(window.high)};
}

/// Two ends, width and level, or a name.
Message help_of_window(Job job) {
    std::string names;
    for (const NamedWindow& named : named_windows())
        names += fmt::format("{}{} W{:g}L{:g}", names.empty() ? "" : ", ", named.name, named.width,
                             named.level);
    const std::string help =
        "what is black and white, values or percentiles; HI,LO inverts; width and level as "
        "W400L40; of a CT: " +
        names;
    if (!has::render(job)) return help;
    return help +
           ". Default the range of all frames; drr 99.5%,1%; mip of an MR 1%,99.9%. composite: "
           "where the grey ramp runs; with colours of its own, as surface and binary: of light, "
           "default 0,1";
}

}  // namespace

Window window_of(const std::string& text) {
    const auto words = split(text, ',');
    if (words.size() != 2) {
        if (const std::optional<Window> named = window_named(text)) return *named;
        const bool has_number = text.find_first_of("0123456789") != std::string::npos;
        if (has_number)
            if (const std::optional<Window> window = width_and_level(text)) return *window;
        throw RequestError(
            message("@window: '{}' given; expected LO,HI in values or percentiles, as 1%,99.5%, or "
                    "width and level, as W400L40, or a name; {}",
                    text, instead_of(text, window_names())));
    }
    const Window window{window_end(words[0]), window_end(words[1])};
    if (window.low.percentile == window.high.percentile && window.low.at == window.high.at)
        throw RequestError(
            message("@window: {}: LO and HI are the same; expected two that differ (the greater "
                    "one first inverts)",
                    text));
    return window;
}

namespace reads {

Reader labels() { return {take_labels, labels_of, Reader::Kind::bare}; }

Reader window() {
    return parts([](const std::string& text, const Message&) { return window_of(text); },
                 window_told, &Query::window);
}

}  // namespace reads

Message help_of_labels(const char* what) {
    return message("{}; @labels(12,13): these alone", what);
}

Message help_of_smooth() {
    return "surfaces of labels: how far vertices may go, of half a sample; 0: the voxels' faces, "
           "default 1. Volumes stay";
}

Rows light_settings() {
    using reads::number;
    static const std::vector<QuerySetting> rows = grouped(
        "",
        {{"outside", "V", "value beyond the input; default 0, of a CT in Hounsfield units its air",
          has::warp, number(&Query::outside)},
         {"mode", "MODE", help_of_mode, has::render,
          reads::with_limits(Limits::words(mode_words()), {take_mode, mode_of})},
         {"zero", "V", "xray: the value that adds nothing", has::render, number(&Query::zero)},
         {"isovalue", "V", "surface and binary: where values reach V", has::render,
          number(&Query::isovalue)},
         {"background", "R,G,B|none",
          "composite, surface and binary: default 0,0,0; none: alpha is kept", has::render,
          reads::with_limits({.least = 0, .greatest = 1, .allowed = {"none"}},
                             {take_background, background_of})},
         {"transfer",
          "FILE",
          "composite: opacity and colour (docs/files.md)",
          has::render,
          {take_transfer, [](const Query& query) { return source_of(query, "transfer"); }}},
         {"preset",
          "NAME|FILE",
          message("composite: a transfer function of `@command(list presets)`, or of a file; "
                  "default with @mode(shaded): one that suits FILE"),
          has::render,
          {take_preset, [](const Query& query) { return source_of(query, "preset"); }}},
         {"shade", value_of_shade, help_of_shade, has::render,
          reads::with_limits(Limits::words(shade_words()), {take_shade, shade_of})},
         {"gradient", "central|sobel|auto",
          message("of lit samples: from neighbours along each axis, or smoothed against noise; "
                  "default auto: sobel where @mode(shaded) takes a preset by itself and finds a "
                  "noisy MR, else central"),
          has::render,
          reads::with_limits(Limits::words(gradient_words()), {take_gradient, gradient_of})},
         QuerySetting{"lights", "X,Y,Z[,I]|head",
                      "towards a light, in screen space (z away from the eye); default "
                      "-0.5,-0.5,-1: over the viewer's left shoulder; head: 0,0,-1. Several add up",
                      has::render, reads::list(light_of, light_told, &Query::lights)}
             .typed_as("light"),
         {"material", "A,D,S,N",
          message("ambient, diffuse, specular, exponent; default that of the preset, else "
                  "0.2,0.9,0.2,20; with @shadows 0.25 more ambient light"),
          has::render, reads::parts(material_of, material_told, &Query::material)},
         {"phase", "G", "particles: mean cosine of the angle that they turn light by; default 0",
          has::render, reads::number_in(Limits::within(-1, 1), &Query::phase)},
         {"shadows", "",
          "composite: samples take away light on its way to others, not ambient light", has::render,
          reads::flag(&Query::shadows)},
         QuerySetting{
             "occlusion", "R",
             "composite: ambient light is taken away by what is nearer than R, in the file's unit",
             has::render, reads::number_in(Limits::above(0), &Query::occlusion)}
             .typed_as("ambient-occlusion"),
         QuerySetting{"cue", "K[,linear|exp]",
                      "xray, mean, composite and surface: light falls off with depth", has::render,
                      reads::parts(cue_of, cue_told, &Query::cue)}
             .typed_as("depth-cue"),
         {"labels", "",
          help_of_labels("the samples are labels: nearest, no new value, values bit for bit"),
          has::views, reads::labels()},
         {"smooth", "0..1", help_of_smooth(), has::render,
          reads::number_in(Limits::between(0, 1), &Query::smooth)},
         {"window", "LO,HI|WnLn|NAME", help_of_window, has::render, reads::window()},
         QuerySetting{"window", "LO,HI|WnLn|NAME", help_of_window, has::warp, reads::window()}
             .of_output(),
         QuerySetting{"exposure", "E",
                      "composite, surface and binary: pictures of 8 and 16 bits show light times "
                      "E; default 1",
                      has::render, reads::number_in(Limits::above(0), &Query::exposure)}
             .of_output()});
    return rows;
}

}  // namespace edgewise
