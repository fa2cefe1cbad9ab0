// Nothing in graph, planner and runtime knows of volumes: here words of a text are counted by their
// length, with spaces, contents, facets and edges of the test's own.
//
//   text/letters --split--> text/words --sort--> text/words+longest --count--> screen/scalar
//        \__________________________scan____________________________________________/
#include <gtest/gtest.h>
#include <sstream>

#include "graph/errors.hpp"
#include "planner/planner.hpp"
#include "runtime/runtime.hpp"

namespace edgewise {
namespace {

constexpr int kLengths = 8;  // words of 1 to 8 letters
using Words = std::vector<std::string>;

Representation text_of_bytes(std::size_t bytes) {
    Representation what;
    what.space = "text";
    what.content = "letters";
    what.axes = 2;
    what.type = Type::u8;
    what.extent = {static_cast<std::int64_t>(bytes), 1, 1};
    return what;
}

/// Content that is no array: a vector of strings, at most twice as many bytes as letters.
Transition split() {
    return {
        .name = "text.split",
        .joins = {{"text/letters", "text/words"}},
        .offer =
            [](const Representation& from, const Ask&, const Parameters&) {
                Offer offer{.from = from, .to = from};
                offer.to.content = "words";
                offer.to.extent.x = 2 * from.extent.x;
                return offer;
            },
        .work = [](const Offer& offer, const Ask&,
                   int) { return Work{.operations = offer.from.bytes()}; },
        .run =
            [](const Offer&, const Ask&, const Data& in, Data& out, const Region&, Context&) {
                const auto* letters = in.as<char>();
                std::istringstream stream(std::string(letters, letters + in.what.samples()));
                Words words;
                for (std::string word; stream >> word;) words.push_back(word);
                out.other = words;
            },
    };
}

/// Attaches a facet: the longest word. It passes the words on.
Transition find_longest() {
    return {
        .name = "text.find_longest",
        .joins = {{"text/words", "text/words+longest"}},
        .attaches = true,
        .offer =
            [](const Representation& from, const Ask&, const Parameters&) {
                Offer offer{.from = from, .to = from};
                offer.to.facets.insert("longest");
                return offer;
            },
        .work = [](const Offer& offer, const Ask&,
                   int) { return Work{.operations = offer.from.bytes()}; },
        .run =
            [](const Offer&, const Ask&, const Data& in, Data& out, const Region&, Context&) {
                std::size_t longest = 0;
                for (const std::string& word : std::any_cast<const Words&>(in.other))
                    longest = std::max(longest, word.size());
                out.facets["longest"] = longest;
            },
    };
}

Transition count() {
    return {
        .name = "text.count",
        .joins = {{"text/words+longest", "screen/scalar"}},
        .offer =
            [](const Representation& from, const Ask& ask, const Parameters&) {
                return Offer{.from = from, .to = screen_scalar(from, ask.want)};
            },
        .work = [](const Offer& offer, const Ask&,
                   int) { return Work{.operations = offer.from.bytes()}; },
        .run =
            [](const Offer&, const Ask&, const Data& in, Data& out, const Region&, Context&) {
                const auto longest = std::any_cast<std::size_t>(in.facets.at("longest"));
                if (longest > kLengths) throw RunError("a word is too long");
                std::fill_n(out.as<float>(), kLengths, 0.f);
                for (const std::string& word : std::any_cast<const Words&>(in.other))
                    ++out.as<float>()[word.size() - 1];
            },
    };
}

/// The slow way, straight on: for each length once over all letters. So slow that three starts of
/// an edge are less.
Transition scan() {
    return {
        .name = "letters.scan",
        .joins = {{"text/letters", "screen/scalar"}},
        .offer =
            [](const Representation& from, const Ask& ask, const Parameters&) {
                return Offer{.from = from, .to = screen_scalar(from, ask.want)};
            },
        .work = [](const Offer& offer, const Ask&,
                   int) { return Work{.operations = 100000 * kLengths * offer.from.bytes()}; },
        .parts =
            [](const Offer&, const Ask&) {
                return Partition{.kind = Partition::output, .leaf = {kLengths, 1, 1}};
            },
        .run =
            [](const Offer&, const Ask&, const Data& in, Data& out, const Region&, Context&) {
                for (int length = 1; length <= kLengths; ++length) {
                    int run = 0, found = 0;
                    for (std::int64_t i = 0; i <= in.what.samples(); ++i) {
                        const bool letter = i < in.what.samples() && in.as<char>()[i] != ' ';
                        found += !letter && run == length;
                        run = letter ? run + 1 : 0;
                    }
                    out.as<float>()[length - 1] = static_cast<float>(found);
                }
            },
    };
}

struct WordCount {
    MemoryBudget memory{1 << 20};
    Request want;
    Scene scene;
    Catalogue catalogue{split(), find_longest(), count(), scan()};
    std::shared_ptr<Data> source;

