#include "scene/measured_results.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "graph/errors.hpp"
#include "graph/filtering.hpp"
#include "graph/written.hpp"
#include "reference/error_tally.hpp"
#include "reference/job_reference.hpp"
#include "reference/stored.hpp"
#include "reference/written.hpp"

namespace edgewise {
namespace {

constexpr double kMostOperations = 1.5e9;       // of one edge, over all parts
constexpr double kMostValues = 1 << 18;         // of results, over all parts
constexpr int kEvenParts = 6, kPartTries = 60;  // parts that are spread evenly
/// An error that was measured on the requested samples themselves is reproduced, except for the
/// order in which squares are added and for roundings to a file's type at a tie.
constexpr double kAgain = 1.02;

/// An edge that makes the result, and an edge before it that may change the type of the samples,
/// if there is one.
struct Way {
    std::optional<Demand> before;
    Demand edge;
};

/// By the fact that tells their error.
std::map<std::string, Way> ways_to_results(const Catalogue& catalogue, const Ask& ask,
                                           const Representation& from, const Demands& asked) {
    std::map<std::string, Way> ways;
    const auto demand_of_arc = [&](const Arc& arc) {
        return Demand{catalogue[static_cast<std::size_t>(arc.edge)].name, arc.offer.with};
    };
    const auto add = [&](const Demands& demands) {
        const TransformGraph spanned = expand(catalogue, ask, {{from}}, demands);
        const Graph& graph = spanned.graph;
        for (const auto arc : boost::make_iterator_range(boost::edges(graph))) {
            if (!graph[boost::target(arc, graph)].target) continue;
            const Arc& step = graph[arc];
            const std::string& name = catalogue[static_cast<std::size_t>(step.edge)].name;
            const Parameters& with = step.offer.with;
            const auto begin = boost::source(arc, graph);
            if (graph[begin].source >= 0) {
                ways.try_emplace(fact_of_runs(name, with), Way{{}, demand_of_arc(step)});
                continue;
            }
            for (const auto first : boost::make_iterator_range(boost::in_edges(begin, graph)))
                if (graph[boost::source(first, graph)].source >= 0)
                    ways.try_emplace(fact_of_runs(name, with, step.offer.from.type),
                                     Way{demand_of_arc(graph[first]), demand_of_arc(step)});
        }
    };
    add({});
    if (!asked.via.empty()) add({.via = asked.via});
    return ways;
}

const Transition& edge_named(const Catalogue& catalogue, const std::string& name) {
    return *std::find_if(catalogue.begin(), catalogue.end(),
                         [&](const Transition& edge) { return edge.name == name; });
}

/// A part of the result, and the samples that it is made of.
struct ResultPart {
    Region output, input;
    bool is_certain = false;  // it would be looked at whatever is drawn
};

/// Samples that a filter reads beyond each one, of two passes.
std::array<std::int64_t, 3> reach_of(const Filtering& filtering) {
    const Extent& n = filtering.stencil.extent;
    return {2 * (n.x / 2) + 1, 2 * (n.y / 2) + 1, 2 * (n.z / 2) + 1};
}

ResultPart part_around(const std::array<std::int64_t, 3>& begin, std::int64_t side, const Extent& n,
                       const std::array<std::int64_t, 3>& reach) {
    ResultPart part;
    for (int axis = 0; axis < 3; ++axis) {
        const auto k = static_cast<std::size_t>(axis);
        const std::int64_t length = std::min(side, n[axis]);
        part.output.begin[k] = std::clamp<std::int64_t>(begin[k], 0, n[axis] - length);
        part.output.end[k] = part.output.begin[k] + length;
        part.input.begin[k] = std::max<std::int64_t>(0, part.output.begin[k] - reach[k]);
        part.input.end[k] = std::min(n[axis], part.output.end[k] + reach[k]);
    }
    return part;
}

std::vector<ResultPart> parts_of_side(std::int64_t side, const Extent& n,
                                      const std::array<std::int64_t, 3>& reach,
                                      const Statistics& statistics) {
    std::vector<ResultPart> parts;
    const auto take = [&](ResultPart part, bool certain) {
        part.is_certain = certain;
        const bool known = std::any_of(parts.begin(), parts.end(), [&](const ResultPart& other) {
            return other.output == part.output;
        });
        if (!known) parts.push_back(part);
    };
    for (const std::int64_t place : {statistics.lowest, statistics.highest}) {
        const std::int64_t x = place % n.x, y = place / n.x % n.y, z = place / (n.x * n.y);
        take(part_around({x - side / 2, y - side / 2, z - side / 2}, side, n, reach), true);
    }
    const std::size_t certain = parts.size();
    // The additive recurrence of the generalised golden ratio (Roberts 2018).
    constexpr std::array<double, 3> kRatio = {0.8191725, 0.6710436, 0.5497005};
    for (int i = 1; i <= kPartTries && parts.size() < certain + kEvenParts; ++i) {
        std::array<std::int64_t, 3> begin{};
        for (int axis = 0; axis < 3; ++axis) {
            const auto k = static_cast<std::size_t>(axis);
            const double room = static_cast<double>(n[axis] - std::min(side, n[axis]) + 1);
            begin[k] = static_cast<std::int64_t>(std::fmod(0.5 + kRatio[k] * i, 1.0) * room);
        }
        take(part_around(begin, side, n, reach), false);
    }
    return parts;
}

/// The samples of a part; of all of the input itself, which must stay alive.
std::shared_ptr<const Data> samples_of(const Data& input, const Region& box,
                                       std::pmr::memory_resource* memory) {
    if (box == Region::all(input.what.extent)) return {std::shared_ptr<const Data>(), &input};
    Representation what = input.what;
    what.extent = box.extent();
    what.drop_facets();
    auto part = std::make_shared<Data>(Data::make(what, memory));
    const std::size_t row = bytes_of(what.type) * static_cast<std::size_t>(what.channels) *
                            static_cast<std::size_t>(what.extent.x);
    auto* to = part->as<std::byte>();
    for (std::int64_t z = box.begin[2]; z < box.end[2]; ++z)
        for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y, to += row)
            std::memcpy(to, input.row_at(box.begin[0], y, z), row);
    return part;
}

Representation widened(const Representation& what) {
    Representation wide = what;
    wide.drop_facets();
    wide.type = Type::f64;
    wide.values = {};
    return wide;
}

Data widened(const Data& in, std::pmr::memory_resource* memory) {
    Data wide = Data::make(widened(in.what), memory);
    const std::int64_t count = in.what.samples() * in.what.channels;
    for (std::int64_t i = 0; i < count; ++i) wide.as<double>()[i] = value_at(in, i);
    return wide;
}

Request request_of_part(const Request& want, const Extent& extent) {
    Request part = want;
    part.input = part.screen = extent;
    part.frames = 1;
    part.budget = {};
    part.threads = part.ranks = 1;
    return part;
}

/// Runs a step that is not cut into regions.
Data made_by(const Transition& edge, const Offer& offer, const Ask& ask, const Data& in,
             std::pmr::memory_resource* memory) {
    Context context;
    context.memory = memory;
    Data out = Data::make(offer.to, memory);
    edge.run(offer, ask, in, out, Region::all(offer.to.extent), context);
    return out;
}

bool may_err(const Error& error) { return !error.known || error.bias > 0 || error.noise > 0; }

/// What a way makes of samples; nothing where it does not apply, cannot err or takes too long.
std::optional<Data> made_by(const Way& way, const Catalogue& catalogue, const Ask& ask,
                            const Data& in, double most, std::pmr::memory_resource* memory) {
    Data between;
    const Data* from = &in;
    bool errs = false;
    if (way.before) {
        const Transition& edge = edge_named(catalogue, way.before->name);
        const Offer offer = edge.offer(in.what, ask, way.before->with);
        if (!offer.refused.empty()) return {};
        errs = may_err(edge.error_of(offer, ask));
        between = made_by(edge, offer, ask, in, memory);
        from = &between;
    }
    const Transition& edge = edge_named(catalogue, way.edge.name);
    const Offer offer = edge.offer(from->what, ask, way.edge.with);
    if (!offer.refused.empty() || !(errs || may_err(edge.error_of(offer, ask))) ||
        edge.work(offer, ask, 0).operations > most)
        return {};
    return made_by(edge, offer, ask, *from, memory);
}

/// What is summed over the samples of one part.
struct PartSums {
    double square = 0, count = 0;
    bool is_certain = false;
};

/// Measures edges on parts of a filter's result, sample by sample.
class FilteredParts {
 public:
    FilteredParts(const Catalogue& catalogue, const Data& input, const Statistics& statistics,
                  const Request& want, const Filtering& filtering, const Scene& scene,
                  std::pmr::memory_resource* memory)
        : catalogue_(catalogue),
          input_(input),
          want_(want),
          scene_(scene),
          memory_(memory),
          channels_(input.what.channels) {
        double magnitudes = 0;
        for (const double weight : filtering.stencil.weights)
            if (std::isfinite(weight)) magnitudes += std::abs(weight);
        if (is_linear(filtering.op))
            cancelled_ = 0x1p-50 * magnitudes * std::max(std::abs(scene.low), std::abs(scene.high));
        find_wide();
        if (wide_) cut(filtering, statistics);
    }

