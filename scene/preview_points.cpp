#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <tbb/parallel_for.h>

#include "reference/drawn_pixels.hpp"
#include "reference/error_tally.hpp"
#include "reference/preview_block.hpp"
#include "reference/ray_look.hpp"
#include "reference/stored.hpp"
#include "scene/model.hpp"
#include "scene/preview.hpp"

namespace edgewise {
namespace {

// Near the faces of the input holds err most, and in a large input few of its samples lie there: a
// stratum of its own.
constexpr int kInner = 300, kOuter = 200, kTries = 60'000;
// So many clusters are looked at cheaply for each that is drawn: where nearest and linear samples
// are far from a guess of the reference, every hold errs, and of much that is smooth few such
// places are met by chance.
constexpr int kLooked = 32;
// Inputs of so many samples are prepared once for all clusters, of which there can be more.
constexpr std::int64_t kSmallInput = 1 << 19;
constexpr int kMore = 5, kMostMore = 20;
// Clusters where the reference may be lowest, and highest: so many of the ends of so many slopes,
// each followed over so many clusters at most.
constexpr std::size_t kExtremes = 16, kStarts = 64;
constexpr int kClimb = 64;
constexpr double kShell = 2;  // samples
/// A few neighbouring output samples, whose places in the input lie together: a cell of a lattice,
/// so that each sample is part of one cluster.
struct Cluster {
    OutputSample corner;  // any sample of the cell
    bool outer = false, counted = true;
    double weight = 1;                 // the inverse of how likely it was to be drawn
    std::array<double, 2> looked{};    // squares of zoh and foh, as looked at
    std::vector<double> squares = {};  // by fact
    double count = 0;
    double low = std::numeric_limits<double>::infinity(), high = -low;
};

/// Those of a cluster that see the input.
std::vector<OutputSample> samples_at(const Reference& reference, const Extent& n,
                                     const OutputSample& corner) {
    std::vector<OutputSample> samples;
    const std::int64_t side = n.z > 1 ? 2 : 4;
    for (std::int64_t k = 0; k < std::min(n.z, side); ++k)
        for (std::int64_t j = 0; j < side; ++j)
            for (std::int64_t i = 0; i < side; ++i) {
                const OutputSample at{corner.view, corner.x / side * side + i,
                                      corner.y / side * side + j,
                                      n.z > 1 ? corner.z / side * side + k : 0};
                if (at.x < n.x && at.y < n.y && at.z < n.z && reference.sees_input(at))
                    samples.push_back(at);
            }
    return samples;
}

struct Drawn {
    std::vector<Cluster> clusters;
    double outer_share = 0;                           // of the samples that see the input
    std::array<std::array<Auxiliary, 2>, 2> known{};  // of zoh and foh; inner, outer
};

/// A cheap estimate of the errors of a cluster.
struct Look {
    OutputSample corner;
    std::array<double, 2> squares{};  // mean squares of the differences of zoh and foh from it
    double low = std::numeric_limits<double>::infinity(), high = -low;  // of the guess
};

Look look_at(const OutputSample& corner, const Reference& reference, const Extent& n) {
    Places places;
    places.count = 0;
    for (const OutputSample& sample : samples_at(reference, n, corner))
        places.add(*reference.geometry().point(sample));
    PointLook at;
    look_at(places, reference.field(), at);
    Look look{.corner = corner};
    for (std::size_t i = 0; i < places.count; ++i) {
        const std::array off = {at.nearest[i] - at.guess[i], at.linear[i] - at.guess[i]};
        if (!std::isfinite(off[0] + off[1])) continue;
        for (std::size_t hold = 0; hold < off.size(); ++hold)
            look.squares[hold] += off[hold] * off[hold] / static_cast<double>(places.count);
        look.low = std::min(look.low, at.guess[i]);
        look.high = std::max(look.high, at.guess[i]);
    }
    return look;
}

using Before = bool (*)(const Look&, const Look&);
bool is_lower(const Look& a, const Look& b) { return a.low < b.low; }
bool is_higher(const Look& a, const Look& b) { return a.high > b.high; }

/// From cluster to neighbouring cluster, as long as the guess goes farther out.
Look climb(Look from, const Reference& reference, const Extent& n, Before before) {
    const std::int64_t side = n.z > 1 ? 2 : 4, deep = n.z > 1 ? 1 : 0;
    for (int step = 0; step < kClimb; ++step) {
        const OutputSample at = from.corner;
        bool moved = false;
        for (std::int64_t k = -deep; k <= deep; ++k)
            for (std::int64_t j = -1; j <= 1; ++j)
                for (std::int64_t i = -1; i <= 1; ++i) {
                    const OutputSample next{at.view, at.x + side * i, at.y + side * j,
                                            at.z + side * k};
                    if (next.x < 0 || next.y < 0 || next.z < 0) continue;
                    const Look there = look_at(next, reference, n);
                    if (!before(there, from)) continue;
                    from = there;
                    moved = true;
                }
        if (!moved) break;
    }
    return from;
}

/// Clusters where the reference is likely to be lowest and highest.
std::vector<OutputSample> extremes_of(std::vector<Look> looks, const Reference& reference,
                                      const Extent& n) {
    const std::size_t count = std::min(looks.size(), kStarts);
    const auto end = looks.begin() + static_cast<std::ptrdiff_t>(count);
    std::vector<OutputSample> extremes;
    for (const Before before : {is_lower, is_higher}) {
        std::partial_sort(looks.begin(), end, looks.end(), before);
        std::vector<Look> ends(looks.begin(), end);
        tbb::parallel_for(std::size_t{0}, count,
                          [&](std::size_t i) { ends[i] = climb(ends[i], reference, n, before); });
        std::stable_sort(ends.begin(), ends.end(), before);
        for (std::size_t i = 0; i < std::min(count, kExtremes); ++i)
            extremes.push_back(ends[i].corner);
    }
    return extremes;
}

/// Of the clusters at some samples, as draw_in_proportion has it, all where there are no more; and
/// uncounted ones where the reference is likely to be extreme.
/// @param known  of zoh and foh, of all that were looked at
std::vector<Cluster> draw_rough_clusters(const Reference& reference, const Extent& n,
                                         const std::vector<OutputSample>& at, double draws,
                                         std::array<Auxiliary, 2>& known) {
    std::vector<Cluster> drawn;
    if (static_cast<double>(at.size()) <= draws) {
        for (const OutputSample& corner : at) drawn.push_back({.corner = corner});
        return drawn;
    }
    std::vector<Look> looks(at.size());
    tbb::parallel_for(std::size_t{0}, at.size(),
                      [&](std::size_t i) { looks[i] = look_at(at[i], reference, n); });
    for (const OutputSample& corner : extremes_of(looks, reference, n))
        drawn.push_back({.corner = corner, .counted = false});
    std::vector<double> rough(looks.size(), 0);
    for (std::size_t hold = 0; hold < known.size(); ++hold) {
        std::vector<double> squares;
        for (const Look& look : looks) squares.push_back(look.squares[hold]);
        known[hold] = Auxiliary::over(squares, HUGE_VAL);
        for (std::size_t i = 0; i < rough.size() && known[hold].mean > 0; ++i)
            rough[i] += squares[i] / known[hold].mean;
    }
    for (double& value : rough) value = std::sqrt(value);
    for (const auto& [place, chance, weight] : draw_in_proportion(rough, draws))
        drawn.push_back({.corner = at[place], .weight = weight, .looked = looks[place].squares});
    return drawn;
}

/// Of input, so many times kInner and kOuter.
int draws_of(const Extent& input, int times) {
    return std::min(kMostMore, times * (input.samples() <= kSmallInput ? kMore : 1));
}

/// Places spread evenly by the additive recurrence of the generalised golden ratio (Roberts 2018),
/// of those that see the input.
Drawn draw(const Request& want, const Reference& reference, int times) {
    constexpr std::array<double, 4> ratio = {0.8566749, 0.7338918, 0.6287067, 0.5385973};
    const Extent n = want.output(), input = reference.field().extent();
    const auto near_a_face = [&](const Vec3& p) {
        for (int axis = 0; axis < want.axes; ++axis)
            if (p[axis] < kShell || p[axis] > static_cast<double>(input[axis] - 1) - kShell)
                return true;
        return false;
    };
    const int more = draws_of(input, times);
    const int most_inner = more * kInner, most_outer = more * kOuter;
    std::array<std::vector<OutputSample>, 2> met;  // inner, outer
    const auto most = [&](bool outer) {
        return static_cast<std::size_t>(std::max(kLooked * times * (outer ? kOuter : kInner),
                                                 2 * (outer ? most_outer : most_inner)));
    };
    std::array<int, 2> count{};
    for (int i = 0;
         i < times * kTries && (met[0].size() < most(false) || met[1].size() < most(true)); ++i) {
        std::array<double, 4> u;
        for (int axis = 0; axis < 4; ++axis) u[axis] = std::fmod(0.5 + ratio[axis] * (i + 1), 1.0);
        const auto place = [&](int axis) {
            return static_cast<std::int64_t>(u[axis] * static_cast<double>(n[axis]));
        };
        const OutputSample at{static_cast<int>(u[3] * want.frames), place(0), place(1), place(2)};
        if (!reference.sees_input(at)) continue;
        const bool is_outer = near_a_face(*reference.geometry().point(at));
        ++count[is_outer];
        if (met[is_outer].size() < most(is_outer)) met[is_outer].push_back(at);
    }
    Drawn drawn;
    for (const bool outer : {false, true}) {
        const double draws = outer ? most_outer : most_inner;
        for (Cluster& cluster :
             draw_rough_clusters(reference, n, met[outer], draws, drawn.known[outer])) {
            cluster.outer = outer;
            drawn.clusters.push_back(std::move(cluster));
        }
    }
    if (count[0] + count[1] > 0) drawn.outer_share = double(count[1]) / (count[0] + count[1]);
    return drawn;
}

/// An output sample near an input sample, in the first view that shows it.
std::optional<OutputSample> around(const Request& want, const Reference& reference,
                                   const Extent& input, std::int64_t place) {
    const Vec3 p(static_cast<double>(place % input.x),
                 static_cast<double>(place / input.x % input.y),
                 static_cast<double>(place / (input.x * input.y)));
    const Extent n = want.output();
    for (int view = 0; view < want.frames; ++view) {
        OutputSample at{view, 0, 0, 0};
        const Vec3 q = want.views.at(view).apply(p).array().floor().matrix();
        if (!q.allFinite()) continue;
        const auto fits = [&](int axis) {
            return q[axis] >= -1 && q[axis] < static_cast<double>(n[axis]);
        };
        if (!fits(0) || !fits(1) || (want.axes == 3 && !fits(2))) continue;
        at.x = std::max<std::int64_t>(0, static_cast<std::int64_t>(q.x()));
        at.y = std::max<std::int64_t>(0, static_cast<std::int64_t>(q.y()));
        if (want.axes == 3) at.z = std::max<std::int64_t>(0, static_cast<std::int64_t>(q.z()));
        if (!samples_at(reference, n, at).empty()) return at;
    }
    return {};
}

/// Whether every coordinate is a whole number: there all fields but a formula are their samples.
bool on_a_sample(const Vec3& p, int axes) {
    for (int axis = 0; axis < axes; ++axis)
        if (std::abs(p[axis] - std::round(p[axis])) > 1e-9) return false;
    return true;
}

/// What a preview of warps measures with: the facts of all models, and behind them what the file's
/// type changes.
struct PointSetting {
    const Request& want;
    std::vector<std::shared_ptr<const Model>> models;
    std::vector<ModelFact> facts = {};

