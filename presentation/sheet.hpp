#pragma once

#include <cstddef>
#include <optional>

#include "io/store.hpp"
#include "presentation/canvas.hpp"
#include "presentation/drawings.hpp"
#include "request/look_spec.hpp"

namespace edgewise {

/// Pictures as they are written: with a scale bar in each, side by side in a montage, beside a
/// legend.
class Sheet {
 public:
    /// @param picture  what one picture is: 8 bits
    /// @param count    pictures of a montage
    Sheet(const LookSpec& look, const store::Header& picture, int count);

    /// Colours and values of the pictures; before the first of them.
    void explain(const Legend& legend);
    /// What is between the pictures of a montage, and where there is none: a pixel; before the
    /// first of them. Else it is black.
    void surround(const std::vector<std::uint8_t>& pixel);
    /// @param number   of a montage its place, from 0
    /// @return whether there is a sheet to be written
    bool add(int number, const void* samples);
    /// Of what add() has made.
    const store::Header& header() const noexcept { return header_; }
    const std::uint8_t* samples() const noexcept { return whole_->samples.data(); }

 private:
    Canvas picture_of(const void* samples) const;
    /// The sheet with the legend at its right, and its header.
    void finish(Canvas sheet);

    const LookSpec look_;
    const store::Header picture_;
    const int count_;
    int added_ = 0;
    std::optional<Legend> legend_;
    std::optional<Canvas> montage_, whole_;
    store::Header header_;
};

/// How large a file is of pictures of one size, without its legend.
Extent sheet_extent(const LookSpec& look, const Extent& picture);

/// How many files a number of pictures makes.
int sheets_of(const LookSpec& look, int pictures);

}  // namespace edgewise
