// What compositing takes, counted while it is done, beside TABLE 32 to 37 of [W93] and their
// errata.
#include "transitions/composite/groupings.hpp"

#include <bit>
#include <cmath>
#include <gtest/gtest.h>
#include <optional>
#include <random>
#include <vector>

#include "tests/thesis/compositing_tables.hpp"

namespace edgewise {
namespace {

constexpr int kLongest = 65;

struct Tally {
    int multiplications = 0, additions = 0;
};

/// A number that counts what is done with it.
struct Counted {
    double value = 0;
    Tally* tally = nullptr;
};
Counted operator*(const Counted& a, const Counted& b) {
    ++a.tally->multiplications;
    return {a.value * b.value, a.tally};
}
Counted operator+(const Counted& a, const Counted& b) {
    ++a.tally->additions;
    return {a.value + b.value, a.tally};
}
Counted operator-(const Counted& a, const Counted& b) {
    ++a.tally->additions;
    return {a.value - b.value, a.tally};
}

/// One ray of one intensity with transparencies (EQ 83, 86 to 88). A transparency that a grouping
/// says nobody asks for does not exist: std::optional throws where one does.
template <class Number>
struct Transparencies {
    struct Part {
        Number light;
        std::optional<Number> left;
    };
    std::vector<Part> samples;

    Transparencies(const std::vector<Number>& shaded, const std::vector<Number>& opacity,
                   const Number& one) {
        for (std::size_t i = 0; i < shaded.size(); ++i) {
            samples.push_back({shaded[i] * opacity[i], {}});
            if (i + 1 < shaded.size()) samples.back().left = one - opacity[i];
        }
    }
    Part leaf(int i) const { return samples[static_cast<std::size_t>(i)]; }
    Part over(const Part& front, const Part& behind, bool updates) const {
        Part both{front.light + behind.light * front.left.value(), {}};
        if (updates) both.left = front.left.value() * behind.left.value();
        return both;
    }
    Part attenuated(const Part& front, int i, bool updates) const {
        Part seen{leaf(i).light * front.left.value(), {}};
        if (updates) seen.left = front.left.value() * leaf(i).left.value();
        return seen;
    }
    Part sum(const Part& front, const Part& behind) const {
        return {front.light + behind.light, behind.left};
    }
};

/// The same with opacities (EQ 84, 85). Kept: 1 - opacity of a composite serves its update too.
template <class Number>
struct Opacities {
    struct Part {
        Number light;
        std::optional<Number> opacity;
    };
    std::vector<Part> samples;
    Number one;
    bool kept;

    Part leaf(int i) const { return samples[static_cast<std::size_t>(i)]; }
    Part over(const Part& front, const Part& behind, bool updates) const {
        const Number through = one - front.opacity.value();
        Part both{front.light + behind.light * through, {}};
        if (updates)
            both.opacity = front.opacity.value() +
                           behind.opacity.value() * (kept ? through : one - front.opacity.value());
        return both;
    }
    // TABLE 37 has no such sum.
    Part attenuated(const Part& front, int i, bool) const { return over(front, leaf(i), true); }
    Part sum(const Part& front, const Part&) const { return front; }
};

struct Ray {
    std::vector<double> shaded, opacity;

