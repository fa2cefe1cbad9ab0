// Shear-warp with nearest samples is volume rendering as line drawing, and so a wavefront that goes
// from slice to slice: both in integers here, to the bit.
#include <algorithm>
#include <array>
#include <cstdint>
#include <gtest/gtest.h>
#include <limits>
#include <memory_resource>
#include <random>
#include <string>
#include <vector>

#include "tests/transitions/project/looking.hpp"
#include "transitions/project/shear_warp.hpp"

namespace edgewise {
namespace {

using namespace looking;

constexpr float kMiss = -7;

/// Parallel rays that go p / q of a voxel across for each slice, along x and y; pixels are voxels
/// of slice 0. Powers of two keep places exact.
struct Lines {
    Extent volume;
    std::array<int, 2> p;
    int q;
    Extent screen{70, 70, 1};

    int middle(int axis) const { return int(screen[axis] - volume[axis]) / 2; }
    Request request() const {
        Request want;
        want.job = Job::render;
        want.mode = Mode::mip;
        want.input = volume;
        want.screen = {screen.x, screen.y, volume.z};
        want.miss = kMiss;
        Mat4 map = Mat4::Identity();
        for (int axis = 0; axis < 2; ++axis) {
            map(axis, 2) = -double(p[std::size_t(axis)]) / q;
            map(axis, 3) = middle(axis);
        }
        want.views = Placement(map);
        return want;
    }
};

/// Where a line is, a slice at a time: its error is carried along, and it never multiplies
/// (Bresenham).
class Line {
 public:
    Line(int start, int p, int q) : voxel_(start), p_(p), q_(q) {}

    int voxel() const { return voxel_; }
    /// @return  whether the place itself, of which the voxel is the nearest, is over n voxels
    bool over(std::int64_t n) const {
        // In halves of 1 / q: a face belongs to the volume.
        const std::int64_t at = 2 * std::int64_t{voxel_} * q_ + 2 * error_;
        return at >= -q_ && at <= (2 * n - 1) * q_;
    }
    /// @return  the step to the next slice's voxel: -1, 0 or 1
    int advance() {
        error_ += p_;
        // Halves round up.
        const int step = 2 * error_ >= q_ ? 1 : 2 * error_ < -q_ ? -1 : 0;
        voxel_ += step;
        error_ -= step * q_;
        return step;
    }

