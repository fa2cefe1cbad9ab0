// Every edge of the filter job beside sums, extremes and medians written out in f64, over random
// shapes, borders, kernels and types.
#include "graph/filtering.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <memory_resource>
#include <oneapi/tbb/global_control.h>
#include <random>
#include <string>
#include <vector>

#include "graph/with_type.hpp"
#include "transitions/filter/backward.hpp"
#include "transitions/filter/forward.hpp"
#include "transitions/filter/fourier.hpp"
#include "transitions/filter/fourier_levels.hpp"
#include "transitions/filter/median.hpp"
#include "transitions/filter/neighbourhood.hpp"
#include "transitions/filter/recursive.hpp"
#include "transitions/filter/running.hpp"
#include "transitions/filter/runs.hpp"
#include "transitions/filter/separable.hpp"
#include "transitions/filter/van_herk.hpp"

namespace edgewise {
namespace {

/// One of so many numbers from 0 on.
std::int64_t below(std::mt19937& random, std::int64_t count) {
    return static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(count));
}

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::vector<Transition> filter_edges() {
    return {filter_backward(),  filter_forward(), filter_separable(),       filter_running(),
            filter_recursive(), filter_fourier(), filter_fourier_levels(),  filter_runs(),
            filter_van_herk(),  filter_median(),  filter_median_histogram()};
}

/// A job with its data, as the engine would make it.
struct Case {
    Request want;
    Scene scene;
    Data in;

    Case(const Extent& extent, int axes, Type type, int channels, const Filtering& filtering,
         unsigned seed)
        : in(random_data(extent, axes, type, channels, seed)) {
        want.job = Job::filter;
        want.axes = axes;
        want.input = want.screen = extent;
        want.setting = JobSetting::of(filtering);
        look();
    }
    /// What the statistics say of the samples.
    void look() {
        scene.low = INFINITY, scene.high = -INFINITY, scene.non_finite = 0;
        for (std::int64_t i = 0; i < in.what.samples() * in.what.channels; ++i) {
            const double value = number(in, i);
            if (!std::isfinite(value)) {
                ++scene.non_finite;
                continue;
            }
            scene.low = std::min(scene.low, value), scene.high = std::max(scene.high, value);
        }
        scene.range = scene.high - scene.low;
    }
    static double number(const Data& data, std::int64_t i) {
        return with_type(data.what.type, [&](auto type) {
            return data.what.values(static_cast<double>(data.as<decltype(type)>()[i]));
        });
    }
    static Data random_data(const Extent& extent, int axes, Type type, int channels,
                            unsigned seed) {
        Representation what;
        what.extent = extent;
        what.axes = axes;
        what.type = type;
        what.channels = channels;
        Data data = Data::make(what, std::pmr::new_delete_resource());
        std::mt19937 random(seed);
        with_type(type, [&](auto sample) {
            using T = decltype(sample);
            for (std::int64_t i = 0; i < what.samples() * channels; ++i) {
                const double number = random() % 3 == 0 ? 0 : double(random() % 251) - 60;
                data.as<T>()[i] = static_cast<T>(std::is_floating_point_v<T> ? number / 7 : number);
            }
        });
        return data;
    }
};

/// A volume of numbers, of one channel.
struct Numbers {
    Extent n;
    std::vector<double> of;

