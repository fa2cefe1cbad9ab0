#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numbers>
#include <span>
#include <tbb/parallel_for.h>

#include "graph/range.hpp"
#include "transitions/reference/likely_extremes.hpp"
#include "transitions/reference/preview.hpp"
#include "transitions/reference/preview_bundle.hpp"
#include "transitions/reference/shear_lines.hpp"
#include "transitions/reference/written.hpp"

namespace edgewise {
namespace {

constexpr int kFewest = 72, kMost = 288;  // bundles
constexpr std::size_t kAtOnce = 128;
constexpr int kSide = 2;                // of a bundle [pixel]
constexpr double kLength = 64 * 256.0;  // that all bundles together should reach [unit]
// Inputs of so many samples are prepared once for all bundles.
constexpr std::int64_t kSmallInput = 1 << 19;
// Pictures of so many pixels are measured whole, if their input is small.
constexpr int kSmallPicture = 1 << 12;
constexpr std::size_t kFinest = 2;  // of kPreviewSteps

/// What a ray was taken for: drawn at random; of the classes of ShortRays; or because the reference
/// is likely to be extreme there, for the range alone.
enum Among : std::size_t {
    kDrawn,
    kShort,
    kAmong = kShort + ShortRays::kClasses,
    kChosen = kAmong
};

/// Neighbouring pixels that are measured together.
struct Draw {
    OutputSample corner;
    std::size_t among = kDrawn;
    double weight = 1;  // the inverse of how likely it was to be drawn
    // How likely it was drawn, of all pixels. 0 where all are measured: there the spread between
    // bundles is the reserve for what previews leave out, as roundings of stored samples.
    double chance = 0;
    int side = kSide;
    bool whole = true;  // with the short rays too, where they are drawn by themselves
};

struct Drawn {
    std::vector<Draw> draws;
    std::array<DrawnPixels, kAmong> from;
    bool all = false;  // every pixel is there, once
};

/// All pixels of all views.
Drawn take_all(const Request& want) {
    Drawn drawn;
    drawn.all = true;
    for (int view = 0; view < want.frames; ++view)
        for (std::int64_t y = 0; y < want.screen.y; y += kSide)
            for (std::int64_t x = 0; x < want.screen.x; x += kSide)
                drawn.draws.push_back({{view, x, y, 0}});
    return drawn;
}

/// Some of the pixels, as draw_pixels has it, each with its neighbours, and short rays.
Drawn draw(const Request& want, const ReferenceField& field, const ViewGeometry& geometry,
           int times) {
    // Without blocks to prepare a ray costs less.
    const double length = (want.input.samples() <= kSmallInput ? 2 : 1) * kLength;
    Drawn drawn;
    drawn.from[kDrawn] = draw_pixels(want, field, geometry, kFewest, kMost, length, kSide, times);
    for (const auto& [corner, weight, chance] : drawn.from[kDrawn].drawn)
        drawn.draws.push_back({.corner = corner,
                               .weight = weight,
                               .chance = chance * drawn.from[kDrawn].share_looked(),
                               .whole = false});
    ShortRays short_rays = draw_short_rays(want, field, geometry, times);
    for (std::size_t c = 0; c < short_rays.classes.size(); ++c) {
        const double looked = short_rays.classes[c].share_looked();
        for (const auto& [at, weight, chance] : short_rays.classes[c].drawn)
            drawn.draws.push_back({.corner = at,
                                   .among = kShort + c,
                                   .weight = weight,
                                   .chance = chance * looked,
                                   .side = 1});
        drawn.from[kShort + c] = std::move(short_rays.classes[c]);
    }
    return drawn;
}

/// Pixels where the reference is likely to be extreme.
void add_chosen(const Request& want, const ReferenceField& field, const Statistics& statistics,
                const ViewGeometry& geometry, Drawn& drawn) {
    std::vector<DrawnPixels::Looked> looked;
    for (const DrawnPixels& from : drawn.from)
        looked.insert(looked.end(), from.looked.begin(), from.looked.end());
    for (const OutputSample& at : likely_extremes(want, field, geometry, statistics, looked))
        drawn.draws.push_back(
            {.corner = {at.view, at.x / kSide * kSide, at.y / kSide * kSide, 0}, .among = kChosen});
}

/// Tallies of everything that is compared, by the name of its fact.
struct Tallies {
    std::array<std::map<std::string, ErrorTally>, kAmong> among;
    std::int64_t draws = 0;
    double low = std::numeric_limits<double>::infinity(), high = -low;
};

constexpr std::array<const char*, ScreenPicture::kMethods> kMethods = {"zoh", "foh", "bspline3",
                                                                       "me"};
/// Edges of project/ stop a ray where less than this is left to see.
constexpr double kTerminated = 1.0 / 4096;

using Values = std::array<double, 4>;

/// As written.
Values values_of(const Stretch& stretch, const Request& want) {
    Values values{};
    stretch.result(want, values.data());
    as_written(want, values.data());
    return values;
}

int channels_of(const Request& want) {
    return written_channels(want, want.mode == Mode::composite ? 4 : 1);
}

double square_of(const Values& a, const Values& b, const Request& want) {
    return mean_square(a.data(), b.data(), channels_of(want));
}

/// Whether slices of a spectrum make such pictures.
bool has_slices(const Request& want, const Statistics& statistics) {
    return !want.eye && !want.projective() && want.axes == 3 && want.field != Field::nearest &&
           statistics.non_finite == 0 && (want.mode == Mode::xray || want.mode == Mode::mean);
}

void add_spectrum(Traced& traced, const SpectrumPicture& picture, const Request& want) {
    traced.spectrum = picture.squares(traced.ray, traced.at,
                                      {.expected = values_of(traced.reference, want)[0],
                                       .spline = values_of(traced.cast[kSpline][kFinest], want)[0],
                                       .linear = values_of(traced.cast[kFoh][kFinest], want)[0]});
}

/// Neighbours have much the same ghosts: one ray stands for all of a bundle but the short ones,
/// each of which is a case of its own.
void add_spectra(Bundle& bundle, const SpectrumPicture& picture, const Request& want) {
    Traced* one = nullptr;
    for (Traced& traced : bundle.rays) {
        if (one && !is_short(traced.ray, want)) {
            ++one->stands_for;
            continue;
        }
        if (!is_short(traced.ray, want)) one = &traced;
        add_spectrum(traced, picture, want);
    }
}

/// Calls each(name, square) for everything that is measured on one ray.
template <class Each>
void compare(const Traced& traced, const Request& want, Each&& each) {
    const Values expected = values_of(traced.reference, want);
    const auto against = [&](const Stretch& got) {
        return square_of(values_of(got, want), expected, want);
    };
    for (std::size_t hold = 0; hold < kPreviewHolds.size(); ++hold)
        for (std::size_t s = 0; s < kPreviewSteps.size(); ++s)
            each(fmt::format("picture/{}/{}", kPreviewHolds[hold], kPreviewSteps[s]),
                 against(traced.cast[hold][s]));
    for (PreviewHold hold : {kZoh, kFoh}) {
        const Values clean = values_of(traced.cast[hold][0], want);
        each(fmt::format("noisy/{}", kPreviewHolds[hold]),
             square_of(values_of(traced.noisy[hold], want), clean, want));
        if (!traced.sheared) continue;
        Values values{};
        traced.sheared->result(hold, want, values);
        as_written(want, values.data());
        each(fmt::format("picture/shear_warp/{}", kPreviewHolds[hold]),
             square_of(values, expected, want));
    }
    for (std::size_t method = 0; traced.screen && method < kMethods.size(); ++method)
        each(fmt::format("picture/screen/{}", kMethods[method]),
             against(traced.screen->of(method)));
    for (const SpectrumPicture::Named& spectrum : traced.spectrum)
        each(spectrum.name, spectrum.square);
    if (want.mode == Mode::composite)
        each("picture/ended", traced.reference.transparency < kTerminated ? 1.0 : 0.0);
}

/// @param even  bundles count by their weights alone, not by how many rays they have
void tally(const Bundle& bundle, const Draw& draw, const Request& want, bool even,
           Tallies& tallies) {
    const int channels = channels_of(want);
    const double weight = draw.weight * (even ? 1 / static_cast<double>(bundle.rays.size()) : 1);
    for (const Traced& traced : bundle.rays) {
        const Values value = values_of(traced.reference, want);
        for (int c = 0; c < channels; ++c) {
            tallies.low = std::min(tallies.low, value[c]);
            tallies.high = std::max(tallies.high, value[c]);
        }
        if (draw.among == kChosen) continue;
        compare(traced, want, [&](const std::string& name, double square) {
            const RayLook::Cast like = cast_like(name);
            const double rays = name.starts_with("picture/spectrum") ? traced.stands_for : 1;
            tallies.among[draw.among][name].add(
                square, weight * rays, like < RayLook::kCasts ? traced.look.squares[like] : 0);
        });
    }
    if (draw.among == kChosen) return;
    ++tallies.draws;
    auto& by_name = tallies.among[draw.among];
    const auto add = [&](const std::string& name, double squares, double points) {
        if (points > 0) by_name[name].add(squares / points, draw.weight * points);
    };
    for (std::size_t method = 0; method < kMethods.size(); ++method)
        add(fmt::format("field/{}", kMethods[method]), bundle.field[method], bundle.points);
    for (std::size_t i = 0; i < bundle.sheared.size(); ++i)
        add(fmt::format("sheared/{}", kMethods[i + 1]), bundle.sheared[i], bundle.sheared_points);
    for (auto& [name, errors] : by_name) errors.close(draw.chance);
}

/// Combining adds what it does to samples without error (of a formula: to the best), and that is
/// independent of what is wrong with the samples. The rest of each picture's error is theirs. As
/// errors may count more or less in a picture than their RMS tells (a blur hardly changes an
/// integral, a random displacement averages out), "combined/..." is the error that, times the gain
/// of linear interpolation, gives the picture's.
void split_combining(std::map<std::string, double>& facts, Field field) {
    const auto picture = [&](const char* method) {
        return facts.at(fmt::format("picture/screen/{}", method));
    };
    // Where no sample is finite there is no field.
    if (!facts.contains("picture/screen/zoh") || !facts.contains("field/foh")) return;
    double added = picture(field == Field::nearest  ? "zoh"
                           : field == Field::linear ? "foh"
                                                    : "bspline3");
    if (field == Field::formula)
        for (const char* method : kMethods) added = std::min(added, picture(method));
    const auto rest = [&](const char* method) {
        return std::sqrt(std::max(0.0, picture(method) * picture(method) - added * added));
    };
    const double blur = facts.at("field/foh");
    const double gain = blur > 0 && rest("foh") > 0 ? rest("foh") / blur : 1;
    for (const char* method : kMethods)
        facts[fmt::format("combined/{}", method)] = rest(method) / gain;
    // The real rule repeats, and so does what it displaces: a pattern of it need not average out as
    // random displacements do, but not worse than noise of two samples alike.
    const auto noise = facts.find("gain/noise/zoh");
    if (noise != facts.end())
        facts["combined/me"] = std::max(facts["combined/me"], std::numbers::sqrt2 * noise->second *
                                                                  facts.at("field/me") / gain);
    facts["gain/blur"] = gain;
    facts["picture/combined"] = added;
}

void add_error(Preview& preview, const std::string& name, const ErrorEstimate& error,
               double noise) {
    if (!name.starts_with("noisy/")) {
        preview.facts[name] = error.upper;
        preview.likely[name] = error.likely;
    } else if (noise > 0) {
        const std::string gain = "gain/noise/" + name.substr(6);
        preview.facts[gain] = preview.likely[gain] = error.likely / noise;
    }
}

/// Of the pixels that see the input.
std::array<double, kAmong> shares_of(const Drawn& drawn) {
    if (drawn.all) return {1};
    std::array<double, kAmong> shares;
    double pixels = 0;
    for (const DrawnPixels& from : drawn.from) pixels += from.pixels;
    for (std::size_t among = 0; among < kAmong; ++among)
        shares[among] = drawn.from[among].pixels / std::max(1.0, pixels);
    return shares;
}

/// A few bundles at once, so that memory does not grow with the draws.
Tallies tally_all(const Drawn& drawn, const Setting& setting, const ViewGeometry& geometry,
                  const Statistics& statistics, std::pmr::memory_resource* memory) {
    const Request& want = setting.want;
    const ReferenceField& field = setting.field;
    std::optional<PreviewBlock> whole;
    if (field.extent().samples() <= kSmallInput)
        whole.emplace(field, Region::all(field.extent()), memory);
    std::optional<SpectrumPicture> spectrum;
    if (has_slices(want, statistics)) spectrum.emplace(want, field.samples(), statistics);
    Tallies tallies;
    std::vector<Bundle> bundles(std::min(kAtOnce, drawn.draws.size()));
    for (std::size_t first = 0; first < drawn.draws.size(); first += bundles.size()) {
        const auto draws = std::span(drawn.draws)
                               .subspan(first)
                               .first(std::min(bundles.size(), drawn.draws.size() - first));
        tbb::parallel_for(std::size_t{0}, draws.size(), [&](std::size_t i) {
            const auto& [corner, among, weight, chance, side, with_short] = draws[i];
            bundles[i] = bundle_at(want, geometry, corner, side, with_short);
            measure(bundles[i], setting, whole ? &*whole : nullptr, memory);
            // Where all were drawn none was looked at: there is no mean of looks to compare with.
            const bool looked = !drawn.all && among != kChosen && !drawn.from[among].looked.empty();
            for (Traced& traced : bundles[i].rays)
                if (looked) traced.look = look_at(traced.ray, want, field);
            if (!spectrum) return;
            add_spectra(bundles[i], *spectrum, want);
        });
        for (std::size_t i = 0; i < draws.size(); ++i)
            if (!bundles[i].rays.empty())
                tally(bundles[i], draws[i], want, !drawn.all && draws[i].among == kDrawn, tallies);
    }
    return tallies;
}

}  // namespace

Preview preview_rays(const Request& want, const ReferenceField& field, const Statistics& statistics,
                     std::pmr::memory_resource* memory, int times) {
    const ViewGeometry geometry(want);
    // About the rounding to 8 bits: gains of a maximum depend on how large noise is.
    const Setting setting{want, field, 1e-3 * range_between(statistics.low, statistics.high),
                          shear_lines(want)};
    // In a small input rays cost little, and in a small picture a few pixels carry the error.
    const bool take_every =
        field.extent().samples() <= kSmallInput &&
        want.output().samples() * want.frames <= std::max(kSmallPicture, 4 * kMost * times);
    Drawn drawn = take_every ? take_all(want) : draw(want, field, geometry, times);
    if (!drawn.all) add_chosen(want, field, statistics, geometry, drawn);
    Tallies tallies = tally_all(drawn, setting, geometry, statistics, memory);
    Preview preview{.facts = {},
                    .likely = {},
                    .draws = tallies.draws,
                    .exhausted = drawn.all,
                    .low = tallies.low,
                    .high = tallies.high};
    const std::array<double, kAmong> shares = shares_of(drawn);
    std::array<std::array<Auxiliary, RayLook::kCasts>, kAmong> auxiliaries;
    for (std::size_t among = 0; among < kAmong; ++among)
        auxiliaries[among] = drawn.from[among].auxiliaries();
    for (const auto& [name, errors] : tallies.among[kDrawn]) {
        // Points of the field are weighed by the length of rays, of which short ones have nothing.
        const bool is_picture = name.starts_with("picture/") || name.starts_with("noisy/");
        const RayLook::Cast like = cast_like(name);
        std::vector<Stratum> strata;
        for (std::size_t among = 0; among < (is_picture ? kAmong : kShort); ++among)
            strata.push_back({shares[among], tallies.among[among][name], drawn.from[among].whole,
                              like < RayLook::kCasts ? auxiliaries[among][like] : Auxiliary{}});
        add_error(preview, name, estimate_of(strata), setting.noise);
    }
    split_combining(preview.facts, field.kind());
    split_combining(preview.likely, field.kind());
    return preview;
}

}  // namespace edgewise
