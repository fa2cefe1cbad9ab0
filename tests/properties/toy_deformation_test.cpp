// A request whose view is no matrix, and an edge of a user's own that takes it: planned, predicted
// and verified as any other. Edges that need a matrix say so.
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

#include "planner/planner.hpp"
#include "reference/verify.hpp"
#include "scene/scene.hpp"
#include "tests/properties/run_request.hpp"
#include "transitions/catalogue.hpp"

namespace edgewise {
namespace {

/// Turns each point about the z axis through `middle` by an angle that falls with its distance.
class Swirl final : public Deformation {
 public:
    Swirl(const Vec3& middle, double angle, double width)
        : middle_(middle), angle_(angle), width_(width) {}
    std::string name() const override { return "swirl"; }
    Vec3 apply(const Vec3& at) const override { return turned(at, 1); }
    Vec3 invert(const Vec3& at) const override { return turned(at, -1); }
    Mat3 jacobian(const Vec3& at) const override {
        const Vec3 d = at - middle_;
        const double a = angle(d), c = std::cos(a), s = std::sin(a);
        // a = angle exp(-r^2 / w^2): its gradient is -2 a d / w^2.
        const Eigen::Vector2d gradient = -2 * a / (width_ * width_) * d.head<2>();
        const Eigen::Vector2d across(-s * d.x() - c * d.y(), c * d.x() - s * d.y());
        Mat3 all = Mat3::Identity();
        all.topLeftCorner<2, 2>() << c, -s, s, c;
        all.topLeftCorner<2, 2>() += across * gradient.transpose();
        return all;
    }

 private:
    double angle(const Vec3& d) const {
        return angle_ * std::exp(-d.head<2>().squaredNorm() / (width_ * width_));
    }
    Vec3 turned(const Vec3& at, double sign) const {
        const Vec3 d = at - middle_;
        const double a = sign * angle(d), c = std::cos(a), s = std::sin(a);
        return middle_ + Vec3(c * d.x() - s * d.y(), s * d.x() + c * d.y(), d.z());
    }
    Vec3 middle_;
    double angle_, width_;
};

/// Backward and trilinear, one transform a sample. Without a model: it is measured.
Transition toy_gather() {
    Transition edge;
    edge.name = "warp.toy_gather";
    edge.joins = {{"object/scalar", "screen/scalar"}};
    edge.any_transform = true;
    edge.offer = [](const Representation& from, const Ask& ask, const Parameters& with) -> Offer {
        if (from.type != Type::f32) return Offer::no("f32 alone");
        return {.from = from, .to = screen_scalar(from, ask.want), .with = with};
    };
    edge.work = [](const Offer& offer, const Ask&, int) {
        return Work{.operations = 200.0 * static_cast<double>(offer.to.samples())};
    };
    edge.run = [](const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region&,
                  Context& context) {
        const Transform back = residual_transform(offer.from, ask.want, context.view).inverse();
        const Extent n = in.what.extent, to = out.what.extent;
        for (std::int64_t z = 0, i = 0; z < to.z; ++z)
            for (std::int64_t y = 0; y < to.y; ++y)
                for (std::int64_t x = 0; x < to.x; ++x, ++i) {
                    const Vec3 p = back.apply(Vec3(double(x), double(y), double(z)));
                    double sum = 0;
                    bool inside = true;
                    for (int axis = 0; axis < 3; ++axis)
                        inside = inside && p[axis] >= -0.5 && p[axis] < double(n[axis]) - 0.5;
                    for (int corner = 0; corner < 8 && inside; ++corner) {
                        double weight = 1;
                        std::int64_t at[3];
                        for (int axis = 0; axis < 3; ++axis) {
                            const double low = std::floor(p[axis]), f = p[axis] - low;
                            const bool next = corner >> axis & 1;
                            weight *= next ? f : 1 - f;
                            at[axis] =
                                std::clamp<std::int64_t>(std::int64_t(low) + next, 0, n[axis] - 1);
                        }
                        sum += weight * in.as<float>()[(at[2] * n.y + at[1]) * n.x + at[0]];
                    }
                    out.as<float>()[i] = static_cast<float>(inside ? sum : ask.want.outside);
                }
    };
    return edge;
}

struct Swirled {
    MemoryBudget memory{std::size_t{1} << 30};
    std::shared_ptr<const Data> data =
        std::make_shared<const Data>(make_phantom("gaussians", 40, &memory));
    Request want = request_of(Job::warp, Mode::mip, data->what, {rotation(0, 0, 10)});

