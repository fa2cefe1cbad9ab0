#include "reference/ray_look.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

#include "reference/answer.hpp"
#include "reference/stored.hpp"

namespace edgewise {
namespace {

constexpr std::int64_t kSide = 24;

Request picture_of(Mode mode) {
    Request want;
    want.job = Job::render;
    want.input = {kSide, kSide, kSide};
    want.screen = {40, 40, 40};
    const Vec3 centre = Vec3::Constant(0.5 * static_cast<double>(kSide - 1));
    const Eigen::Affine3d view = Eigen::Translation3d(Vec3::Constant(19.5)) *
                                 Eigen::AngleAxisd(0.6, Vec3(1, 2, 0.5).normalized()) *
                                 Eigen::Translation3d(-centre);
    want.views = view.matrix();
    want.mode = mode;
    want.transfer.points = {{0, 0, {0, 0, 0}}, {100, 0.3, {1, 0.5, 0.25}}};
    return want;
}

/// Blobs of numbers between 0 and 100, the same in every type.
Data blobs(Type type) {
    Representation what;
    what.extent = {kSide, kSide, kSide};
    what.type = type;
    Data data = Data::make(what, std::pmr::get_default_resource());
    with_stored_type(type, [&](auto zero) {
        using T = decltype(zero);
        if constexpr (!std::is_same_v<T, StoredHalf>)
            for (std::int64_t i = 0; i < what.samples(); ++i) {
                const auto x = static_cast<double>(i % kSide);
                const auto y = static_cast<double>(i / kSide % kSide);
                const auto z = static_cast<double>(i / (kSide * kSide));
                const double wave = std::sin(0.9 * x) * std::cos(0.7 * y) * std::sin(0.5 * z + 1);
                data.as<T>()[i] = static_cast<T>(std::round(100 * std::max(0.0, wave)));
            }
    });
    return data;
}

/// Calls each(look, place) for every pixel whose ray meets the input.
template <class Each>
void for_each_look(const Request& want, const ReferenceField& field, Each&& each) {
    const ViewGeometry geometry(want);
    for (std::int64_t i = 0; i < want.screen.x * want.screen.y; ++i) {
        const OutputSample at{0, i % want.screen.x, i / want.screen.x, 0};
        if (const auto ray = geometry.ray(at)) each(look_at(*ray, want, field), at);
    }
}

TEST(RayLook, FindsNothingWrongWithWhatIsTheSameEverywhere) {
    Data data = blobs(Type::f32);
    std::fill_n(data.as<float>(), data.what.samples(), 42.f);
    const ReferenceField field(data, Field::spline);
    for (const Mode mode : modes())
        for_each_look(picture_of(mode), field, [&](const RayLook& look, const OutputSample&) {
            ASSERT_TRUE(look.seen());
            // Short rays have one sample of a long step where they have two of a short one.
            if (mode->sampled_every > 0) return;
            // Lengths and weights add up to rounding of f32, of at most 42 * 42 voxels.
            for (std::size_t cast = 0; cast < RayLook::kSlices; ++cast)
                EXPECT_LT(look.squares[cast], 1e-6);
            if (mode == Mode::mip) {
                EXPECT_NEAR(look.high, 42, 1e-4);
            }
        });
}

TEST(RayLook, IsTheSameForEveryType) {
    const Data plain = blobs(Type::f32);
    const ReferenceField expected(plain, Field::spline);
    for (const Type type :
         {Type::u8, Type::i8, Type::u16, Type::i16, Type::u32, Type::i32, Type::f64}) {
        const Data data = blobs(type);
        const ReferenceField field(data, Field::spline);
        const Request want = picture_of(Mode::xray);
        const ViewGeometry geometry(want);
        for_each_look(want, field, [&](const RayLook& look, const OutputSample& at) {
            const RayLook other = look_at(*geometry.ray(at), want, expected);
            EXPECT_EQ(look.squares, other.squares);
            EXPECT_EQ(look.high, other.high);
        });
    }
}

TEST(RayLook, GuessesTheReference) {
    const Data data = blobs(Type::u8);
    const ReferenceField field(data, Field::spline);
    for (const Mode mode : {Mode::mip, Mode::xray, Mode::mean}) {
        const Request want = picture_of(mode);
        const Reference reference(want, field, std::pmr::get_default_resource());
        double off = 0, blur = 0;
        for_each_look(want, field, [&](const RayLook& look, const OutputSample& at) {
            const double value = reference.values(std::array{at})[0];
            off += (look.high - value) * (look.high - value);
            blur += look.squares[RayLook::kFoh1];
        });
        // By much less than what linear samples differ by from it.
        EXPECT_LT(off, 0.2 * blur);
    }
}

TEST(RayLook, LeavesOutWhatIsNotFinite) {
    Data data = blobs(Type::f32);
    for (std::int64_t i = 0; i < data.what.samples(); i += 5)
        data.as<float>()[i] = std::numeric_limits<float>::quiet_NaN();
    const ReferenceField field(data, Field::spline);
    for (const Mode mode : modes())
        for_each_look(picture_of(mode), field, [&](const RayLook& look, const OutputSample&) {
            for (const double square : look.squares) EXPECT_TRUE(std::isfinite(square));
            EXPECT_TRUE(std::isfinite(look.low) && std::isfinite(look.high));
        });
}

}  // namespace
}  // namespace edgewise
