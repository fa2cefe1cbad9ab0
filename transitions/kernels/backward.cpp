#include "transitions/kernels/backward.hpp"

#include <algorithm>
#include <cmath>

#include "transitions/kernels/backward_rows.hpp"
#include "transitions/kernels/backward_scalar.hpp"

namespace edgewise::kernels {
namespace {

double snapped(double value, double tolerance) {
    const double whole = std::floor(value + 0.5);
    return std::abs(value - whole) <= tolerance ? whole : value;
}

/// cos(90 degrees) is 6e-17: without snapping, quarter turns and shifts would interpolate.
Affine snapped(Affine map) {
    for (int row = 0; row < 3; ++row) {
        for (int k = 0; k < 3; ++k) map[4 * row + k] = snapped(map[4 * row + k], 1e-12);
        map[4 * row + 3] = snapped(map[4 * row + 3], 1e-9);
    }
    return map;
}

BackwardPlan common_plan(const Grid& input, Hold hold, float outside, const Filter* filter) {
    BackwardPlan plan;
    plan.input = input;
    plan.hold = hold;
    plan.filter = filter;
    plan.below = hold == Hold::bspline3 ? 1 : 0;
    if (hold == Hold::weighted) {
        plan.weights = &TapPolynomials::of(*filter);
        plan.interpolates = !filter->coefficients;
        plan.below = filter->taps / 2 - 1;
    }
    plan.axes = input.extent.z == 1 ? 2 : 3;
    plan.mapped = !input.values.identity();
    plan.slope = float(input.values.slope);
    plan.offset = float(input.values.offset);
    plan.outside = outside;
    plan.extent = {input.extent.x, input.extent.y, input.extent.z};
    plan.stride[0] = std::int64_t(bytes_of(input.type)) * input.channels;
    plan.stride[1] = plan.stride[0] * input.row_step();
    plan.stride[2] = plan.stride[0] * input.slice_step();
    for (int a = 0; a < 3; ++a) plan.next[a] = plan.extent[a] > 1 ? plan.stride[a] : 0;
    return plan;
}

bool has_lanes(const BackwardPlan& plan) {
    constexpr std::int64_t kLongest = 1 << 22;  // 24.40 fixed point, with room for one chunk
    for (int a = 0; a < plan.axes; ++a)
        if (plan.extent[a] > kLongest) return false;
    if (plan.axes == 3 && plan.input.channels > 1) return false;
    if (plan.hold == Hold::weighted && plan.filter->taps % 2 != 0) return false;
    const Type type = plan.input.type;
    return in_lanes(type) && (type == Type::f32 || plan.hold != Hold::bspline3);
}

/// So far ahead of the reads their lines are asked for. Of 1, 2, 3 and 4 the best with 128^3 f32
/// and 256^3 u8 turned by 30 degrees: lines come in time and are still there.
constexpr double kSlicesAhead = 2;

constexpr double kGreatestOffset = 2147483647.0;  // bytes that a lane's 32-bit offset can bridge

/// Lanes hold 9 bits of whole samples from the block's origin, and offsets of 32 bits.
bool lanes_reach(const BackwardPlan& plan) {
    double reach = 0;
    for (int a = 0; a < plan.axes; ++a) {
        const double step = std::abs(plan.map[4 * a]);
        if (!(step <= 14)) return false;
        // Taps lie at most four samples from the cell.
        reach += (kBlock * step + 4) * double(plan.stride[a]);
    }
    return reach < kGreatestOffset;
}

template <class T>
constexpr auto scalar_of() {
    return &backward_scalar<T>;
}

using Scalar = void (*)(const BackwardPlan&, const WarpOutput&, const Region&);

Scalar scalar_path(Type type) {
    switch (type) {
        case Type::u8:
            return scalar_of<std::uint8_t>();
        case Type::i8:
            return scalar_of<std::int8_t>();
        case Type::u16:
            return scalar_of<std::uint16_t>();
        case Type::i16:
            return scalar_of<std::int16_t>();
        case Type::u32:
            return scalar_of<std::uint32_t>();
        case Type::i32:
            return scalar_of<std::int32_t>();
        case Type::f16:
            return scalar_of<Half>();
        case Type::f64:
            return scalar_of<double>();
        default:
            return scalar_of<float>();
    }
}

}  // namespace

void backward_in_f64(const BackwardPlan& plan, const WarpOutput& output,
                     const Region& region) noexcept {
    scalar_path(plan.input.type)(plan, output, region);
}

BackwardWarp::BackwardWarp(const Grid& input, const Affine& to_input, Hold hold, float outside,
                           const Filter* filter)
    : plan_(common_plan(input, hold, outside, filter)) {
    plan_.map = snapped(to_input);
    // A volume of one plane is an image only while its points stay in the plane.
    const Affine& m = plan_.map;
    if (m[8] != 0 || m[9] != 0 || m[10] != 1 || m[11] != 0) plan_.axes = 3;
    plan_.vector = has_lanes(plan_) && lanes_reach(plan_);
    if (!plan_.vector) return;
    for (int a = 0; a < plan_.axes; ++a) {
        const double step = plan_.map[4 * a];
        plan_.inverse[a] = step == 0 ? 0 : 1 / step;
        plan_.step16[a] = std::int64_t(std::floor(kBlock * step * kFixedOne + 0.5));
        for (int lane = 0; lane < kBlock; ++lane)
            plan_.lane[a][lane] = std::int32_t(std::floor(lane * step * 8388608.0 + 0.5));
        const double most = double(plan_.extent[a]);
        const double slices = std::clamp(kSlicesAhead * plan_.map[4 * a + 2], -most, most);
        plan_.ahead += std::int64_t(std::floor(slices + 0.5)) * plan_.stride[a];
    }
}

BackwardWarp::BackwardWarp(const Grid& input, const Homography& to_input, Hold hold, float outside,
                           const Filter* filter)
    : plan_(common_plan(input, hold, outside, filter)) {
    plan_.homography = to_input;
    plan_.projective = true;
    const double bytes = double(plan_.stride[1]) * double(plan_.extent[1]);
    plan_.vector = has_lanes(plan_) && bytes < kGreatestOffset;
}

void BackwardWarp::operator()(const WarpOutput& output, const Region& region) const noexcept {
    if (region.empty()) return;
    if (!plan_.projective && plan_.axes == 2 && region.end[2] > 1) {  // planes beyond the only one
        BackwardPlan solid = plan_;
        solid.axes = 3;
        return backward_in_f64(solid, output, region);
    }
    if (!plan_.vector) return backward_in_f64(plan_, output, region);
    if (plan_.hold == Hold::weighted) return backward_weighted_simd(plan_, output, region);
    if (plan_.axes == 2) return backward_2d_simd(plan_, output, region);
    backward_3d_simd(plan_, output, region);
}

Extent preferred_tile(const Extent& output) noexcept {
    if (output.z == 1) return {128, 64, 1};
    return {64, 16, 16};
}

}  // namespace edgewise::kernels
