#include "cli/session/known_scene.hpp"

#include <fmt/format.h>
#include <functional>
#include <nlohmann/json.hpp>

#include "cli/request/request_text.hpp"
#include "cli/session/facts_json.hpp"
#include "cli/session/known_facts.hpp"
#include "transitions/project/casting.hpp"
#include "transitions/reference/scene.hpp"

namespace edgewise::cli {
namespace {

/// Of less the statistics are measured anew: to find a fact takes 0.1 ms, to keep one 0.2 ms and
/// more, to look at so many bytes 0.3 ms and more (benchmarks/facts.cpp).
constexpr double kWorthKeeping = 4 << 20;  // [byte]

/// @param of  what the fact depends on beside the data
template <class Fact>
Fact known(const Input& input, const std::string& name, const std::string& of,
           const std::function<Fact()>& measure) {
    const KnownFacts facts(input.identity);
    if (const auto json = facts.find(name, of)) {
        try {
            Fact fact;
            read(*json, fact);
            return fact;
        } catch (const std::exception&) {
            // Somebody else's file: measured anew, and replaced.
        }
    }
    const Fact fact = measure();
    facts.keep(name, json_of(fact), of);
    return fact;
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

Scene known_scene(const Input& input, const Statistics& statistics, const Request& want,
                  std::pmr::memory_resource* memory, int times) {
    // Each by itself: whether more is drawn depends on budgets, which are no part of the request.
    const std::string of = request_text(want) + (times > 1 ? fmt::format(" draws {}", times) : "");
    const Seen seen = known<Seen>(input, "view", of, [&] {
        const Phantom* formula = input.phantom ? &*input.phantom : nullptr;
        Scene scene = measure_scene(*input.data, statistics, want, formula, memory, times);
        measure_casting(*input.data, want, scene.facts, memory);
        return Seen{scene.range, std::move(scene.facts), std::move(scene.likely), scene.draws,
                    scene.exhausted};
    });
    Scene scene = unseen_scene(statistics);
    scene.range = seen.range;
    scene.facts = seen.facts;
    scene.likely = seen.likely;
    scene.draws = seen.draws;
    scene.exhausted = seen.exhausted;
    return scene;
}

}  // namespace edgewise::cli
