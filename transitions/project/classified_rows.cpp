#include "transitions/project/classified_rows.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numeric>
#include <tbb/parallel_for.h>

#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/scalar_load.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/splat_view.hpp"

namespace edgewise {
namespace {

using kernels::ClassifiedVoxel;

/// Whether samples of the commonest value are not seen.
bool commonest_is_clear(const Ask& ask) {
    return !ask.want.mode->takes_transfer || !(ask.want.transfer.at(ask.scene.commonest)[3] > 0);
}

std::ptrdiff_t up_to_16(std::ptrdiff_t n) { return (n + 15) / 16 * 16; }

constexpr std::ptrdiff_t kTilePlane = SheetTile::kWidth * SheetTile::kHeight + 16;

}  // namespace

std::array<int, 3> axes_by_slices(int along) noexcept {
    return {along == 0 ? 1 : 0, along == 2 ? 1 : 2, along};
}

/// Calls use(row, voxel) for the voxels of slice z along the third axis, in the order of memory.
template <class Use>
void ClassifiedRows::each_seen(std::int64_t z, const Use& use) const {
    const Extent& n = in_.what.extent;
    const kernels::Grid grid = kernels::grid_of(in_);
    const kernels::ScalarLoad load = kernels::scalar_load(in_.what.type);
    const double per_weight = length_ * want_.unit / want_.transfer.unit;
    const auto [along, from_row, from_slice] = axes_;
    float last = std::numeric_limits<float>::quiet_NaN();  // differs from all
    ClassifiedVoxel voxel{};
    for (std::int64_t y = 0; y < n.y; ++y)
        for (std::int64_t x = 0; x < n.x; ++x) {
            const float stored =
                load(grid.samples, z * grid.slice_step() + y * grid.row_step() + x);
            if (!std::isfinite(stored)) continue;
            if (stored != last) {
                last = stored;
                const std::array<double, 4> optics =
                    want_.transfer.at(in_.what.values(static_cast<double>(stored)));
                const double depth = -std::log1p(-std::clamp(optics[3], 0.0, 1.0)) * per_weight;
                voxel.depth = static_cast<float>(std::min(depth, ClassifiedVoxel::kOpaque));
                for (std::size_t c = 0; c < 3; ++c) voxel.color[c] = static_cast<float>(optics[c]);
            }
            if (!(voxel.depth > 0)) continue;
            const std::array<std::int64_t, 3> at{x, y, z};
            const auto of = [&](int axis) { return at[static_cast<std::size_t>(axis)]; };
            voxel.place = static_cast<std::int32_t>(of(along));
            use(of(from_slice) * n[from_row] + of(from_row), voxel);
        }
}

ClassifiedRows::ClassifiedRows(const Data& in, const Request& want, int along, double length,
                               const Context& context)
    : in_(in),
      want_(want),
      axes_(axes_by_slices(along)),
      length_(length),
      begins_(static_cast<std::size_t>(in.what.extent[axes_[1]] * in.what.extent[axes_[2]] + 2),
              context.memory) {
    const Extent& n = in.what.extent;
    const std::int64_t rows = n[axes_[1]] * n[axes_[2]];
    // Slices along z share no row: x is never the axis from row to row.
    const auto each = [&](const auto& use) {
        tbb::parallel_for(std::int64_t{0}, n.z, [&](std::int64_t z) {
            if (!context.stopped()) each_seen(z, use);
        });
        context.poll();
    };
    std::int64_t* begins = begins_.data();
    std::fill_n(begins, rows + 2, 0);
    each([&](std::int64_t row, const ClassifiedVoxel&) { ++begins[row + 2]; });
    std::partial_sum(begins, begins + rows + 2, begins);
    voxels_.emplace(static_cast<std::size_t>(std::max<std::int64_t>(1, begins[rows + 1])),
                    context.memory);
    // A row's end is where it has got to, and then where the next one begins.
    ClassifiedVoxel* voxels = voxels_->data();
    each(
        [&](std::int64_t row, const ClassifiedVoxel& voxel) { voxels[begins[row + 1]++] = voxel; });
}

kernels::ClassifiedRows ClassifiedRows::rows() noexcept {
    kernels::ClassifiedRows rows;
    rows.extent = in_.what.extent;
    rows.axes = axes_;
    rows.begins = begins_.data();
    rows.voxels = voxels_->data();
    return rows;
}

double ClassifiedRows::bytes(const Representation& from, const Ask& ask) noexcept {
    const Extent& n = from.extent;
    const auto rows = static_cast<double>(std::max({n.x * n.y, n.x * n.z, n.y * n.z}));
    return 8 * (rows + 2) +
           static_cast<double>(sizeof(ClassifiedVoxel)) * std::max(1.0, voxels_seen(from, ask));
}

double ClassifiedRows::operations(const Representation& from, const Ask& ask) noexcept {
    const auto points = static_cast<double>(ask.want.transfer.points.size());
    // Twice: to count them, and to write them down.
    return 2 *
           (8 * static_cast<double>(from.samples()) + (60 + 4 * points) * voxels_seen(from, ask));
}

double voxels_seen(const Representation& from, const Ask& ask) noexcept {
    return commonest_is_clear(ask) ? samples_splatted(from, ask)
                                   : static_cast<double>(from.samples());
}

std::string no_classified_splats(const Ask& ask) {
    const Request& want = ask.want;
    if (!want.mode->takes_transfer)
        return "only what has a transfer function is composited in order";
    if (std::string reason = no_slices(want); !reason.empty()) return reason;
    if (want.field == Field::nearest) return "labels: footprints that overlap would mix them";
    if (ask.scene.non_finite > 0)
        return fmt::format("{} samples are not finite, and have no colour", ask.scene.non_finite);
    return {};
}

SheetTile::SheetTile(const Region& tile, const Layout& layout, std::pmr::memory_resource* memory)
    : tile_(tile),
      plane_(up_to_16(layout.floats)),
      memory_(static_cast<std::size_t>(bytes(layout)), memory),
      first_(static_cast<float*>(memory_.data())),
      lengths_(first_ + kPlanes * plane_) {
    std::fill_n(first_, kPlanes * plane_, 0.0f);
    std::fill_n(lengths_, kTilePlane, 1.0f);
    sheet_ = {.begin = {tile.begin[0], tile.begin[1]},
              .end = {tile.end[0], tile.end[1]},
              .first = first_ + layout.first,
              .pitch = layout.pitch};
    pixels_ = {lengths_ + kTilePlane, kWidth, kTilePlane};
    std::fill_n(pixels_.first, kTilePlane, 1.0f);
    std::fill_n(pixels_.first + kTilePlane, 3 * kTilePlane, 0.0f);
}

double SheetTile::bytes(const Layout& layout) noexcept {
    return 4.0 * static_cast<double>(kPlanes * up_to_16(layout.floats) + 5 * kTilePlane);
}

bool SheetTile::composite() noexcept {
    const bool any = kernels::composite_sheet(sheet_, plane_, lengths_, pixels_,
                                              static_cast<float>(kTerminated));
    std::fill_n(first_, kPlanes * plane_, 0.0f);
    return any;
}

void SheetTile::finish(Data& out) const noexcept {
    for (std::int64_t y = tile_.begin[1]; y < tile_.end[1]; ++y)
        for (std::int64_t x = tile_.begin[0]; x < tile_.end[0]; ++x) {
            const float* pixel = pixels_.first + (y - tile_.begin[1]) * kWidth + x - tile_.begin[0];
            float* to = out.at<float>(x, y, 0);
            for (std::ptrdiff_t c = 0; c < 3; ++c) to[c] = pixel[(c + 1) * kTilePlane];
            to[3] = 1 - *pixel;
        }
}

}  // namespace edgewise
