#include "engine/facts/known_scene.hpp"

#include <functional>
#include <new>
#include <nlohmann/json.hpp>
#include <string>

#include "engine/facts/code_version.hpp"
#include "engine/facts/facts_json.hpp"
#include "graph/request_fields.hpp"
#include "scene/preview.hpp"
#include "scene/ring_free.hpp"
#include "scene/scene.hpp"

namespace edgewise {
namespace {

/// Of less the statistics are measured anew: to find a fact takes 0.1 ms, to keep one 0.2 ms and
/// more, to look at so many bytes 0.3 ms and more (benchmarks/facts.cpp).
constexpr double kWorthKeeping = 4 << 20;  // [byte]

/// Notices where memory ran out.
class Noticing final : public std::pmr::memory_resource {
 public:
    explicit Noticing(std::pmr::memory_resource* memory) : memory_(memory) {}
    bool ran_out() const noexcept { return ran_out_; }

 private:
    void* do_allocate(std::size_t bytes, std::size_t alignment) override {
        try {
            return memory_->allocate(bytes, alignment);
        } catch (const std::bad_alloc&) {
            ran_out_ = true;
            throw;
        }
    }
    void do_deallocate(void* block, std::size_t bytes, std::size_t alignment) override {
        memory_->deallocate(block, bytes, alignment);
    }
    bool do_is_equal(const memory_resource& other) const noexcept override {
        return this == &other;
    }