    explicit Swirled(double angle = 1.5) {
        const Transform swirl(std::make_shared<Swirl>(Vec3(19.5, 19.5, 19.5), angle, 12));
        want.views = Placement(want.views.at(0) * swirl);
    }
};

TEST(Transform, ComposesAndInverts) {
    const Transform swirl(std::make_shared<Swirl>(Vec3(3, 4, 5), 0.7, 6));
    const Transform turn(rotation(10, 20, 30)), both = turn * swirl, back = both.inverse();
    EXPECT_FALSE(both.is_matrix());
    EXPECT_EQ(both.name(), "swirl");
    EXPECT_THROW(both.matrix(), RequestError);
    const Vec3 p(1, 2, 3), q = both.apply(p);
    EXPECT_LT((q - turn.apply(swirl.apply(p))).norm(), 1e-12);
    EXPECT_LT((back.apply(q) - p).norm(), 1e-12);
    // What cancels leaves the matrix.
    EXPECT_TRUE((both * swirl.inverse()).is_matrix());
    EXPECT_EQ((both * swirl.inverse()).matrix(), turn.matrix());
    for (const Transform& one : {turn, swirl, both, back})
        for (int axis = 0; axis < 3; ++axis) {
            constexpr double kStep = 1e-5;
            const Vec3 step = kStep * Vec3::Unit(axis);
            const Vec3 slope = (one.apply(p + step) - one.apply(p - step)) / (2 * kStep);
            EXPECT_LT((slope - one.jacobian(p).col(axis)).norm(), 1e-8);
        }
    Mat4 homography = Mat4::Identity();
    homography(3, 0) = 0.01;
    homography(0, 1) = 0.2;
    const Transform projective(homography);
    const Vec3 slope =
        (projective.apply(Vec3(2 + 1e-6, 1, 0)) - projective.apply(Vec3(2, 1, 0))) / 1e-6;
    EXPECT_LT((slope - projective.jacobian(Vec3(2, 1, 0)).col(0)).norm(), 1e-5);
    EXPECT_FALSE(projective.apply(Vec3(-200, 0, 0)).allFinite());  // behind the eye
}

TEST(ToyDeformation, EdgesThatNeedAMatrixSaySo) {
    Swirled swirled;
    const Scene scene =
        measure_scene(catalogue(), *swirled.data, statistics_of(*swirled.data, &swirled.memory),
                      swirled.want, nullptr, &swirled.memory);
    const Answer answer = plan(catalogue(), {swirled.want, scene}, {{swirled.data->what}},
                               default_profile(catalogue()));
    EXPECT_FALSE(answer.plan);
    for (const char* name : {"warp.backward", "warp.shear", "warp.permutation"}) {
        const auto refusal = std::find_if(answer.refused.begin(), answer.refused.end(),
                                          [&](const Refusal& r) { return r.transition == name; });
        ASSERT_NE(refusal, answer.refused.end()) << name;
        EXPECT_NE(refusal->reason.text().find("'swirl' is no matrix"), std::string::npos)
            << refusal->reason;
    }
}

TEST(ToyDeformation, IsPlannedWithTheErrorThatItHas) {
    Catalogue edges = catalogue();
    edges.push_back(toy_gather());
    for (const double angle : {0.2, 1.5}) {
        Swirled swirled(angle);
        const Statistics statistics = statistics_of(*swirled.data, &swirled.memory);
        const Scene scene =
            measure_scene(edges, *swirled.data, statistics, swirled.want, nullptr, &swirled.memory);
        const Ask ask{swirled.want, scene};
        const Answer answer = plan(edges, ask, {{swirled.data->what}}, default_profile(edges));
        ASSERT_TRUE(answer.plan) << answer.problem;
        EXPECT_EQ(answer.plan->texts(), std::vector<std::string>{"warp.toy_gather"});
        ASSERT_TRUE(answer.plan->predicted.known);
        const ReferenceField field(*swirled.data, swirled.want.field, nullptr);
        const auto results = results_of(*answer.plan, ask, swirled.data, 2, swirled.memory);
        const double error = Expected(swirled.want, field, &swirled.memory).error_of(results);
        EXPECT_GT(error, answer.plan->predicted.error / 3);
        EXPECT_LT(error, answer.plan->predicted.error * 3);
        Verifier verifier(swirled.want, field, 0, 1, &swirled.memory);
        verifier.frame(0, *results[0]);
        EXPECT_NEAR(verifier.finish().nrmse, error, 0.05 * error);
    }
}

TEST(ToyDeformation, PicturesAreOfStraightRays) {
    Swirled swirled;
    swirled.want.job = Job::render;
    EXPECT_THROW(ViewGeometry{swirled.want}, RequestError);
}

}  // namespace
}  // namespace edgewise
