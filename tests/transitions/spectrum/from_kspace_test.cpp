#include "transitions/spectrum/from_kspace.hpp"

#include <atomic>
#include <cmath>
#include <complex>
#include <gtest/gtest.h>
#include <limits>
#include <numbers>
#include <random>
#include <tbb/global_control.h>

#include "tests/transitions/spectrum/spectrum_scene.hpp"

namespace edgewise {
namespace {

using Sample = std::complex<double>;

/// A phantom in k-space: sums of exponentials in f64, one axis after another.
std::vector<Sample> kspace_of(std::vector<Sample> samples, const Extent& n) {
    const std::int64_t steps[] = {1, n.x, n.x * n.y};
    for (int axis = 0; axis < 3; ++axis) {
        std::vector<Sample> next(samples.size());
        for (std::int64_t at = 0; at < n.samples(); ++at) {
            const std::int64_t k = at / steps[axis] % n[axis], first = at - k * steps[axis];
            const std::int64_t middle = n[axis] / 2;
            for (std::int64_t i = 0; i < n[axis]; ++i)
                next[static_cast<std::size_t>(at)] +=
                    samples[static_cast<std::size_t>(first + i * steps[axis])] *
                    std::polar(1., -2 * std::numbers::pi *
                                       static_cast<double>((k - middle) * (i - middle)) /
                                       static_cast<double>(n[axis]));
        }
        samples = std::move(next);
    }
    return samples;
}

struct Acquired {
    Extent extent;
    Counting memory;
    std::vector<Sample> phantom;
    Data data;
    Request want;
    Scene scene;

    explicit Acquired(const Extent& n, bool phases) : extent(n) {
        const Data values = blobs(n, 0, &memory);
        std::mt19937 random(4);
        for (std::int64_t i = 0; i < n.samples(); ++i)
            phantom.push_back(std::polar(static_cast<double>(values.as<float>()[i]),
                                         phases ? static_cast<double>(random() % 628) / 100 : 0));
        Representation what;
        what.extent = n;
        what.type = Type::c64;
        what.content = "kspace";
        data = Data::make(what, &memory);
        const std::vector<Sample> samples = kspace_of(phantom, n);
        for (std::size_t i = 0; i < samples.size(); ++i)
            data.as<std::complex<float>>()[i] = std::complex<float>(samples[i]);
        want = request_of(n, Vec3(1, 1, 1), Mode::xray, 1);
        scene = scene_of(values);
    }
    Ask ask() const { return {want, scene}; }
    Data volume(const char* part) {
        const Transition edge = spectrum_from_kspace();
        const Offer offer = edge.offer(data.what, ask(), {{"part", std::string(part)}});
        Data out = Data::make(offer.to, &memory);
        Context context{.memory = &memory};
        edge.run(offer, ask(), data, out, {}, context);
        return out;
    }
};

TEST(SpectrumFromKspace, GivesThePhantomBack) {
    for (const Extent& n : {Extent{12, 10, 8}, Extent{7, 9, 5}, Extent{1, 1, 1}, Extent{11, 1, 2}})
        for (const bool phases : {false, true}) {
            Acquired scan(n, phases);
            const Data magnitude = scan.volume("magnitude"), real = scan.volume("real");
            for (std::int64_t i = 0; i < n.samples(); ++i) {
                const Sample& expected = scan.phantom[static_cast<std::size_t>(i)];
                // Values up to 120, rounded some ten times.
                ASSERT_NEAR(magnitude.as<float>()[i], std::abs(expected), 120 * 10 * 6e-8);
                ASSERT_NEAR(real.as<float>()[i], expected.real(), 120 * 10 * 6e-8);
            }
        }
}

/// From k-space to a picture, through the spectrum of what lies between.
TEST(SpectrumFromKspace, LeadsToThePicturesOfTheVolume) {
    Acquired scan({20, 18, 16}, true);
    const Data values = blobs(scan.extent, 0, &scan.memory), volume = scan.volume("magnitude");
    const Path path(volume.what, scan.ask(), {6, 2, "volume"});
    ASSERT_EQ(path.made.refused, "");
    const Data got =
        path.picture(path.spectrum(volume, scan.ask(), &scan.memory), scan.ask(), 2, &scan.memory);
    const Data expected =
        path.picture(path.spectrum(values, scan.ask(), &scan.memory), scan.ask(), 2, &scan.memory);
    for (std::int64_t i = 0; i < got.what.extent.samples(); ++i)
        ASSERT_NEAR(got.as<float>()[i], expected.as<float>()[i], 2400 * 20 * 6e-8);
}

TEST(SpectrumFromKspace, RefusesWhatIsNoKspace) {
    Acquired scan({4, 3, 2}, false);
    const Transition edge = spectrum_from_kspace();
    const Parameters with{{"part", std::string("real")}};
    EXPECT_EQ(edge.offer(scan.data.what, scan.ask(), with).refused, "");
    EXPECT_EQ(edge.offer(scan.data.what, scan.ask(), with).to.kind(), "object/scalar");
    scan.scene.non_finite = 2;
    EXPECT_EQ(edge.offer(scan.data.what, scan.ask(), with).refused,
              "2 samples are not finite, a transform would spread them everywhere");
    scan.scene.non_finite = 0;
    scan.data.what.type = Type::f32;
    EXPECT_EQ(edge.offer(scan.data.what, scan.ask(), with).refused,
              "k-space is one channel of complex samples, whole in memory");
}

TEST(SpectrumFromKspace, BytesAreCountedAndDoNotDependOnThreads) {
    Acquired scan({17, 12, 9}, true);
    const Transition edge = spectrum_from_kspace();
    const Offer offer =
        edge.offer(scan.data.what, scan.ask(), {{"part", std::string("magnitude")}});
    std::vector<std::vector<float>> volumes;
    for (const std::size_t threads : {1, 3}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        Data out = Data::make(offer.to, &scan.memory);
        const Work work = edge.work(offer, scan.ask(), 0);
        const double most = static_cast<double>(scan.memory.now()) +
                            static_cast<double>(threads) * work.scratch + work.workspace;
        scan.memory.restart();
        Context context{.memory = &scan.memory};
        edge.run(offer, scan.ask(), scan.data, out, {}, context);
        EXPECT_LE(static_cast<double>(scan.memory.peak()), most);
        volumes.emplace_back(out.as<float>(), out.as<float>() + out.what.extent.samples());
    }
    EXPECT_EQ(volumes[0], volumes[1]);
    const std::atomic<bool> stop{true};
    Context context{.memory = &scan.memory, .stop = &stop};
    Data out = Data::make(offer.to, &scan.memory);
    EXPECT_THROW(edge.run(offer, scan.ask(), scan.data, out, {}, context), Cancelled);
}

}  // namespace
}  // namespace edgewise