    PointSetting(const Request& want_, std::vector<std::shared_ptr<const Model>> models_)
        : want(want_), models(std::move(models_)) {
        for (const auto& model : models)
            facts.insert(facts.end(), model->facts().begin(), model->facts().end());
        if (want.written) facts.push_back({.name = kWritten});
    }
};

/// The mean square change of one sample by rounding to the file's type.
double changed_by_writing(const WrittenAs& written, const std::vector<double>& expected) {
    std::vector<double> got = expected;
    round_as(written, got);
    double square = 0;
    for (std::size_t c = 0; c < got.size(); ++c) {
        const double d = got[c] - expected[c];
        if (std::isfinite(d)) square += d * d / static_cast<double>(got.size());
    }
    return square;
}

/// The sample at a place, with all its digits, which a block of f32 does not keep.
std::vector<double> sample_of(const ReferenceField& field, const Vec3& p) {
    const Data& samples = field.samples();
    const Extent& n = samples.what.extent;
    const Vec3 q = field.clamped(p);
    const auto at = [&](int axis) { return std::llround(q[axis]); };
    const std::int64_t place = at(0) + n.x * (at(1) + n.y * at(2));
    std::vector<double> values(static_cast<std::size_t>(samples.what.channels));
    for (int c = 0; c < samples.what.channels; ++c)
        values[static_cast<std::size_t>(c)] = value_at(samples, place * samples.what.channels + c);
    return values;
}

/// @param whole  of all the input, or null: one is prepared here
void measure(const Reference& reference, const PointSetting& setting, Cluster& cluster,
             const PreviewBlock* whole, std::pmr::memory_resource* memory) {
    const ReferenceField& field = reference.field();
    const bool labels = field.kind() == Field::nearest;
    cluster.squares.assign(setting.facts.size(), 0);
    Region cells{{field.extent().x, field.extent().y, field.extent().z}, {0, 0, 0}};
    std::vector<Vec3> places;
    for (const OutputSample& sample :
         samples_at(reference, setting.want.output(), cluster.corner)) {
        places.push_back(*reference.geometry().point(sample));
        const Vec3 p = field.clamped(places.back());
        for (int axis = 0; axis < 3; ++axis) {
            const auto cell = static_cast<std::int64_t>(std::floor(p[axis]));
            cells.begin[axis] = std::min(cells.begin[axis], cell);
            cells.end[axis] = std::max(cells.end[axis], cell + 1);
        }
    }
    std::optional<PreviewBlock> own;
    if (!whole) own.emplace(field, cells, memory);
    const PreviewBlock& block = whole ? *whole : *own;
    std::vector<double> expected(static_cast<std::size_t>(field.samples().what.channels));
    std::vector<double> squares(setting.facts.size());
    for (const Vec3& place : places) {
        Vec3 p = place;
        const bool exact = on_a_sample(p, field.axes());
        if (exact) p = p.array().round().matrix();
        if (!block.reference(p, expected.data())) continue;
        if (exact && field.kind() != Field::formula) block.hold(kZoh, p, expected.data());
        for (double value : expected) {
            cluster.low = std::min(cluster.low, value);
            cluster.high = std::max(cluster.high, value);
        }
        ++cluster.count;
        std::fill(squares.begin(), squares.end(), 0.0);
        std::size_t first = 0;
        for (const auto& model : setting.models) {
            const std::size_t count = model->facts().size();
            model->at({block, place, p, exact, labels, expected},
                      std::span(squares).subspan(first, count));
            first += count;
        }
        if (setting.want.written && !labels)
            squares.back() = changed_by_writing(
                *setting.want.written,
                exact && field.kind() != Field::formula ? sample_of(field, p) : expected);
        for (std::size_t fact = 0; fact < squares.size(); ++fact)
            cluster.squares[fact] += squares[fact];
    }
}

}  // namespace

Preview preview_points(const Catalogue& catalogue, const PreviewOf& of, const Request& want,
                       const ReferenceField& field, const Statistics& statistics,
                       std::pmr::memory_resource* memory) {
    const auto times = static_cast<int>(std::ceil(of.times));
    const Reference reference(want, field, memory);
    ModelSetting made{want, field, statistics, {}, {}, {}};
    const PointSetting setting(want, models_of(catalogue, field.samples().what, of, made));
    Drawn drawn = draw(want, reference, times);
    std::vector<Cluster>& clusters = drawn.clusters;
    for (const auto& [place, before] :
         {std::pair<std::int64_t, Before>{statistics.lowest, is_lower},
          {statistics.highest, is_higher}})
        if (const auto corner = around(want, reference, field.extent(), place)) {
            const Extent n = want.output();
            const Look start = look_at(*corner, reference, n);
            for (const Look& at : {start, climb(start, reference, n, before)})
                clusters.push_back({.corner = at.corner, .counted = false});
        }
    std::optional<PreviewBlock> whole;
    if (field.extent().samples() <= kSmallInput)
        whole.emplace(field, Region::all(field.extent()), memory);
    tbb::parallel_for(std::size_t{0}, clusters.size(), [&](std::size_t i) {
        measure(reference, setting, clusters[i], whole ? &*whole : nullptr, memory);
    });

    Preview preview{.facts = {},
                    .likely = {},
                    .exhausted = draws_of(field.extent(), times) == kMostMore,
                    .low = std::numeric_limits<double>::infinity(),
                    .high = -std::numeric_limits<double>::infinity(),
                    .without = {}};
    for (const Cluster& cluster : clusters) {
        preview.low = std::min(preview.low, cluster.low);
        preview.high = std::max(preview.high, cluster.high);
        preview.draws += cluster.counted && cluster.count > 0;
    }
    FactMaps facts;
    for (std::size_t fact = 0; fact < setting.facts.size(); ++fact) {
        const std::size_t like = setting.facts[fact].like_point;
        std::array<ErrorTally, 2> tallies;  // inner, outer
        for (const Cluster& cluster : clusters) {
            if (!cluster.counted || !(cluster.count > 0)) continue;
            // A cluster is drawn as often as it has samples that see the input.
            tallies[cluster.outer].add(cluster.squares[fact] / cluster.count, cluster.weight,
                                       cluster.looked[like]);
            tallies[cluster.outer].close();
        }
        const ErrorEstimate error =
            estimate_of(std::array{Stratum{.share = 1 - drawn.outer_share,
                                           .tally = tallies[0],
                                           .auxiliary = drawn.known[0][like]},
                                   Stratum{.share = drawn.outer_share,
                                           .tally = tallies[1],
                                           .auxiliary = drawn.known[1][like]}});
        facts.upper[setting.facts[fact].name] = error.upper;
        facts.likely[setting.facts[fact].name] = error.likely;
    }
    for (const auto& model : setting.models) model->derive(facts);
    preview.facts = std::move(facts.upper);
    preview.likely = std::move(facts.likely);
    return preview;
}

}  // namespace edgewise
