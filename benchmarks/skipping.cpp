// What rays look at and what they sample, counted, by three ways to pass over what does not
// matter: bricks one by one, leaps over several, and octrees.
//   skipping_benchmark FILE... prints, a pixel of 256 x 256: looks at the map, of these at what is
//   passed by or crossed, samples taken, and cells that were left out. No time is taken.
#include <Eigen/Geometry>
#include <fmt/format.h>
#include <memory_resource>
#include <string>
#include <vector>

#include "request/input.hpp"
#include "scene/scene.hpp"
#include "scene/statistics.hpp"
#include "transitions/kernels/brick_distances.hpp"
#include "transitions/project/bricks_of.hpp"
#include "transitions/project/octree_cast.hpp"
#include "transitions/project/stretches.hpp"
#include "transitions/store/octree.hpp"

namespace {

using namespace edgewise;

constexpr int kSide = 256;  // pixels

/// Turned about its middle, as large as the screen.
Request looking_at(const Input& input, const Data& data, Mode mode, const Statistics& statistics) {
    Request want;
    want.job = Job::render;
    want.mode = mode;
    want.input = data.what.extent;
    const auto& apart = input.header.spacing;
    want.spacing = Vec3(apart[0], apart[1], apart[2]);
    want.unit = want.spacing.minCoeff();
    const Vec3 size(double(want.input.x), double(want.input.y), double(want.input.z));
    const double depth = size.cwiseProduct(want.spacing).norm() / want.unit;
    want.screen = {kSide, kSide, static_cast<std::int64_t>(depth) + 1};
    const Eigen::Matrix3d turn =
        (Eigen::AngleAxisd(0.5, Vec3::UnitX()) * Eigen::AngleAxisd(0.35, Vec3::UnitY()))
            .toRotationMatrix();
    Mat4 map = Mat4::Identity();
    map.topLeftCorner<3, 3>() = Vec3(kSide / depth, kSide / depth, 1).asDiagonal() * turn *
                                Eigen::Matrix3d((want.spacing / want.unit).asDiagonal());
    const Vec3 middle = Vec3(kSide - 1, kSide - 1, depth) / 2;
    map.topRightCorner<3, 1>() = middle - map.topLeftCorner<3, 3>() * (size - Vec3::Ones()) / 2;
    want.views = Placement(map);
    const double low = statistics.low, high = statistics.high, range = high - low;
    want.transfer.points = {{low + 0.3 * range, 0, {1, 1, 1}}, {high, 0.3, {1, 1, 1}}};
    return want;
}

void print(const std::string& what, const kernels::StretchesTaken& taken) {
    const auto a_pixel = [](std::int64_t count) { return double(count) / (kSide * kSide); };
    fmt::print("    {:24} {:8.2f} {:8.2f} {:8.2f} {:8.2f}\n", what, a_pixel(taken.looks),
               a_pixel(taken.passed + taken.crossed), a_pixel(taken.samples),
               a_pixel(taken.unsampled));
}

class Counter {
 public:
    Counter(const Request& want, const Data& data, const Scene& scene)
        : ask_{want, scene},
          data_(data),
          offer_(octree_cast().offer(data.what, ask_, {{"step", 1.0}})),
          rays_(offer_, ask_, data, 0),
          out_(kSide * kSide * 4) {}

    void count_bricks() {
        const auto bricks = bricks_of(rays_.cast().volume, {.optics = rays_.optics()}, memory_, {});
        const ValueMap& values = rays_.cast().volume.values;
        const double least = (ask_.scene.low - values.offset) / values.slope;
        for (const int leap : {1, kernels::BrickDistances::kMost}) {
            const kernels::BrickDistances to(
                *bricks, rays_.optics() ? 0 : static_cast<float>(least), leap, memory_);
            print(leap == 1 ? "bricks" : "leaps over bricks",
                  taken_by({.cast = rays_.cast(), .bricks = &to}));
        }
    }
    void count_octree(double tolerance) {
        const Transition edge = octree();
        const Offer offer = edge.offer(data_.what, ask_, {{"tolerance", tolerance}});
        Data beside = Data::sharing(data_, offer.to);
        Context context{.memory = memory_};
        edge.run(offer, ask_, data_, beside, Region::all(data_.what.extent), context);
        const auto made = octree_of(beside);
        const auto nodes = static_cast<std::int64_t>(made->tree.nodes.size());
        kernels::OctreeStops stops{.tree = &made->tree, .stops = {}};
        stops.stops.resize(made->tree.nodes.size());
        see_nodes(rays_.cast().rule, rays_.cast().volume.values.slope < 0, rays_.optics(), 0, nodes,
                  stops);
        join_sampled(rays_.cast().rule, stops);
        print(fmt::format("octree/tolerance={}", tolerance),
              taken_by({.cast = rays_.cast(), .octree = &stops}));
        fmt::print("      {} nodes, {:.1f} % of the places in leaves\n", nodes,
                   100 * made->tree.leaves);
    }

 private:
    kernels::StretchesTaken taken_by(kernels::StretchCast by) {
        kernels::StretchesTaken taken;
        by.taken = &taken;
        kernels::stretch_cast(by, 0, 0, kSide, kSide, out_.data(), kSide * 4);
        return taken;
    }

    std::pmr::memory_resource* memory_ = std::pmr::new_delete_resource();
    Ask ask_;
    const Data& data_;
    Offer offer_;
    StretchRays rays_;
    std::vector<float> out_;
};

void count(const std::string& file) {
    auto* memory = std::pmr::new_delete_resource();
    Input input = inspected(file, {});
    read_data(input, memory);
    const Data& data = *input.data;
    const Statistics statistics = statistics_of(data, memory);
    const Scene scene = unseen_scene(statistics);
    fmt::print("{}\n    {:24} {:>8} {:>8} {:>8} {:>8}\n", file, "a pixel", "looks", "passed",
               "samples", "left out");
    for (const char* name : {"mip", "composite", "xray"}) {
        const Request want = looking_at(input, data, mode_named(name), statistics);
        fmt::print("  {}\n", name);
        Counter counter(want, data, scene);
        if (want.mode->skips != ModeTraits::Levels::none) counter.count_bricks();
        for (const double tolerance : {0.0, 0.003, 0.01, 0.03}) counter.count_octree(tolerance);
    }
}

}  // namespace

int main(int argc, char** argv) {
    for (int i = 1; i < argc; ++i) count(argv[i]);
    return 0;
}
