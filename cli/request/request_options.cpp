#include "cli/request/request_options.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <map>

#include "cli/request/filter_words.hpp"
#include "cli/request/radon_words.hpp"
#include "engine/look/colormap.hpp"
#include "engine/request/windows.hpp"
#include "reference/job_reference.hpp"

namespace edgewise::cli {
namespace {

constexpr const char* kSmoothHelp =
    "surfaces of labels: how far vertices may go, of half a sample; 0: the voxels' faces, default "
    "1. Volumes stay";

using Words = std::vector<std::string>;

constexpr const char* kSteps[] = {"rotate", "matrix",    "scale", "translate",
                                  "shear",  "turntable", "path"};

CLI::Option* add_list(CLI::App& app, const std::string& name, Words& into,
                      const std::string& help) {
    return app
        .add_option(name, CLI::callback_t([&into](const Words& words) {
                        into = words;
                        return true;
                    }),
                    help)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

void add_geometry(CLI::App& app, JobOptions& o) {
    const std::string group = "Geometry, in the order given";
    const auto text = [&](const char* name, std::optional<std::string>& into, const char* value,
                          const char* help) {
        add_text(app, name, into, help)->type_name(value)->group(group);
    };
    const auto step = [&](const char* name, const char* value, const char* help) {
        // Order comes from the parser; see order_geometry.
        app.add_option(name, CLI::callback_t([](const Words&) { return true; }), help)
            ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
            ->type_name(value)
            ->group(group);
    };
    text("--view", o.geometry.view, "SIDE",
         "front, back, left, right, top, bottom (or coronal, sagittal, axial), or x, y, z: along "
         "the file's axis");
    step("--rotate", "A|X,Y,Z", "degrees about z (2D), or about x, then y, then z");
    step("--matrix", "NUMBERS|FILE", "object -> screen, row by row");
    step("--scale", "S[,S[,S]]", "more than 1 enlarges");
    step("--translate", "T,T[,T]", "in the file's unit");
    step("--shear", "xy=K,...", "adds K y to x");
    text("--about", o.geometry.about, "X,Y[,Z]", "sample that is held fixed; default the centre");
    if (o.job == Job::render) {
        text("--perspective", o.geometry.perspective, "FOV",
             "vertical angle; default parallel rays");
        text("--eye", o.geometry.eye, "X,Y,Z",
             "where the eye of --perspective is, also within the volume: a sample of FILE");
        text("--look-at", o.geometry.look_at, "X,Y,Z",
             "sample of FILE in the middle of its view, in place of --view's direction; up stays "
             "that of --view");
        step("--turntable", "N[,ARC]",
             "N views about screen y, over ARC degrees (360), at its place among the others");
        step("--path", "FILE", "matrices, one for each view, at its place among the others");
        text("--zoom", o.geometry.zoom, "Z", "more than 1 shows less of the scene, larger");
    } else {
        text("--clip", o.geometry.clip, "X0,Y0,Z0,X1,Y1,Z1",
             "crop: first and last sample of FILE that is kept along each axis (an image: "
             "X0,Y0,X1,Y1); it stays where it is in the world");
        text("--move", o.geometry.move, "content|grid",
             "what all but --view turns: what is seen (default), or where it is sampled (MPR)");
    }
    text("--spacing", o.geometry.spacing, "S[,S[,S]]", "distance of output samples");
    text("--size", o.geometry.size, o.job == Job::warp ? "WxH[xD]|N|fit" : "WxH|N|native",
         o.job == Job::render ? "output samples; N: of the longer side; native: one for each "
                                "smallest spacing of the volume. Default native, at least 512 on "
                                "the longer side"
                              : "output samples; N: of the longer side");
}

/// What rays see of the volume.
void add_clip(CLI::App& app, GeometryWords& words) {
    const std::string group = "Clipping";
    add_text(app, "--clip", words.clip, "keeps the box of these samples of FILE, ends included")
        ->type_name("X0,Y0,Z0,X1,Y1,Z1")
        ->group(group);
    add_list(app, "--clip-plane", words.clip_planes,
             "keeps Ax+By+Cz+D >= 0, in samples of FILE; several add up")
        ->type_name("A,B,C,D")
        ->group(group);
    add_list(app, "--clip-ball", words.clip_balls,
             "keeps the ball around sample X,Y,Z of FILE, radius in the file's unit; of several "
             "what they share")
        ->type_name("X,Y,Z,R")
        ->group(group);
    add_text(app, "--slab", words.slab,
             "keeps so much of each view about its middle plane, or from --eye on, in the file's "
             "unit")
        ->type_name("T")
        ->group(group);
}

void add_input(CLI::App& app, JobOptions& o) {
    app.add_option(
           "FILE", o.input,
           "file, folder, phantom:NAME:N, raw:FILE:WxHxD:TYPE, kspace:FILE:WxHxD or, for plans, "
           "describe:WxHxD:TYPE")
        ->required();
    add_selection(app, o.selection);
}

/// "mip (default), xray, ..."
std::string mode_help() {
    std::string help;
    for (const Mode mode : modes())
        help += (help.empty() ? "" : ", ") + std::string(mode->name) +
                (mode == Mode::mip ? " (default)" : "");
    return help + "; shaded: composite with --shade phong and a preset";
}

/// "none|phong|..."
std::string shade_words() {
    std::string words;
    for (const Shade by : known_shades())
        words += (words.empty() ? "" : "|") + std::string(name_of(by));
    return words;
}

/// What each mode takes, and what it does unasked.
std::string shade_help() {
    std::string help = "how light meets samples";
    for (const Mode mode : modes()) {
        if (!mode->takes_light()) continue;
        help += "; " + std::string(mode->name) + ":";
        for (const Shade by : mode->shades)
            help += (by == mode->shades.front() ? " " : ", ") + std::string(name_of(by));
        help += " (default " + std::string(name_of(mode->shade)) + ")";
    }
    return help + "; --mode shaded: phong";
}

/// --labels, or --labels=12,13.
void add_labels(CLI::App& app, JobOptions& o, const std::string& help) {
    app.add_option("--labels", CLI::callback_t([&o](const Words& words) {
                       o.labels = true;
                       const bool bare = words.back().empty() || words.back() == "true";
                       o.only_labels = bare ? std::nullopt : std::optional(words.back());
                       return true;
                   }),
                   help + "; --labels=12,13: these alone")
        ->expected(0, 0)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

/// How values become a picture for people.
void add_look(CLI::App& app, JobOptions& o) {
    const std::string group = "Looks";
    const auto text = [&](const char* name, std::optional<std::string>& into, const char* value,
                          const std::string& help) {
        add_text(app, name, into, help)->type_name(value)->group(group);
    };
    const char* of = o.job == Job::render ? "mip, minip, xray, mean ..." : "pictures";
    std::string maps;
    for (const std::string& name : colormap_names()) maps += (maps.empty() ? "" : ", ") + name;
    text("--colormap", o.colormap, "NAME|FILE",
         fmt::format("{}: {}; or rows of R,G,B (docs/looks.md)", of, maps));
    if (o.job == Job::render)
        app.add_flag("--depth-colour", o.depth_colour,
                     "mip: colours by the depth of the value, red in front and blue behind, or of "
                     "--colormap")
            ->group(group);
    app.add_flag("--legend", o.legend, "colours and their values, in a strip at the right")
        ->group(group);
    app.add_flag("--scale-bar", o.scale_bar, "a length, at the lower left")->group(group);
    text("--montage", o.montage, "WxH",
         o.job == Job::render ? "frames side by side, in W columns and H rows"
                              : "slices side by side, W x H of them, equally far apart");
    if (o.job == Job::render)
        text("--mpr", o.mpr, "X,Y,Z",
             "in place of a mode: the three planes through this sample of FILE, in one picture");
}

/// Two ends, width and level, or a name.
std::string window_help() {
    std::string names;
    for (const NamedWindow& named : named_windows())
        names += fmt::format("{}{} W{:g}L{:g}", names.empty() ? "" : ", ", named.name, named.width,
                             named.level);
    return "what is black and white, values or percentiles; HI,LO inverts; width and level as "
           "W400L40; of a CT: " +
           names;
}

void add_mode(CLI::App& app, JobOptions& o) {
    if (o.job == Job::warp) {
        add_text(app, "--outside", o.outside,
                 "value beyond the input; default 0, of a CT in Hounsfield units its air")
            ->type_name("V");
    } else {
        add_text(app, "--mode", o.mode, mode_help())->type_name("MODE");
        add_text(app, "--zero", o.zero, "xray: the value that adds nothing")->type_name("V");
        add_text(app, "--isovalue", o.isovalue, "surface and binary: where values reach V")
            ->type_name("V");
        add_text(app, "--background", o.background,
                 "composite, surface and binary: default 0,0,0; none: alpha is kept")
            ->type_name("R,G,B|none");
        add_text(app, "--transfer", o.transfer, "composite: opacity and colour (docs/files.md)")
            ->type_name("FILE");
        add_text(app, "--preset", o.preset,
                 "composite: a transfer function of `edgewise list presets`, or of a file; "
                 "default with --mode shaded: one that suits FILE")
            ->type_name("NAME|FILE");
        add_text(app, "--shade", o.shade, shade_help())->type_name(shade_words());
        add_text(app, "--gradient", o.gradient,
                 "of lit samples: from neighbours along each axis, or smoothed against noise; "
                 "default auto: sobel where --mode shaded takes a preset by itself and finds a "
                 "noisy MR, else central")
            ->type_name("central|sobel|auto");
        add_list(app, "--light", o.lights,
                 "towards a light, in screen space (z away from the eye); default -0.5,-0.5,-1: "
                 "over the viewer's left shoulder; head: 0,0,-1. Several add up")
            ->type_name("X,Y,Z[,I]|head");
        add_text(app, "--material", o.material,
                 "ambient, diffuse, specular, exponent; default that of the preset, else "
                 "0.2,0.9,0.2,20; with --shadows 0.25 more "
                 "ambient light")
            ->type_name("A,D,S,N");
        add_text(app, "--phase", o.phase,
                 "particles: mean cosine of the angle that they turn light by; default 0")
            ->type_name("G");
        app.add_flag("--shadows", o.shadows,
                     "composite: samples take away light on its way to others, not ambient light");
        add_text(app, "--ambient-occlusion", o.occlusion,
                 "composite: ambient light is taken away by what is nearer than R, in the file's "
                 "unit")
            ->type_name("R");
        add_text(app, "--depth-cue", o.cue,
                 "xray, mean, composite and surface: light falls off with depth")
            ->type_name("K[,linear|exp]");
    }
    add_labels(app, o, "the samples are labels: nearest, no new value, values bit for bit");
    if (o.job == Job::render) add_text(app, "--smooth", o.smooth, kSmoothHelp)->type_name("0..1");
    add_text(app, "--window", o.window,
             o.job == Job::render
                 ? window_help() +
                       ". Default the range of all frames; drr 99.5%,1%; mip of an MR 1%,99.9%. "
                       "composite: where the grey ramp runs; with colours of its own, as surface "
                       "and binary: of light, default 0,1"
                 : window_help())
        ->type_name("LO,HI|WnLn|NAME");
    if (o.job == Job::render)
        add_text(app, "--exposure", o.exposure,
                 "composite, surface and binary: pictures of 8 and 16 bits show light times E; "
                 "default 1")
            ->type_name("E");
}

void add_surface(CLI::App& app, JobOptions& o) {
    add_text(app, "--isovalue", o.isovalue, "the surface where values reach V")->type_name("V");
    add_labels(app, o, "a closed surface around each label but 0");
    add_text(app, "--smooth", o.smooth, std::string(kSmoothHelp) + "; of isosurfaces: default 0")
        ->type_name("0..1");
    app.add_flag("--close", o.lids, "closes an isosurface at the volume's faces");
    app.add_flag("--largest", o.largest,
                 "keeps the connected part with the largest area; of labels, of each");
    add_text(app, "--decimate", o.decimate, "takes away this share of the triangles")
        ->type_name("0..1");
}

void add_budgets(CLI::App& app, JobOptions& o) {
    const auto text = [&](const char* name, std::optional<std::string>& into, const char* value,
                          const char* help) {
        add_text(app, name, into, help)->type_name(value)->group("Budgets");
    };
    const bool surface = o.job == Job::mesh;
    if (!surface) {
        const bool is_exact = o.job == Job::filter || o.job == radon_job();
        text("--max-error", o.max_error, "E",
             is_exact ? "NRMSE as 0.01 or 1%, or PSNR as 40dB; default: equal but for rounding"
                      : "NRMSE as 0.01 or 1%, or PSNR as 40dB; default linear: as good as linear "
                        "interpolation");
        text("--range", o.range, "R", "the difference in values that counts as an error of 1");
        if (!is_exact)
            text("--reference", o.reference, "FIELD",
                 "what the samples mean: spline, linear or nearest");
    }
    text("--max-time", o.max_time, "T", "50ms, 2s, 1min");
    text("--max-memory", o.max_memory, "M", "512MiB, 2GB: peak of the process");
    if (!surface) text("--minimize", o.minimize, "WHAT", "time, error or memory");
    text("--threads", o.threads, "N", "default: the cores this process may use");
    if (!surface)
        text("--ranks", o.ranks, "N", "plan: memories that samples lie in; default: the machine's");
    text("--machine", o.machine, "FILE|NAME", "profile to predict with (docs/files.md)");
    if (!surface) {
        text("--planner", o.planner, "estimate|pilot|exhaustive",
             "models alone, contenders measured, or all paths");
        text("--planning-time", o.planning_time, "T", "pilot, exhaustive: then the best so far");
    }
    app.add_flag("--strict", o.strict, "a measured budget that is broken: exit 1, no output")
        ->group("Budgets");
    const char* value = "NAME[/key=value]...";
    add_list(app, "--via", o.via,
             "an edge or a family that must be on the path; filters: zoh nearest, foh linear")
        ->type_name(value)
        ->group("Budgets");
    add_list(app, "--without", o.without, "an edge or a family that must not")
        ->type_name(value)
        ->group("Budgets");
}

void add_verify(CLI::App& app, JobOptions& o) {
    app.add_option("--verify", CLI::callback_t([&o](const Words& words) {
                       o.verify = words.back().empty() ? "2048" : words.back();
                       return true;
                   }),
                   "measure the error on N random samples (--verify=N; default 2048) or all")
        ->expected(0, 0)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
        ->group("Output");
    add_text(app, "--seed", o.seed, "of these samples; default 1")->type_name("S")->group("Output");
}

void add_output(CLI::App& app, JobOptions& o, OutNeeded out) {
    const auto text = [&](const char* name, std::optional<std::string>& into, const char* value,
                          const char* help) {
        return add_text(app, name, into, help)->type_name(value)->group("Output");
    };
    const bool surface = o.job == Job::mesh;
    if (out != OutNeeded::absent) {
        CLI::Option* option =
            text("-o", o.out, "OUT",
                 surface ? "file that ends in .ply, .obj or .stl; null:"
                         : "file, by its ending; %d is the frame; - (PNG); null:");
        option->required(out == OutNeeded::yes);
    }
    if (!surface) {
        text("--bits", o.bits, "8|16|32", "8, 16: a view; 32: values");
        text("--quality", o.quality, "Q",
             "1 to 100: of JPEG, default 95; WebP and JPEG 2000 keep every value without it");
    }
    if (o.job == Job::render)
        text("--fps", o.fps, "F",
             "pictures a second of a .gif (at most 50), .apng or .mp4 of several; default 15");
    if (o.job == Job::render && out != OutNeeded::absent) {
        app.add_flag("--progressive", o.progressive,
                     "composite: writes OUT again and again on the way, from the front")
            ->group("Output");
        text("--stop-after", o.stop_after, "T",
             "composite: what is done from the front by then is the picture");
    }
    text("--json", o.json, "FILE|-", "report");
    app.add_option("--explain", CLI::callback_t([&o](const Words& words) {
                       o.explain = true;
                       o.explain_all = words.back() == "all";
                       return words.back().empty() || o.explain_all;
                   }),
                   "the plan and its alternatives; --explain=all: each refusal too")
        ->expected(0, 0)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
        ->group("Output");
    const bool is_verifiable = has_reference(o.job);
    if (is_verifiable) add_verify(app, o);
    text("--repeat", o.repeat, "N", "run N times");
    if (out == OutNeeded::yes && is_verifiable)
        text("--report", o.report, "FILE.html", "a page of the run: plan, pictures, error map");
    text("--trace", o.trace, "FILE.json", "what ran when, for Chrome's trace viewer");
    text("--flow", o.flow, "FILE.dot", "the nodes that run");
    add_text(app, "--progress", o.progress, "auto, always or never")
        ->type_name("WHEN")
        ->group("Output");
    app.add_flag("--quiet", o.quiet, "errors only")->group("Output");
    text("--log", o.log, "LEVEL", "error, warning, info or debug");
}

}  // namespace

void add_selection(CLI::App& app, SelectionWords& words) {
    const auto text = [&](const char* name, std::optional<std::string>& into, const char* value,
                          const char* help) { add_text(app, name, into, help)->type_name(value); };
    text("--series", words.series, "UID|N", "which series of a folder, or image of an OME-TIFF");
    text(
        "--level", words.level, "N|auto",
        "which resolution of several (OME-Zarr), from 0, the finest; auto: the coarsest that is as "
        "fine as the result");
    text("--time", words.time, "N|all",
         "which time point, from 0; all: a film of render, a frame for each; a series of filter");
    text("--channel", words.channel, "N|NAME|N[=COLOUR],...|all",
         "which channel, from 0, or as the file calls it; render merges several, as 0,1 or "
         "0=red,2=#00ff80; of colours "
         "(RGB, RGBA) all are taken where none is named");
    text("--orient", words.orient, "RAS|...", "where x, y, z point, where FILE is silent or wrong");
    text("--input-spacing", words.spacing, "S[,S[,S]]",
         "distance of FILE's samples, where it is silent or wrong");
    text("--input-unit", words.unit, "mm|um|nm",
         "unit of FILE's lengths, where it is silent or wrong");
}

CLI::Option* add_text(CLI::App& app, const std::string& name, std::optional<std::string>& into,
                      const std::string& help) {
    return app
        .add_option(name, CLI::callback_t([&into](const Words& words) {
                        into = words.back();
                        return true;
                    }),
                    help)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

void add_job_options(CLI::App& app, JobOptions& options, OutNeeded out) {
    add_input(app, options);
    if (options.job == Job::mesh) {
        add_surface(app, options);
    } else if (options.job == Job::filter) {
        add_filter(app, options);
    } else if (options.job == radon_job()) {
        add_radon(app, options);
    } else {
        add_geometry(app, options);
        if (options.job == Job::render) add_clip(app, options.geometry);
        add_mode(app, options);
        add_look(app, options);
    }
    add_budgets(app, options);
    add_output(app, options, out);
}

std::vector<std::string> typed_words(const CLI::App& app) {
    std::vector<std::string> words;
    for (const CLI::App* at = &app; at; at = at->get_parent())
        words.insert(words.begin(), at->get_name());
    std::map<const CLI::Option*, std::size_t> taken;
    for (const CLI::Option* option : app.parse_order()) {
        const std::string name = option->get_name();
        const std::string value = option->results().at(taken[option]++);
        if (option->get_positional()) {
            words.push_back(value);
        } else if (option->get_expected_max() > 0) {
            words.insert(words.end(), {name, value});
        } else {
            const bool is_flag = value.empty() || value == "true";
            words.push_back(is_flag ? name : name + "=" + value);
        }
    }
    return words;
}

void order_geometry(const CLI::App& app, JobOptions& options) {
    std::map<const CLI::Option*, std::size_t> taken;
    for (const CLI::Option* option : app.parse_order())
        for (const char* step : kSteps)
            if (option->get_lnames() == Words{step})
                options.geometry.steps.emplace_back(step, option->results().at(taken[option]++));
}

}  // namespace edgewise::cli
