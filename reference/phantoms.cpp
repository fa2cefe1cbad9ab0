#include "reference/phantoms.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <numbers>
#include <random>
#include <tbb/parallel_for.h>

#include "graph/errors.hpp"
#include "graph/words.hpp"

namespace edgewise {
namespace {

using std::numbers::pi;

/// Numbers in [0, 1), the same in every standard library (distributions are not).
class Uniform {
 public:
    explicit Uniform(std::uint64_t seed) : bits_(seed) {}
    double operator()() { return static_cast<double>(bits_() >> 11) * 0x1p-53; }
    double operator()(double low, double high) { return low + (high - low) * (*this)(); }

 private:
    std::mt19937_64 bits_;
};

/// Position about the centre, in half sides: the faces of the volume are at -1 and 1.
Vec3 relative(const Vec3& index, double side) {
    return (index.array() - 0.5 * (side - 1)).matrix() * (2 / side);
}

double sphere(const Vec3& index, double side) {
    return std::max(0.0, 1 - 2 * relative(index, side).norm());  // radius side / 4
}

double cube(const Vec3& index, double side) {
    // Not through relative(): faces lie at whole indices for a side of 128, and belong to the cube.
    const double half = 31.5 / 128 * side;
    return (index.array() - 0.5 * (side - 1)).abs().maxCoeff() <= half ? 1 : 0;
}

double marschner_lobb(const Vec3& index, double side) {
    constexpr double alpha = 0.25, frequency = 6;
    const Vec3 p = relative(index, side);
    const double ring = std::cos(2 * pi * frequency * std::cos(pi * std::hypot(p.x(), p.y()) / 2));
    return (1 - std::sin(pi * p.z() / 2) + alpha * (1 + ring)) / (2 * (1 + alpha));
}

struct Ellipsoid {
    double value;
    std::array<double, 3> half, centre;
    double turn;  // about z [degree]
};

constexpr std::array<Ellipsoid, 10> kHead = {{
    {1, {.69, .92, .81}, {0, 0, 0}, 0},
    {-.8, {.6624, .874, .78}, {0, -.0184, 0}, 0},
    {-.2, {.11, .31, .22}, {.22, 0, 0}, -18},
    {-.2, {.16, .41, .28}, {-.22, 0, 0}, 18},
    {.1, {.21, .25, .41}, {0, .35, -.15}, 0},
    {.1, {.046, .046, .05}, {0, .1, .25}, 0},
    {.1, {.046, .046, .05}, {0, -.1, .25}, 0},
    {.1, {.046, .023, .05}, {-.08, -.605, 0}, 0},
    {.1, {.023, .023, .02}, {0, -.606, 0}, 0},
    {.1, {.023, .046, .05}, {.06, -.605, 0}, 0},
}};

double shepp_logan(const Vec3& index, double side) {
    const Vec3 p = relative(index, side);
    double sum = 0;
    for (const Ellipsoid& e : kHead) {
        const double angle = e.turn * pi / 180, c = std::cos(angle), s = std::sin(angle);
        const double x = p.x() - e.centre[0], y = p.y() - e.centre[1], z = p.z() - e.centre[2];
        const double u = (c * x + s * y) / e.half[0], v = (c * y - s * x) / e.half[1];
        const double w = z / e.half[2];
        if (u * u + v * v + w * w <= 1) sum += e.value;
    }
    return std::clamp(sum, 0.0, 1.0);  // rounding of 1 - 0.8 - 0.2
}

struct Blob {
    Vec3 centre;
    double width, height;
};

std::vector<Blob> make_blobs() {
    Uniform uniform(20);
    std::vector<Blob> blobs(14);
    for (Blob& blob : blobs) {
        for (double& c : blob.centre) c = uniform(-0.6, 0.6);
        blob.width = uniform(0.06, 0.25);
        blob.height = uniform(0.3, 0.9);
    }
    return blobs;
}

double gaussians(const Vec3& index, double side) {
    static const std::vector<Blob> blobs = make_blobs();
    const Vec3 p = relative(index, side);
    double left = 1;  // joined like opacities, so that the sum stays within 1
    for (const Blob& blob : blobs)
        left *= 1 - blob.height *
                        std::exp(-(p - blob.centre).squaredNorm() / (2 * blob.width * blob.width));
    return 1 - left;
}

struct Wave {
    Vec3 frequency;  // radians a sample
    double phase;
};

std::vector<Wave> make_waves() {
    Uniform uniform(93);
    std::vector<Wave> waves(24);
    for (Wave& wave : waves) {
        do {
            for (double& f : wave.frequency) f = uniform(-1, 1);
        } while (wave.frequency.squaredNorm() > 1);
        wave.frequency *= 2 * pi * 0.2;
        wave.phase = uniform(0, 2 * pi);
    }
    return waves;
}

double noise(const Vec3& index, double) {
    static const std::vector<Wave> waves = make_waves();
    double sum = 0;
    for (const Wave& wave : waves) sum += std::cos(wave.frequency.dot(index) + wave.phase);
    return 0.5 + 0.5 * sum / static_cast<double>(waves.size());
}

double zone_plate(const Vec3& index, double side) {
    const double x = index.x() - 0.5 * (side - 1), y = index.y() - 0.5 * (side - 1);
    return 0.5 + 0.5 * std::cos(pi * 0.8 * (x * x + y * y) / side);
}

double checker(const Vec3& index, double side) {
    const auto field = [&](double at) { return std::floor((at + 0.5) * 8 / side); };
    return std::fmod(std::abs(field(index.x()) + field(index.y())), 2);
}

struct Named {
    const char* name;
    int axes;
    double (*at)(const Vec3&, double);
};

constexpr std::array<Named, 8> kPhantoms = {{{"sphere", 3, sphere},
                                             {"cube", 3, cube},
                                             {"marschner-lobb", 3, marschner_lobb},
                                             {"shepp-logan", 3, shepp_logan},
                                             {"gaussians", 3, gaussians},
                                             {"noise", 3, noise},
                                             {"zone-plate", 2, zone_plate},
                                             {"checker", 2, checker}}};

const Named& named(const std::string& name) {
    const auto found = std::find_if(kPhantoms.begin(), kPhantoms.end(), [&](const Named& phantom) {
        return same_word(name, phantom.name);
    });
    if (found == kPhantoms.end())
        throw RequestError(
            fmt::format("no phantom is called '{}'; {}", name, instead_of(name, phantom_names())));
    return *found;
}

}  // namespace

std::vector<std::string> phantom_names() {
    std::vector<std::string> names;
    for (const Named& phantom : kPhantoms) names.emplace_back(phantom.name);
    return names;
}

Phantom phantom_named(const std::string& name, std::int64_t side) {
    const Named& found = named(name);
    if (side < 1)
        throw RequestError(fmt::format("a phantom of side {}: expected at least 1", side));
    return {name, side, found.axes, found.at};
}

Data make_phantom(const std::string& name, std::int64_t side, std::pmr::memory_resource* memory) {
    const Phantom phantom = phantom_named(name, side);
    Representation what;
    what.axes = phantom.axes;
    what.extent = {side, side, phantom.axes == 3 ? side : 1};
    Data data = Data::make(what, memory);
    float* samples = data.as<float>();
    tbb::parallel_for(std::int64_t{0}, what.extent.y * what.extent.z, [&](std::int64_t row) {
        Vec3 p(0, static_cast<double>(row % side), static_cast<double>(row / side));
        for (std::int64_t x = 0; x < side; ++x) {
            p.x() = static_cast<double>(x);
            samples[row * side + x] = static_cast<float>(phantom.at(p));
        }
    });
    return data;
}

}  // namespace edgewise
