// Facts that are kept change nothing: a fact is used only where measuring it anew would give the
// same, to the last bit.
#include <bit>
#include <cstring>
#include <functional>
#include <gtest/gtest.h>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "engine/facts/memory_facts.hpp"
#include "engine/prepared.hpp"
#include "engine/reached.hpp"
#include "graph/errors.hpp"
#include "graph/request_fields.hpp"
#include "planner/profile.hpp"
#include "query_fields.hpp"
#include "runtime/memory_budget.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

/// Counts what is found and kept.
class Counted final : public FactStore {
 public:
    std::optional<std::string> find(const FactKey& key) const override {
        auto found = facts_.find(key);
        if (found) ++hits;
        return found;
    }
    bool keep(const FactKey& key, const std::string& fact) override {
        ++kept;
        return facts_.keep(key, fact);
    }
    mutable int hits = 0;
    int kept = 0;

 private:
    MemoryFacts facts_;
};

Engine engine_with(std::shared_ptr<FactStore> facts, Catalogue edges = catalogue()) {
    const Profile machine = default_profile(edges);
    return {std::move(edges), machine, std::move(facts)};
}

std::shared_ptr<const Data> volume_of(std::uint32_t seed, int side = 12) {
    static MemoryBudget memory(std::size_t{64} << 20);
    auto data = std::make_shared<Data>(make_phantom("gaussians", side, &memory));
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> noise(0, 0.2f);
    for (std::int64_t i = 0; i < data->what.samples(); ++i) data->as<float>()[i] += noise(random);
    return data;
}

Scene scene_of(const Engine& engine, const Query& query, std::shared_ptr<const Data> samples) {
    Listener listener;
    Reached reached(ask(engine, query, {.runs = true, .guest = true, .given = std::move(samples)}));
    reached.open_all(listener);
    reached.look_at({.errors = ErrorsWanted::asked}, listener);
    return reached.looked()->scene;
}

std::string bits_of(const Scene& scene) {
    Fingerprint all;
    all.add(scene.low).add(scene.high).add(scene.range).add(scene.facts).add(scene.likely);
    all.add(scene.draws).add(scene.exhausted);
    return all.text();
}

using Random = std::mt19937_64;
double share(Random& random) { return std::uniform_real_distribution<>(0, 1)(random); }

