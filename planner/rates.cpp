#include "planner/rates.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <nlohmann/json.hpp>
#include <shared_mutex>
#include <span>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "graph/errors.hpp"
#include "planner/json_fields.hpp"

namespace edgewise {
namespace {

constexpr double kAlike = 1.35;        // sizes within this factor are one
constexpr double kLeastSpread = 0.03;  // two runs of the same path differ by so much
constexpr double kBorrowed = 0.25;     // spread of a rate under another name, at least
constexpr double kBeyond = 0.1;        // more spread for each factor e beyond the measured sizes
/// [s] that any run takes in addition to what is counted: threads wake, pages are new. They belong
/// to the loops. So small counts say little.
constexpr double kSetUp = 1e-5;
constexpr std::size_t kNear = 4;  // sharing is a median over so many neighbours on either side

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    const std::size_t n = values.size();
    return (values[(n - 1) / 2] + values[n / 2]) / 2;
}

/// Median absolute deviation as the standard deviation of a normal distribution.
double spread_of(const std::vector<double>& logs, double centre) {
    std::vector<double> away;
    for (double value : logs) away.push_back(std::abs(value - centre));
    return std::max(kLeastSpread, 1.4826 * median(away));
}

/// One rate of several of about one size.
Rate joined(const Rate* first, const Rate* last) {
    std::vector<double> counted, ratio, shared;
    Rate rate;
    for (const Rate* each = first; each != last; ++each) {
        counted.push_back(std::log(each->counted));
        ratio.push_back(std::log(each->ratio));
        shared.push_back(each->shared);
        rate.runs += each->runs;
        rate.frames = each->frames;
        rate.spread = std::max(rate.spread, each->spread);
    }
    rate.counted = std::exp(median(counted));
    const double centre = median(ratio);
    rate.ratio = std::exp(centre);
    rate.shared = median(shared);
    rate.spread = std::max(rate.spread, spread_of(ratio, centre));
    return rate;
}

/// Joins rates of about one size. @param rates  in any order
std::vector<Rate> by_size(std::vector<Rate> rates) {
    std::sort(rates.begin(), rates.end(), [](const Rate& a, const Rate& b) {
        return std::tie(a.frames, a.counted) < std::tie(b.frames, b.counted);
    });
    std::vector<Rate> curve;
    for (std::size_t begin = 0; begin < rates.size();) {
        std::size_t end = begin;
        while (end < rates.size() && rates[end].frames == rates[begin].frames &&
               rates[end].counted <= kAlike * rates[begin].counted)
            ++end;
        curve.push_back(joined(rates.data() + begin, rates.data() + end));
        begin = end;
    }
    return curve;
}

/// The name without the type.
std::string base_of(const std::string& name) { return name.substr(0, name.rfind(' ')); }

/// Measured over counted seconds of loops and set-up.
double loops_pace(const Rate& rate) {
    return seconds_of_loops(rate) / (rate.counted - rate.apart + kSetUp);
}

/// Expected seconds on one thread. @param pace  of loops, see loops_pace()
double expected(const Counted& counted, double pace) {
    return pace * (counted.seconds - counted.apart + kSetUp) + counted.apart;
}

std::string edge_of(const std::string& name) { return name.substr(0, name.find_first_of(" /")); }

/// The parts of a name: the edge, its parameters, variant, kind and type.
class Parts {
 public:
    explicit Parts(std::string_view name) {
        while (count_ < kMost) {
            const std::size_t end = name.find_first_of(" /");
            parts_[count_++] = name.substr(0, end);
            if (end == name.npos) return;
            name.remove_prefix(end + 1);
        }
    }
    static constexpr std::size_t kMost = 32;
    std::span<const std::string_view> all() const { return {parts_.data(), count_}; }

