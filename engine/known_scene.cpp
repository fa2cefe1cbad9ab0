#include "engine/known_scene.hpp"

#include <fmt/format.h>
#include <functional>
#include <nlohmann/json.hpp>

#include "engine/facts_json.hpp"
#include "engine/known_facts.hpp"
#include "engine/request/request_text.hpp"
#include "scene/scene.hpp"

namespace edgewise {
namespace {

/// Of less the statistics are measured anew: to find a fact takes 0.1 ms, to keep one 0.2 ms and
/// more, to look at so many bytes 0.3 ms and more (benchmarks/facts.cpp).
constexpr double kWorthKeeping = 4 << 20;  // [byte]

/// @param of  what the fact depends on in addition to the data
template <class Fact>
std::optional<Fact> kept(const Input& input, const std::string& name, const std::string& of) {
    const auto json = KnownFacts(input.identity).find(name, of);
    if (!json) return std::nullopt;
    try {
        Fact fact;
        read(*json, fact);
        return fact;
    } catch (const std::exception&) {
        return std::nullopt;  // somebody else's file: measured anew, and replaced
    }
}

template <class Fact>
Fact known(const Input& input, const std::string& name, const std::string& of,
           const std::function<Fact()>& measure) {
    if (auto fact = kept<Fact>(input, name, of)) return std::move(*fact);
    const Fact fact = measure();
    KnownFacts(input.identity).keep(name, json_of(fact), of);
    return fact;
}

constexpr const char* kView = "view";

/// Each by itself: whether more is drawn depends on budgets, which are no part of the request.
std::string name_of_view(const Request& want, int times, const Demands& asked) {
    std::string name = request_text(want) + (times > 1 ? fmt::format(" draws {}", times) : "");
    for (const Demand& demand : asked.via) name += " " + demand.name + demand.with.text();
    return name;
}

Scene scene_of(const Statistics& statistics, const Seen& seen) {
    Scene scene = unseen_scene(statistics);
    scene.range = seen.range;
    scene.facts = seen.facts;
    scene.likely = seen.likely;
    scene.draws = seen.draws;
    scene.exhausted = seen.exhausted;
    return scene;
}

}  // namespace

Statistics known_statistics(const Input& input, std::pmr::memory_resource* memory) {
    if (input.bytes() < kWorthKeeping) return statistics_of(*input.data, memory);
    return known<Statistics>(input, "statistics", "",
                             [&] { return statistics_of(*input.data, memory); });
}

Histogram known_histogram(const Input& input, const Statistics& statistics) {
    return known<Histogram>(input, "histogram", "",
                            [&] { return histogram_of(*input.data, statistics); });
}

RadialPower known_spectrum(const Input& input, const Statistics& statistics,
                           std::pmr::memory_resource* memory) {
    return known<RadialPower>(input, "spectrum", "", [&] {
        return measure_radial_power(*input.data, statistics.occupied, memory);
    });
}

Scene known_scene(const Catalogue& edges, const Input& input, const Statistics& statistics,
                  const Request& want, std::pmr::memory_resource* memory, int times,
                  const Demands& asked) {
    return scene_of(statistics, known<Seen>(input, kView, name_of_view(want, times, asked), [&] {
                        const Phantom* formula = input.phantom ? &*input.phantom : nullptr;
                        Scene scene = measure_scene(edges, *input.data, statistics, want, formula,
                                                    memory, times, asked);
                        count_scene(edges, *input.data, want, scene, memory);
                        return Seen{scene.range, std::move(scene.facts), std::move(scene.likely),
                                    scene.draws, scene.exhausted};
                    }));
}

std::optional<Scene> kept_scene(const Input& input, const Statistics& statistics,
                                const Request& want, const Demands& asked) {
    const auto seen = kept<Seen>(input, kView, name_of_view(want, 1, asked));
    return seen ? std::optional(scene_of(statistics, *seen)) : std::nullopt;
}

}  // namespace edgewise
