#include "transitions/reference/preview_paths.hpp"

#include <algorithm>
#include <cmath>

namespace edgewise {
namespace {

/// The length that sample k of a span stands for [samples].
double share_of(std::int64_t k, double low, double high) {
    const auto z = static_cast<double>(k);
    return (z + 1 > high ? high : z + 0.5) - (z - 1 < low ? low : z - 0.5);
}

void add_finite(Stretch& to, double value, double length, const Request& want) {
    if (std::isfinite(value)) to.add(value, length, want);
}

/// Cuts [low, high] to where at + k shear lies between the faces of n samples.
void clip(double at, double shear, std::int64_t n, double& low, double& high) {
    const double first = -0.5, last = static_cast<double>(n) - 0.5;
    if (shear == 0) {
        if (at < first || at > last) high = low - 1;
        return;
    }
    const double a = (first - at) / shear, b = (last - at) / shear;
    low = std::max(low, std::min(a, b));
    high = std::min(high, std::max(a, b));
}

}  // namespace

ScreenPicture::ScreenPicture(const RaySpan& ray, Mode mode)
    : ray_(ray), next_(static_cast<std::int64_t>(std::ceil(ray.low))) {
    stretches_.fill(Stretch::empty(mode));
}

void ScreenPicture::trace(const PreviewBlock& block, double end, const Request& want) {
    for (; static_cast<double>(next_) < end && static_cast<double>(next_) <= ray_.high; ++next_) {
        const auto t = static_cast<double>(next_);
        const Vec3 p = ray_.origin + t * ray_.direction;
        const double length = share_of(next_, ray_.low, ray_.high);
        double value = 0;
        for (PreviewHold hold : {kZoh, kFoh, kSpline}) {
            block.hold(hold, p, &value);
            add_finite(stretches_[hold], value, length, want);
        }
        // Roundings of a shear by 0.27 (of a turn by 30 degrees) repeat after some four samples:
        // neighbours on a ray are displaced alike, so that less averages out.
        constexpr double kAlike = 2;
        const double group = std::floor(t / kAlike);
        block.assigned(p, static_cast<std::uint64_t>(std::abs(1e3 * (group + ray_.origin.sum()))),
                       &value);
        add_finite(stretches_[kMethods - 1], value, length, want);
    }
}

ShearedPicture::ShearedPicture(const RaySpan& ray, const Extent& input, Mode mode)
    : ray_(ray), input_(input) {
    // As in warp.axis_permutation: a rounding error does not decide between equals.
    constexpr double kClearlyFaster = 1e-9;
    for (int k = 1; k >= 0; --k)
        if (std::abs(ray.direction[k]) > std::abs(ray.direction[axis_]) * (1 + kClearlyFaster))
            axis_ = k;
    const double advance = ray.direction[axis_];
    step_ = 1 / std::abs(advance);
    const double slice = advance > 0 ? 0 : static_cast<double>(input[axis_] - 1);
    first_ = (slice - ray.origin[axis_]) / advance;
    std::array<double, 2> at{}, whole{};
    for (int i = 0; i < 2; ++i) {
        across_[i] = (axis_ + 1 + i) % 3;
        at[i] = ray.origin[across_[i]] + first_ * ray.direction[across_[i]];
        shear_[i] = ray.direction[across_[i]] * step_;
        whole[i] = std::floor(at[i]);
    }
    for (std::size_t corner = 0; corner < corners_.size(); ++corner) {
        const double i = static_cast<double>(corner & 1), j = static_cast<double>(corner >> 1);
        const double u = at[0] - whole[0], v = at[1] - whole[1];
        corners_[corner] =
            pixel_at(whole[0] + i, whole[1] + j, (i > 0 ? u : 1 - u) * (j > 0 ? v : 1 - v), mode);
    }
    nearest_ = pixel_at(std::floor(at[0] + 0.5), std::floor(at[1] + 0.5), 1, mode);
    double begin = static_cast<double>(input[axis_]), end = -1;
    const auto join = [&](const Pixel& pixel) {
        if (pixel.weight == 0 || !(pixel.low < pixel.high)) return;
        begin = std::min(begin, std::ceil(pixel.low));
        end = std::max(end, std::floor(pixel.high));
    };
    for (const Pixel& corner : corners_) join(corner);
    join(nearest_);
    next_ = static_cast<std::int64_t>(begin);
    last_ = static_cast<std::int64_t>(end);
}

ShearedPicture::Pixel ShearedPicture::pixel_at(double u, double v, double weight, Mode mode) const {
    Pixel pixel{.low = -0.5,
                .high = static_cast<double>(input_[axis_]) - 0.5,
                .weight = weight,
                .at = {u, v},
                .stretch = Stretch::empty(mode)};
    for (int i = 0; i < 2; ++i)
        clip(pixel.at[i], shear_[i], input_[across_[i]], pixel.low, pixel.high);
    const double length = pixel.high - pixel.low, after = std::ceil(pixel.low);
    if (length > 0 && after > pixel.high) {
        const double before = after - 1, last = static_cast<double>(input_[axis_] - 1);
        if (after > last || (before >= 0 && pixel.low - before <= after - pixel.high)) {
            pixel.low = before;
            pixel.high = before + length;
        } else {
            pixel.low = after - length;
            pixel.high = after;
        }
    }
    return pixel;
}

void ShearedPicture::add(Pixel& pixel, PreviewHold hold, const PreviewBlock& block,
                         const Request& want) {
    const auto k = static_cast<double>(next_);
    if (pixel.weight == 0 || k < pixel.low || k > pixel.high) return;
    Vec3 p;
    p[axis_] = ray_.direction[axis_] > 0 ? k : static_cast<double>(input_[axis_] - 1) - k;
    for (int i = 0; i < 2; ++i) p[across_[i]] = pixel.at[i] + k * shear_[i];
    double value = 0;
    block.hold(hold, p, &value);
    add_finite(pixel.stretch, value, share_of(next_, pixel.low, pixel.high) * step_, want);
}

void ShearedPicture::trace(const PreviewBlock& block, double end, const Request& want) {
    for (; next_ <= last_ && begin() < end; ++next_) {
        for (Pixel& corner : corners_) add(corner, kFoh, block, want);
        add(nearest_, kZoh, block, want);
    }
}

void ShearedPicture::result(PreviewHold hold, const Request& want,
                            std::span<double, 4> values) const {
    std::fill(values.begin(), values.end(), 0.0);
    if (hold == kZoh) {
        nearest_.stretch.result(want, values.data());
        return;
    }
    double weight = 0, length = 0;
    for (const Pixel& corner : corners_) {
        if (corner.weight == 0 || !(corner.low < corner.high)) continue;
        std::array<double, 4> value{};
        corner.stretch.result(want, value.data());
        weight += corner.weight;
        length += corner.weight * (corner.high - corner.low);
        for (std::size_t c = 0; c < 4; ++c) values[c] += corner.weight * value[c];
    }
    if (weight == 0) return;
    for (double& value : values) value /= weight;
    const double share = (ray_.high - ray_.low) / step_ * weight / length;
    if (want.mode == Mode::xray) values[0] *= share;
    if (want.mode == Mode::composite && values[3] > 0) {
        const double opacity = 1 - std::pow(std::max(0.0, 1 - values[3]), share);
        const double scale = opacity / values[3];
        for (double& value : values) value *= scale;
    }
}

}  // namespace edgewise