 private:
    std::array<std::string_view, kMost> parts_;
    std::size_t count_ = 0;
};

/// How alike two names of one edge are: first by the number of parts that they share, then by how
/// early these are in `name`, then by how few others `other` has.
int likeness(const Parts& name, const Parts& other) {
    constexpr int kMost = Parts::kMost;
    int alike = -static_cast<int>(other.all().size()), place = 0;
    for (const std::string_view part : name.all()) {
        if (std::ranges::find(other.all(), part) != other.all().end())
            alike += kMost * (kMost * kMost + kMost - place);
        ++place;
    }
    return alike;
}

/// Calls each(entry) for all names of an edge.
template <class Map, class Each>
void for_edge(const Map& named, const std::string& edge, Each&& each) {
    // They follow each other, among those of edges that begin alike.
    for (auto entry = named.lower_bound(edge);
         entry != named.end() && entry->first.starts_with(edge); ++entry)
        if (edge_of(entry->first) == edge) each(*entry);
}

/// Calls each(entry) for those names of an edge that are most like one.
template <class Map, class Each>
void for_most_alike(const Map& named, const std::string& name, Each&& each) {
    const Parts parts(name);
    int best = std::numeric_limits<int>::min();
    std::vector<const typename Map::value_type*> most;
    for_edge(named, edge_of(name), [&](const auto& entry) {
        const int alike = likeness(parts, Parts(entry.first));
        if (alike > best) most.clear();
        best = std::max(best, alike);
        if (alike == best) most.push_back(&entry);
    });
    for (const auto* entry : most) each(*entry);
}

/// @param curve  sorted by frames, then by size: those of the fewest frames count
Rate between(const std::vector<Rate>& curve, double counted) {
    const auto end = std::find_if(curve.begin(), curve.end(), [&](const Rate& rate) {
        return rate.frames != curve.front().frames;
    });
    const auto above =
        std::lower_bound(curve.begin(), end, counted,
                         [](const Rate& rate, double value) { return rate.counted < value; });
    const auto beyond = [&](Rate rate) {
        rate.spread += kBeyond * std::abs(std::log(counted / rate.counted));
        return rate;
    };
    if (above == curve.begin()) return beyond(curve.front());
    if (above == end) return beyond(*(end - 1));
    const Rate &low = *(above - 1), &high = *above;
    const double f = std::log(counted / low.counted) / std::log(high.counted / low.counted);
    return {.counted = counted,
            .ratio = std::exp((1 - f) * std::log(low.ratio) + f * std::log(high.ratio)),
            .shared = (1 - f) * low.shared + f * high.shared,
            .spread = (1 - f) * low.spread + f * high.spread,
            .runs = std::min(low.runs, high.runs)};
}

}  // namespace

double seconds_of_loops(const Rate& rate) noexcept {
    constexpr double kLeast = 0.1;
    const double took = rate.ratio * rate.counted;
    return std::max(took - rate.apart, kLeast * took);
}

Rates::Shared Rates::shared_of(const Curves& curves) {
    Shared edges;
    for (const auto& [name, curve] : curves)
        for (const Rate& rate : curve)
            edges[edge_of(name)].push_back({rate.counted * rate.ratio * rate.frames, rate.shared});
    for (auto& [edge, points] : edges) {
        std::sort(points.begin(), points.end(),
                  [](const Sharing& a, const Sharing& b) { return a.alone < b.alone; });
        std::vector<Sharing> smooth;
        for (std::size_t i = 0; i < points.size(); ++i) {
            // The ends use the nearest point that has neighbours on either side.
            const std::size_t side = std::min(kNear, (points.size() - 1) / 2);
            const std::size_t middle = std::clamp(i, side, points.size() - 1 - side);
            std::vector<double> near;
            for (std::size_t k = middle - side; k <= middle + side; ++k)
                near.push_back(points[k].shared);
            smooth.push_back({points[i].alone, median(near)});
        }
        points = std::move(smooth);
    }
    return edges;
}

double Rates::shared_at(const std::string& name, double alone) const {
    const std::vector<Sharing>& curve = shared_.at(edge_of(name));
    const auto above =
        std::lower_bound(curve.begin(), curve.end(), alone,
                         [](const Sharing& each, double value) { return each.alone < value; });
    if (above == curve.begin()) return curve.front().shared;
    if (above == curve.end()) return curve.back().shared;
    const Sharing &low = *(above - 1), &high = *above;
    const double f = std::log(alone / low.alone) / std::log(high.alone / low.alone);
    return (1 - f) * low.shared + f * high.shared;
}

/// What is known of a name, whatever the size.
struct Rates::Resolved {
    double pace = 0;          // the factor of loops; 0: nothing was measured under any part
    std::vector<Rate> curve;  // its own, or of the names that are most like it
    bool own = false;
};

/// Names are compared as text, and a planner asks for the same ones again and again.
struct Rates::Memo {
    std::shared_mutex mutex;
    std::unordered_map<std::string, std::shared_ptr<const Resolved>> known;
};

std::shared_ptr<const Rates::Resolved> Rates::resolved(const std::string& name) const {
    {
        const std::shared_lock lock(memo_->mutex);
        if (const auto found = memo_->known.find(name); found != memo_->known.end())
            return found->second;
    }
    auto made = std::make_shared<Resolved>();
    made->pace = pace_of(name);
    if (made->pace > 0) {
        const auto own = left_.find(name);
        made->own = own != left_.end();
        made->curve = made->own ? own->second : nearest(name);
    }
    const std::unique_lock lock(memo_->mutex);
    return memo_->known.try_emplace(name, std::move(made)).first->second;
}