    /// Whether some edge filters in f64 in reasonable time.
    bool can_be_compared() const noexcept { return wide_ && !parts_.empty(); }

    void measure(const std::map<std::string, Way>& ways, Scene& scene) {
        for (const ResultPart& part : parts_) measure_part(part, ways);
        if (!(low_ <= high_)) return;
        scene.range = range_of(want_, low_, high_);
        for (const auto& [fact, sums] : sums_) {
            if (sums.size() != parts_.size()) continue;
            const ErrorEstimate error = estimate(sums);
            scene.facts[fact] = error.upper;
            scene.likely[fact] = error.likely;
        }
        // Of what writing adds the labels of paths know by themselves.
        if (!want_.written || !scene.likely.contains(kWritten)) return;
        const double once = scene.likely[kWritten];
        for (const auto& [fact, sums] : sums_) {
            if (fact == kWritten.name || fact == kResultRms.name || !scene.facts.contains(fact))
                continue;
            double &upper = scene.facts[fact], &likely = scene.likely[fact];
            const double times = likely > 0 ? upper / likely : 1;
            likely = std::sqrt(std::max(0.0, likely * likely - once * once));
            upper = times * likely;
        }
    }

 private:
    double operations(const Transition& edge, const Parameters& with, const Representation& what,
                      const Request& request) const {
        const Ask ask{request, scene_};
        const Offer offer = edge.offer(what, ask, with);
        return offer.refused.empty() ? edge.work(offer, ask, 0).operations
                                     : std::numeric_limits<double>::infinity();
    }