/// For each field of a query another value, drawn; of some there is none that a test like this can
/// serve.
const std::map<std::string, std::function<void(Query&, Random&)>>& changes() {
    using Kind = GeometryStep::Kind;
    static const auto none = [](Query&, Random&) {};
    static const std::map<std::string, std::function<void(Query&, Random&)>> all = {
        {"job",
         [](Query& q, Random&) {
             q.job = q.job == Job::warp ? Job::render : Job::warp;
             q.filter.reset(), q.radon.reset();
         }},
        {"input", none},  // the samples are the test's
        {"selection",
         [](Query& q, Random& r) {
             q.selection.spacing = {1, 1, 1 + share(r)};
         }},
        {"level_by_result", none},
        {"out", [](Query& q, Random&) { q.out = "null:"; }},
        {"geometry",
         [](Query& q, Random& r) {
             switch (r() % 5) {
                 case 0:
                     q.geometry.steps = {{Kind::rotate, {90 * share(r), 20, 10}}};
                     break;
                 case 1:
                     q.geometry.steps.push_back({Kind::scale, {0.8 + share(r)}});
                     break;
                 case 2:
                     q.geometry.view = r() % 2 ? "x" : "y";
                     break;
                 case 3:
                     q.geometry.about = {{5, 6, 5 + share(r)}};
                     break;
                 default:
                     q.geometry.size = OutputSize{.sides = {6 + std::int64_t(r() % 6)}};
             }
         }},
        {"clip",
         [](Query& q, Random& r) {
             if (r() % 2)
                 q.clip.box = {1, 1, 1, 8, 9, 7 + double(r() % 3)};
             else
                 q.clip.balls = {{5, 5, 5, 3 + 3 * share(r)}};
         }},
        {"filter",
         [](Query& q, Random& r) {
             q.job = Job::filter;
             q.radon.reset();
             FilterSpec& filter = q.filter.emplace();
             filter.kernel.size = 1 + double(r() % 2);
             filter.border = r() % 2 ? Border::clamp : Border::mirror;
         }},
        {"radon", none},
        {"mode",
         [](Query& q, Random& r) {
             constexpr const char* kModes[] = {"mip", "xray", "mean", "composite", "minip"};
             q.mode = mode_named(kModes[r() % 5]);
         }},
        {"isovalue",
         [](Query& q, Random& r) {
             q.mode = mode_named("surface");
             q.isovalue = 0.3 + 0.3 * share(r);
         }},
        {"zero",
         [](Query& q, Random& r) {
             q.mode = Mode::xray;
             q.zero = 0.1 * share(r);
         }},
        {"outside",
         [](Query& q, Random& r) {
             q.job = Job::warp;
             q.outside = share(r);
         }},
        {"background",
         [](Query& q, Random& r) {
             q.background = {share(r), 0, 0.5};
         }},
        {"keeps_alpha", [](Query& q, Random&) { q.keeps_alpha = !q.keeps_alpha; }},
        {"transfer",
         [](Query& q, Random& r) {
             q.mode = Mode::composite;
             TransferSpec& spec = q.transfer.emplace();
             spec.transfer.points = {{0, 0, {1, 1, 1}}, {1, share(r), {1, 0, 0}}};
         }},
        {"suiting_preset", [](Query& q, Random&) { q.suiting_preset = !q.suiting_preset; }},
        {"shade",
         [](Query& q, Random& r) {
             q.mode = Mode::composite;
             q.shade = r() % 2 ? Shade::phong : Shade::none;
         }},
        {"gradient", [](Query& q, Random&) { q.gradient = GradientScheme::sobel; }},
        {"lights",
         [](Query& q, Random& r) {
             q.lights = {{Vec3(share(r), 0, -1), 1}};
         }},
        {"material",
         [](Query& q, Random& r) {
             q.material = {share(r) / 2, 0.5, 0.1, 8};
         }},
        {"phase", none},
        {"shadows", [](Query& q, Random&) { q.shadows = !q.shadows; }},
        {"occlusion", [](Query& q, Random& r) { q.occlusion = 1 + share(r); }},
        {"cue",
         [](Query& q, Random& r) {
             q.cue = DepthCue{0.05 * share(r), false};
         }},
        {"window",
         [](Query& q, Random& r) {
             q.window = {{0}, {0.5 + share(r)}};
         }},
        {"exposure", [](Query& q, Random&) { q.exposure = 2; }},
        {"reference",
         [](Query& q, Random& r) { q.reference = r() % 2 ? Field::linear : Field::spline; }},
        {"labels", [](Query& q, Random&) { q.labels = !q.labels; }},
        {"only_labels", none},
        {"smooth", none},
        {"look", [](Query& q, Random&) { q.look.colormap = "viridis"; }},
        {"finish", none},
        {"channel_name", none},
        {"max_error", [](Query& q, Random& r) { q.max_error = 0.001 + 0.1 * share(r); }},
        {"like_linear", [](Query& q, Random&) { q.like_linear = !q.like_linear; }},
        {"range", [](Query& q, Random& r) { q.range = 0.5 + share(r); }},
        {"max_time", [](Query& q, Random& r) { q.max_time = 0.01 + share(r); }},
        {"max_memory", [](Query& q, Random& r) { q.max_memory = 1e9 + 1e8 * share(r); }},
        {"notation", [](Query& q, Random&) { q.notation.error = "40dB"; }},
        {"minimize",
         [](Query& q, Random& r) { q.minimize = r() % 2 ? Minimize::error : Minimize::memory; }},
        {"threads", [](Query& q, Random& r) { q.threads = 1 + int(r() % 3); }},
        {"ranks", none},
        {"planner", [](Query& q, Random&) { q.planner = Planner::pilot; }},
        {"planning_time", none},
        {"demands",
         [](Query& q, Random&) {
             q.demands.via = {{"project.ray_cast", {{"filter", "cubic"}}}};
             q.job = Job::render;
         }},
        {"fps", none},
        {"film_encoder", [](Query& q, Random&) { q.film_encoder = "/usr/bin/ffmpeg"; }},
        {"bits", none},
        {"quality", none},
        {"verify", [](Query& q, Random&) { q.verify = 10; }},
        {"seed", [](Query& q, Random&) { q.seed = 7; }},
        {"repeat", [](Query& q, Random&) { q.repeat = 2; }},
        {"strict", [](Query& q, Random&) { q.strict = !q.strict; }},
        {"remembers", none},
    };
    return all;
}

