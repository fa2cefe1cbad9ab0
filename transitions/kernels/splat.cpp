#include "transitions/kernels/splat.hpp"

#include <algorithm>
#include <cmath>

namespace edgewise::kernels {
namespace {

/// Lanes of the widest vector, and rows of short ones in it: what a footprint is rounded up to.
constexpr std::int64_t kWidest = 16, kRowsOfOne = 4;

}  // namespace

double kernel_at(Face face, double x) noexcept {
    constexpr double kRounding = 1e-9;  // places at a face are inside
    const bool first = face == Face::first || face == Face::both;
    const bool last = face == Face::last || face == Face::both;
    if (first && x <= 0) return x >= -0.5 - kRounding ? 1 : 0;
    if (last && x >= 0) return x <= 0.5 + kRounding ? 1 : 0;
    return std::max(0.0, 1 - std::abs(x));
}

int Footprints::Shape::places(int side) const noexcept {
    const double reach = 1 + std::abs(slopes[static_cast<std::size_t>(side)]);
    return 2 * static_cast<int>(std::ceil(cells * reach)) + 1;
}

double Footprints::Shape::bytes() const noexcept {
    return 4.0 * (places(0) + 1) * (places(1) + 1) * numbers() + kSlack;
}

Footprints::Footprints(const Shape& shape, std::pmr::memory_resource* memory)
    : shape_(shape), memory_(memory), columns_(shape.places(0)), rows_(shape.places(1)) {}

const float* Footprints::of(const std::array<Face, 3>& faces) {
    const auto which =
        static_cast<std::size_t>(static_cast<int>(faces[0]) + 4 * static_cast<int>(faces[1]) +
                                 16 * static_cast<int>(faces[2]));
    std::call_once(made_[which], [&] {
        const auto floats = static_cast<std::size_t>(shape_.bytes()) / sizeof(float);
        auto table = std::make_unique<Block<float>>(floats, memory_);
        std::fill_n(table->data(), floats, 0.0f);
        make(faces, table->data());
        tables_[which] = std::move(table);
    });
    return tables_[which]->data();
}

/// The integral by the midpoint rule: a product of two kernels a section of the ray. Faces lie
/// between sections, and the rule adds up to 1 over slices as the kernels do.
void Footprints::make(const std::array<Face, 3>& faces, float* table) const {
    const auto kernel = [&](int axis, double x) {
        return kernel_at(faces[static_cast<std::size_t>(axis)], x);
    };
    Block<float> row(static_cast<std::size_t>(columns_), memory_);
    for (int s = 0; s < 2 * kSections; ++s) {
        const double t = (s + 0.5) / kSections - 1;
        const double weight = kernel(shape_.along, t) / kSections;
        const auto at = [&](int side, int place, int places) {
            const double x = static_cast<double>(place - places / 2) / shape_.cells;
            const auto i = static_cast<std::size_t>(side);
            return kernel(shape_.across[i], x + shape_.slopes[i] * t);
        };
        for (int i = 0; i < columns_; ++i)
            row[static_cast<std::size_t>(i)] = static_cast<float>(at(0, i, columns_));
        for (int j = 0; j < rows_; ++j) {
            const auto scale = static_cast<float>(weight * at(1, j, rows_));
            float* to = table + static_cast<std::ptrdiff_t>(j) * pitch() * shape_.numbers();
            if (shape_.depth == Depth::whole)
                add_section(row.data(), scale, to);
            else
                append_section(row.data(), scale, s, to);
        }
    }
}

void Footprints::add_section(const float* row, float scale, float* to) const {
    if (scale == 0) return;
    for (int i = 0; i < columns_; ++i) to[i] += scale * row[i];
}

void Footprints::append_section(const float* row, float scale, int section, float* to) const {
    const int numbers = shape_.numbers();
    for (int i = 0; i < columns_; ++i) {
        float* before = to + static_cast<std::ptrdiff_t>(i) * numbers + section;
        before[1] = before[0] + scale * row[i];
    }
}

std::int64_t SplatSums::pitch_of(const Splat& splat, std::int64_t width) noexcept {
    return 2 * splat.patch[0] + width + kWidest;
}
std::int64_t SplatSums::floats_of(const Splat& splat, std::int64_t width,
                                  std::int64_t height) noexcept {
    return pitch_of(splat, width) * (2 * splat.patch[1] + height + kRowsOfOne);
}
std::int64_t SplatSums::first_of(const Splat& splat, std::int64_t width) noexcept {
    return pitch_of(splat, width) * splat.patch[1] + splat.patch[0];
}

}  // namespace edgewise::kernels
