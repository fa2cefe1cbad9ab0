#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory_resource>
#include <span>
#include <tbb/parallel_for.h>

#include "graph/range.hpp"
#include "reference/jumps.hpp"
#include "reference/written.hpp"
#include "scene/likely_extremes.hpp"
#include "scene/preview.hpp"
#include "scene/preview_bundle.hpp"

namespace edgewise {
namespace {

constexpr int kFewest = 72, kMost = 288;  // bundles
constexpr std::size_t kAtOnce = 128;
constexpr int kSide = 2;                // of a bundle [pixel]
constexpr double kLength = 64 * 256.0;  // that all bundles together should reach [unit]
// Inputs of so many samples are prepared once for all bundles.
constexpr std::int64_t kSmallInput = 1 << 19;
// Pictures of so many pixels are measured whole, if their input is small, or if a few of their
// pixels jump.
constexpr int kSmallPicture = 1 << 12;

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
           double times) {
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

/// Tallies of everything that is compared, by fact.
struct Tallies {
    explicit Tallies(std::size_t facts) {
        among.fill(std::vector<ErrorTally>(facts));
        measured.fill(std::vector<bool>(facts));
        jumps.fill(std::vector<Jumps>(facts));
    }
    std::array<std::vector<ErrorTally>, kAmong> among;
    std::array<std::vector<bool>, kAmong> measured;  // by fact
    struct Jumps {
        double fourths = 0, weight = 0;
    };
    std::array<std::vector<Jumps>, kAmong> jumps;  // by fact
    std::int64_t draws = 0;
    double low = std::numeric_limits<double>::infinity(), high = -low;
};

/// @param even  bundles count by their weights alone, not by how many rays they have
void tally(const Bundle& bundle, const Draw& draw, const RaySetting& setting, bool even,
           Tallies& tallies) {
    const Request& want = setting.want;
    const int channels = written_channels(want, want.mode->channels);
    const double weight = draw.weight * (even ? 1 / static_cast<double>(bundle.rays.size()) : 1);
    for (const Traced& traced : bundle.rays) {
        const RayAnswer answer(traced.reference, want);  // for what is expected alone
        for (int c = 0; c < channels; ++c) {
            tallies.low = std::min(tallies.low, answer.expected()[c]);
            tallies.high = std::max(tallies.high, answer.expected()[c]);
        }
        if (draw.among == kChosen) continue;
        for (std::size_t m = 0; m < setting.models.size(); ++m) {
            const double rays = setting.models[m]->stands_for_neighbours() ? traced.stands_for : 1;
            for (std::size_t i = 0; i < setting.models[m]->facts().size(); ++i) {
                const std::size_t fact = setting.first[m] + i;
                if (!traced.squares[fact]) continue;
                const RayLook::Cast like = setting.facts[fact].like;
                tallies.among[draw.among][fact].add(
                    *traced.squares[fact], weight * rays,
                    like < RayLook::kCasts ? traced.look.squares[like] : 0);
                tallies.measured[draw.among][fact] = true;
                Tallies::Jumps& jumps = tallies.jumps[draw.among][fact];
                if (!traced.fourths.empty()) jumps.fourths += weight * rays * traced.fourths[fact];
                jumps.weight += weight * rays;
            }
        }
    }
    if (draw.among == kChosen) return;
    ++tallies.draws;
    for (std::size_t fact = 0; fact < setting.facts.size(); ++fact) {
        ErrorTally& errors = tallies.among[draw.among][fact];
        const auto& [squares, points] = bundle.points[fact];
        if (points > 0) {
            errors.add(squares / points, draw.weight * points);
            tallies.measured[draw.among][fact] = true;
        }
        errors.close(draw.chance);
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

/// Decisive values of kernels and of previews in f32, against f64.
double rounding_of(const Statistics& statistics, const Request& want) {
    // Places and weights move values by a share of their range; sums in f32 round their magnitude.
    constexpr double kRounding = 1e-5, kOfMagnitude = 0x1p-22;
    return std::max(kRounding * range_between(statistics.low, statistics.high),
                    kOfMagnitude * want.magnitude);
}

/// Where jumps are told by their density, their number in the picture is left to chance: Poisson's
/// variance of the mean square.
double jumps_of(const Tallies& tallies, const std::array<double, kAmong>& shares,
                const Drawn& drawn, std::size_t fact) {
    double pixels = 0, mean = 0;
    for (std::size_t among = 0; among < kAmong; ++among) {
        const auto& [fourths, weight] = tallies.jumps[among][fact];
        if (weight > 0) mean += shares[among] * fourths / weight;
        pixels += drawn.from[among].pixels;
    }
    return mean / std::max(1.0, pixels);
}

/// A few bundles at once, so that memory does not grow with the draws.
/// @return by group of draws, each a systematic part of them; all in one where there are no groups
std::vector<Tallies> tally_all(const Drawn& drawn, const RaySetting& setting,
                               const ViewGeometry& geometry, const PreviewOf& of,
                               std::pmr::memory_resource* memory) {
    const ReferenceField& field = setting.field;
    std::optional<PreviewBlock> whole;
    if (field.extent().samples() <= kSmallInput && of.times >= 1) {
        whole.emplace(field, Region::all(field.extent()), memory);
        if (setting.want.mode->threshold) whole->read_exactly(memory);
    }
    // Blocks are too large for malloc to keep: each would be mapped, and cleared, anew.
    std::pmr::synchronized_pool_resource blocks(
        {.max_blocks_per_chunk = 1, .largest_required_pool_block = 1 << 20}, memory);
    std::vector<Tallies> tallies(std::max<std::size_t>(1, of.groups),
                                 Tallies(setting.facts.size()));
    std::vector<Bundle> bundles(std::min(kAtOnce, drawn.draws.size()));
    for (std::size_t first = 0; first < drawn.draws.size(); first += bundles.size()) {
        const auto draws = std::span(drawn.draws)
                               .subspan(first)
                               .first(std::min(bundles.size(), drawn.draws.size() - first));
        tbb::parallel_for(std::size_t{0}, draws.size(), [&](std::size_t i) {
            const auto& [corner, among, weight, chance, side, with_short] = draws[i];
            bundles[i] = bundle_at(setting, geometry, corner, side, with_short);
            measure(bundles[i], setting, whole ? &*whole : nullptr, &blocks);
            // Where all were drawn none was looked at: there is no mean of looks to compare with.
            const bool looked = !drawn.all && among != kChosen && !drawn.from[among].looked.empty();
            for (Traced& traced : bundles[i].rays)
                if (looked) {
                    traced.look = look_at(traced.ray, setting.want, field);
                    count_nearby(traced.look, drawn.from[among].nearby);
                }
        });
        for (std::size_t i = 0; i < draws.size(); ++i)
            if (!bundles[i].rays.empty())
                tally(bundles[i], draws[i], setting, !drawn.all && draws[i].among == kDrawn,
                      tallies[(first + i) % tallies.size()]);
    }
    return tallies;
}

/// Of all groups but one. @param but  not a group: all of them
Tallies joined(const std::vector<Tallies>& groups, std::size_t but) {
    Tallies all(groups.front().among.front().size());
    for (std::size_t g = 0; g < groups.size(); ++g) {
        if (g == but) continue;
        const Tallies& group = groups[g];
        all.draws += group.draws;
        all.low = std::min(all.low, group.low), all.high = std::max(all.high, group.high);
        for (std::size_t among = 0; among < kAmong; ++among)
            for (std::size_t fact = 0; fact < all.among[among].size(); ++fact) {
                all.among[among][fact].append(group.among[among][fact]);
                if (group.measured[among][fact]) all.measured[among][fact] = true;
                all.jumps[among][fact].fourths += group.jumps[among][fact].fourths;
                all.jumps[among][fact].weight += group.jumps[among][fact].weight;
            }
    }
    return all;
}

using Auxiliaries = std::array<std::array<Auxiliary, RayLook::kCasts>, kAmong>;

FactMaps facts_of(const Tallies& tallies, const Drawn& drawn, const Auxiliaries& auxiliaries,
                  const RaySetting& setting) {
    FactMaps facts;
    const std::array<double, kAmong> shares = shares_of(drawn);
    const auto most =
        static_cast<std::size_t>(std::max_element(shares.begin(), shares.end()) - shares.begin());
    for (std::size_t fact = 0; fact < setting.facts.size(); ++fact) {
        const auto& [name, like, like_point, of_points] = setting.facts[fact];
        // In a thin slab all rays are short, and none was drawn at random.
        if (!tallies.measured[kDrawn][fact] && (of_points || !tallies.measured[most][fact]))
            continue;
        // Points of the field are weighed by the length of rays, of which short ones have nothing.
        std::vector<Stratum> strata;
        for (std::size_t among = 0; among < (of_points ? kShort : kAmong); ++among)
            strata.push_back({shares[among], tallies.among[among][fact], drawn.from[among].whole,
                              like < RayLook::kCasts ? auxiliaries[among][like] : Auxiliary{}});
        const ErrorEstimate error = estimate_of(strata, jumps_of(tallies, shares, drawn, fact));
        facts.upper[name] = error.upper;
        facts.likely[name] = error.likely;
    }
    for (const auto& model : setting.models) model->derive(facts);
    return facts;
}

/// Whether all pixels are measured: in a small input rays cost little, and in a small picture a few
/// pixels carry the error.
bool takes_all(const Request& want, const ReferenceField& field, const PreviewOf& of) {
    const std::int64_t pixels = want.output().samples() * want.frames;
    if (of.times < 1) return pixels <= kFewest;
    const bool small = field.extent().samples() <= kSmallInput;
    const double most = std::max<double>(kSmallPicture, 4 * kMost * of.times);
    return (small && static_cast<double>(pixels) <= most) ||
           (want.mode->threshold && pixels <= kSmallPicture);
}

}  // namespace

Preview preview_rays(const Catalogue& catalogue, const PreviewOf& of, const Request& want,
                     const ReferenceField& field, const Statistics& statistics,
                     std::pmr::memory_resource* memory) {
    const ViewGeometry geometry(want);
    ModelSetting made{want, field, statistics, {}, {}, {}};
    RaySetting setting(want, field, models_of(catalogue, field.samples().what, of, made));
    Drawn drawn =
        takes_all(want, field, of) ? take_all(want) : draw(want, field, geometry, of.times);
    if (!drawn.all && !of.wanted) add_chosen(want, field, statistics, geometry, drawn);
    setting.nearby = {drawn.from[kDrawn].nearby, rounding_of(statistics, want), lowered_by(want)};
    const std::vector<Tallies> groups = tally_all(drawn, setting, geometry, of, memory);
    const Tallies tallies = joined(groups, groups.size());
    Auxiliaries auxiliaries;
    for (std::size_t among = 0; among < kAmong; ++among)
        auxiliaries[among] = drawn.from[among].auxiliaries();
    FactMaps facts = facts_of(tallies, drawn, auxiliaries, setting);
    Preview preview{.facts = std::move(facts.upper),
                    .likely = std::move(facts.likely),
                    .draws = tallies.draws,
                    .exhausted = drawn.all,
                    .low = tallies.low,
                    .high = tallies.high,
                    .without = {}};
    for (std::size_t g = 0; g < of.groups; ++g)
        preview.without.push_back(facts_of(joined(groups, g), drawn, auxiliaries, setting).likely);
    return preview;
}

}  // namespace edgewise