    /// The edge with the fewest operations whose error is no larger than that of f64.
    void find_wide() {
        const Representation what = widened(input_.what);
        const Ask ask{want_, scene_};
        double least = std::numeric_limits<double>::infinity();
        for (const auto& [fact, way] : ways_to_results(catalogue_, ask, what, {})) {
            if (way.before) continue;
            const Demand& demand = way.edge;
            const Transition& edge = edge_named(catalogue_, demand.name);
            const Offer offer = edge.offer(what, ask, demand.with);
            if (!offer.refused.empty() || offer.to.type != Type::f64) continue;
            const Error error = edge.error_of(offer, ask);
            const double off = error.bias + error.noise;
            if (!error.known || !(off <= std::max(0x1p-30 * off_in_f32(), cancelled_))) continue;
            const double operations = edge.work(offer, ask, 0).operations;
            if (operations >= least) continue;
            least = operations;
            wide_ = demand;
        }
    }
    double off_in_f32() const {
        return std::max({std::abs(scene_.low), std::abs(scene_.high), cancelled_ * 0x1p50});
    }

    /// Whole where that is small, else parts as large as may be.
    void cut(const Filtering& filtering, const Statistics& statistics) {
        const Extent& n = input_.what.extent;
        const Transition& edge = edge_named(catalogue_, wide_->name);
        const auto cost = [&](const std::vector<ResultPart>& parts) {
            double all = 0;
            for (const ResultPart& part : parts) {
                Representation what = widened(input_.what);
                what.extent = part.input.extent();
                all += operations(edge, wide_->with, what, request_of_part(want_, what.extent));
            }
            return all;
        };
        const std::vector<ResultPart> whole = {{Region::all(n), Region::all(n), true}};
        const double values = static_cast<double>(n.samples()) * channels_;
        if (values <= kMostValues && cost(whole) <= kMostOperations) {
            parts_ = whole;
            return;
        }
        const double each = kMostValues / (kEvenParts + 2) / channels_;
        const int axes = (n.x > 1) + (n.y > 1) + (n.z > 1);
        const std::int64_t least = axes > 2 ? 8 : 16;
        for (double side = std::pow(each, 1.0 / std::max(1, axes)); side >= double(least);
             side *= 0.75) {
            std::vector<ResultPart> parts =
                parts_of_side(static_cast<std::int64_t>(side), n, reach_of(filtering), statistics);
            if (cost(parts) > kMostOperations) continue;
            parts_ = std::move(parts);
            return;
        }
    }

