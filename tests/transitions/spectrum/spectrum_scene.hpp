#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <memory_resource>
#include <random>
#include <vector>

#include "graph/transition.hpp"
#include "transitions/spectrum/forward.hpp"
#include "transitions/spectrum/inverse.hpp"
#include "transitions/spectrum/slice.hpp"

namespace edgewise {

/// Counts what is allocated at once.
class Counting : public std::pmr::memory_resource {
 public:
    std::size_t peak() const noexcept { return peak_; }
    void restart() noexcept { peak_ = now_.load(); }
    std::size_t now() const noexcept { return now_; }

 private:
    void* do_allocate(std::size_t bytes, std::size_t alignment) override {
        const std::size_t held = now_ += bytes;
        for (std::size_t seen = peak_; seen < held && !peak_.compare_exchange_weak(seen, held);) {
        }
        return std::pmr::new_delete_resource()->allocate(bytes, alignment);
    }
    void do_deallocate(void* data, std::size_t bytes, std::size_t alignment) override {
        now_ -= bytes;
        std::pmr::new_delete_resource()->deallocate(data, bytes, alignment);
    }
    bool do_is_equal(const memory_resource& other) const noexcept override {
        return this == &other;
    }
    std::atomic<std::size_t> now_{0}, peak_{0};
};

/// Blobs and fine texture in the middle, a constant towards the faces.
inline Data blobs(const Extent& extent, double constant, std::pmr::memory_resource* memory) {
    Representation what;
    what.extent = extent;
    Data data = Data::make(what, memory);
    std::mt19937 random(7);
    for (std::int64_t z = 0; z < extent.z; ++z)
        for (std::int64_t y = 0; y < extent.y; ++y)
            for (std::int64_t x = 0; x < extent.x; ++x) {
                const double at[3] = {static_cast<double>(x), static_cast<double>(y),
                                      static_cast<double>(z)};
                double r = 0, s = 0;  // of two blobs, in units of the half extent
                for (int axis = 0; axis < 3; ++axis) {
                    const auto n = static_cast<double>(extent[axis]);
                    r += std::pow((at[axis] - 0.45 * n) / (0.5 * n), 2);
                    s += std::pow((at[axis] - 0.6 * n) / (0.5 * n), 2);
                }
                const double texture = static_cast<double>(random()) * 0x1p-32;
                const double value = (r < 0.4 ? 80 + 40 * texture : 0) + 100 * std::exp(-20 * s);
                data.as<float>()[(z * extent.y + y) * extent.x + x] =
                    static_cast<float>(value < 1 ? constant : value + constant);
            }
    return data;
}

inline Request request_of(const Extent& input, const Vec3& spacing, Mode mode, double pixel) {
    Request want;
    want.input = input;
    want.spacing = spacing;
    want.mode = mode;
    want.unit = spacing.minCoeff();
    Vec3 size;
    for (int axis = 0; axis < 3; ++axis)
        size[axis] = static_cast<double>(input[axis]) * spacing[axis];
    const auto side = static_cast<std::int64_t>(0.8 * size.norm() / pixel);
    want.screen = {side, side + 3, 1};
    std::vector<Mat4> maps;
    for (const Vec3& turn : {Vec3(0, 0, 0), Vec3(0, 0.5, 0), Vec3(0.4, -2.2, 0.3)}) {
        Eigen::Affine3d map = Eigen::Affine3d::Identity();
        map.translate(Vec3(static_cast<double>(want.screen.x - 1) / 2,
                           static_cast<double>(want.screen.y - 1) / 2, 0));
        map.scale(Vec3(1 / pixel, 1 / pixel, 1 / want.unit));
        for (int axis = 2; axis >= 0; --axis)
            map.rotate(Eigen::AngleAxisd(turn[axis], Vec3::Unit(axis)));
        map.scale(spacing);
        map.translate(-0.5 * Vec3(static_cast<double>(input.x - 1),
                                  static_cast<double>(input.y - 1),
                                  static_cast<double>(input.z - 1)));
        maps.push_back(map.matrix());
    }
    want.frames = static_cast<int>(maps.size());
    want.views = Placement::each(std::move(maps));
    return want;
}

inline Scene scene_of(const Data& data) {
    const float* values = data.as<float>();
    const Extent& n = data.what.extent;
    Scene scene;
    scene.low = *std::min_element(values, values + n.samples());
    scene.high = *std::max_element(values, values + n.samples());
    std::map<float, std::int64_t> counts;
    for (std::int64_t i = 0; i < n.samples(); ++i) ++counts[values[i]];
    const auto most = std::max_element(counts.begin(), counts.end(),
                                       [](auto& a, auto& b) { return a.second < b.second; });
    scene.commonest = most->first;
    scene.occupied = {{n.x, n.y, n.z}, {0, 0, 0}};
    for (std::int64_t i = 0; i < n.samples(); ++i) {
        if (values[i] == most->first) continue;
        const std::int64_t at[3] = {i % n.x, i / n.x % n.y, i / (n.x * n.y)};
        for (int axis = 0; axis < 3; ++axis) {
            scene.occupied.begin[axis] = std::min(scene.occupied.begin[axis], at[axis]);
            scene.occupied.end[axis] = std::max(scene.occupied.end[axis], at[axis] + 1);
        }
    }
    return scene;
}

struct Chosen {
    double width = 4, padding = 1.25;
    const char* band = "volume";
};

/// The three edges of a path through spectra.
struct SlicePath {
    Transition forward, slice, inverse;
    Offer made, cut, seen;

    void choose(const Representation& from, const Ask& ask, const Parameters& with,
                const char* band) {
        made = forward.offer(from, ask, with);
        if (!made.refused.empty()) return;
        cut = slice.offer(made.to, ask, {{"band", std::string(band)}});
        seen = inverse.offer(cut.to, ask, {});
    }
    Data spectrum(const Data& in, const Ask& ask, std::pmr::memory_resource* memory) const {
        Data out = Data::make(made.to, memory);
        Context context{.memory = memory};
        forward.run(made, ask, in, out, Region::all(made.to.extent), context);
        return out;
    }
    Data picture(const Data& spectrum, const Ask& ask, int view,
                 std::pmr::memory_resource* memory) const {
        Context context{.memory = memory, .view = view};
        Data plane = Data::make(cut.to, memory), out = Data::make(seen.to, memory);
        slice.run(cut, ask, spectrum, plane, Region::all(cut.to.extent), context);
        inverse.run(seen, ask, plane, out, Region::all(seen.to.extent), context);
        return out;
    }
};

struct Path : SlicePath {
    Path(const Representation& from, const Ask& ask, const Chosen& chosen)
        : SlicePath{spectrum_forward(), spectrum_slice(), spectrum_inverse(), {}, {}, {}} {
        choose(from, ask, {{"width", chosen.width}, {"padding", chosen.padding}}, chosen.band);
    }
    /// What is predicted, in values of the picture.
    double error(const Ask& ask) const {
        return forward.error(made, ask).bias + slice.error(cut, ask).bias;
    }
};

}  // namespace edgewise
