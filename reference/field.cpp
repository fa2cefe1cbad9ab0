#include "reference/field.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "reference/sobel.hpp"
#include "reference/stored.hpp"

namespace edgewise {
namespace {

constexpr double kFaceSlack = 1e-9;  // a position this far beyond a face was meant to lie in it

std::int64_t place_of(const Extent& n, std::int64_t x, std::int64_t y, std::int64_t z) {
    return x + n.x * (y + n.y * z);
}

/// Weights of the samples begin ... begin + size - 1 along one axis, for a field that is separable.
struct Line {
    std::int64_t begin = 0;
    int size = 1;
    std::array<double, 2 * FieldPiece::kMargin + 4> weight{1};
};

/// Cardinal spline along one axis: the coefficient of sample i is sqrt(3) sum of pole^|i - k| s_k,
/// on the mirrored line, so a sample's weight is that sum over the four B-splines around p.
Line cardinal(double p, std::int64_t n) {
    if (n == 1) return {};
    const auto cell = static_cast<std::int64_t>(std::floor(p));
    const double f = p - static_cast<double>(cell), g = 1 - f;
    const std::array<double, 4> spline = {g * g * g / 6, (4 - 3 * f * f * (2 - f)) / 6,
                                          (4 - 3 * g * g * (2 - g)) / 6, f * f * f / 6};
    Line line;
    constexpr int reach = FieldPiece::kMargin;
    line.begin = std::max<std::int64_t>(0, cell - reach - 1);
    line.size = static_cast<int>(std::min(n, cell + reach + 3) - line.begin);
    line.weight.fill(0);
    // The unfolded line reaches beyond the faces; what falls there weighs the mirrored sample.
    for (std::int64_t k = cell - reach - 1; k < cell + reach + 3; ++k) {
        double sum = 0;
        for (int i = 0; i < 4; ++i)
            sum += spline[i] *
                   std::pow(kSplinePole, static_cast<double>(std::abs(k - (cell + i - 1))));
        const std::int64_t place = mirrored_index(k, n) - line.begin;
        // A reflection that lands outside of the stretch weighs less than what the stretch leaves
        // out.
        if (place >= 0 && place < line.size) line.weight[place] += std::sqrt(3.0) * sum;
    }
    return line;
}

}  // namespace

ReferenceField::ReferenceField(const Data& samples, Field kind, const Phantom* formula)
    : samples_(samples), kind_(kind), formula_(formula), floating_(!is_integer(samples.what.type)) {
    if (kind == Field::formula && !formula)
        throw std::invalid_argument("a field by formula needs a phantom");
}

bool ReferenceField::inside(const Vec3& p) const noexcept {
    for (int axis = 0; axis < axes(); ++axis) {
        const double top = static_cast<double>(extent()[axis]) - 0.5;
        if (!(p[axis] >= -0.5 - kFaceSlack && p[axis] <= top + kFaceSlack)) return false;
    }
    return true;
}

Vec3 ReferenceField::clamped(const Vec3& p) const noexcept {
    Vec3 q = Vec3::Zero();
    for (int axis = 0; axis < axes(); ++axis)
        q[axis] = std::clamp(p[axis], 0.0, static_cast<double>(extent()[axis] - 1));
    return q;
}

bool ReferenceField::nearest_is_finite(const Vec3& p) const noexcept {
    if (!floating_) return true;
    const Vec3 q = (clamped(p).array() + 0.5).floor().matrix();
    const std::int64_t at =
        place_of(extent(), static_cast<std::int64_t>(q.x()), static_cast<std::int64_t>(q.y()),
                 static_cast<std::int64_t>(q.z()));
    for (int c = 0; c < samples_.what.channels; ++c)
        if (!std::isfinite(value_at(samples_, at * samples_.what.channels + c))) return false;
    return true;
}

bool ReferenceField::near_non_finite(const Vec3& p) const noexcept {
    if (!floating_ || kind_ == Field::formula) return false;
    const Vec3 q = clamped(p);
    std::array<std::int64_t, 3> low{}, high{};
    for (int axis = 0; axis < 3; ++axis) {
        const auto cell = static_cast<std::int64_t>(std::floor(q[axis]));
        low[axis] = std::max<std::int64_t>(0, cell - 1);
        high[axis] = std::min<std::int64_t>(extent()[axis] - 1, cell + 2);
    }
    for (std::int64_t z = low[2]; z <= high[2]; ++z)
        for (std::int64_t y = low[1]; y <= high[1]; ++y)
            for (std::int64_t x = low[0]; x <= high[0]; ++x)
                for (int c = 0; c < samples_.what.channels; ++c)
                    if (!std::isfinite(value_at(
                            samples_, place_of(extent(), x, y, z) * samples_.what.channels + c)))
                        return true;
    return false;
}

bool ReferenceField::has_no_nearest(const Vec3& p) const noexcept {
    std::array<std::array<std::int64_t, 2>, 3> near{};
    bool on_face = false;
    for (int axis = 0; axis < axes(); ++axis) {
        const auto last = static_cast<double>(extent()[axis] - 1);
        for (int side = 0; side < 2; ++side) {
            const double at = p[axis] + (side == 0 ? -kFaceSlack : kFaceSlack);
            near[axis][side] =
                static_cast<std::int64_t>(std::floor(std::clamp(at, 0.0, last) + 0.5));
        }
        on_face = on_face || near[axis][0] != near[axis][1];
    }
    if (!on_face) return false;
    const auto place = [&](int corner) {
        return place_of(extent(), near[0][corner & 1], near[1][corner >> 1 & 1],
                        near[2][corner >> 2]);
    };
    const int channels = samples_.what.channels;
    for (int corner = 1; corner < 8; ++corner)
        for (int c = 0; c < channels; ++c)
            if (value_at(samples_, place(corner) * channels + c) !=
                value_at(samples_, place(0) * channels + c))
                return true;
    return false;
}

void ReferenceField::nearest(const Vec3& p, double* values) const noexcept {
    const Vec3 q = (p.array() + 0.5).floor().matrix();
    const std::int64_t at =
        place_of(extent(), static_cast<std::int64_t>(q.x()), static_cast<std::int64_t>(q.y()),
                 static_cast<std::int64_t>(q.z()));
    for (int c = 0; c < channels(); ++c) values[c] = value_at(samples_, at * channels() + c);
}

void ReferenceField::linear(const Vec3& p, double* values) const noexcept {
    std::array<std::array<std::int64_t, 2>, 3> index{};
    std::array<std::array<double, 2>, 3> weight{};
    for (int axis = 0; axis < 3; ++axis) {
        const double cell = std::floor(p[axis]);
        const auto i = static_cast<std::int64_t>(cell);
        index[axis] = {i, std::min(i + 1, extent()[axis] - 1)};
        weight[axis] = {1 - (p[axis] - cell), p[axis] - cell};
    }
    for (int c = 0; c < channels(); ++c) {
        double sum = 0, finite = 0;
        for (int corner = 0; corner < 8; ++corner) {
            const int i = corner & 1, j = corner >> 1 & 1, k = corner >> 2;
            const double w = weight[0][i] * weight[1][j] * weight[2][k];
            if (w == 0) continue;
            const std::int64_t at = place_of(extent(), index[0][i], index[1][j], index[2][k]);
            const double value = value_at(samples_, at * channels() + c);
            if (!std::isfinite(value)) continue;
            sum += w * value;
            finite += w;
        }
        values[c] = sum / finite;
    }
}

void ReferenceField::spline(const Vec3& p, double* values) const {
    const std::array<Line, 3> line = {cardinal(p.x(), extent().x), cardinal(p.y(), extent().y),
                                      cardinal(p.z(), extent().z)};
    const int channels = this->channels();
    const ValueMap map = samples_.what.values;
    with_stored_type(samples_.what.type, [&](auto zero) {
        const auto* samples = samples_.as<decltype(zero)>();
        for (int c = 0; c < channels; ++c) {
            double sum = 0, finite = 0;
            for (int k = 0; k < line[2].size; ++k)
                for (int j = 0; j < line[1].size; ++j) {
                    const auto* row = samples + c +
                                      channels * place_of(extent(), line[0].begin,
                                                          line[1].begin + j, line[2].begin + k);
                    double along = 0, weight = 0;
                    for (int i = 0; i < line[0].size; ++i) {
                        const double stored = as_double(row[i * channels]);
                        if (!std::isfinite(stored)) continue;
                        along += line[0].weight[i] * stored;
                        weight += line[0].weight[i];
                    }
                    sum += line[2].weight[k] * line[1].weight[j] * along;
                    finite += line[2].weight[k] * line[1].weight[j] * weight;
                }
            values[c] = map(sum / finite);
        }
    });
}

bool ReferenceField::simple_at(const Vec3& p, double& value) const {
    if (kind_ == Field::formula) {
        value = formula_->at(p);
        return std::isfinite(value);
    }
    if (!nearest_is_finite(p)) return false;
    std::array<double, 4> values{};
    if (kind_ == Field::nearest)
        nearest(clamped(p), values.data());
    else
        linear(clamped(p), values.data());
    value = values[0];
    return true;
}

bool ReferenceField::at(const Vec3& p, std::span<double> values) const {
    if (!inside(p)) return false;
    if (kind_ == Field::formula) {
        values[0] = formula_->at(p);
        return true;
    }
    if (!nearest_is_finite(p)) return false;
    const Vec3 q = clamped(p);
    if (kind_ == Field::nearest)
        nearest(q, values.data());
    else if (is_linear(p))
        linear(q, values.data());
    else
        spline(q, values.data());
    return true;
}

FieldPiece::FieldPiece(const ReferenceField& field, const Region& cells,
                       std::pmr::memory_resource* memory)
    : field_(field) {
    if (field.kind() == Field::spline) spline_.emplace(field.samples(), cells, kMargin, memory);
}

double difference_step(Field kind) noexcept {
    switch (kind) {
        case Field::spline:
        case Field::formula:
            return 1.0 / 256;
        default:
            return 1;
    }
}

Vec3 FieldPiece::gradient(const Vec3& p, GradientScheme scheme) const {
    const bool sobel = scheme == GradientScheme::sobel;
    if (spline_ && !spline_->has_gaps() && !sobel) return spline_->gradient(field_.clamped(p));
    const double step = difference_step(field_.kind());
    std::array<double, 4> values{};
    const bool formula = field_.kind() == Field::formula;
    const auto value = [&](const Vec3& at) {
        if (formula) return field_.formula()->at(at);
        return this->at(field_.clamped(at), values.data()) ? values[0] : NAN;
    };
    const Vec3 q = formula ? p : field_.clamped(p);
    const double here = value(q);
    if (sobel) return sobel_gradient(q, here, value);
    Vec3 gradient;
    for (int axis = 0; axis < 3; ++axis) {
        const Vec3 away = step * Vec3::Unit(axis);
        double below = value(q - away), above = value(q + away);
        if (!std::isfinite(below)) below = here;
        if (!std::isfinite(above)) above = here;
        gradient[axis] = (above - below) / (2 * step);
    }
    return gradient;
}

bool FieldPiece::at(const Vec3& p, double* values) const {
    if (!spline_ || (spline_->has_gaps() && field_.near_non_finite(p)))
        return field_.at(p, {values, static_cast<std::size_t>(field_.channels())});
    if (!field_.inside(p)) return false;
    spline_->at(field_.clamped(p), values);
    return true;
}

}  // namespace edgewise