    void measure_part(const ResultPart& part, const std::map<std::string, Way>& ways) {
        const std::shared_ptr<const Data> in = samples_of(input_, part.input, memory_);
        const Request request = request_of_part(want_, in->what.extent);
        const Ask ask{request, scene_};
        const Data right = right_of(*in, ask);
        Region box;
        for (std::size_t k = 0; k < 3; ++k) {
            box.begin[k] = part.output.begin[k] - part.input.begin[k];
            box.end[k] = part.output.end[k] - part.input.begin[k];
        }
        look_at(right, box, part.is_certain);
        const double most = kMostOperations / static_cast<double>(parts_.size());
        for (const auto& [fact, way] : ways)
            if (const auto made = made_by(way, catalogue_, ask, *in, most, memory_))
                sums_[fact].push_back(compared(*made, right, box, part.is_certain));
    }

    /// What f64 makes of a part. What cancels to less than its own rounding is 0.
    Data right_of(const Data& in, const Ask& ask) const {
        const Data wide = widened(in, memory_);
        const Transition& edge = edge_named(catalogue_, wide_->name);
        const Offer offer = edge.offer(wide.what, ask, wide_->with);
        if (!offer.refused.empty()) throw RequestError(offer.refused);
        Data right = made_by(edge, offer, ask, wide, memory_);
        const std::int64_t count = right.what.samples() * right.what.channels;
        for (std::int64_t i = 0; i < count; ++i)
            if (std::abs(right.as<double>()[i]) <= cancelled_) right.as<double>()[i] = 0;
        return right;
    }

    /// Calls take(place of channel 0) for the samples of a box that have a value.
    template <class Take>
    void each_sample(const Data& right, const Region& box, const Take& take) const {
        const Extent& n = right.what.extent;
        for (std::int64_t z = box.begin[2]; z < box.end[2]; ++z)
            for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y)
                for (std::int64_t x = box.begin[0]; x < box.end[0]; ++x) {
                    const std::int64_t at = right.what.channels * (x + n.x * (y + n.y * z));
                    if (std::isfinite(right.as<double>()[at])) take(at);
                }
    }

    /// Range, magnitude, and what writing changes.
    void look_at(const Data& right, const Region& box, bool certain) {
        PartSums rms{.is_certain = certain}, written = rms;
        const int channels = right.what.channels;
        std::vector<double> values(static_cast<std::size_t>(channels));
        each_sample(right, box, [&](std::int64_t at) {
            for (int c = 0; c < channels; ++c) {
                const double value = right.as<double>()[at + c];
                values[static_cast<std::size_t>(c)] = value;
                if (!std::isfinite(value)) continue;
                low_ = std::min(low_, value);
                high_ = std::max(high_, value);
                rms.square += value * value / channels;
            }
            rms.count += 1;
            if (!want_.written) return;
            round_as(*want_.written, values);
            for (int c = 0; c < channels; ++c) {
                const double off = values[static_cast<std::size_t>(c)] - right.as<double>()[at + c];
                if (std::isfinite(off)) written.square += off * off / channels;
            }
            written.count += 1;
        });
        sums_[kResultRms].push_back(rms);
        if (want_.written) sums_[kWritten].push_back(written);
    }

