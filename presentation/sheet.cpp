#include "presentation/sheet.hpp"

#include <fmt/format.h>

#include "graph/errors.hpp"

namespace edgewise {
namespace {

constexpr int kGap = 2;  // pixels between pictures of a montage

int columns_of(const LookSpec& look) { return (*look.montage)[0]; }
int rows_of_sheet(const LookSpec& look) { return (*look.montage)[1]; }

}  // namespace

Sheet::Sheet(const LookSpec& look, const store::Header& picture, int count)
    : look_(look), picture_(picture), count_(count) {
    if (!look_.montage) return;
    const Extent sheet = sheet_extent(look_, picture.extent);
    constexpr std::int64_t kMostSide = 65535;
    if (sheet.x > kMostSide || sheet.y > kMostSide)
        throw RequestError(
            message("@montage({}x{}): would be {}x{} pixels; at most {} a side: give the pictures "
                    "a smaller @size",
                    columns_of(look_), rows_of_sheet(look_), sheet.x, sheet.y, kMostSide));
    montage_.emplace(static_cast<int>(sheet.x), static_cast<int>(sheet.y), picture.channels);
}

void Sheet::explain(const Legend& legend) { legend_ = legend; }

void Sheet::surround(const std::vector<std::uint8_t>& pixel) {
    if (montage_ && added_ == 0) montage_->fill(pixel);
}

Canvas Sheet::picture_of(const void* samples) const {
    Canvas canvas(static_cast<int>(picture_.extent.x), static_cast<int>(picture_.extent.y),
                  picture_.channels);
    const auto* bytes = static_cast<const std::uint8_t*>(samples);
    canvas.samples.assign(bytes, bytes + canvas.samples.size());
    if (look_.scale_bar)
        draw_scale_bar(canvas, scale_bar_of(canvas.width, picture_.spacing[0], picture_.unit));
    return canvas;
}

bool Sheet::add(int number, const void* samples) {
    Canvas picture = picture_of(samples);
    if (!montage_) {
        finish(std::move(picture));
        return true;
    }
    const int columns = columns_of(look_);
    montage_->put((number % columns) * (picture.width + kGap),
                  (number / columns) * (picture.height + kGap), picture.width, picture.height,
                  picture.samples);
    if (++added_ < count_) return false;
    finish(std::move(*montage_));
    montage_.reset();
    return true;
}

void Sheet::finish(Canvas sheet) {
    if (legend_) {
        const Canvas legend = legend_of(*legend_, sheet.height, sheet.channels);
        Canvas both(sheet.width + legend.width, sheet.height, sheet.channels);
        both.put(0, 0, sheet.width, sheet.height, sheet.samples);
        both.put(sheet.width, 0, legend.width, legend.height, legend.samples);
        sheet = std::move(both);
    }
    header_ = picture_;
    header_.extent = {sheet.width, sheet.height, 1};
    whole_ = std::move(sheet);
}

Extent sheet_extent(const LookSpec& look, const Extent& picture) {
    if (!look.montage) return picture;
    // Sides and counts are far below where this could overflow.
    return {columns_of(look) * (picture.x + kGap) - kGap,
            rows_of_sheet(look) * (picture.y + kGap) - kGap, 1};
}

int sheets_of(const LookSpec& look, int pictures) {
    if (!look.montage) return pictures;
    const int room = columns_of(look) * rows_of_sheet(look);
    if (pictures > room)
        throw RequestError(message("@montage({}x{}): {} pictures do not fit; {} do",
                                   columns_of(look), rows_of_sheet(look), pictures, room));
    return 1;
}

}  // namespace edgewise
