#include <gtest/gtest.h>
#include <string>

#include "tests/transitions/spectrum/spectrum_scene.hpp"
#include "transitions/spectrum/hartley.hpp"
#include "transitions/spectrum/projection.hpp"
#include "transitions/spectrum/spectrum_model.hpp"

namespace edgewise {
namespace {

struct Asked {
    Extent extent{24, 22, 20};
    Data data = blobs(extent, 0, std::pmr::new_delete_resource());
    Request want = request_of(extent, Vec3(1, 1, 1), Mode::xray, 1);
    Scene scene = scene_of(data);

    Ask ask() const { return {want, scene}; }
    /// What a preview told: errors over the range.
    void measured(double ends, double narrow, double wide) {
        scene.facts["picture/spectrum/ends"] = ends * scene.range;
        const std::vector<kernels::KaiserBessel>& tried = SpectrumRays::tried();
        scene.facts[fact_of_spectrum(tried[0], extent, want)] = narrow * scene.range;
        scene.facts[fact_of_spectrum(tried[1], extent, want)] = wide * scene.range;
    }
};

/// The windows that spectrum.wide offers, of those that it tries.
std::vector<Offer> offered(const Asked& asked, std::string* reason = nullptr) {
    const Transition wide = spectrum_wide();
    std::vector<Offer> all;
    for (const Value& width : wide.parameters.at("width").tried)
        for (const Value& padding : wide.parameters.at("padding").tried) {
            Offer offer =
                wide.offer(asked.data.what, asked.ask(), {{"width", width}, {"padding", padding}});
            if (offer.refused.empty())
                all.push_back(std::move(offer));
            else if (reason)
                *reason = offer.refused;
        }
    return all;
}

TEST(SpectrumWide, IsNotOfferedUnlessABudgetAsks) {
    Asked asked;
    asked.measured(1e-7, 1e-3, 1e-4);
    std::string reason;
    EXPECT_TRUE(offered(asked, &reason).empty());
    EXPECT_EQ(Message(reason).text(),
              "no error is asked for; spectrum.forward takes any width by via");
    asked.want.budget.error = 2e-4;
    EXPECT_TRUE(offered(asked, &reason).empty());
    EXPECT_EQ(reason, "a window of 6 taps keeps an error of 0.0002");
    asked.want.budget.error = 1e-5;
    asked.want.budget.error_yields = true;
    EXPECT_TRUE(offered(asked).empty());
}

TEST(SpectrumWide, OffersTheCheapestWindowWhoseBoundKeepsTheBudget) {
    Asked asked;
    asked.measured(1e-7, 4e-3, 4e-3);
    double last = 1;
    for (const double budget : {3e-3, 3e-4, 5e-5, 1.5e-5, 4e-6}) {
        asked.want.budget.error = budget;
        const std::vector<Offer> offers = offered(asked);
        ASSERT_EQ(offers.size(), 1u) << budget;
        const Error error = spectrum_wide().error(offers[0], asked.ask());
        EXPECT_TRUE(error.known);
        // A window that keeps far less than it may would take more than it must.
        EXPECT_LE(error.bias, budget * asked.scene.range);
        EXPECT_LE(error.bias, last);
        last = error.bias;
        // It leads where spectrum.slice reads.
        EXPECT_EQ(offers[0].to.kind(), spectrum_kind(window_of(offers[0].to)));
    }
    std::string reason;
    asked.want.budget.error = 3e-7;  // below what rounding leaves
    EXPECT_TRUE(offered(asked, &reason).empty());
    EXPECT_NE(reason.find("no window's bound"), std::string::npos) << reason;
}

TEST(SpectrumWide, NoWindowMendsWhatAllOfThemGetWrong) {
    Asked asked;
    asked.measured(1e-3, 2e-3, 1.1e-3);
    asked.want.budget.error = 1e-5;
    std::string reason;
    EXPECT_TRUE(offered(asked, &reason).empty());
    EXPECT_EQ(reason, "pictures by any window are wrong by 0.001, which is asked to be 1e-05");
}

TEST(SpectrumWide, IsRefusedWhereNoSliceIsAProjection) {
    Asked asked;
    asked.measured(1e-7, 1e-3, 1e-3);
    asked.want.budget.error = 1e-5;
    asked.scene.non_finite = 1;
    std::string reason;
    EXPECT_TRUE(offered(asked, &reason).empty());
    EXPECT_NE(reason.find("not finite"), std::string::npos);
}

TEST(SpectrumForward, EveryWindowStatesAnErrorThatFallsWithItsWidth) {
    Asked asked;
    for (const double padding : {1.25, 1.5, 2.}) {
        double last = 1e300;
        for (int width = 2; width <= 8; ++width) {
            const Path path(asked.data.what, asked.ask(), {double(width), padding});
            ASSERT_EQ(path.made.refused, "");
            const Error error = path.forward.error(path.made, asked.ask());
            EXPECT_TRUE(error.known);
            EXPECT_LT(error.bias, last) << width << " " << padding;
            last = error.bias;
        }
    }
    const Path linear(asked.data.what, asked.ask(), {2, 1.});
    EXPECT_EQ(linear.made.to.kind(), "object/spectrum+window2x1");
    EXPECT_GT(linear.forward.error(linear.made, asked.ask()).bias, 0.1 * asked.scene.range);
}

/// Pictures by every window, beside that by the widest: what is left is the window's mean ghost.
TEST(SpectrumForward, EveryWindowMakesThePicture) {
    Asked asked;
    std::pmr::memory_resource* const memory = std::pmr::new_delete_resource();
    const auto picture = [&](double width, double padding) {
        const Path path(asked.data.what, asked.ask(), {width, padding});
        const Data made =
            path.picture(path.spectrum(asked.data, asked.ask(), memory), asked.ask(), 2, memory);
        return std::vector<float>(made.as<float>(), made.as<float>() + made.what.extent.samples());
    };
    const std::vector<float> best = picture(8, 2);
    const double largest = *std::max_element(best.begin(), best.end());
    for (const kernels::KaiserBessel& window : windows()) {
        const std::vector<float> made = picture(window.width(), window.padding());
        double squares = 0;
        for (std::size_t i = 0; i < made.size(); ++i) squares += std::pow(made[i] - best[i], 2);
        const double rms = std::sqrt(squares / static_cast<double>(made.size())) / largest;
        EXPECT_LT(rms, 2 * window.mean_ghost() + 2e-6) << window_facet(window);
    }
}

struct HartleyPath {
    Path half;
    Transition hartley = spectrum_hartley();
    Offer turned, cut;

