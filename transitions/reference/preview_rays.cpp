#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numbers>
#include <tbb/parallel_for.h>

#include "transitions/reference/coarse_picture.hpp"
#include "transitions/reference/drawn_pixels.hpp"
#include "transitions/reference/preview.hpp"
#include "transitions/reference/preview_block.hpp"
#include "transitions/reference/preview_paths.hpp"
#include "transitions/reference/preview_short.hpp"
#include "transitions/reference/preview_spectrum.hpp"

namespace edgewise {
namespace {

constexpr int kFewest = 96, kMost = 448;  // bundles
constexpr double kLength = 96 * 256.0;    // that all bundles together should reach [unit]
// Inputs of so many samples are prepared once for all bundles.
constexpr std::int64_t kSmallInput = 1 << 19;
// Pictures of so many pixels are measured whole, if their input is small.
constexpr std::int64_t kSmallPicture = 1 << 12;
constexpr std::array<double, 4> kSteps = {1, 0.5, 0.25, 2};
constexpr std::size_t kFinest = 2;  // of kSteps
constexpr double kFine = 1.0 / Reference::kStepsPerUnit;
constexpr double kBlockSide = 20;  // samples that a stretch of a bundle covers on its longest axis

/// One ray with all pictures that it is part of.
struct Traced {
    RaySpan ray;
    OutputSample at;
    Stretch reference;
    std::array<Stretch, 2> noisy;  // zoh, foh with noise in the samples, step 1
    std::array<std::array<Stretch, kSteps.size()>, 3> cast;  // by hold and step
    std::optional<ScreenPicture> screen;
    std::optional<ShearedPicture> sheared;               // of parallel rays
    std::vector<SpectrumPicture::Named> spectrum;        // squared errors
    std::array<std::int64_t, 1 + kSteps.size()> next{};  // cell, of the fine step and the others
    double low = 0, high = 0;  // part of the ray that any of the pictures needs [t]
};

/// What a ray was taken for: drawn at random; chosen, because the reference is likely to be extreme
/// there; of the classes of ShortRays.
enum Among : std::size_t { kDrawn, kChosen, kShort, kAmong = kShort + ShortRays::kClasses };

/// Neighbouring pixels, so that their rays share blocks of the input.
struct Bundle {
    std::size_t among = kDrawn;
    double weight = 1;  // the inverse of how likely it was to be drawn
    std::vector<Traced> rays;
    std::array<double, 4> field{};    // squared errors of zoh, foh, bspline3, me
    std::array<double, 2> sheared{};  // of a pass of shears: foh, bspline3
    double points = 0, sheared_points = 0;
};

/// What a stretch of a bundle is measured with.
struct Setting {
    const Request& want;
    const ReferenceField& field;
    double noise;  // RMS [value]
};

/// Where the first cell of cast rays begins: in front of the first layer of the screen, or in the
/// eye, as in project.ray_cast.
double front_of(const Request& want) { return want.eye ? 0 : -0.5; }

bool is_short(const RaySpan& ray, const Request& want) {
    return ShortRays::class_of(ray, want) < ShortRays::kClasses;
}

/// @param side   pixels along x and y
/// @param whole  with the short rays too, where they are drawn by themselves
Bundle bundle_at(const Request& want, const ViewGeometry& geometry, const OutputSample& corner,
                 std::size_t among, int side = 2, bool whole = true) {
    Bundle bundle{.among = among, .rays = {}};
    for (int i = 0; i < side * side; ++i) {
        const std::int64_t x = corner.x + i % side, y = corner.y + i / side;
        if (x < 0 || y < 0 || x >= want.screen.x || y >= want.screen.y) continue;
        const std::optional<RaySpan> ray =
            geometry.ray(corner.view, static_cast<double>(x), static_cast<double>(y));
        if (!ray || (!whole && is_short(*ray, want))) continue;
        const Stretch empty = Stretch::empty(want.mode);
        Traced traced{.ray = *ray,
                      .at = {corner.view, x, y, 0},
                      .reference = empty,
                      .noisy = {empty, empty},
                      .cast = {},
                      .screen = {},
                      .sheared = {},
                      .spectrum = {},
                      .low = ray->low,
                      .high = ray->high};
        if (!want.eye) {
            traced.screen.emplace(*ray, want.mode);
            traced.sheared.emplace(*ray, want.input, want.mode);
            traced.low = std::min(traced.low, traced.sheared->begin());
            traced.high = std::max(traced.high, traced.sheared->end());
        }
        for (auto& steps : traced.cast) steps.fill(empty);
        traced.next[0] = static_cast<std::int64_t>(std::floor(ray->low / kFine));
        for (std::size_t s = 0; s < kSteps.size(); ++s)
            traced.next[s + 1] =
                static_cast<std::int64_t>(std::floor((ray->low - front_of(want)) / kSteps[s]));
        bundle.rays.push_back(traced);
    }
    return bundle;
}

/// Calls each(t, length) for the cells of one step whose middles lie before `end`.
template <class Each>
void cells_before(double end, double front, double step, const RaySpan& ray, std::int64_t& next,
                  Each&& each) {
    for (;; ++next) {
        const double begin = front + static_cast<double>(next) * step;
        const double low = std::max(ray.low, begin), high = std::min(ray.high, begin + step);
        if (0.5 * (low + high) >= end || begin >= ray.high) return;
        if (low < high) each(0.5 * (low + high), high - low);
    }
}

void trace(Traced& traced, const PreviewBlock& block, double end, const Setting& setting,
           Bundle& bundle) {
    const Request& want = setting.want;
    const RaySpan& ray = traced.ray;
    double expected = 0;
    const auto place = [&](double t) { return Vec3(ray.origin + t * ray.direction); };
    const auto add = [&](Stretch& to, double seen, double length) {
        if (std::isfinite(seen)) to.add(seen, length, want);
    };
    cells_before(end, 0, kFine, ray, traced.next[0], [&](double t, double length) {
        const Vec3 p = place(t);
        if (block.reference(p, &expected)) add(traced.reference, expected, length);
    });
    if (traced.screen) traced.screen->trace(block, end, want);
    if (traced.sheared) traced.sheared->trace(block, end, want);
    for (std::size_t s = 0; s < kSteps.size(); ++s)
        cells_before(
            end, front_of(want), kSteps[s], ray, traced.next[s + 1], [&](double t, double length) {
                const Vec3 p = place(t);
                std::array<double, 4> held{};
                for (PreviewHold hold : {kZoh, kFoh, kSpline}) {
                    block.hold(hold, p, &held[hold]);
                    add(traced.cast[hold][s], held[hold], length);
                }
                if (kSteps[s] == 1)
                    for (PreviewHold hold : {kZoh, kFoh})
                        add(traced.noisy[hold], held[hold] + setting.noise * block.noise(hold, p),
                            length);
                if (kSteps[s] != 0.5 || !block.reference(p, &expected)) return;
                block.assigned(p, static_cast<std::uint64_t>(std::abs(1e3 * (t + p.sum()))),
                               &held[3]);
                for (std::size_t method = 0; method < 4; ++method) {
                    const double d = held[method] - expected;
                    if (std::isfinite(d)) bundle.field[method] += d * d * length;
                }
                bundle.points += length;
                if (want.eye || (traced.next[s + 1] & 3) != 0) return;
                const std::array<double, 2> wrong =
                    block.sheared(p, static_cast<std::uint64_t>(std::abs(1e3 * (t + p.sum()))));
                for (std::size_t i = 0; i < wrong.size(); ++i)
                    if (std::isfinite(wrong[i])) bundle.sheared[i] += wrong[i] * wrong[i];
                ++bundle.sheared_points;
            });
}

/// The box of cells that the rays of a bundle cross between begin and end; none: empty.
Region cells_between(const Bundle& bundle, double begin, double end, const ReferenceField& field) {
    Region cells{{field.extent().x, field.extent().y, field.extent().z}, {0, 0, 0}};
    for (const Traced& traced : bundle.rays)
        for (double t : {std::max(begin, traced.low), std::min(end, traced.high)}) {
            if (t < traced.low || t > traced.high) continue;
            const Vec3 p = field.clamped(traced.ray.origin + t * traced.ray.direction);
            for (int axis = 0; axis < 3; ++axis) {
                const auto cell = static_cast<std::int64_t>(std::floor(p[axis]));
                cells.begin[axis] = std::min(cells.begin[axis], cell);
                cells.end[axis] = std::max(cells.end[axis], cell + 1);
            }
        }
    return cells;
}

/// @param whole  of all the input, or null: one is prepared for each stretch
void measure(Bundle& bundle, const Setting& setting, const PreviewBlock* whole,
             std::pmr::memory_resource* memory) {
    constexpr double kEnd = std::numeric_limits<double>::infinity();
    if (whole) {
        for (Traced& traced : bundle.rays) trace(traced, *whole, kEnd, setting, bundle);
        return;
    }
    double low = kEnd, high = -low, speed = 0;
    for (const Traced& traced : bundle.rays) {
        low = std::min(low, traced.low);
        high = std::max(high, traced.high);
        speed = std::max(speed, traced.ray.direction.cwiseAbs().maxCoeff());
    }
    const double piece = kBlockSide / speed;
    for (double begin = low; begin < high; begin += piece) {
        const double end = begin + piece >= high ? kEnd : begin + piece;
        const Region cells = cells_between(bundle, begin, std::min(end, high), setting.field);
        if (cells.empty()) continue;
        const PreviewBlock block(setting.field, cells, memory);
        for (Traced& traced : bundle.rays) trace(traced, block, end, setting, bundle);
    }
}

struct Drawn {
    std::vector<Bundle> bundles;
    double pixels = 0;  // of all views that see the input, about; without short rays
    bool all = false;   // every pixel is there, once
};

/// All pixels of all views that see the input.
Drawn take_all(const Request& want, const ViewGeometry& geometry) {
    Drawn drawn;
    drawn.all = true;
    for (int view = 0; view < want.frames; ++view)
        for (std::int64_t y = 0; y < want.screen.y; y += 2)
            for (std::int64_t x = 0; x < want.screen.x; x += 2) {
                Bundle bundle = bundle_at(want, geometry, {view, x, y, 0}, kDrawn);
                drawn.pixels += static_cast<double>(bundle.rays.size());
                if (!bundle.rays.empty()) drawn.bundles.push_back(std::move(bundle));
            }
    return drawn;
}

/// Some of the pixels, as draw_pixels has it, each with its neighbours.
Drawn draw(const Request& want, const ReferenceField& field, const ViewGeometry& geometry) {
    // Without blocks to prepare a ray costs less.
    const double length = (want.input.samples() <= kSmallInput ? 2 : 1) * kLength;
    const DrawnPixels pixels = draw_pixels(want, field, geometry, kFewest, kMost, length);
    Drawn drawn{.bundles = {}, .pixels = pixels.pixels};
    for (const auto& [at, weight] : pixels.drawn) {
        // Cells of a lattice, so that each pixel is part of one bundle.
        drawn.bundles.push_back(
            bundle_at(want, geometry, {at.view, at.x / 2 * 2, at.y / 2 * 2, 0}, kDrawn, 2, false));
        drawn.bundles.back().weight = weight;
    }
    return drawn;
}

/// Tallies of everything that is compared, by the name of its fact.
struct Tallies {
    std::array<std::map<std::string, ErrorTally>, kAmong> among;
    double chosen_rays = 0;
    double low = std::numeric_limits<double>::infinity(), high = -low;
};

constexpr std::array<const char*, ScreenPicture::kMethods> kMethods = {"zoh", "foh", "bspline3",
                                                                       "me"};
/// Edges of project/ stop a ray where less than this is left to see.
constexpr double kTerminated = 1.0 / 4096;

using Values = std::array<double, 4>;

Values values_of(const Stretch& stretch, const Request& want) {
    Values values{};
    stretch.result(want, values.data());
    return values;
}

double square_of(const Values& a, const Values& b, const Request& want) {
    double square = 0;
    for (std::size_t c = 0; c < a.size(); ++c) square += (a[c] - b[c]) * (a[c] - b[c]);
    return want.mode == Mode::composite ? square / 4 : square;
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

/// Calls each(name, square) for everything that is measured on one ray.
template <class Each>
void compare(const Traced& traced, const Request& want, Each&& each) {
    const Values expected = values_of(traced.reference, want);
    const auto against = [&](const Stretch& got) {
        return square_of(values_of(got, want), expected, want);
    };
    for (std::size_t hold = 0; hold < kPreviewHolds.size(); ++hold)
        for (std::size_t s = 0; s < kSteps.size(); ++s)
            each(fmt::format("picture/{}/{}", kPreviewHolds[hold], kSteps[s]),
                 against(traced.cast[hold][s]));
    for (PreviewHold hold : {kZoh, kFoh}) {
        const Values clean = values_of(traced.cast[hold][0], want);
        each(fmt::format("noisy/{}", kPreviewHolds[hold]),
             square_of(values_of(traced.noisy[hold], want), clean, want));
        if (!traced.sheared) continue;
        Values values{};
        traced.sheared->result(hold, want, values);
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

/// @param even  bundles count alike: each was drawn as often as it has rays that meet the input
void tally(const Bundle& bundle, const Request& want, bool even, Tallies& tallies) {
    auto& by_name = tallies.among[bundle.among];
    const int channels = want.mode == Mode::composite ? 4 : 1;
    const double weight = bundle.weight * (even ? 1 / static_cast<double>(bundle.rays.size()) : 1);
    for (const Traced& traced : bundle.rays) {
        const Values value = values_of(traced.reference, want);
        for (int c = 0; c < channels; ++c) {
            tallies.low = std::min(tallies.low, value[c]);
            tallies.high = std::max(tallies.high, value[c]);
        }
        compare(traced, want, [&](const std::string& name, double square) {
            by_name[name].add(square * weight, weight);
        });
    }
    if (bundle.among == kChosen) tallies.chosen_rays += static_cast<double>(bundle.rays.size());
    for (std::size_t method = 0; method < kMethods.size(); ++method)
        by_name[fmt::format("field/{}", kMethods[method])].add(bundle.weight * bundle.field[method],
                                                               bundle.weight * bundle.points);
    for (std::size_t i = 0; i < bundle.sheared.size(); ++i)
        by_name[fmt::format("sheared/{}", kMethods[i + 1])].add(
            bundle.weight * bundle.sheared[i], bundle.weight * bundle.sheared_points);
    for (auto& [name, errors] : by_name) errors.close();
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
    if (!facts.contains("picture/screen/zoh")) return;
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

/// Of the pixels that see the input.
std::array<double, kAmong> shares_of(const Drawn& drawn, const ShortRays& short_rays,
                                     const Tallies& tallies) {
    std::array<double, kAmong> shares{1};
    if (drawn.all) return shares;
    double pixels = drawn.pixels;
    for (const DrawnPixels& of : short_rays.classes) pixels += of.pixels;
    pixels = std::max(1.0, pixels);
    shares[kChosen] = std::min(1.0, tallies.chosen_rays / pixels);
    for (std::size_t c = 0; c < short_rays.classes.size(); ++c)
        shares[kShort + c] = short_rays.classes[c].pixels / pixels;
    shares[kDrawn] = 1;
    for (std::size_t among = kChosen; among < kAmong; ++among) shares[kDrawn] -= shares[among];
    shares[kDrawn] = std::max(0.0, shares[kDrawn]);
    return shares;
}

}  // namespace

Preview preview_rays(const Request& want, const ReferenceField& field, const Statistics& statistics,
                     std::pmr::memory_resource* memory) {
    const ViewGeometry geometry(want);
    // About the rounding to 8 bits: gains of a maximum depend on how large noise is.
    const Setting setting{want, field, 1e-3 * (statistics.high - statistics.low)};
    // In a small input rays cost little, and in a small picture a few pixels carry the error.
    const bool is_small = field.extent().samples() <= kSmallInput;
    const bool take_every = is_small && want.output().samples() * want.frames <= kSmallPicture;
    Drawn drawn = take_every ? take_all(want, geometry) : draw(want, field, geometry);
    std::vector<Bundle>& bundles = drawn.bundles;
    std::optional<PreviewBlock> whole;
    for (OutputSample at : likely_extremes(want, field, geometry, statistics)) {
        at.x -= is_small;
        at.y -= is_small;
        bundles.push_back(bundle_at(want, geometry, at, kChosen, is_small ? 4 : 2));
    }
    ShortRays short_rays;
    if (!drawn.all) short_rays = draw_short_rays(want, field, geometry);
    for (std::size_t c = 0; c < short_rays.classes.size(); ++c)
        for (const auto& [at, weight] : short_rays.classes[c].drawn) {
            bundles.push_back(bundle_at(want, geometry, at, kShort + c, 1));
            bundles.back().weight = weight;
        }
    if (is_small) whole.emplace(field, Region::all(field.extent()), memory);
    std::optional<SpectrumPicture> spectrum;
    if (has_slices(want, statistics)) spectrum.emplace(want, field.samples(), statistics);
    tbb::parallel_for(std::size_t{0}, bundles.size(), [&](std::size_t i) {
        measure(bundles[i], setting, whole ? &*whole : nullptr, memory);
        if (!spectrum) return;
        // Neighbours have much the same ghosts: of four rays one.
        for (Traced& traced : bundles[i].rays)
            if (bundles[i].rays.size() == 1 || (traced.at.x % 2 == 0 && traced.at.y % 2 == 0))
                add_spectrum(traced, *spectrum, want);
    });

    Tallies tallies;
    for (const Bundle& bundle : bundles)
        tally(bundle, want, !drawn.all && bundle.among == kDrawn, tallies);
    Preview preview{.facts = {}, .low = tallies.low, .high = tallies.high};
    const std::array<double, kAmong> shares = shares_of(drawn, short_rays, tallies);
    for (const auto& [name, errors] : tallies.among[kDrawn]) {
        // Points of the field are weighed by the length of rays, of which short ones have nothing.
        const bool is_picture = name.starts_with("picture/") || name.starts_with("noisy/");
        std::vector<Stratum> strata;
        double square = 0;
        for (std::size_t among = 0; among < (is_picture ? kAmong : kShort); ++among) {
            const ErrorTally& tally = tallies.among[among][name];
            const bool whole_one =
                among == kChosen || (among >= kShort && short_rays.classes[among - kShort].whole);
            strata.push_back({shares[among], tally, whole_one});
            square += shares[among] * tally.mean();
        }
        if (!name.starts_with("noisy/"))
            preview.facts[name] = upper_of(strata);
        else if (setting.noise > 0)
            preview.facts["gain/noise/" + name.substr(6)] = std::sqrt(square) / setting.noise;
    }
    split_combining(preview.facts, field.kind());
    return preview;
}

}  // namespace edgewise