    std::pmr::memory_resource* memory_;
    std::atomic<bool> ran_out_ = false;
};

/// @param of  what the fact depends on beside the samples, with the code that measures it
std::optional<FactKey> key_of(const Input& input, const char* kind, const Fingerprint& of) {
    if (!input.identity || !of.certain()) return std::nullopt;
    Fingerprint all;
    all.add(input.identity->what).add(of.text());
    return FactKey{kind, input.identity->where, input.identity->where + "|" + of.text(),
                   all.text()};
}

template <class Fact>
bool says_something(const Fact&) {
    return true;
}
/// That there was nothing to run is soon known again.
bool says_something(const Seen& seen) { return seen.draws > 0 || !seen.facts.empty(); }

template <class Fact>
Fact known(FactStore* store, const std::optional<FactKey>& key, std::pmr::memory_resource* memory,
           const std::function<Fact(std::pmr::memory_resource*)>& measure) {
    if (!store || !key) return measure(memory);
    if (const auto text = store->find(*key)) {
        try {
            Fact fact;
            read(nlohmann::json::parse(*text), fact);
            return fact;
        } catch (const std::exception&) {  // somebody else's: measured anew, and replaced
        }
    }
    Noticing noticing(memory);
    Fact fact = measure(&noticing);
    if (!noticing.ran_out() && says_something(fact)) store->keep(*key, json_of(fact).dump());
    return fact;
}

/// Of what depends on the samples alone: one place an input.
std::optional<FactKey> key_of_samples(const Input& input, const char* kind) {
    Fingerprint build;
    add_build(build);
    auto key = key_of(input, kind, build);
    if (key) key->place = input.identity->where;
    return key;
}

/// What previews may see of a request: budgets are upper limits, and a fact holds whatever they
/// are. That there is one in place of a likeness decides which edges are of use.
Request without_limits(Request want) {
    const bool likeness = want.budget.like.has_value();
    want.budget = {};
    if (likeness) want.budget.like.emplace();
    want.threads = 1;
    return want;
}

/// What runs of edges may see: which edges are offered may depend on the limit of the error.
Request without_haste(Request want, const std::optional<double>& most_bytes) {
    want.budget.seconds.reset();
    want.budget.bytes = most_bytes;
    want.threads = 1;
    return want;
}

Fingerprint fingerprint_of(const Measuring& of, const Request& want, double times) {
    Fingerprint on;
    on.add(of.engine.code()).add(want).add(times);
    for (const Demand& demand : of.asked.via) on.add(demand.name).add(demand.with.text());
    return on;
}

std::optional<FactKey> key_of_scene(const Measuring& of, const char* kind, const Request& want,
                                    int times) {
    return key_of(of.input, kind, fingerprint_of(of, want, times));
}

const Phantom* formula_of(const Input& input) { return input.phantom ? &*input.phantom : nullptr; }

Seen previewed(const Measuring& of, const Request& want, int times,
               std::pmr::memory_resource* memory) {
    Scene scene = preview_scene(of.engine.edges(), *of.input.data, of.statistics, want,
                                formula_of(of.input), memory, times, of.asked);
    return {scene.range, std::move(scene.facts), std::move(scene.likely), scene.draws,
            scene.exhausted};
}

/// What is new in a scene when edges were run.
Seen ran(const Measuring& of, const Request& want, const Scene& before,
         std::pmr::memory_resource* memory) {
    Scene scene = before;
    run_scene(of.engine.edges(), *of.input.data, of.statistics, want, formula_of(of.input), scene,
              memory, of.asked);
    Seen seen;
    for (const auto& fact : scene.facts)
        if (!before.facts.contains(fact.first)) seen.facts.insert(fact);
    for (const auto& fact : scene.likely)
        if (!before.likely.contains(fact.first)) seen.likely.insert(fact);
    return seen;
}

}  // namespace

Statistics known_statistics(FactStore* store, const Input& input,
                            std::pmr::memory_resource* memory) {
    if (input.bytes() < kWorthKeeping) store = nullptr;
    return known<Statistics>(store, key_of_samples(input, "statistics"), memory,
                             [&](auto* from) { return statistics_of(*input.data, from); });
}

double known_slope(const Engine& engine, const Input& input, const Request& want) {
    if (!want.mode->takes_transfer) return seen_slope(*input.data, want);  // nothing to look at
    Fingerprint on;
    on.add(engine.code()).add(without_limits(want));
    return known<SeenSlope>(engine.facts().get(), key_of(input, "slope", on), nullptr,
                            [&](auto*) { return SeenSlope{seen_slope(*input.data, want)}; })
        .value;
}

Histogram known_histogram(FactStore* store, const Input& input, const Statistics& statistics) {
    return known<Histogram>(store, key_of_samples(input, "histogram"), nullptr,
                            [&](auto*) { return histogram_of(*input.data, statistics); });
}

RadialPower known_spectrum(FactStore* store, const Input& input, const Statistics& statistics,
                           std::pmr::memory_resource* memory) {
    return known<RadialPower>(store, key_of_samples(input, "spectrum"), memory, [&](auto* from) {
        return measure_radial_power(*input.data, statistics.occupied, from);
    });
}

Scene known_scene(const Measuring& of, int times) {
    FactStore* const store = of.engine.facts().get();
    const Request seen = without_limits(of.want);
    Seen preview = known<Seen>(store, key_of_scene(of, "view", seen, times), of.memory,
                               [&](auto* memory) { return previewed(of, seen, times, memory); });
    Scene scene = of.counted;
    scene.range = preview.range;
    scene.draws = preview.draws;
    scene.exhausted = preview.exhausted;
    scene.facts.merge(std::move(preview.facts));
    scene.likely = std::move(preview.likely);
    if (!has_silent_edges(of.engine.edges())) return scene;
    const Request run = without_haste(of.want, of.most_bytes);
    Seen found = known<Seen>(store, key_of_scene(of, "runs", run, times), of.memory,
                             [&](auto* memory) { return ran(of, run, scene, memory); });
    scene.facts.merge(std::move(found.facts));
    scene.likely.merge(std::move(found.likely));
    return scene;
}

Counts known_counts(const Measuring& of) {
    const Request want = without_limits(of.want);
    FactStore* const store = of.input.bytes() < kWorthKeeping ? nullptr : of.engine.facts().get();
    return known<Counts>(store, key_of_scene(of, "counts", want, 1), of.memory,
                         [&](std::pmr::memory_resource* memory) {
                             Scene scene = of.counted;
                             count_scene(of.engine.edges(), *of.input.data, want, scene, memory,
                                         &of.asked);
                             return Counts{std::move(scene.facts)};
                         });
}

FewDraws known_draws(const Measuring& measuring, const PreviewOf& of) {
    const Request want = without_limits(measuring.want);
    Fingerprint on = fingerprint_of(measuring, want, of.times);
    on.add(of.groups);
    if (of.wanted)
        for (const std::string& fact : *of.wanted) on.add(fact);
    return known<FewDraws>(measuring.engine.facts().get(), key_of(measuring.input, "draws", on),
                           measuring.memory, [&](std::pmr::memory_resource* memory) {
                               Preview seen =
                                   preview_facts(measuring.engine.edges(), *measuring.input.data,
                                                 measuring.statistics, want,
                                                 formula_of(measuring.input), of, memory);
                               return FewDraws{std::move(seen.likely), std::move(seen.without)};
                           });
}

}  // namespace edgewise
