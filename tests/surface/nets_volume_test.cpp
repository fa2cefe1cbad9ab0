// Volume and thickness of smoothed labels, against the samples that they are of.
#include <array>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <map>
#include <set>

#include "surface/mesh_measures.hpp"
#include "surface/nets.hpp"
#include "tests/surface/mesh_checks.hpp"

namespace edgewise::surface {
namespace {

using Inside = std::function<int(std::array<double, 3>)>;

Data filled(const Extent& n, const Inside& label) {
    return volume_of<std::uint16_t>(n, Type::u16, [&](auto x, auto y, auto z) {
        return label({double(x), double(y), double(z)});
    });
}

Mesh smoothed(const Data& data, double smooth = 1) {
    return surface_nets(data, 0, smooth, Mat4::Identity(), std::pmr::get_default_resource());
}

Measures measured(const Mesh& mesh) { return measures_of(mesh, std::pmr::get_default_resource()); }

/// Volumes that the triangles of each label enclose.
std::map<double, double> volumes_of(const Mesh& mesh) {
    std::map<double, double> volumes;
    const auto at = [&](std::uint32_t v) {
        const Float3& p = mesh.positions()[v];
        return Vec3(p[0], p[1], p[2]);
    };
    for (std::size_t t = 0; t < mesh.triangles().size(); ++t) {
        const Triangle& of = mesh.triangles()[t];
        volumes[mesh.labels[mesh.groups()[t]]] += at(of[0]).dot(at(of[1]).cross(at(of[2]))) / 6;
    }
    return volumes;
}

std::map<double, double> samples_of(const Data& data) {
    std::map<double, double> samples;
    for (std::int64_t i = 0; i < data.what.samples(); ++i)
        if (const auto label = data.as<std::uint16_t>()[i]; label != 0) samples[label] += 1;
    return samples;
}

/// Where a line along an axis enters and leaves a mesh, ascending. It runs beside the grid's lines.
std::vector<double> passed(const Mesh& mesh, int axis, double u, double v) {
    std::vector<double> places;
    const auto a = static_cast<std::size_t>((axis + 1) % 3),
               b = static_cast<std::size_t>((axis + 2) % 3), c = static_cast<std::size_t>(axis);
    for (const Triangle& t : mesh.triangles()) {
        const Float3 &p = mesh.positions()[t[0]], &q = mesh.positions()[t[1]],
                     &r = mesh.positions()[t[2]];
        const auto twice = [&](double x0, double y0, double x1, double y1) {
            return (x0 - u) * (y1 - v) - (x1 - u) * (y0 - v);
        };
        const double wr = twice(p[a], p[b], q[a], q[b]), wp = twice(q[a], q[b], r[a], r[b]),
                     wq = twice(r[a], r[b], p[a], p[b]);
        if (!((wp > 0 && wq > 0 && wr > 0) || (wp < 0 && wq < 0 && wr < 0))) continue;
        places.push_back((wp * double(p[c]) + wq * double(q[c]) + wr * double(r[c])) /
                         (wp + wq + wr));
    }
    std::sort(places.begin(), places.end());
    return places;
}

struct Shape {
    const char* name;
    Extent n;
    Inside label;
};

/// About a line through the middle of 32^3.
Inside tube(double radius, std::array<double, 3> along) {
    return [=](std::array<double, 3> p) {
        double length = 0, t = 0, square = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            p[k] -= 15;
            length += along[k] * along[k];
            t += along[k] * p[k];
            square += p[k] * p[k];
        }
        t /= std::sqrt(length);
        return std::abs(t) < 12 && std::sqrt(std::max(0.0, square - t * t)) <= radius ? 1 : 0;
    };
}

Inside box(std::array<int, 3> size) {
    return [=](const std::array<double, 3>& p) {
        for (std::size_t k = 0; k < 3; ++k)
            if (p[k] < 4 || p[k] >= 4 + size[k]) return 0;
        return 1;
    };
}

Inside ball(double radius) {
    return [=](const std::array<double, 3>& p) {
        return std::hypot(p[0] - 15, p[1] - 15, p[2] - 15) <= radius ? 1 : 0;
    };
}

std::vector<Shape> shapes() {
    const Extent cube{31, 31, 31};
    std::vector<Shape> all{{"ball 1.5", cube, ball(1.5)},
                           {"ball 3", cube, ball(3)},
                           {"ball 6", cube, ball(6)},
                           {"ball 10", cube, ball(10)},
                           {"voxel", cube, box({1, 1, 1})}};
    for (const int thick : {1, 2, 3})
        for (std::size_t axis = 0; axis < 3; ++axis) {
            std::array<int, 3> plate{20, 20, 20}, line{thick, thick, thick};
            plate[axis] = thick;
            line[axis] = 20;
            all.push_back({"plate", cube, box(plate)});
            all.push_back({"line", cube, box(line)});
        }
    for (const double radius : {0.75, 1.0, 1.5, 2.5, 4.0})
        for (const std::array<double, 3> along : {std::array<double, 3>{1, 0, 0},
                                                  {0, 1, 0},
                                                  {0, 0, 1},
                                                  {1, 1, 0},
                                                  {1, 1, 1},
                                                  {1, 2, 3}})
            all.push_back({"tube", cube, tube(radius, along)});
    all.push_back({"through all slices", {12, 12, 7}, [](const std::array<double, 3>& p) {
                       return p[0] >= 4 && p[0] < 8 && p[1] >= 3 && p[1] < 7 ? 1 : 0;
                   }});
    all.push_back({"one slice", {40, 40, 1}, [](const std::array<double, 3>& p) {
                       return std::hypot(p[0] - 20, p[1] - 20) < 9 ? 1 : 0;
                   }});
    all.push_back({"one slice, one wide", {1, 40, 40}, [](const std::array<double, 3>& p) {
                       return p[1] == 7 && p[2] > 3 && p[2] < 30 ? 1 : 0;
                   }});
    all.push_back({"a sheet that leans", cube, [](const std::array<double, 3>& p) {
                       return std::floor(0.3 * p[0] + 0.17 * p[1] + 6) == p[2] ? 1 : 0;
                   }});
    all.push_back({"a sheet of corners", cube, [](const std::array<double, 3>& p) {
                       const double sum = p[0] + p[1] + p[2];
                       return sum == 40 || sum == 41 ? 1 : 0;
                   }});
    all.push_back({"everything", {5, 6, 7}, [](const std::array<double, 3>&) { return 1; }});
    return all;
}

TEST(NetVolumes, AreThoseOfTheSamplesWithinFivePercent) {
    for (const Shape& shape : shapes()) {
        const Data data = filled(shape.n, shape.label);
        const double samples = samples_of(data).at(1);
        for (const double smooth : {0.0, 0.3, 1.0}) {
            const Mesh mesh = smoothed(data, smooth);
            ASSERT_EQ(no_manifold(mesh), "") << shape.name;
            const double volume = measured(mesh).volume.value();
            EXPECT_NEAR(volume, samples, smooth > 0 ? 0.05 * samples : 1e-6 * samples)
                << shape.name << ' ' << smooth;
        }
        // What cannot be smoother grows by the rounding of its steps alone.
        EXPECT_LE(measured(smoothed(data)).area, 1.001 * measured(smoothed(data, 0)).area)
            << shape.name;
    }
}

TEST(NetVolumes, HaveTheThicknessOfTheirSamplesWithinFivePercent) {
    for (const int thick : {1, 2, 3, 5, 8})
        for (int axis = 0; axis < 3; ++axis)
            for (const bool is_line : {false, true}) {
                std::array<int, 3> size{20, 20, 20};
                size[static_cast<std::size_t>(axis)] = thick;
                if (is_line) size[static_cast<std::size_t>((axis + 1) % 3)] = thick;
                const Mesh mesh = smoothed(filled({31, 31, 31}, box(size)));
                // Three samples from the ends of what is long, and in the middle.
                for (const double u : {7.03, 9.51, 14.02})
                    for (const double v : {7.04, 11.52, 20.03}) {
                        const double across = is_line ? 4 + (thick - 1) / 2.0 + 0.01 : u;
                        const std::vector<double> places = passed(mesh, axis, across, v);
                        ASSERT_EQ(places.size(), 2u) << thick << ' ' << axis << ' ' << is_line;
                        EXPECT_NEAR(places[1] - places[0], thick, 0.05 * thick);
                        EXPECT_NEAR((places[0] + places[1]) / 2, 4 + (thick - 1) / 2.0, 0.05);
                    }
            }
}

TEST(NetVolumes, StayInTheirCells) {
    const Data data = filled({31, 31, 31}, tube(2.5, {1, 2, 3}));
    const Mesh rough = smoothed(data, 0);
    for (const double smooth : {0.1, 0.5, 1.0}) {
        const Mesh mesh = smoothed(data, smooth);
        ASSERT_EQ(mesh.positions().size(), rough.positions().size());
        double most = 0;
        for (std::size_t v = 0; v < mesh.positions().size(); ++v)
            for (std::size_t axis = 0; axis < 3; ++axis)
                most = std::max(most, std::abs(double(mesh.positions()[v][axis]) -
                                               double(rough.positions()[v][axis])));
        EXPECT_LE(most, smooth / 2 + 1e-5);
        EXPECT_GT(most, smooth / 4);
    }
}

TEST(NetVolumes, LeaveNeitherGapNorOverlapBetweenLabels) {
    // Three labels that meet along lines, one of them as thin as a sample, within background.
    const Data data = filled({31, 31, 31}, [](const std::array<double, 3>& p) {
        if (std::hypot(p[0] - 15, p[1] - 15, p[2] - 15) > 11) return 0;
        const double side = p[0] + 0.4 * p[1] - 0.3 * p[2];
        return side < 15 ? 7 : side < 16.2 ? 600 : 9;
    });
    const Mesh mesh = smoothed(data);
    EXPECT_EQ(no_manifold(mesh), "");
    double sum = 0, all = 0;
    const auto volumes = volumes_of(mesh), samples = samples_of(data);
    for (const auto& [label, volume] : volumes) {
        EXPECT_NEAR(volume, samples.at(label), 0.05 * samples.at(label)) << label;
        sum += volume;
        all += samples.at(label);
    }
    EXPECT_NEAR(sum, all, 0.01 * all);
    // A wall between two labels is there once for each, in the same triangles: every line leaves
    // one label where it enters the next.
    using Corners = std::set<Float3>;
    std::map<Corners, int> times;
    for (const Triangle& t : mesh.triangles())
        ++times[{mesh.positions()[t[0]], mesh.positions()[t[1]], mesh.positions()[t[2]]}];
    std::size_t shared = 0;
    for (const auto& [corners, count] : times) {
        EXPECT_LE(count, 2);
        shared += count == 2;
    }
    EXPECT_GT(shared, 900u);  // two walls of about 22 x 22 x 0.8 samples, of two triangles and more
    for (const double u : {10.03, 14.02, 17.04})
        for (const double v : {11.03, 15.02, 19.01}) {
            const std::vector<double> places = passed(mesh, 0, u, v);
            ASSERT_EQ(places.size() % 2, 0u);
            for (std::size_t i = 1; i + 1 < places.size(); i += 2)
                EXPECT_NEAR(places[i], places[i + 1], 1e-5);
        }
}

TEST(NetVolumes, OfManyCellsAreClosedAndEachOfItsOwn) {
    // 5832 blocks of 3^3 samples, 60 of which are left out.
    const Data data = filled({54, 54, 54}, [](const std::array<double, 3>& p) {
        const int block = static_cast<int>(p[0]) / 3 + 18 * (static_cast<int>(p[1]) / 3) +
                          324 * (static_cast<int>(p[2]) / 3);
        return block % 97 == 5 ? 0 : block + 1;
    });
    const Mesh mesh = smoothed(data);
    const auto samples = samples_of(data), volumes = volumes_of(mesh);
    ASSERT_EQ(mesh.labels.size(), samples.size());
    ASSERT_GT(samples.size(), 5000u);
    EXPECT_TRUE(measured(mesh).closed);
    for (const auto& [label, volume] : volumes) EXPECT_NEAR(volume, 27, 0.05 * 27) << label;
}

TEST(NetVolumes, OfWideTypesAreTakenByValue) {
    const Extent n{9, 5, 5};
    const auto label = [](auto x, auto y, auto z) {
        return y == 0 || z == 0 || x == 0 ? 0.0 : x < 4 ? 4294967294.0 : x < 7 ? 4294967295.0 : 3.0;
    };
    const std::vector<double> expected{3, 4294967294.0, 4294967295.0};
    EXPECT_EQ(smoothed(volume_of<std::uint32_t>(n, Type::u32, label)).labels, expected);
    EXPECT_EQ(smoothed(volume_of<double>(n, Type::f64, label)).labels, expected);
    const Mesh halves = smoothed(volume_of<float>(n, Type::f32, [](auto x, auto, auto) {
        return x < 3 ? -0.0F : x < 6 ? 0.5F : -1.25F;
    }));
    EXPECT_EQ(halves.labels, (std::vector<double>{-1.25, 0.5}));
    const Mesh negative = smoothed(volume_of<std::int32_t>(n, Type::i32, [](auto x, auto, auto) {
        return x < 3 ? 0 : x < 6 ? -2147483647 : 5;
    }));
    EXPECT_EQ(negative.labels, (std::vector<double>{-2147483647, 5}));
}

}  // namespace
}  // namespace edgewise::surface
