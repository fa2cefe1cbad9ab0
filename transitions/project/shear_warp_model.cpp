#include "transitions/project/shear_warp_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "reference/written.hpp"
#include "transitions/kernels/axis_permutation.hpp"
#include "transitions/project/picture.hpp"

namespace edgewise {
namespace {

/// The length that sample k of a span stands for [samples].
double share_of(std::int64_t k, double low, double high) {
    const auto z = static_cast<double>(k);
    return (z + 1 > high ? high : z + 0.5) - (z - 1 < low ? low : z - 0.5);
}

/// Samples that a ray takes, one after another, each for a length.
struct Samples {
    Places places;
    std::array<double, Places::kMost> pieces;

    bool full() const { return places.count == Places::kMost; }
    void add(const Vec3& p, double piece) {
        pieces[places.count] = piece;
        places.add(p);
    }
    void combine(PreviewHold hold, const PreviewBlock& block, const Request& want,
                 Stretch& to) const {
        std::array<double, Places::kMost> values;
        block.hold(hold, places, values.data());
        to.add({values.data(), places.count}, pieces.data(), want);
    }
};

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

/// What samples -2 ... 3 weigh in the cubic spline through them at f, between 0 and 1 [Unser 1999].
std::array<double, 6> spline_weights(double f) {
    const double pole = std::sqrt(3.0) - 2, scale = -6 * pole / (1 - pole * pole);
    const double g = 1 - f;
    const std::array<double, 4> basis = {g * g * g / 6, 2.0 / 3 - f * f * (2 - f) / 2,
                                         2.0 / 3 - g * g * (2 - g) / 2, f * f * f / 6};
    std::array<double, 6> weights{};
    double sum = 0;
    for (int tap = 0; tap < 6; ++tap) {
        for (int k = 0; k < 4; ++k)
            weights[tap] += basis[k] * scale * std::pow(pole, std::abs(tap - 1 - k));
        sum += weights[tap];
    }
    for (double& weight : weights) weight /= sum;
    return weights;
}

}  // namespace

ShearedPicture::ShearedPicture(const RaySpan& ray, const Extent& input, Mode mode)
    : ray_(ray), input_(input) {
    axis_ = kernels::fastest_axis(ray.direction);
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
    // The nearest pixel whose ray meets the input; only rounding may leave none.
    const std::size_t own = (at[0] - whole[0] < 0.5 ? 0u : 1u) + (at[1] - whole[1] < 0.5 ? 0u : 2u);
    const Pixel* nearest = nullptr;
    for (const std::size_t flip : {0u, 1u, 2u, 3u}) {
        const Pixel& pixel = corners_[own ^ flip];
        if (pixel.low < pixel.high && pixel.weight > (nearest ? nearest->weight : 0))
            nearest = &pixel;
    }
    farther_ = nearest && nearest != &corners_[own];
    nearest_ = nearest ? *nearest : corners_[own];
    nearest_.weight = 1;
    if (mode->extreme != 0) smooth_ = smooth_at(at, mode);
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

std::optional<ShearedPicture::Smooth> ShearedPicture::smooth_at(const std::array<double, 2>& at,
                                                                Mode mode) const {
    Smooth smooth;
    for (int i = 0; i < 2; ++i) {
        smooth.first[i] = std::floor(at[i]) - Smooth::kBefore;
        smooth.place[i] = at[i] - std::floor(at[i]);
    }
    smooth.largest.fill(-std::numeric_limits<float>::infinity());
    for (std::size_t tap = 0; tap < smooth.only.size(); ++tap) {
        const Pixel pixel =
            pixel_at(smooth.first[0] + static_cast<double>(tap % Smooth::kTaps),
                     smooth.first[1] + static_cast<double>(tap / Smooth::kTaps), 1, mode);
        const double slice = std::ceil(pixel.low);
        const bool one = pixel.low < pixel.high && slice == std::floor(pixel.high);
        smooth.only[tap] = one ? static_cast<std::int32_t>(slice) : -1;
    }
    return smooth;
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

void ShearedPicture::add(Pixel& pixel, PreviewHold hold, std::int64_t first,
                         const PreviewBlock& block, const Request& want) const {
    if (pixel.weight == 0) return;
    std::int64_t k = first;
    const auto more = [&] { return k < next_ && static_cast<double>(k) <= pixel.high; };
    while (k < next_ && static_cast<double>(k) < pixel.low) ++k;
    while (more()) {
        Samples samples;
        for (; more() && !samples.full(); ++k)
            samples.add(place_of(pixel.at, k), share_of(k, pixel.low, pixel.high) * step_);
        samples.combine(hold, block, want, pixel.stretch);
    }
}

Vec3 ShearedPicture::place_of(const std::array<double, 2>& at, std::int64_t slice) const {
    const auto k = static_cast<double>(slice);
    Vec3 p;
    p[axis_] = ray_.direction[axis_] > 0 ? k : static_cast<double>(input_[axis_] - 1) - k;
    for (int i = 0; i < 2; ++i) p[across_[i]] = at[i] + k * shear_[i];
    return p;
}

void ShearedPicture::add_smooth(std::int64_t slice, const PreviewBlock& block) {
    const auto take = [&](std::size_t tap, float value) {
        if (std::isfinite(value)) smooth_->largest[tap] = std::max(smooth_->largest[tap], value);
    };
    block.linear_square(place_of(smooth_->first, slice), across_, [&](int i, int j, float value) {
        take(static_cast<std::size_t>(j * Smooth::kTaps + i), value);
    });
    for (std::size_t tap = 0; tap < smooth_->only.size(); ++tap) {
        if (smooth_->only[tap] != slice) continue;
        double value = 0;
        block.hold(kFoh,
                   place_of({smooth_->first[0] + static_cast<double>(tap % Smooth::kTaps),
                             smooth_->first[1] + static_cast<double>(tap / Smooth::kTaps)},
                            slice),
                   &value);
        take(tap, static_cast<float>(value));
    }
}

/// The mean of the neighbours that are known: those beside, above and below before those across.
std::optional<float> ShearedPicture::Smooth::continued(int i, int j) const {
    for (const bool diagonal : {false, true}) {
        int count = 0;
        float sum = 0;
        for (int y = std::max(j - 1, 0); y <= std::min(j + 1, kTaps - 1); ++y)
            for (int x = std::max(i - 1, 0); x <= std::min(i + 1, kTaps - 1); ++x) {
                const float value = largest[static_cast<std::size_t>(y * kTaps + x)];
                if ((x != i && y != j) != diagonal || !std::isfinite(value)) continue;
                sum += value;
                ++count;
            }
        if (count > 0) return sum / static_cast<float>(count);
    }
    return std::nullopt;
}

/// Where pixels meet nothing, others continue ring by ring, as in continue_image of the edge.
double ShearedPicture::Smooth::result(double miss) const {
    const auto unknown = [](const Smooth& of) {
        return std::any_of(of.largest.begin(), of.largest.end(),
                           [](float value) { return !std::isfinite(value); });
    };
    Smooth known = *this;
    for (int ring = 1; ring < kTaps && unknown(known); ++ring) {
        const Smooth before = known;
        for (int at = 0; at < kTaps * kTaps; ++at)
            if (!std::isfinite(before.largest[static_cast<std::size_t>(at)]))
                if (const auto value = before.continued(at % kTaps, at / kTaps))
                    known.largest[static_cast<std::size_t>(at)] = *value;
    }
    if (unknown(known)) return miss;
    const std::array<double, kTaps> across = spline_weights(place[0]),
                                    down = spline_weights(place[1]);
    double sum = 0;
    for (std::size_t at = 0; at < known.largest.size(); ++at)
        sum += across[at % kTaps] * down[at / kTaps] * static_cast<double>(known.largest[at]);
    return sum;
}

void ShearedPicture::trace(const PreviewBlock& block, double end, const Request& want) {
    const std::int64_t first = next_;
    while (next_ <= last_ && begin() < end) ++next_;
    if (smooth_)
        for (std::int64_t slice = first; slice < next_; ++slice) add_smooth(slice, block);
    else
        for (Pixel& corner : corners_) add(corner, kFoh, first, block, want);
    add(nearest_, kZoh, first, block, want);
}

void ShearedPicture::give_length(double share, Mode mode, std::span<double, 4> values) noexcept {
    if (!mode->lengthen) return;
    // A ray ends where so little is left to see: what an opaque neighbour would have let through
    // of a shorter way is not known any more.
    if (mode->left && 1 - values[3] < kTerminated && share < 1) {
        const double scale = 1 / values[3];
        for (double& value : values) value *= scale;
        return;
    }
    mode->lengthen(share, values);
}

void ShearedPicture::result(PreviewHold hold, const Request& want,
                            std::span<double, 4> values) const {
    std::fill(values.begin(), values.end(), 0.0);
    const double chord = (ray_.high - ray_.low) / step_;
    if (hold == kZoh) {
        nearest_.stretch.result(want, values.data());
        if (farther_) give_length(chord / (nearest_.high - nearest_.low), want.mode, values);
        return;
    }
    if (smooth_) {
        values[0] = smooth_->result(want.miss);
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
    give_length(chord * weight / length, want.mode, values);
}

namespace {

class ShearedRay final : public RayModel {
 public:
    ShearedRay(const RaySpan& ray, const Request& want)
        : want_(want), picture_(ray, want.input, want.mode) {}
    void trace(const PreviewBlock& block, double end) override {
        picture_.trace(block, end, want_);
    }
    double begin() const override { return picture_.begin(); }
    double end() const override { return picture_.end(); }
    void finish(const RayAnswer& answer, RaySquares& squares) override {
        for (const PreviewHold hold : {kZoh, kFoh}) {
            const Threshold* const threshold = want_.mode->threshold;
            if (hold == kZoh && threshold && threshold->flip) {
                const double square = answer.square(picture_.nearest());
                squares.add(hold, square, answer.fourth(square));
                continue;
            }
            PixelValues values{};
            picture_.result(hold, want_, values);
            as_written(want_, values.data());
            squares.add(hold, answer.square(values));
        }
    }

 private:
    const Request& want_;
    ShearedPicture picture_;
};

class ShearWarpModel final : public Model {
 public:
    explicit ShearWarpModel(const ModelSetting& setting) : want_(setting.want) {
        facts_ = {{.name = kShearWarpError(filter_of(kZoh).name), .like = RayLook::kSlices},
                  {.name = kShearWarpError(filter_of(kFoh).name), .like = RayLook::kFoh1}};
    }
    std::unique_ptr<RayModel> follow(const RaySpan& ray, const OutputSample&) const override {
        return std::make_unique<ShearedRay>(ray, want_);
    }

 private:
    const Request& want_;
};

}  // namespace

std::shared_ptr<const Model> shear_warp_model(const ModelSetting& setting) {
    const Request& want = setting.want;
    const bool refused = want.eye || !no_slices(want).empty();
    if (!want.job->of_rays() || refused) return nullptr;
    return std::make_shared<ShearWarpModel>(setting);
}

}  // namespace edgewise