Rate Rates::at(const std::string& name, const Counted& counted, int runs) const {
    if (!(counted.seconds > 0) || measured_.empty()) return {.ratio = 0};
    const std::shared_ptr<const Resolved> known = resolved(name);
    if (!(known->pace > 0)) return {.ratio = 0};
    const double foreseen = expected(counted, known->pace);
    Rate rate = between(known->curve, foreseen);
    if (!known->own) rate.spread = std::max(rate.spread, kBorrowed);
    const double seconds = foreseen * rate.ratio;
    rate.counted = counted.seconds;
    rate.apart = counted.apart;
    rate.ratio = seconds / counted.seconds;
    if (runs > 1 || !known->own || foreseen * kAlike < known->curve.front().counted)
        rate.shared = shared_at(name, seconds * runs);
    return rate;
}

double Rates::pace_of(const std::string& name) const {
    const std::string base = base_of(name);
    if (const auto exact = paces_.find(base); exact != paces_.end()) return exact->second;
    std::vector<double> paces;
    for_most_alike(paces_, base, [&](const auto& each) { paces.push_back(each.second); });
    return paces.empty() ? 0 : median(std::move(paces));
}

std::vector<Rate> Rates::nearest(const std::string& name) const {
    std::vector<Rate> pooled;
    for_most_alike(left_, name, [&](const Curves::value_type& each) {
        pooled.insert(pooled.end(), each.second.begin(), each.second.end());
    });
    return by_size(std::move(pooled));
}

Rates::Rates() : memo_(std::make_shared<Memo>()) {}

Rates::Rates(Curves measured) : Rates() {
    std::map<std::string, std::vector<double>> paces;
    for (auto& [name, rates] : measured) {
        if (rates.empty()) continue;
        std::sort(rates.begin(), rates.end(), [](const Rate& a, const Rate& b) {
            return std::tie(a.frames, a.counted) < std::tie(b.frames, b.counted);
        });
        for (const Rate& rate : rates) paces[base_of(name)].push_back(loops_pace(rate));
        measured_[name] = std::move(rates);
    }
    for (auto& [base, all] : paces) paces_[base] = median(std::move(all));
    for (const auto& [name, rates] : measured_) {
        std::vector<Rate> left = rates;
        for (Rate& rate : left) {
            const double took = rate.ratio * rate.counted;
            rate.counted = expected({rate.counted, rate.apart}, pace_of(name));
            rate.ratio = took / rate.counted;
        }
        left_[name] = by_size(std::move(left));
    }
    shared_ = shared_of(measured_);
}

Rates rates_of(const std::map<std::string, std::vector<Timed>>& timed) {
    Rates::Curves curves;
    for (const auto& [name, list] : timed)
        for (const Timed& each : list)
            if (each.counted > 0 && each.alone > 0)
                curves[name].push_back(
                    {.counted = each.counted,
                     .apart = each.apart,
                     .ratio = each.alone / each.counted,
                     .shared = each.together > 0 ? each.together / each.alone : 1,
                     .spread = each.spread,
                     .runs = each.runs,
                     .frames = each.frames});
    return Rates(std::move(curves));
}

nlohmann::json to_json(const Rates& rates) {
    nlohmann::json json = nlohmann::json::object();
    for (const auto& [name, curve] : rates.measured()) {
        nlohmann::json& list = json[name] = nlohmann::json::array();
        for (const Rate& rate : curve)
            list.push_back({{"counted", rate.counted},
                            {"apart", rate.apart},
                            {"ratio", rate.ratio},
                            {"shared", rate.shared},
                            {"spread", rate.spread},
                            {"runs", rate.runs},
                            {"frames", rate.frames}});
    }
    return json;
}

Rates rates_of(const nlohmann::json& json, const std::string& file) {
    const JsonFields fields(file);
    if (!json.is_object()) fields.reject("rates", "expected an object");
    Rates::Curves curves;
    for (const auto& [name, list] : json.items()) {
        const std::string where = "rates." + name;
        if (!list.is_array()) fields.reject(where, "expected a list");
        std::vector<Rate> curve;
        for (const nlohmann::json& each : list) {
            if (!each.is_object()) fields.reject(where, "expected objects");
            const auto number = [&](const char* key, double low, double high) {
                return fields.number(each.value(key, nlohmann::json()), where + "." + key, low,
                                     high);
            };
            const int frames =
                each.contains("frames") ? static_cast<int>(number("frames", 1, 1e9)) : 1;
            const double counted = number("counted", 1e-12, 1e9);
            curve.push_back({.counted = counted,
                             .apart = each.contains("apart") ? number("apart", 0, counted) : 0,
                             .ratio = number("ratio", 1e-6, 1e6),
                             .shared = number("shared", 1e-6, 1e3),
                             .spread = number("spread", 0, 10),
                             .runs = static_cast<int>(number("runs", 1, 1e9)),
                             .frames = frames});
        }
        curves[name] = std::move(curve);
    }
    return Rates(std::move(curves));
}

}  // namespace edgewise
