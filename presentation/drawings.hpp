#pragma once

#include <string>

#include "presentation/canvas.hpp"
#include "presentation/colormap.hpp"

namespace edgewise {

/// A length that one reads well, and what it is called.
struct ScaleBar {
    double pixels = 0;
    std::string text;  // "50 mm"
};
/// The longest of 1, 2 or 5 times a power of ten that is at most a quarter of the picture.
/// @param pixel  length of one along x [unit]
/// @param unit   "mm", "um" ...; "": none is known, pixels are counted where `pixel` is 1
ScaleBar scale_bar_of(int width, double pixel, const std::string& unit);

/// Draws one at the lower left: white with a dark rim, black with a bright one where the picture is
/// bright.
void draw_scale_bar(Canvas& canvas, const ScaleBar& bar);

/// What the colours of a picture stand for.
struct Legend {
    Colormap colours;
    double low = 0, high = 1;  // values of the first and the last colour; may fall
    std::string unit;          // of the values; "": not known
};
/// From the front of a scene to its end; in µm or nm where it is small.
Legend depth_legend(const Colormap& colours, double depth, const std::string& unit);
/// A strip of colours with their values, as high as a picture; black around.
Canvas legend_of(const Legend& legend, int height, int channels);

/// Values that one writes beside an axis: 1, 2 or 5 times a power of ten apart, at most `most`.
std::vector<double> ticks_between(double low, double high, int most);

}  // namespace edgewise