Query random_query(Random& random) {
    Query query;
    query.geometry.size = OutputSize{.sides = {8}};
    query.geometry.steps = {{GeometryStep::Kind::rotate, {20, 10 * share(random), 0}}};
    constexpr const char* kJobs[] = {"warp", "filter", "mode", "mode", "mode", "shade"};
    const std::string start = kJobs[random() % 6];
    if (start == "warp")
        query.job = Job::warp;
    else
        changes().at(start)(query, random);
    if (random() % 2) changes().at("max_error")(query, random);
    return query;
}

TEST(Facts, EveryFieldOfAQueryIsChangedByTheTestBelow) {
    std::set<std::string> fields;
    const Query query;
    visit_fields(query, [&](std::string_view name, const auto&) { fields.emplace(name); });
    std::set<std::string> changed;
    for (const auto& [name, change] : changes()) changed.insert(name);
    EXPECT_EQ(fields, changed);
}

/// One store for all: a fact of one request that is taken for another's shows as another scene.
TEST(Facts, AFactIsUsedOnlyWhereTheResultIsTheSame) {
    const auto store = std::make_shared<Counted>();
    const Engine keeps = engine_with(store), forgets = engine_with(nullptr);
    const auto samples = volume_of(1);
    Random random(20261128);
    std::vector<std::string> names;
    for (const auto& [name, change] : changes()) names.push_back(name);
    int served = 0, refused = 0;
    std::size_t next = 0;
    for (int i = 0; i < 200; ++i) {
        const Query query = random_query(random);
        const std::string before = bits_of(scene_of(keeps, query, samples));
        for (int k = 0; k < 3; ++k) {
            const std::string& name = names[next++ % names.size()];
            Query other = query;
            changes().at(name)(other, random);
            try {
                const std::string anew = bits_of(scene_of(forgets, other, samples));
                EXPECT_EQ(bits_of(scene_of(keeps, other, samples)), anew) << i << ": " << name;
                ++served;
            } catch (const RequestError&) {
                ++refused;
            }
        }
        EXPECT_EQ(bits_of(scene_of(keeps, query, samples)), before) << i;
    }
    EXPECT_GT(served, 3 * refused);
    EXPECT_GT(store->hits, 200);  // or nothing was tested
    EXPECT_GT(store->kept, 200);
}

/// Levels of resolution are measured only where a limit of the error may want them, and where the
/// request has work enough that they can pay.
TEST(Facts, WhatALimitDecidesToMeasureIsNotTakenForAnother) {
    const auto store = std::make_shared<Counted>();
    const Engine keeps = engine_with(store), forgets = engine_with(nullptr);
    const auto samples = volume_of(2, 32);
    Query query;
    query.geometry.size = OutputSize{.sides = {64}};
    query.geometry.steps = {{GeometryStep::Kind::turntable, {300}}};
    Query limited = query, best = query;
    limited.max_error = 0.1;
    best.minimize = Minimize::error;
    std::set<std::string> different;
    for (const Query& each : {query, limited, best, limited, query}) {
        const std::string anew = bits_of(scene_of(forgets, each, samples));
        EXPECT_EQ(bits_of(scene_of(keeps, each, samples)), anew);
        different.insert(anew);
    }
    EXPECT_GT(different.size(), 1u) << "or nothing was tested";
    limited.max_error = 0.2;
    const int before = store->hits;
    scene_of(keeps, limited, samples);
    EXPECT_GT(store->hits, before) << "a preview holds whatever the limit is";
}

TEST(Facts, OtherSamplesOfTheSameShapeHaveFactsOfTheirOwn) {
    const auto store = std::make_shared<Counted>();
    const Engine keeps = engine_with(store);
    Random random(1);
    const Query query = random_query(random);
    auto samples =
        std::make_shared<Data>(Data::make(volume_of(1)->what, std::pmr::get_default_resource()));
    const auto fill = [&](std::uint32_t seed) {
        const auto from = volume_of(seed);
        std::memcpy(samples->samples.data(), from->samples.data(), from->samples.bytes());
    };
    fill(1);
    const std::string first = bits_of(scene_of(keeps, query, samples));
    fill(2);  // the caller's memory, with other values
    const std::string second = bits_of(scene_of(keeps, query, samples));
    EXPECT_NE(first, second);
    EXPECT_EQ(store->hits, 0);
    fill(1);
    EXPECT_EQ(bits_of(scene_of(keeps, query, samples)), first);
    EXPECT_GT(store->hits, 0);
}

/// The place in the catalogue of an edge.
std::size_t place_of(const Catalogue& edges, const std::string& name) {
    for (std::size_t i = 0; i < edges.size(); ++i)
        if (edges[i].name == name) return i;
    throw std::out_of_range(name);
}