    PartSums compared(const Data& got, const Data& right, const Region& box, bool certain) const {
        PartSums sums{.is_certain = certain};
        const int channels = right.what.channels;
        std::vector<double> values(static_cast<std::size_t>(channels));
        each_sample(right, box, [&](std::int64_t at) {
            for (int c = 0; c < channels; ++c)
                values[static_cast<std::size_t>(c)] = value_at(got, at + c);
            if (want_.written) round_as(*want_.written, values);
            for (int c = 0; c < channels; ++c) {
                const double off = values[static_cast<std::size_t>(c)] - right.as<double>()[at + c];
                if (std::isfinite(off)) sums.square += off * off / channels;
            }
            sums.count += 1;
        });
        return sums;
    }

    ErrorEstimate estimate(const std::vector<PartSums>& sums) const {
        ErrorTally certain, even;
        double in_certain = 0;
        int drawn = 0;
        for (const PartSums& part : sums) {
            if (!(part.count > 0)) continue;
            ErrorTally& tally = part.is_certain ? certain : even;
            tally.add(part.square / part.count, part.count);
            tally.close();
            if (part.is_certain)
                in_certain += part.count;
            else
                ++drawn;
        }
        if (drawn == 0) {
            const ErrorEstimate found =
                estimate_of(std::array{Stratum{.tally = certain, .whole = true}});
            return {found.likely, kAgain * found.likely};
        }
        const double share = std::min(1.0, in_certain / static_cast<double>(input_.what.samples()));
        return estimate_of(std::array{Stratum{.share = share, .tally = certain, .whole = true},
                                      Stratum{.share = 1 - share, .tally = even}});
    }

    const Catalogue& catalogue_;
    const Data& input_;
    const Request& want_;
    const Scene scene_;  // without what is measured here
    std::pmr::memory_resource* memory_;
    int channels_;
    double cancelled_ = 0;  // below this sums in f64 are rounding alone
    std::optional<Demand> wide_;
    std::vector<ResultPart> parts_;
    std::map<std::string, std::vector<PartSums>> sums_;
    double low_ = std::numeric_limits<double>::infinity(), high_ = -low_;
};

/// Measures edges on output samples that are drawn evenly, against the reference.
class DrawnResults {
 public:
    DrawnResults(const Catalogue& catalogue, const Data& input, const Request& want,
                 const Scene& scene, std::pmr::memory_resource* memory)
        : catalogue_(catalogue),
          input_(input),
          want_(want),
          scene_(scene),
          memory_(memory),
          field_(input, want.field),
          reference_(job_reference(want, field_)) {}

    void measure(const std::map<std::string, Way>& ways, Scene& scene) {
        draw();
        const std::vector<double> right = reference_->values(samples_);
        double low = std::numeric_limits<double>::infinity(), high = -low, square = 0, count = 0;
        const auto channels = static_cast<std::size_t>(input_.what.channels);
        double changed = 0;
        std::vector<double> written(channels);
        for (std::size_t i = 0; i < right.size(); ++i) {
            const double value = right[i];
            if (!std::isfinite(value)) continue;
            low = std::min(low, value), high = std::max(high, value);
            square += value * value, ++count;
            if (!want_.written || i % channels > 0) continue;
            std::copy_n(right.begin() + static_cast<std::ptrdiff_t>(i), channels, written.begin());
            round_as(*want_.written, written);
            for (std::size_t c = 0; c < channels; ++c)
                if (const double off = written[c] - right[i + c]; std::isfinite(off))
                    changed += off * off;
        }
        if (count == 0) return;
        if (want_.written)
            scene.facts[kWritten] = scene.likely[kWritten] = std::sqrt(changed / count);
        scene.facts[kResultRms] = scene.likely[kResultRms] = std::sqrt(square / count);
        // Errors are told in units of the scene's range, whatever the results are.
        double scale = 1;
        if (const std::optional<double> own = reference_->range())
            scale = scene.range / *own;
        else
            scene.range = range_of(want_, low, high);
        const Ask ask{want_, scene_};
        for (const auto& [fact, way] : ways) {
            const auto made = made_by(way, catalogue_, ask, input_, 2 * kMostOperations, memory_);
            if (!made) continue;
            const ErrorEstimate error = compared(*made, right);
            scene.facts[fact] = scale * error.upper;
            scene.likely[fact] = scale * error.likely;
        }
    }