    HartleyPath(const Asked& asked, const Chosen& chosen)
        : half(asked.data.what, asked.ask(), chosen) {
        turned = hartley.offer(half.made.to, asked.ask(), {});
        if (turned.refused.empty())
            cut = half.slice.offer(turned.to, asked.ask(), {{"band", std::string(chosen.band)}});
    }
};

TEST(SpectrumHartley, GivesTheSamePicture) {
    Asked asked;
    Counting memory;
    for (const kernels::KaiserBessel& window : windows())
        for (const char* band : {"volume", "picture"}) {
            const HartleyPath path(asked, {double(window.width()), window.padding(), band});
            ASSERT_EQ(path.turned.refused, "");
            EXPECT_EQ(path.turned.to.kind(), hartley_kind(window));
            EXPECT_EQ(path.cut.to.key(), path.half.cut.to.key());
            const Data spectrum = path.half.spectrum(asked.data, asked.ask(), &memory);
            const Data picture = path.half.picture(spectrum, asked.ask(), 2, &memory);
            Context context{.memory = &memory, .view = 2};
            Data real = Data::make(path.turned.to, &memory),
                 plane = Data::make(path.cut.to, &memory),
                 seen = Data::make(path.half.seen.to, &memory);
            path.hartley.run(path.turned, asked.ask(), spectrum, real,
                             Region::all(path.turned.to.extent), context);
            EXPECT_TRUE(real.facets.contains(window_facet(window)));
            path.half.slice.run(path.cut, asked.ask(), real, plane, Region::all(path.cut.to.extent),
                                context);
            path.half.inverse.run(path.half.seen, asked.ask(), plane, seen,
                                  Region::all(path.half.seen.to.extent), context);
            const std::int64_t n = picture.what.extent.samples();
            const double largest = *std::max_element(picture.as<float>(), picture.as<float>() + n);
            // Rounding of both sums, as large as the window makes it.
            const double most = 1e-6 * std::pow(std::max(1., window.amplified()), 3) * largest;
            for (std::int64_t i = 0; i < n; ++i)
                ASSERT_NEAR(picture.as<float>()[i], seen.as<float>()[i], most)
                    << window_facet(window);
        }
}

TEST(SpectrumHartley, SaysItsPrice) {
    const Asked asked;
    const HartleyPath path(asked, {6, 1.5, "volume"});
    const Extent period = spectrum_period(path.half.made.to);
    EXPECT_EQ(path.turned.to.bytes(),
              4. * static_cast<double>((period.x + 9) * period.y * period.z));
    EXPECT_LT(path.turned.to.bytes(), path.half.made.to.bytes());
    EXPECT_GT(path.turned.to.bytes(), 0.7 * path.half.made.to.bytes());
    // Twice the rows, and as many operations.
    const Work real = path.half.slice.work(path.cut, asked.ask(), 1),
               half = path.half.slice.work(path.half.cut, asked.ask(), 1);
    EXPECT_EQ(real.operations, half.operations);
    EXPECT_EQ(real.gathers, 2 * half.gathers);
    EXPECT_EQ(path.hartley.error(path.turned, asked.ask()).bias, 0);
    EXPECT_TRUE(path.hartley.on_demand);
    EXPECT_EQ(spectrum_period(path.turned.to).x, period.x);
}

TEST(SpectrumHartley, RefusesWhatIsNoProjectionAndStops) {
    Asked asked;
    const HartleyPath path(asked, {});
    asked.want.mode = Mode::mip;
    EXPECT_EQ(path.hartley.offer(path.half.made.to, asked.ask(), {}).refused,
              "mip does not commute with the Fourier slice theorem");
    asked.want.mode = Mode::xray;
    Counting memory;
    const Data spectrum = path.half.spectrum(asked.data, asked.ask(), &memory);
    Data real = Data::make(path.turned.to, &memory);
    const std::atomic<bool> stop{true};
    Context context{.memory = &memory, .stop = &stop};
    EXPECT_THROW(path.hartley.run(path.turned, asked.ask(), spectrum, real, {}, context),
                 Cancelled);
}

}  // namespace
}  // namespace edgewise