    explicit Ray(int samples, unsigned seed = 3) {
        std::mt19937 bits(seed);
        std::uniform_real_distribution<double> share(0, 1);
        for (int i = 0; i < samples; ++i) {
            shaded.push_back(share(bits));
            opacity.push_back(share(bits) * share(bits));
        }
    }
    /// EQ 61 as a sum, with 1 - opacity in place of the exponential.
    double light() const {
        double sum = 0, left = 1;
        for (std::size_t i = 0; i < shaded.size(); ++i) {
            sum += shaded[i] * opacity[i] * left;
            left *= 1 - opacity[i];
        }
        return sum;
    }
};

std::vector<Counted> counted(const std::vector<double>& values, Tally& tally) {
    std::vector<Counted> all;
    for (const double value : values) all.push_back({value, &tally});
    return all;
}

/// What a grouping takes with transparencies, having given the right light.
Tally with_transparencies(Compositing how, int samples) {
    const Ray ray(samples);
    Tally tally;
    Transparencies<Counted> algebra(counted(ray.shaded, tally), counted(ray.opacity, tally),
                                    {1, &tally});
    Grouping<Transparencies<Counted>> grouping(algebra, samples);
    const auto all = grouping.composite(how, 0, samples);
    // Roundings of W products and sums of numbers up to 1, by 2^-53.
    EXPECT_NEAR(all.light.value, ray.light(), 2 * samples * 0x1p-53);
    EXPECT_FALSE(all.left) << "nobody asks for it";
    return tally;
}

Tally with_opacities(Compositing how, int samples, bool kept) {
    const Ray ray(samples);
    Tally tally;
    Opacities<Counted> algebra{{}, {1, &tally}, kept};
    const auto shaded = counted(ray.shaded, tally), opacity = counted(ray.opacity, tally);
    for (std::size_t i = 0; i < shaded.size(); ++i)
        algebra.samples.push_back({shaded[i] * opacity[i], opacity[i]});
    Grouping<Opacities<Counted>> grouping(algebra, samples);
    EXPECT_NEAR(grouping.composite(how, 0, samples).light.value, ray.light(),
                4 * samples * 0x1p-53);
    return tally;
}

TEST(Groupings, TakeWhatTheFormulasSay) {
    for (const auto& [name, how] : thesis::kMethods)
        for (int samples = 1; samples <= kLongest; ++samples) {
            SCOPED_TRACE(std::string(name) + ", W " + std::to_string(samples));
            const Tally tally = with_transparencies(how, samples);
            const Counts counts = counts_of(how, samples);
            EXPECT_EQ(tally.multiplications, counts.multiplications);
            EXPECT_EQ(tally.additions, counts.additions);
        }
}

TEST(Groupings, OfColoursShareOneTransparency) {
    for (const auto& [name, how] : thesis::kMethods)
        for (int samples = 1; samples <= kLongest; ++samples) {
            const Counts one = counts_of(how, samples), three = counts_of(how, samples, 3);
            const double updates = transparency_updates(how, samples);
            EXPECT_EQ(three.multiplications - updates, 3 * (one.multiplications - updates)) << name;
            EXPECT_EQ(three.additions - (samples - 1), 3 * (one.additions - (samples - 1))) << name;
            // Every composite has an update where the opacity of the ray is asked for too.
            EXPECT_EQ(updates + opacity_counts(how, samples).multiplications, samples - 1) << name;
        }
}

/// The formula of a method, as printed.
std::string formula_of(int number, Compositing how, const char* column) {
    for (const thesis::Row& row : thesis::table(number))
        if (thesis::method(row) == how) {
            const std::string text = row.at(column);
            return text.substr(0, text.find(" or"));
        }
    return {};
}

constexpr Compositing kExact[] = {Compositing::back_to_front, Compositing::front_to_back,
                                  Compositing::tree_from_back, Compositing::sum};

TEST(Tables36And37, ArePrintedAsCountedOfFourMethods) {
    for (const Compositing how : kExact)
        for (int samples = 2; samples <= kLongest; ++samples) {
            const Tally tally = with_transparencies(how, samples);
            EXPECT_EQ(tally.multiplications,
                      thesis::value_of(formula_of(36, how, "multiplications"), samples));
            EXPECT_EQ(tally.additions,
                      thesis::value_of(formula_of(37, how, "transparency"), samples));
        }
}

TEST(Tables36And37, AreBoundsOfTreesFromTheFront) {
    constexpr Compositing kHow = Compositing::tree_from_front;
    for (int samples = 2; samples <= kLongest; ++samples) {
        const auto last = static_cast<unsigned>(samples - 1);
        const int levels = std::bit_width(last), ones = std::popcount(last);
        const Tally tally = with_transparencies(kHow, samples);
        EXPECT_EQ(tally.multiplications, 3 * samples - 2 - ones);
        EXPECT_EQ(thesis::value_of(formula_of(36, kHow, "multiplications"), samples) -
                      tally.multiplications,
                  (1 << levels) - samples - levels + ones);
        EXPECT_EQ(tally.additions, thesis::value_of(formula_of(37, kHow, "transparency"), samples));
        const Tally opacities = with_opacities(kHow, samples, true);
        EXPECT_EQ(opacities.additions, 3 * samples - 3 - ones);
        EXPECT_EQ(thesis::value_of(formula_of(37, kHow, "opacity"), samples) - opacities.additions,
                  (1 << levels) - samples - levels + ones);
    }
}

TEST(Eq89, IsNegativeAsPrintedAndRightFromOneOn) {
    for (int samples = 2; samples <= kLongest; ++samples) {
        int from_zero = 0, from_one = 0;
        for (int i = 0; (samples - 1) >> i > 0; ++i) {
            from_zero += (samples - 1) >> i;
            if (i > 0) from_one += (samples - 1) >> i;
        }
        const Tally tally = with_transparencies(Compositing::tree_from_front, samples);
        const int updates = tally.multiplications - (2 * samples - 1);
        EXPECT_EQ(from_one, updates);
        const int printed = samples - 1 - from_zero;
        EXPECT_EQ(printed, -updates);
        EXPECT_LT(printed, samples > 2 ? 0 : 1);
    }
}

TEST(Table37, KeepsOneLessOpacityInTreesOnly) {
    for (int samples = 2; samples <= kLongest; ++samples) {
        for (const Compositing how : {Compositing::back_to_front, Compositing::tree_from_back}) {
            const Tally tally = with_opacities(how, samples, true);
            EXPECT_EQ(tally.additions, thesis::value_of(formula_of(37, how, "opacity"), samples));
            EXPECT_EQ(tally.additions, additions_with_opacity(how, samples, true));
        }
        // Front to back: 4W - 6 is what it takes without, W - 2 more than with.
        constexpr Compositing kHow = Compositing::front_to_back;
        const double printed = thesis::value_of(formula_of(37, kHow, "opacity"), samples);
        EXPECT_EQ(with_opacities(kHow, samples, false).additions, printed);
        const Tally kept = with_opacities(kHow, samples, true);
        EXPECT_EQ(kept.additions, 3 * samples - 4);
        EXPECT_EQ(printed - kept.additions, samples - 2);
        EXPECT_EQ(kept.multiplications, counts_of(kHow, samples).multiplications);
    }
}

TEST(Lemma41, AnyTwoStretchesJoin) {
    const int samples = 23;
    const Ray ray(samples);
    Transparencies<double> algebra(ray.shaded, ray.opacity, 1.0);
    Grouping<Transparencies<double>> grouping(algebra, samples);
    for (const auto& [name, how] : thesis::kMethods)
        for (int cut = 1; cut < samples; ++cut) {
            const auto front = grouping.composite(how, 0, cut);
            const auto behind = grouping.composite(Compositing::tree_from_back, cut, samples);
            EXPECT_NEAR(algebra.over(front, behind, false).light, ray.light(), 1e-14) << name;
        }
}

TEST(Lemma42, OrderMatters) {
    const int samples = 8;
    Ray ray(samples);
    const double there = ray.light();
    std::swap(ray.shaded[2], ray.shaded[5]);
    std::swap(ray.opacity[2], ray.opacity[5]);
    Transparencies<double> algebra(ray.shaded, ray.opacity, 1.0);
    Grouping<Transparencies<double>> grouping(algebra, samples);
    for (const auto& [name, how] : thesis::kMethods) {
        const double swapped = grouping.composite(how, 0, samples).light;
        EXPECT_GT(std::abs(swapped - there), 1e-3) << name;
        EXPECT_NEAR(swapped, ray.light(), 1e-15) << name;
    }
}

}  // namespace
}  // namespace edgewise