 private:
    /// As many as the reference works out in some 50 ms.
    void draw() {
        const Extent n = want_.output();
        double each = 12.0 * static_cast<double>(want_.input.x + want_.input.y);
        if (const Filtering* filtering = want_.setting.as<Filtering>())
            each = 2.0 * static_cast<double>(filtering->stencil.weights.size());
        constexpr double kLeast = 256, kMost = 4096, kReads = 1.6e7;
        const std::int64_t there = n.samples();
        const auto wanted = static_cast<std::int64_t>(std::clamp(kReads / each, kLeast, kMost));
        is_all_ = there <= wanted;
        std::uint64_t state = 0x5eed;
        for (std::int64_t i = 0; i < std::min(there, wanted); ++i) {
            // One in each stretch of equal length, anywhere in it.
            state = state * 6364136223846793005u + 1442695040888963407u;
            const double part = static_cast<double>(state >> 11) * 0x1p-53;
            const std::int64_t at = is_all_
                                        ? i
                                        : static_cast<std::int64_t>((double(i) + part) /
                                                                    double(wanted) * double(there));
            samples_.push_back({0, at % n.x, at / n.x % n.y, at / (n.x * n.y)});
        }
    }

    ErrorEstimate compared(const Data& got, const std::vector<double>& right) const {
        ErrorTally tally;
        const Extent& n = got.what.extent;
        const int channels = got.what.channels;
        std::vector<double> values(static_cast<std::size_t>(channels));
        for (std::size_t i = 0; i < samples_.size(); ++i) {
            const OutputSample& at = samples_[i];
            const std::int64_t place = channels * (at.x + n.x * (at.y + n.y * at.z));
            double square = 0;
            for (int c = 0; c < channels; ++c)
                values[static_cast<std::size_t>(c)] = value_at(got, place + c);
            for (int c = 0; c < channels; ++c) {
                const double off =
                    values[static_cast<std::size_t>(c)] -
                    right[i * static_cast<std::size_t>(channels) + static_cast<std::size_t>(c)];
                if (std::isfinite(off)) square += off * off / channels;
            }
            tally.add(square, 1);
            tally.close();
        }
        const ErrorEstimate found = estimate_of(std::array{Stratum{.tally = tally}});
        return is_all_ ? ErrorEstimate{found.likely, kAgain * found.likely} : found;
    }

    const Catalogue& catalogue_;
    const Data& input_;
    const Request& want_;
    const Scene scene_;
    std::pmr::memory_resource* memory_;
    ReferenceField field_;
    std::shared_ptr<const JobReference> reference_;
    std::vector<OutputSample> samples_;
    bool is_all_ = false;
};

}  // namespace

void measure_results(const Catalogue& catalogue, const Demands& asked, const Data& input,
                     const Statistics& statistics, const Request& want, Scene& scene,
                     std::pmr::memory_resource* memory) {
    if (want.ranks > 1 || input.what.type == Type::c64 || input.what.samples() == 0) return;
    const Filtering* filtering = want.setting.as<Filtering>();
    if (!filtering && !has_reference(want.job)) return;
    const Ask ask{want, scene};
    const std::map<std::string, Way> ways = ways_to_results(catalogue, ask, input.what, asked);
    const ValueMap& values = input.what.values;
    const bool narrows = want.written && want.written->type == Type::f32 &&
                         !(values.identity() && scene.fits_f32(input.what.type, values));
    const bool any = narrows || std::any_of(ways.begin(), ways.end(), [&](const auto& each) {
                         if (each.second.before) return true;
                         const Transition& edge = edge_named(catalogue, each.second.edge.name);
                         const Offer offer = edge.offer(input.what, ask, each.second.edge.with);
                         const Error error = edge.error_of(offer, ask);
                         return may_err(error) || (want.written && !error.copies);
                     });
    if (!any) return;
    scene.facts[kResultType] = static_cast<double>(input.what.type);
    const Scene before = scene;
    try {
        if (filtering) {
            FilteredParts parts(catalogue, input, statistics, want, *filtering, before, memory);
            if (parts.can_be_compared()) return parts.measure(ways, scene);
        }
        DrawnResults(catalogue, input, want, before, memory).measure(ways, scene);
    } catch (const std::bad_alloc&) {  // guesses remain
        scene = before;
    } catch (const RequestError&) {
        scene = before;
    } catch (const RunError&) {
        scene = before;
    }
}

}  // namespace edgewise