TEST(Facts, AnEdgeThatIsBuiltAnewHasNoOldFacts) {
    const auto store = std::make_shared<MemoryFacts>();
    const Engine before = engine_with(store);
    Catalogue rebuilt = catalogue();
    Transition& edge = rebuilt[place_of(rebuilt, "project.ray_cast")];
    const auto old = edge.error;
    edge.error = [old](const Offer& offer, const Ask& ask) {
        Error error = old(offer, ask);
        error.bias += 0.5;
        return error;
    };
    EXPECT_NE(engine_with(store, rebuilt).code(), before.code());

    Catalogue versioned = catalogue();
    versioned[place_of(versioned, "project.ray_cast")].version = "2";
    EXPECT_NE(engine_with(store, versioned).code(), before.code());

    Catalogue fewer;
    for (const Transition& each : catalogue())
        if (each.name != "project.ray_cast") fewer.push_back(each);
    EXPECT_NE(engine_with(store, fewer).code(), before.code());

    EXPECT_EQ(engine_with(store).code(), before.code());
}

TEST(Facts, ACatalogueWithOneEdgeLessMeasuresItsOwn) {
    const auto store = std::make_shared<Counted>();
    const auto samples = volume_of(3);
    Query query;
    query.geometry.size = OutputSize{.sides = {8}};
    query.geometry.steps = {{GeometryStep::Kind::rotate, {20, 10, 0}}};
    const Scene whole = scene_of(engine_with(store), query, samples);
    Catalogue fewer;
    for (const Transition& each : catalogue())
        if (each.name != "project.ray_cast") fewer.push_back(each);
    const Scene without = scene_of(engine_with(store, fewer), query, samples);
    EXPECT_EQ(store->hits, 0);
    EXPECT_EQ(bits_of(without), bits_of(scene_of(engine_with(nullptr, fewer), query, samples)));
    EXPECT_NE(bits_of(whole), bits_of(without));
}

/// A setting of a program's own job, with fields and without.
struct Told {
    int number = 0;
};
template <Either<Told> T, class F>
void visit_fields(T& told, F&& f) {
    auto& [number] = told;
    f("number", number);
}
struct Untold {
    int number = 0;
};

TEST(Facts, SettingsOfAProgramsOwnJobAreToldApartOrNothingIsKept) {
    const auto of = [](JobSetting setting) {
        Request want;
        want.setting = std::move(setting);
        Fingerprint print;
        print.add(want);
        return print.certain() ? print.text() : "";
    };
    EXPECT_EQ(of(JobSetting::of(Told{1})), of(JobSetting::of(Told{1})));
    EXPECT_NE(of(JobSetting::of(Told{1})), of(JobSetting::of(Told{2})));
    EXPECT_NE(of(JobSetting::of(Told{1})), of({}));
    EXPECT_EQ(of(JobSetting::of(Untold{1})), "");
}

class Swirl final : public Deformation {
    std::string name() const override { return "swirl"; }
    Vec3 apply(const Vec3& at) const override { return at; }
    Vec3 invert(const Vec3& at) const override { return at; }
    Mat3 jacobian(const Vec3&) const override { return Mat3::Identity(); }
};

TEST(Facts, OfADeformationNothingIsKept) {
    Request want;
    want.views = Placement(Transform(std::make_shared<Swirl>()));
    Fingerprint print;
    print.add(want);
    EXPECT_FALSE(print.certain());
}

/// Kept facts say how soon an answer is there, and never which.
TEST(Facts, ThePlanIsTheSameWithFactsAndWithout) {
    const auto store = std::make_shared<Counted>();
    const Engine keeps = engine_with(store), forgets = engine_with(nullptr);
    const auto samples = volume_of(4);
    Random random(4);
    for (int i = 0; i < 40; ++i) {
        const Query query = random_query(random);
        const Effort effort{.errors = ErrorsWanted::for_choice, .front = false};
        const auto planned = [&](const Engine& engine) {
            Prepared plan = prepare(engine, query, samples, effort);
            return plan.plan().texts();
        };
        const auto without = planned(forgets);
        EXPECT_EQ(planned(keeps), without) << i;
        scene_of(keeps, query, samples);  // all that there is to know
        EXPECT_EQ(planned(keeps), without) << i;
    }
    EXPECT_GT(store->hits, 0);
}

}  // namespace
}  // namespace edgewise