 private:
    int voxel_, p_, q_, error_ = 0;
};

/// A pixel, and whether its line meets the volume where no voxel is the nearest: in the far face,
/// as halves round up, or between two slices only.
struct Drawn {
    float largest = kMiss;
    bool beside_voxels = false;
};

/// The voxel of a line that meets the volume between two slices only: that of the nearest one.
template <class T>
float between_slices(const Lines& of, const Data& data, const std::array<int, 2>& start) {
    const Extent& n = of.volume;
    double low = -0.5, high = double(n.z) - 0.5;
    std::array<double, 2> slope;
    for (std::size_t axis = 0; axis < 2; ++axis) {
        slope[axis] = double(of.p[axis]) / of.q;
        const double from = -0.5 - start[axis], to = double(n[int(axis)]) - 0.5 - start[axis];
        if (slope[axis] == 0) {
            if (from > 0 || to < 0) return kMiss;
            continue;
        }
        low = std::max(low, std::min(from / slope[axis], to / slope[axis]));
        high = std::min(high, std::max(from / slope[axis], to / slope[axis]));
    }
    if (!(low < high)) return kMiss;
    const double before = std::floor(low), after = before + 1;
    const bool takes = after > double(n.z - 1) || (before >= 0 && low - before <= after - high);
    const double slice = takes ? before : after;
    const auto voxel = [&](std::size_t axis) {
        const double at =
            std::clamp(start[axis] + slice * slope[axis], 0.0, double(n[int(axis)] - 1));
        return std::int64_t(std::floor(at + 0.5));
    };
    return static_cast<float>(*data.at<T>(voxel(0), voxel(1), std::int64_t(slice)));
}

/// One line a pixel: the largest of the voxels that it draws.
template <class T>
std::vector<Drawn> drawn(const Lines& of, const Data& data) {
    const Extent &n = of.volume, &screen = of.screen;
    std::vector<Drawn> picture;
    for (int y = 0; y < int(screen.y); ++y)
        for (int x = 0; x < int(screen.x); ++x) {
            const std::array<int, 2> start{x - of.middle(0), y - of.middle(1)};
            Line u(start[0], of.p[0], of.q), v(start[1], of.p[1], of.q);
            Drawn pixel;
            bool any = false;
            for (std::int64_t z = 0; z < n.z; ++z, u.advance(), v.advance()) {
                if (!u.over(n.x) || !v.over(n.y)) continue;
                pixel.beside_voxels =
                    pixel.beside_voxels || u.voxel() == int(n.x) || v.voxel() == int(n.y);
                const auto i = std::min<std::int64_t>(u.voxel(), n.x - 1);
                const auto j = std::min<std::int64_t>(v.voxel(), n.y - 1);
                const auto value = static_cast<float>(*data.at<T>(i, j, z));
                pixel.largest = any ? std::max(pixel.largest, value) : value;
                any = true;
            }
            if (!any) pixel.largest = between_slices<T>(of, data, start);
            pixel.beside_voxels = pixel.beside_voxels || (!any && pixel.largest != kMiss);
            picture.push_back(pixel);
        }
    return picture;
}

/// The same by planes of voxels of equal depth: one state for each voxel of a plane, which takes
/// the voxel that it stands over; then all states are shifted to the next plane, by one voxel at
/// most along either axis. What leaves the plane at one side is done, and new lines come in at the
/// other.
template <class T>
std::vector<float> as_wavefront(const Lines& of, const Data& data) {
    const Extent &n = of.volume, &screen = of.screen;
    std::vector<float> front(static_cast<std::size_t>(screen.x * screen.y), kMiss);
    // Where the state of voxel (0, 0) stands, in lines.
    std::array<int, 2> shift{of.middle(0), of.middle(1)};
    std::array<Line, 2> line{Line(0, of.p[0], of.q), Line(0, of.p[1], of.q)};
    for (std::int64_t z = 0; z < n.z; ++z) {
        for (int j = 0; j < int(n.y); ++j)
            for (int i = 0; i < int(n.x); ++i) {
                const std::int64_t x = i + shift[0], y = j + shift[1];
                if (x < 0 || y < 0 || x >= screen.x || y >= screen.y) continue;
                float& state = front[std::size_t(y * screen.x + x)];
                state = std::max(state, static_cast<float>(*data.at<T>(i, j, z)));
            }
        for (std::size_t axis = 0; axis < 2; ++axis) {
            const int step = line[axis].advance();
            EXPECT_LE(std::abs(step), 1);
            shift[axis] -= step;
        }
    }
    return front;
}

std::vector<Lines> lines() {
    const Extent n{23, 19, 31};
    return {{n, {0, 0}, 1},  {n, {3, -2}, 8},  {n, {-5, 7}, 16},        {n, {1, 1}, 1},
            {n, {-1, 1}, 2}, {n, {0, 13}, 64}, {{1, 1, 9}, {1, -3}, 4}, {{12, 9, 1}, {1, 1}, 4}};
}

template <class T>
void expect_lines(Type type) {
    std::mt19937 random(11);
    for (const Lines& of : lines()) {
        Representation what;
        what.extent = of.volume;
        what.type = type;
        Data data = Data::make(what, std::pmr::new_delete_resource());
        for (std::int64_t i = 0; i < what.samples(); ++i)
            data.as<T>()[i] = static_cast<T>(random() % 120);
        const Request want = of.request();
        const Scene scene;
        const Data got = made(shear_warp(), data, {want, scene}, {{"filter", "zoh"}});
        const std::vector<Drawn> line = drawn<T>(of, data);
        const std::vector<float> wave = as_wavefront<T>(of, data);
        std::int64_t inside = 0;
        for (std::int64_t i = 0; i < got.what.samples(); ++i) {
            const Drawn& pixel = line[static_cast<std::size_t>(i)];
            ASSERT_EQ(got.as<float>()[i], pixel.largest) << i << ' ' << of.p[0] << ' ' << of.p[1];
            if (pixel.beside_voxels) continue;
            ASSERT_EQ(got.as<float>()[i], wave[static_cast<std::size_t>(i)]) << i;
            inside += pixel.largest != kMiss;
        }
        EXPECT_GE(inside, of.volume.x * of.volume.y / 2);
    }
}

TEST(ShearWarpLines, NearestSamplesAreThoseOfDrawnLines) {
    expect_lines<float>(Type::f32);
    expect_lines<std::uint8_t>(Type::u8);
    expect_lines<std::int16_t>(Type::i16);
    expect_lines<std::uint32_t>(Type::u32);
}

}  // namespace
}  // namespace edgewise
