#include "reference/preview_block.hpp"

#include <gtest/gtest.h>
#include <random>

namespace edgewise {
namespace {

std::pmr::memory_resource* heap() { return std::pmr::get_default_resource(); }

Data random_volume(const Extent& n) {
    Representation what;
    what.extent = n;
    what.type = Type::u16;
    what.values = {0.5, -100};
    Data data = Data::make(what, heap());
    std::mt19937 bits(11);
    for (std::int64_t i = 0; i < n.samples(); ++i)
        data.as<std::uint16_t>()[i] = static_cast<std::uint16_t>(bits() % 1000);
    return data;
}

/// Whole ones, some of them in the outermost layers, and others beyond the input.
Places random_places(const Region& cells, std::size_t count) {
    std::mt19937 bits(12);
    std::uniform_real_distribution<double> uniform(0, 1);
    Places places;
    for (std::size_t i = 0; i < count; ++i) {
        Vec3 p;
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = static_cast<double>(cells.begin[axis]) - 0.4 +
                      uniform(bits) * static_cast<double>(cells.end[axis] - cells.begin[axis] - 1);
        places.add(i % 5 == 0 ? Vec3(p.array().round()) : p);
    }
    return places;
}

/// Vectors of places, from one to as many as there can be, and blocks at faces and cut off.
TEST(PreviewBlock, ManyPlacesAreWhatEachIsByItself) {
    for (const Extent& n : {Extent{61, 47, 39}, Extent{5, 17, 3}, Extent{33, 29, 1}}) {
        const Data data = random_volume(n);
        const ReferenceField nearest(data, Field::nearest), linear(data, Field::linear);
        const Region all = Region::all(n);
        Region inner = all;
        for (int axis = 0; axis < 3; ++axis)
            if (n[axis] > 30) inner.begin[axis] = 11, inner.end[axis] = 19;
        for (const Region& cells : {all, inner}) {
            const PreviewBlock block(nearest, cells, heap());
            const SplineBlock<float> spline(data, cells, 6, heap());
            for (const std::size_t count : {std::size_t{1}, std::size_t{19}, Places::kMost}) {
                const Places places = random_places(cells, count);
                std::array<std::array<double, Places::kMost>, 3> held;
                for (PreviewHold hold : {kZoh, kFoh, kSpline})
                    block.hold(hold, places, held[hold].data());
                for (std::size_t i = 0; i < count; ++i) {
                    double expected = 0;
                    ASSERT_TRUE(nearest.at(places[i], {&expected, 1}));
                    EXPECT_EQ(held[kZoh][i], expected);
                    ASSERT_TRUE(linear.at(places[i], {&expected, 1}));
                    EXPECT_NEAR(held[kFoh][i], expected, 1e-3);  // values to 400 in f32
                    spline.at(linear.clamped(places[i]), &expected);
                    EXPECT_EQ(held[kSpline][i], expected);
                }
            }
        }
    }
}

}  // namespace
}  // namespace edgewise
