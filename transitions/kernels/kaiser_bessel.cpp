#include "transitions/kernels/kaiser_bessel.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <mutex>
#include <numbers>
#include <optional>

namespace edgewise::kernels {
namespace {

constexpr double kPi = std::numbers::pi;

struct Shape {
    int width;
    double padding, per_tap;
    double mean_ghost, bound, amplified;
};
// b / width: least mean square of ghost(x) over |x| <= 1 / (2 padding); then what the header says
// of these windows. A test works all four out again.
constexpr Shape kShapes[] = {
    {2, 1, 0, 3.59e-1, 1.47, 1.18},          {2, 1.25, 1.59, 9.81e-2, 8.37e-1, 1.02},
    {2, 1.5, 1.83, 5.96e-2, 5.78e-1, 0.92},  {2, 2, 2.10, 3.51e-2, 3.21e-1, 0.86},
    {3, 1.25, 1.71, 1.95e-2, 2.10e-1, 1.18}, {3, 1.5, 1.95, 8.66e-3, 5.28e-2, 0.93},
    {3, 2, 2.23, 3.65e-3, 2.64e-2, 0.82},    {4, 1.25, 1.78, 4.25e-3, 6.35e-2, 1.45},
    {4, 1.5, 2.0, 1.34e-3, 1.41e-2, 1.00},   {4, 2, 2.28, 3.93e-4, 2.24e-3, 0.80},
    {5, 1.25, 1.82, 1.02e-3, 9.10e-3, 1.89}, {5, 1.5, 2.04, 2.06e-4, 2.33e-3, 1.09},
    {5, 2, 2.31, 4.18e-5, 3.15e-4, 0.80},    {6, 1.25, 1.84, 2.45e-4, 3.75e-3, 2.55},
    {6, 1.5, 2.06, 3.35e-5, 2.72e-4, 1.23},  {6, 2, 2.32, 4.47e-6, 3.88e-5, 0.81},
    {7, 1.25, 1.85, 5.97e-5, 7.56e-4, 3.58}, {7, 1.5, 2.06, 5.28e-6, 5.58e-5, 1.43},
    {7, 2, 2.33, 4.79e-7, 3.74e-6, 0.84},    {8, 1.25, 1.86, 1.47e-5, 1.97e-4, 5.09},
    {8, 1.5, 2.07, 8.55e-7, 9.87e-6, 1.67},  {8, 2, 2.33, 5.26e-8, 3.23e-7, 0.87}};

const Shape* find(int width, double padding) noexcept {
    for (const Shape& shape : kShapes)
        if (shape.width == width && shape.padding == padding) return &shape;
    return nullptr;
}
const Shape& shape_of(const KaiserBessel& window) noexcept {
    const Shape* found = find(window.width(), window.padding());
    return found ? *found : kShapes[0];
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
    if (shape_ == 0) return std::max(0., 1 - std::abs(s));
    return std::abs(s) <= 1 ? bessel_i0(shape_ * std::sqrt(1 - s * s)) / at_zero_ : 0;
}

double KaiserBessel::transform(double x) const noexcept {
    if (shape_ == 0) {
        const double sinc = x == 0 ? 1 : std::sin(kPi * x) / (kPi * x);
        return sinc * sinc;
    }
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

double KaiserBessel::mean_ghost() const noexcept { return shape_of(*this).mean_ghost; }
double KaiserBessel::bound() const noexcept { return shape_of(*this).bound; }
double KaiserBessel::amplified() const noexcept { return shape_of(*this).amplified; }

const std::vector<KaiserBessel>& known_windows() {
    static const std::vector<KaiserBessel> all = [] {
        std::vector<KaiserBessel> made;
        for (const Shape& shape : kShapes) made.emplace_back(shape.width, shape.padding);
        return made;
    }();
    return all;
}

TapTable::TapTable(const KaiserBessel& window)
    : width(window.width()),
      fractions(1 << tap_bits(width)),
      taps((fractions + 1) * kMostTaps),
      pairs((fractions + 1) * 2 * kMostTaps) {
    const double first = (width - 1) / 2 - (width % 2) * 0.5;  // whole samples, and a half
    for (int row = 0; row <= fractions; ++row)
        for (int tap = 0; tap < width; ++tap) {
            const double fraction = static_cast<double>(row) / fractions;
            const auto weight = static_cast<float>(window(fraction + first - tap));
            const int at = row * kMostTaps + tap;
            taps[at] = pairs[2 * at] = pairs[2 * at + 1] = weight;
        }
}

const TapTable& TapTable::of(const KaiserBessel& window) {
    // Each by itself: a path reads one of them.
    static std::array<std::once_flag, std::size(kShapes)> once;
    static std::array<std::optional<TapTable>, std::size(kShapes)> tables;
    const auto place = static_cast<std::size_t>(&shape_of(window) - kShapes);
    std::call_once(once[place], [&] { tables[place].emplace(window); });
    return *tables[place];
}

}  // namespace edgewise::kernels