    double at(Border border, std::int64_t x, std::int64_t y, std::int64_t z) const {
        x = bordered(border, x, n.x), y = bordered(border, y, n.y), z = bordered(border, z, n.z);
        if (x < 0 || y < 0 || z < 0) return 0;
        return of[static_cast<std::size_t>(x + n.x * (y + n.y * z))];
    }
};

/// One of sum, max, min, median over in(p + sign k) with weights, straight from the definition.
Numbers applied(const Numbers& in, const Stencil& kernel, Border border, int sign,
                const std::string& rule) {
    Numbers out = in;
    std::size_t i = 0;
    const auto centre = kernel.centre();
    for (std::int64_t z = 0; z < in.n.z; ++z)
        for (std::int64_t y = 0; y < in.n.y; ++y)
            for (std::int64_t x = 0; x < in.n.x; ++x) {
                double sum = 0, most = -INFINITY, least = INFINITY;
                std::vector<double> all;
                for (std::int64_t c = 0; c < kernel.extent.z; ++c)
                    for (std::int64_t b = 0; b < kernel.extent.y; ++b)
                        for (std::int64_t a = 0; a < kernel.extent.x; ++a) {
                            const double weight = kernel.at(a, b, c);
                            if (std::isnan(weight)) continue;
                            const double value =
                                in.at(border, x + sign * (a - centre[0]),
                                      y + sign * (b - centre[1]), z + sign * (c - centre[2]));
                            if (rule == "median" && std::isnan(value)) continue;
                            sum += weight * value;
                            most = std::max(most, value + weight);
                            least = std::min(least, value - weight);
                            all.push_back(value);
                        }
                if (rule == "median") {
                    std::sort(all.begin(), all.end());
                    out.of[i++] = all.empty() ? kNone : all[(all.size() - 1) / 2];
                } else {
                    out.of[i++] = rule == "sum" ? sum : rule == "max" ? most : least;
                }
            }
    return out;
}

/// What a pass made goes back to all samples that it was made of, by the kernel of that pass.
Numbers given_back(const Numbers& original, const Numbers& in, const Stencil& kernel, Border border,
                   int sign, const std::string& rule) {
    Numbers out = in;
    const bool most = rule == "max";
    std::fill(out.of.begin(), out.of.end(), most ? -INFINITY : INFINITY);
    const auto centre = kernel.centre();
    for (std::int64_t z = 0; z < in.n.z; ++z)
        for (std::int64_t y = 0; y < in.n.y; ++y)
            for (std::int64_t x = 0; x < in.n.x; ++x)
                for (std::int64_t c = 0; c < kernel.extent.z; ++c)
                    for (std::int64_t b = 0; b < kernel.extent.y; ++b)
                        for (std::int64_t a = 0; a < kernel.extent.x; ++a) {
                            const double weight = kernel.at(a, b, c);
                            if (std::isnan(weight)) continue;
                            const std::int64_t i =
                                bordered(border, x + sign * (a - centre[0]), in.n.x);
                            const std::int64_t j =
                                bordered(border, y + sign * (b - centre[1]), in.n.y);
                            const std::int64_t k =
                                bordered(border, z + sign * (c - centre[2]), in.n.z);
                            double& to =
                                out.of[static_cast<std::size_t>(i + in.n.x * (j + in.n.y * k))];
                            const double value = in.at(border, x, y, z);
                            to = most ? std::max(to, value + weight) : std::min(to, value - weight);
                        }
    for (std::size_t i = 0; i < out.of.size(); ++i)
        if (std::isinf(out.of[i])) out.of[i] = original.of[i];  // read by none
    return out;
}

Numbers expected(const Numbers& in, const Filtering& by) {
    if (is_binary(by.op)) {
        Numbers mask = in;
        for (double& value : mask.of) value = value != 0 && !std::isnan(value);
        Filtering grey = by;
        grey.op = grey_of(by.op);
        mask = expected(mask, grey);
        for (double& value : mask.of) value *= by.inside;
        return mask;
    }
    if (by.op == FilterOp::gradient) {
        Numbers length = in;
        std::fill(length.of.begin(), length.of.end(), 0);
        for (const Stencil& derivative : by.derivatives) {
            const Numbers along = applied(in, derivative, by.border, 1, "sum");
            for (std::size_t i = 0; i < along.of.size(); ++i)
                length.of[i] = std::hypot(length.of[i], along.of[i]);
        }
        return length;
    }
    const auto second = [&](const Numbers& from, int sign, const char* rule) {
        return by.border == Border::zero ? applied(from, by.stencil, by.border, sign, rule)
                                         : given_back(in, from, by.stencil, by.border, -sign, rule);
    };
    const auto pass = [&](const Numbers& from, int sign, const char* rule) {
        return applied(from, by.stencil, by.border, sign, rule);
    };
    switch (by.op) {
        case FilterOp::convolve:
            return pass(in, -1, "sum");
        case FilterOp::correlate:
            return pass(in, 1, "sum");
        case FilterOp::dilate:
            return pass(in, -1, "max");
        case FilterOp::erode:
            return pass(in, 1, "min");
        case FilterOp::open:
            return second(pass(in, 1, "min"), -1, "max");
        case FilterOp::close:
            return second(pass(in, -1, "max"), 1, "min");
        case FilterOp::tophat: {
            Numbers opened = second(pass(in, 1, "min"), -1, "max");
            for (std::size_t i = 0; i < opened.of.size(); ++i)
                opened.of[i] = in.of[i] - opened.of[i];
            return opened;
        }
        case FilterOp::median:
            return pass(in, 1, "median");
        default:
            return in;
    }
}

Numbers channel_of(const Data& data, int channel) {
    Numbers numbers{data.what.extent, {}};
    for (std::int64_t i = 0; i < data.what.samples(); ++i)
        numbers.of.push_back(Case::number(data, i * data.what.channels + channel));
    return numbers;
}

Data run_edge(const Transition& edge, const Case& of, const Offer& offer) {
    Data out = Data::make(offer.to, std::pmr::new_delete_resource());
    Context context{.memory = std::pmr::new_delete_resource()};
    edge.run(offer, {of.want, of.scene}, of.in, out, Region::all(offer.to.extent), context);
    return out;
}

/// A kernel of random weights, with holes, of any size, even ones too.
Stencil random_stencil(std::mt19937& random, int axes, bool of_sum, bool flat) {
    Stencil stencil;
    for (int axis = 0; axis < axes; ++axis)
        stencil.extent[axis] = 1 + below(random, axes == 2 ? 7 : 4);
    stencil.weights.clear();
    for (std::int64_t i = 0; i < stencil.extent.samples(); ++i) {
        const bool hole = random() % 4 == 0;
        const double weight = flat ? 0 : (double(random() % 17) - 8) / 4;
        stencil.weights.push_back(hole ? (of_sum ? 0 : kNone) : weight);
    }
    stencil.weights[random() % stencil.weights.size()] = flat ? 0 : 1;
    return stencil;
}

/// How far a result may be off: what the edge says, four times over, and rounding to f32.
double allowed(const Transition& edge, const Case& of, const Offer& offer) {
    const Error error = edge.error(offer, {of.want, of.scene});
    EXPECT_TRUE(error.known);
    const double f32 = offer.to.type == Type::f32 ? 1e-6 * 255 : 0;
    return 2 * error.bias + 8 * error.noise + f32;
}

void expect_right(const Case& of, const std::string& name, int* served) {
    for (const Transition& edge : filter_edges()) {
        const Offer offer = edge.offer(of.in.what, {of.want, of.scene}, {});
        if (!offer.refused.empty()) continue;
        ++*served;
        const Data out = run_edge(edge, of, offer);
        const double most = allowed(edge, of, offer);
        for (int channel = 0; channel < of.in.what.channels; ++channel) {
            const Numbers want =
                expected(channel_of(of.in, channel), *of.want.setting.as<Filtering>());
            const Numbers got = channel_of(out, channel);
            for (std::size_t i = 0; i < want.of.size(); ++i)
                // What is stored as f32 has 24 bits.
                ASSERT_NEAR(got.of[i], want.of[i], most + 0x1p-24 * std::abs(want.of[i]))
                    << edge.name << ' ' << name << " at " << i;
        }
    }
}

TEST(Filtering, EveryEdgeIsTheDefinition) {
    std::mt19937 random(5);
    constexpr Type kTypes[] = {Type::u8,  Type::i8,  Type::u16, Type::i16,
                               Type::u32, Type::i32, Type::f32, Type::f64};
    int served = 0;
    for (int round = 0; round < 160; ++round) {
        const FilterOp op = filter_ops()[static_cast<std::size_t>(round) % filter_ops().size()];
        const int axes = random() % 2 ? 2 : 3;
        Extent extent{1 + below(random, 40), 1 + below(random, 12), 1};
        if (axes == 3) extent = {1 + below(random, 14), 1 + below(random, 7), 1 + below(random, 6)};
        Filtering filtering{op, {}, static_cast<Border>(random() % 4)};
        const bool flat = is_binary(op) || (!is_linear(op) && random() % 3 != 0);
        filtering.inside = is_binary(op) ? 3 : 1;
        for (int axis = 0; op == FilterOp::gradient && axis < axes; ++axis)
            filtering.derivatives.push_back(
                random() % 2 ? Stencil::difference(axis, axes).times(2)
                             : Stencil::gauss_derivative(0.6 + axis, axis, axes));
        filtering.stencil = random_stencil(random, axes, is_linear(op), flat);
        if (random() % 3 == 0)
            filtering.stencil = Stencil::box(double(random() % 5), axes, is_linear(op));
        if (random() % 5 == 0)
            filtering.stencil = Stencil::ball(1 + double(random() % 4), axes, is_linear(op));
        const Type type = kTypes[random() % 8];
        const int channels = axes == 2 && random() % 4 == 0 ? 3 : 1;
        const Case of(extent, axes, type, channels, filtering, static_cast<unsigned>(random()));
        expect_right(of,
                     std::string(name_of(op)) + ' ' + std::string(name_of(type)) + ' ' +
                         filtering.stencil.name + ' ' + std::string(name_of(filtering.border)),
                     &served);
    }
    EXPECT_GT(served, 420);
}

TEST(Filtering, LargeKernelsCrossManyTiles) {
    int served = 0;
    for (const double radius : {9.0, 18.0})
        for (const FilterOp op : {FilterOp::convolve, FilterOp::dilate, FilterOp::erode}) {
            const Filtering ball{op, Stencil::ball(radius, 2, is_linear(op)), Border::mirror};
            expect_right(Case({301, 40, 1}, 2, Type::u8, 1, ball, 1), "disc", &served);
            const Filtering box{op, Stencil::box(radius, 2, is_linear(op)), Border::wrap};
            expect_right(Case({301, 40, 1}, 2, Type::f32, 1, box, 2), "box", &served);
        }
    const Filtering cube{FilterOp::erode, Stencil::box(3, 3, false), Border::clamp};
    expect_right(Case({150, 21, 19}, 3, Type::i16, 1, cube, 3), "cube", &served);
    EXPECT_GT(served, 25);
}

TEST(Filtering, LevelsThroughTheSpectrumAreTheExtremes) {
    int served = 0;
    for (const FilterOp op : {FilterOp::dilate, FilterOp::erode, FilterOp::median, FilterOp::open})
        for (const Border border : {Border::zero, Border::mirror, Border::wrap}) {
            const Filtering by{op, Stencil::ball(4, 2, false), border};
            Case of({70, 50, 1}, 2, Type::u8, 1, by, 8);
            for (std::int64_t i = 0; i < of.in.what.samples(); ++i)
                of.in.as<std::uint8_t>()[i] %= 4;
            of.look();
            const Transition edge = filter_fourier_levels();
            served += edge.offer(of.in.what, {of.want, of.scene}, {}).refused.empty();
            int all = 0;
            expect_right(of, std::string(name_of(op)), &all);
        }
    EXPECT_EQ(served, 12);
}

TEST(Filtering, SumsOfIntegersAreExact) {
    // Each serves weights of any kind in such a way that rounding to integers gives those of f64.
    for (const Stencil& kernel : {Stencil::gauss(1.3, 2), Stencil::sobel(0, 2), Stencil::laplace(2),
                                  Stencil::box(2, 2, true)}) {
        const Case of({53, 41, 1}, 2, Type::u8, 1, {FilterOp::correlate, kernel, Border::clamp}, 9);
        const Numbers want = expected(channel_of(of.in, 0), *of.want.setting.as<Filtering>());
        for (const Transition& edge :
             {filter_backward(), filter_separable(), filter_running(), filter_forward()}) {
            const Offer offer = edge.offer(of.in.what, {of.want, of.scene}, {});
            if (!offer.refused.empty()) continue;
            const Numbers got = channel_of(run_edge(edge, of, offer), 0);
            for (std::size_t i = 0; i < want.of.size(); ++i)
                ASSERT_EQ(std::nearbyint(got.of[i]), std::nearbyint(want.of[i]))
                    << edge.name << ' ' << kernel.name;
        }
    }
}

TEST(Filtering, NaNReachesAsFarAsTheKernel) {
    for (const FilterOp op : {FilterOp::convolve, FilterOp::dilate, FilterOp::erode}) {
        Case of({60, 40, 1}, 2, Type::f32, 1, {op, Stencil::ball(3, 2, is_linear(op))}, 4);
        *of.in.at<float>(20, 17, 0) = std::numeric_limits<float>::quiet_NaN();
        of.look();
        int served = 0;
        for (const Transition& edge : filter_edges()) {
            const Offer offer = edge.offer(of.in.what, {of.want, of.scene}, {});
            if (!offer.refused.empty()) continue;
            ++served;
            const Data out = run_edge(edge, of, offer);
            for (std::int64_t y = 0; y < 40; ++y)
                for (std::int64_t x = 0; x < 60; ++x) {
                    const double distance = std::hypot(double(x - 20), double(y - 17));
                    ASSERT_EQ(std::isnan(*out.at<float>(x, y, 0)), distance <= 3)
                        << edge.name << ' ' << x << ' ' << y;
                }
        }
        EXPECT_GT(served, 0);
    }
}

TEST(Filtering, ScatteredExtremesAreThoseGathered) {
    // Sparse, with whole tiles of one value, infinite samples and heights of all signs.
    std::mt19937 random(31);
    for (const FilterOp op : {FilterOp::dilate, FilterOp::erode, FilterOp::open})
        for (const bool flat : {true, false})
            for (const bool infinite : {false, true}) {
                const Filtering by{op, random_stencil(random, 2, false, flat), Border::clamp};
                Case of({600, 70, 1}, 2, Type::f32, 1, by, 4);
                for (std::int64_t i = 0; i < of.in.what.samples(); ++i) {
                    float& sample = of.in.as<float>()[i];
                    if (random() % 50) sample = -3;
                    if (infinite && random() % 400 == 0)
                        sample = random() % 2 ? INFINITY : -INFINITY;
                }
                of.look();
                const Transition forward = filter_forward(), backward = filter_backward();
                const Offer offer = forward.offer(of.in.what, {of.want, of.scene}, {});
                ASSERT_EQ(offer.refused, "");
                const Data got = run_edge(forward, of, offer), want = run_edge(backward, of, offer);
                for (std::int64_t i = 0; i < of.in.what.samples(); ++i)
                    ASSERT_EQ(Case::number(got, i), Case::number(want, i))
                        << name_of(op) << ' ' << i;
            }
}

TEST(Filtering, TransformsAndRecursionsRefuseWhatTheyWouldSpread) {
    Case of({60, 40, 1}, 2, Type::f32, 1, {FilterOp::convolve, Stencil::gauss(3, 2)}, 4);
    *of.in.at<float>(20, 17, 0) = std::numeric_limits<float>::infinity();
    of.look();
    for (const Transition& edge : {filter_fourier(), filter_recursive(), filter_running()})
        EXPECT_FALSE(edge.offer(of.in.what, {of.want, of.scene}, {}).refused.empty()) << edge.name;
}

TEST(Filtering, RecursionIsAsFarOffAsItSays) {
    for (const double sigma : {0.8, 2.0, 7.5}) {
        const Case of({90, 80, 1}, 2, Type::f32, 1,
                      {FilterOp::convolve, Stencil::gauss(sigma, 2), Border::mirror}, 6);
        const Transition edge = filter_recursive();
        const Offer offer = edge.offer(of.in.what, {of.want, of.scene}, {});
        const Numbers got = channel_of(run_edge(edge, of, offer), 0);
        const Numbers want = expected(channel_of(of.in, 0), *of.want.setting.as<Filtering>());
        double worst = 0;
        for (std::size_t i = 0; i < want.of.size(); ++i)
            worst = std::max(worst, std::abs(got.of[i] - want.of[i]));
        const double bias = edge.error(offer, {of.want, of.scene}).bias;
        EXPECT_LE(worst, bias + 1e-4) << sigma;
        EXPECT_LT(bias, 0.02 * of.scene.range) << sigma;
    }
}

TEST(Filtering, SameBytesForAnyThreads) {
    const Case sum({700, 300, 1}, 2, Type::f32, 1,
                   {FilterOp::convolve, Stencil::gauss(4, 2), Border::mirror}, 7);
    const Case extreme({700, 300, 1}, 2, Type::u8, 1,
                       {FilterOp::open, Stencil::ball(6, 2, false), Border::mirror}, 7);
    for (const Case* of : {&sum, &extreme})
        for (const Transition& edge : filter_edges()) {
            const Offer offer = edge.offer(of->in.what, {of->want, of->scene}, {});
            if (!offer.refused.empty()) continue;
            std::vector<Data> results;
            for (const std::size_t threads : {1u, 2u, 7u}) {
                const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                                threads);
                results.push_back(run_edge(edge, *of, offer));
            }
            const auto bytes = static_cast<std::size_t>(offer.to.bytes());
            for (const Data& other : results)
                ASSERT_EQ(0, std::memcmp(results[0].samples.data(), other.samples.data(), bytes))
                    << edge.name;
        }
}

