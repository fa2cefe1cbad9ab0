#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>

#include "transitions/reference/coarse_picture.hpp"
#include "transitions/reference/preview.hpp"
#include "transitions/reference/preview_block.hpp"

namespace edgewise {
namespace {

constexpr int kFewest = 28, kMost = 112;     // bundles
constexpr double kLength = 28 * 256.0;       // that all bundles together should reach [unit]
constexpr int kTries = 64 * kFewest;
constexpr std::array<double, 3> kSteps = {1, 0.5, 0.25};
constexpr double kFine = 1.0 / Reference::kStepsPerUnit;
constexpr double kBlockSide = 20;  // samples that a stretch of a bundle covers on its longest axis

/// One ray with all pictures that it is part of.
struct Traced {
    RaySpan ray;
    Stretch reference, fine, noisy;  // reference; foh with its step; foh with noise, step 1
    std::array<std::array<Stretch, kSteps.size()>, 3> cast;  // by hold and step
    std::array<std::int64_t, 1 + kSteps.size()> next{};      // cell, of the fine step and the others
};

/// Neighbouring pixels, so that their rays share blocks of the input.
struct Bundle {
    bool counted = true;  // false: only the reference, for the range
    std::vector<Traced> rays;
    std::array<double, 4> field{};  // squared errors of zoh, foh, bspline3, me
    double points = 0;
};

/// What a stretch of a bundle is measured with.
struct Setting {
    const Request& want;
    const ReferenceField& field;
    double noise;  // RMS [value]
};

Bundle bundle_at(const Request& want, const ViewGeometry& geometry, const OutputSample& corner,
                 bool counted) {
    Bundle bundle{.counted = counted, .rays = {}};
    for (int i = 0; i < 4; ++i) {
        const std::int64_t x = corner.x + (i & 1), y = corner.y + (i >> 1);
        if (x >= want.screen.x || y >= want.screen.y) continue;
        const std::optional<RaySpan> ray =
            geometry.ray(corner.view, static_cast<double>(x), static_cast<double>(y));
        if (!ray) continue;
        Traced traced{.ray = *ray, .reference = {}, .fine = {}, .noisy = {}, .cast = {}};
        const Stretch empty = Stretch::empty(want.mode);
        traced.reference = traced.fine = traced.noisy = empty;
        for (auto& steps : traced.cast) steps.fill(empty);
        traced.next[0] = static_cast<std::int64_t>(std::floor(ray->low / kFine));
        for (std::size_t s = 0; s < kSteps.size(); ++s)
            traced.next[s + 1] = static_cast<std::int64_t>(std::floor(ray->low / kSteps[s]));
        bundle.rays.push_back(traced);
    }
    return bundle;
}

/// Calls each(t, length) for the cells of one step whose middles lie before `end`.
template <class Each>
void cells_before(double end, double step, const RaySpan& ray, std::int64_t& next, Each&& each) {
    for (;; ++next) {
        const double low = std::max(ray.low, static_cast<double>(next) * step);
        const double high = std::min(ray.high, static_cast<double>(next + 1) * step);
        if (0.5 * (low + high) >= end || static_cast<double>(next) * step >= ray.high) return;
        if (low < high) each(0.5 * (low + high), high - low);
    }
}

void trace(Traced& traced, const PreviewBlock& block, double end, const Setting& setting,
           Bundle& bundle) {
    const Request& want = setting.want;
    const RaySpan& ray = traced.ray;
    double expected = 0, value = 0;
    const auto place = [&](double t) { return Vec3(ray.origin + t * ray.direction); };
    const auto add = [&](Stretch& to, double seen, double length) {
        if (std::isfinite(seen)) to.add(seen, length, want);
    };
    cells_before(end, kFine, ray, traced.next[0], [&](double t, double length) {
        const Vec3 p = place(t);
        if (block.reference(p, &expected)) add(traced.reference, expected, length);
        if (!bundle.counted) return;
        block.hold(kFoh, p, &value);
        add(traced.fine, value, length);
    });
    if (!bundle.counted) return;
    for (std::size_t s = 0; s < kSteps.size(); ++s)
        cells_before(end, kSteps[s], ray, traced.next[s + 1], [&](double t, double length) {
            const Vec3 p = place(t);
            std::array<double, 4> held{};
            for (PreviewHold hold : {kZoh, kFoh, kSpline}) {
                block.hold(hold, p, &held[hold]);
                add(traced.cast[hold][s], held[hold], length);
            }
            if (kSteps[s] == 1)
                add(traced.noisy, held[kFoh] + setting.noise * block.noise(p), length);
            if (kSteps[s] != 0.5 || !block.reference(p, &expected)) return;
            block.assigned(p, static_cast<std::uint64_t>(std::abs(1e3 * (t + p.sum()))), &held[3]);
            for (std::size_t method = 0; method < 4; ++method) {
                const double d = held[method] - expected;
                if (std::isfinite(d)) bundle.field[method] += d * d * length;
            }
            bundle.points += length;
        });
}

/// The box of cells that the rays of a bundle cross between begin and end; none: empty.
Region cells_between(const Bundle& bundle, double begin, double end, const ReferenceField& field) {
    Region cells{{field.extent().x, field.extent().y, field.extent().z}, {0, 0, 0}};
    for (const Traced& traced : bundle.rays)
        for (double t : {std::max(begin, traced.ray.low), std::min(end, traced.ray.high)}) {
            if (t < traced.ray.low || t > traced.ray.high) continue;
            const Vec3 p = field.clamped(traced.ray.origin + t * traced.ray.direction);
            for (int axis = 0; axis < 3; ++axis) {
                const auto cell = static_cast<std::int64_t>(std::floor(p[axis]));
                cells.begin[axis] = std::min(cells.begin[axis], cell);
                cells.end[axis] = std::max(cells.end[axis], cell + 1);
            }
        }
    return cells;
}

void measure(Bundle& bundle, const Setting& setting, std::pmr::memory_resource* memory) {
    double low = std::numeric_limits<double>::infinity(), high = -low, speed = 0;
    for (const Traced& traced : bundle.rays) {
        low = std::min(low, traced.ray.low);
        high = std::max(high, traced.ray.high);
        speed = std::max(speed, traced.ray.direction.cwiseAbs().maxCoeff());
    }
    const double piece = kBlockSide / speed;
    for (double begin = low; begin < high; begin += piece) {
        const double end = begin + piece >= high ? std::numeric_limits<double>::infinity()
                                                 : begin + piece;
        const Region cells = cells_between(bundle, begin, std::min(end, high), setting.field);
        if (cells.empty()) continue;
        const PreviewBlock block(setting.field, cells, memory);
        for (Traced& traced : bundle.rays) trace(traced, block, end, setting, bundle);
    }
}

/// Rays spread evenly over views and pixels by the additive recurrence of the generalised golden
/// ratio (Roberts 2018), of those that meet the input.
std::vector<Bundle> draw(const Request& want, const ViewGeometry& geometry) {
    constexpr std::array<double, 3> ratio = {0.8191725, 0.6710436, 0.5497005};
    std::vector<Bundle> bundles;
    double length = 0;
    for (int i = 0; i < kTries && bundles.size() < kMost; ++i) {
        if (bundles.size() >= kFewest && length > kLength) break;
        std::array<double, 3> u;
        for (int axis = 0; axis < 3; ++axis)
            u[axis] = std::fmod(0.5 + ratio[axis] * (i + 1), 1.0);
        const OutputSample at{
            static_cast<int>(u[2] * want.frames),
            static_cast<std::int64_t>(u[0] * static_cast<double>(want.screen.x)),
            static_cast<std::int64_t>(u[1] * static_cast<double>(want.screen.y)), 0};
        const std::optional<RaySpan> ray = geometry.ray(at);
        if (!ray) continue;
        bundles.push_back(bundle_at(want, geometry, at, true));
        length += ray->high - ray->low;
    }
    return bundles;
}

/// Tallies of everything that is compared, by the name of its fact.
struct Tallies {
    std::map<std::string, ErrorTally> by_name;
    ErrorTally fine, noisy;
    double low = std::numeric_limits<double>::infinity(), high = -low;
};

double square_of(const Stretch& got, const Stretch& expected, const Request& want) {
    std::array<double, 4> a{}, b{};
    got.result(want, a.data());
    expected.result(want, b.data());
    double square = 0;
    for (int c = 0; c < 4; ++c) square += (a[c] - b[c]) * (a[c] - b[c]);
    return want.mode == Mode::composite ? square / 4 : square;
}

void tally(const Bundle& bundle, const Request& want, Tallies& tallies) {
    const int channels = want.mode == Mode::composite ? 4 : 1;
    for (const Traced& traced : bundle.rays) {
        std::array<double, 4> value{};
        traced.reference.result(want, value.data());
        for (int c = 0; c < channels; ++c) {
            tallies.low = std::min(tallies.low, value[c]);
            tallies.high = std::max(tallies.high, value[c]);
        }
    }
    if (!bundle.counted) return;
    for (std::size_t hold = 0; hold < kPreviewHolds.size(); ++hold)
        for (std::size_t s = 0; s < kSteps.size(); ++s) {
            ErrorTally& errors =
                tallies.by_name[fmt::format("picture/{}/{}", kPreviewHolds[hold], kSteps[s])];
            for (const Traced& traced : bundle.rays)
                errors.add(square_of(traced.cast[hold][s], traced.reference, want), 1);
            errors.close();
        }
    for (const Traced& traced : bundle.rays) {
        tallies.fine.add(square_of(traced.fine, traced.reference, want), 1);
        tallies.noisy.add(square_of(traced.noisy, traced.cast[kFoh][0], want), 1);
    }
    tallies.fine.close();
    tallies.noisy.close();
    for (int method = 0; method < 4; ++method) {
        ErrorTally& errors =
            tallies.by_name[method < 3 ? fmt::format("field/{}", kPreviewHolds[method])
                                       : "field/me"];
        errors.add(bundle.field[method], bundle.points);
        errors.close();
    }
}

}  // namespace

Preview preview_rays(const Request& want, const ReferenceField& field,
                     const Statistics& statistics, std::pmr::memory_resource* memory) {
    const ViewGeometry geometry(want);
    // About the rounding to 8 bits: gains of a maximum depend on how large noise is.
    const Setting setting{want, field, 1e-3 * (statistics.high - statistics.low)};
    std::vector<Bundle> bundles = draw(want, geometry);
    for (const OutputSample& at : likely_extremes(want, field, geometry, statistics))
        bundles.push_back(bundle_at(want, geometry, at, false));
    tbb::parallel_for(std::size_t{0}, bundles.size(),
                      [&](std::size_t i) { measure(bundles[i], setting, memory); });

    Tallies tallies;
    for (const Bundle& bundle : bundles) tally(bundle, want, tallies);
    Preview preview{.facts = {}, .low = tallies.low, .high = tallies.high};
    for (const auto& [name, errors] : tallies.by_name) preview.facts[name] = errors.upper();
    if (tallies.by_name.empty()) return preview;
    const double blur = tallies.by_name["field/foh"].rms();
    if (blur > 0) preview.facts["gain/blur"] = tallies.fine.rms() / blur;
    if (setting.noise > 0) preview.facts["gain/noise"] = tallies.noisy.rms() / setting.noise;
    return preview;
}

}  // namespace edgewise
