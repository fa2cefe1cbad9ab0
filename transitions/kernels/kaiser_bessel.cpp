#include "transitions/kernels/kaiser_bessel.hpp"

#include <cmath>
#include <numbers>

namespace edgewise::kernels {
namespace {

constexpr double kPi = std::numbers::pi;

struct Shape {
    int width;
    double padding, per_tap;
};
// b / width: least mean square of ghost(x) over |x| <= 1 / (2 padding). A test searches them again.
constexpr Shape kShapes[] = {{4, 1.25, 1.78}, {6, 1.25, 1.84}, {4, 1.5, 2.0},
                             {6, 1.5, 2.06},  {4, 2, 2.28},    {6, 2, 2.32}};

const Shape* find(int width, double padding) noexcept {
    for (const Shape& shape : kShapes)
        if (shape.width == width && shape.padding == padding) return &shape;
    return nullptr;
}

double bessel_i0(double x) noexcept {
    double term = 1, sum = 1;
    for (int k = 1; term > 1e-17 * sum; ++k) sum += term *= x * x / (4. * k * k);
    return sum;
}

}  // namespace

bool KaiserBessel::known(int width, double padding) noexcept { return find(width, padding); }

KaiserBessel::KaiserBessel(int width, double padding)
    : width_(width),
      padding_(padding),
      shape_(width * (find(width, padding) ? find(width, padding)->per_tap : 2)),
      at_zero_(bessel_i0(shape_)) {}

double KaiserBessel::operator()(double t) const noexcept {
    const double s = 2 * t / width_;
    return std::abs(s) <= 1 ? bessel_i0(shape_ * std::sqrt(1 - s * s)) / at_zero_ : 0;
}

double KaiserBessel::transform(double x) const noexcept {
    const double square = shape_ * shape_ - kPi * width_ * x * kPi * width_ * x;
    const double root = std::sqrt(std::abs(square));
    const double shape = root < 1e-6 ? 1 : (square > 0 ? std::sinh(root) : std::sin(root)) / root;
    return width_ / at_zero_ * shape;
}

double KaiserBessel::ghost(double x) const noexcept {
    double squares = 0;
    for (int m = 1; m <= 8; ++m)
        squares += std::pow(transform(x + m), 2) + std::pow(transform(x - m), 2);
    return std::sqrt(squares) / transform(x);
}

TapTable::TapTable(const KaiserBessel& window)
    : width(window.width()),
      taps((kFractions + 1) * kMostTaps),
      pairs((kFractions + 1) * 2 * kMostTaps) {
    for (int row = 0; row <= kFractions; ++row)
        for (int tap = 0; tap < width; ++tap) {
            const double fraction = static_cast<double>(row) / kFractions;
            const auto weight = static_cast<float>(window(fraction + width / 2 - 1 - tap));
            const int at = row * kMostTaps + tap;
            taps[at] = pairs[2 * at] = pairs[2 * at + 1] = weight;
        }
}

const TapTable& TapTable::of(const KaiserBessel& window) {
    static const std::vector<TapTable> tables = [] {
        std::vector<TapTable> all;
        for (const Shape& shape : kShapes)
            all.emplace_back(KaiserBessel(shape.width, shape.padding));
        return all;
    }();
    return tables[find(window.width(), window.padding()) - kShapes];
}

}  // namespace edgewise::kernels