TEST(Products, AreTheKernel) {
    std::mt19937 random(2);
    for (int round = 0; round < 30; ++round) {
        Neighbourhood sum;
        const Extent n{1 + below(random, 6), 1 + below(random, 6), 1 + below(random, 4)};
        sum.high = {n.x - 1, n.y - 1, n.z - 1};
        sum.weights.clear();
        for (std::int64_t i = 0; i < n.samples(); ++i)
            sum.weights.push_back((double(random() % 201) - 100) / 32);
        const auto products = products_of(sum).value();
        EXPECT_LE(products.size(), static_cast<std::size_t>(n.x * n.y * n.z));
        std::size_t at = 0;
        for (std::int64_t z = 0; z < n.z; ++z)
            for (std::int64_t y = 0; y < n.y; ++y)
                for (std::int64_t x = 0; x < n.x; ++x, ++at) {
                    double weight = 0;
                    for (const Product& product : products)
                        weight += product.along[0][static_cast<std::size_t>(x)] *
                                  product.along[1][static_cast<std::size_t>(y)] *
                                  product.along[2][static_cast<std::size_t>(z)];
                    ASSERT_NEAR(weight, sum.weights[at], 1e-10);
                }
    }
    Neighbourhood sobel;
    const Stencil stencil = Stencil::sobel(1, 3);
    sobel.low = {-1, -1, -1}, sobel.high = {1, 1, 1};
    sobel.weights.assign(stencil.weights.begin(), stencil.weights.end());
    const auto one = products_of(sobel).value();
    ASSERT_EQ(one.size(), 1u);
    for (const auto& line : one[0].along)
        for (const double weight : line) EXPECT_EQ(weight, std::round(weight));
}

}  // namespace
}  // namespace edgewise
