#pragma once

#include <optional>

#include "engine/chart_pictures.hpp"
#include "request/tail.hpp"

namespace edgewise {

struct Shown;
class Listener;

/// Takes the pictures of a run while its results and the input's samples are in memory.
class ShownResult {
 public:
    /// @param shown  where they go; outlives it
    ShownResult(const Looked& looked, Shown& shown, Listener& messages);

    /// Takes the first frame as it is written: its values wait for compare().
    /// @param levels  that it is written with; another picture than one through a window has its
    /// own
    void take(const Data& result, const Shades& levels);
    /// The error map: the reference at the places of the picture. Without memory for it there is
    /// none. @throws Cancelled
    /// @param samples  of the input
    void compare(const Data& samples);

 private:
    charts::ReportPicture picture_of(const Data& result, const Shades& levels) const;
    /// @param range  that counts as an error of 1, where the job has one of its own
    void show_difference(const charts::Raster& reference, std::optional<double> range);
    std::string difference_text(const charts::Raster& reference,
                                std::optional<double> own_range) const;

    const Looked& looked_;
    Shown& shown_;
    Listener& messages_;
    PictureTaker large_, small_;
    charts::Raster taken_;  // small
};

/// Bytes of memory that the pictures need while a path runs, and that the reference and the page
/// need when it has ended.
double shown_bytes(const Looked& looked);
double showing_bytes(const Looked& looked);

}  // namespace edgewise