    explicit WordCount(const std::string& text) {
        want.job = Job::warp;
        want.axes = 2;
        want.screen = {kLengths, 1, 1};
        source = std::make_shared<Data>(Data::make(text_of_bytes(text.size()), &memory));
        std::copy(text.begin(), text.end(), source->as<char>());
    }
    Answer answer(const PlanOptions& options = {}) const {
        return plan(catalogue, {want, scene}, {{source->what}}, Profile{}, options);
    }
    std::vector<float> counts(const Plan& by, RunOptions options = {}) {
        std::vector<float> counted;
        options.memory = &memory;
        run(
            by, {want, scene}, source,
            [&](int, std::shared_ptr<const Data> result) {
                counted.assign(result->as<float>(), result->as<float>() + kLengths);
            },
            options);
        return counted;
    }
};

const std::string kText = "so it goes on and on with one word or two and no end in sight";
const std::vector<float> kCounts{0, 7, 5, 3, 1, 0, 0, 0};  // counted by hand

TEST(ToyGraph, BothWaysCountTheSame) {
    WordCount words(kText);
    const Answer answer = words.answer();
    ASSERT_TRUE(answer.plan);
    EXPECT_EQ(answer.plan->texts(),
              (std::vector<std::string>{"text.split", "text.find_longest", "text.count"}));
    EXPECT_EQ(words.counts(*answer.plan), kCounts);
    PlanOptions straight;
    straight.demands.via = {demand_of("letters", words.catalogue)};
    const Answer other = words.answer(straight);
    ASSERT_TRUE(other.plan);
    EXPECT_EQ(other.plan->texts(), std::vector<std::string>{"letters.scan"});
    EXPECT_EQ(words.counts(*other.plan), kCounts);
    EXPECT_EQ(answer.front.size(), 2u);  // the straight way needs less memory
}

TEST(ToyGraph, LeastMemoryGoesStraight) {
    WordCount words(kText);
    words.want.minimize = Minimize::memory;
    EXPECT_EQ(words.answer().plan->texts(), std::vector<std::string>{"letters.scan"});
}

TEST(ToyGraph, AFailedStepIsGoneRound) {
    WordCount words(kText + " incomprehensibilities");  // too long to be counted the fast way
    const std::size_t before = words.memory.used();
    RunOptions options{.threads = 2};
    options.replan = [&](const std::string& failed, const std::string& why,
                         const std::vector<Representation>& held) {
        EXPECT_EQ(failed, "text.count");
        EXPECT_EQ(why, "a word is too long");
        std::vector<Source> sources;
        for (const Representation& what : held) sources.push_back({what});
        PlanOptions without;
        without.demands.without = {demand_of(failed, words.catalogue)};
        return plan(words.catalogue, {words.want, words.scene}, sources, Profile{}, without).plan;
    };
    EXPECT_EQ(words.counts(*words.answer().plan, options), kCounts);
    EXPECT_EQ(words.memory.used(), before);
}

}  // namespace
}  // namespace edgewise
