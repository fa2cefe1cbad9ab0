#include "graph/representation.hpp"

#include <functional>
#include <gtest/gtest.h>
#include <set>

#include "graph/errors.hpp"

namespace edgewise {
namespace {

Mat4 shifted(double by) {
    Mat4 map = Mat4::Identity();
    map(0, 3) = by;
    return map;
}

TEST(Representation, EqualOnesHaveOneKeyAndEveryFieldTellsApart) {
    const Representation plain;
    EXPECT_EQ(plain.key(), Representation().key());
    const std::function<void(Representation&)> changes[] = {
        [](auto& r) { r.space = "screen"; },
        [](auto& r) { r.content = "spectrum"; },
        [](auto& r) { r.facets = {"minmax"}; },
        [](auto& r) {
            r.facets = {"minmax", "gradient"};
        },
        [](auto& r) { r.axes = 2; },
        [](auto& r) { r.extent.x = 2; },
        [](auto& r) { r.extent.y = 2; },
        [](auto& r) { r.extent.z = 2; },
        [](auto& r) { r.channels = 4; },
        [](auto& r) { r.type = Type::u8; },
        [](auto& r) { r.values.slope = 2; },
        [](auto& r) { r.values.offset = 2; },
        [](auto& r) { r.layout = Layout::bricked; },
        [](auto& r) { r.place = Place::disk; },
        [](auto& r) { r.placed = shifted(2); },
        // Boundaries between names must not run together.
        [](auto& r) { r.space = "objects", r.content = "calar"; },
    };
    std::set<std::string> keys{plain.key()};
    for (const auto& change : changes) {
        Representation other;
        change(other);
        EXPECT_TRUE(keys.insert(other.key()).second) << other.text();
        Representation again;
        change(again);
        EXPECT_EQ(other.key(), again.key());
    }
}

TEST(Representation, KeyForgivesRoundingOfOneMap) {
    Representation a, b;
    a.placed = shifted(1);
    b.placed = shifted(1 + 1e-8);
    EXPECT_EQ(a.key(), b.key());
    b.placed = shifted(1 + 1e-5);
    EXPECT_NE(a.key(), b.key());
    b.placed = shifted(-0.0);
    a.placed = shifted(0.0);
    EXPECT_EQ(a.key(), b.key());
}

TEST(Representation, KeyTellsOneMapAViewByTheSpaceAlone) {
    Representation a, b;
    a.placed = Placement::each({shifted(1), shifted(2)});
    b.placed = Placement::each({shifted(3), shifted(4)});
    EXPECT_EQ(a.key(), b.key());
    b.placed = {};
    EXPECT_NE(a.key(), b.key());
}

TEST(Representation, TextKindAndBytes) {
    Representation what;
    what.type = Type::u8;
    what.extent = {256, 256, 109};
    EXPECT_EQ(what.text(), "object/scalar/u8/linear/256x256x109");
    what.facets = {"minmax", "gradient"};
    EXPECT_EQ(what.kind(), "object/scalar+gradient+minmax");
    EXPECT_EQ(what.bytes(), 256.0 * 256 * 109);
    what = {};
    what.axes = 2;
    what.extent = {3, 5, 1};
    what.channels = 4;
    what.layout = Layout::bricked;
    EXPECT_EQ(what.text(), "object/scalar/f32/bricked/3x5x4ch");
    EXPECT_EQ(what.bytes(), 3.0 * 5 * 4 * 4);
    what.type = Type::c64;
    EXPECT_EQ(what.bytes(), 3.0 * 5 * 4 * 8);
    what.channels = 1;
    what.extent = {1 << 20, 1 << 20, 1 << 10};  // beyond 32 bits
    EXPECT_EQ(what.bytes(), 0x1p53);
}

TEST(Placement, OneMapServesAllViews) {
    const Placement placed(shifted(3));
    EXPECT_FALSE(placed.one_a_view());
    EXPECT_EQ(placed.different(), 1);
    for (const int view : {0, 1, 359}) {
        EXPECT_EQ(placed.at(view).matrix(), shifted(3));
        EXPECT_EQ(placed.variant(view), 0);
    }
    EXPECT_EQ(placed.first_view(0), 0);
}

TEST(Placement, EqualMapsShareAVariant) {
    std::vector<Mat4> maps;
    for (int view = 0; view < 12; ++view) maps.push_back(shifted(view % 4 + 1e-13 * view));
    const Placement placed = Placement::each(maps);
    EXPECT_TRUE(placed.one_a_view());
    EXPECT_EQ(placed.different(), 4);
    for (int view = 0; view < 12; ++view) {
        EXPECT_EQ(placed.variant(view), view % 4);
        EXPECT_EQ(placed.at(view).matrix(), maps[view]);  // each view keeps its own map
        EXPECT_EQ(placed.first_view(placed.variant(view)), view % 4);
    }
    EXPECT_EQ(Placement::each({shifted(1), shifted(1 + 1e-6)}).different(), 2);
    EXPECT_EQ(Placement::each({shifted(1)}).different(), 1);
}

TEST(Types, NamesGoThereAndBack) {
    const std::pair<const char*, std::size_t> all[] = {
        {"u8", 1},  {"i8", 1},  {"u16", 2}, {"i16", 2}, {"u32", 4},
        {"i32", 4}, {"f16", 2}, {"f32", 4}, {"f64", 8}, {"c64", 8}};
    for (const auto& [name, bytes] : all) {
        EXPECT_EQ(name_of(type_named(name)), name);
        EXPECT_EQ(bytes_of(type_named(name)), bytes) << name;
        EXPECT_EQ(is_integer(type_named(name)), name[0] == 'u' || name[0] == 'i');
    }
    EXPECT_EQ(limits_of(Type::i16), (std::array<double, 2>{-32768, 32767}));
    EXPECT_EQ(limits_of(Type::f16)[1], 65504);
    try {
        type_named("u64");
        FAIL();
    } catch (const RequestError& error) {
        EXPECT_STREQ(error.what(), "there is no sample type 'u64'; did you mean f64?");
    }
}

TEST(Region, KnowsItsExtentAndWhetherItIsEmpty) {
    const Region region{{1, 2, 3}, {4, 4, 4}};
    EXPECT_EQ(region.extent(), (Extent{3, 2, 1}));
    EXPECT_FALSE(region.empty());
    EXPECT_TRUE((Region{{1, 2, 3}, {4, 2, 4}}).empty());
    EXPECT_EQ(Region::all({5, 6, 7}).extent().samples(), 210);
}

}  // namespace
}  // namespace edgewise
