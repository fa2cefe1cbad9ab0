#include "presentation/drawings.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <iterator>
#include <optional>

namespace edgewise {
namespace {

constexpr Canvas::Colour kWhite{255, 255, 255}, kBlack{0, 0, 0};

/// The largest of 1, 2 and 5 times a power of ten that is at most a length.
double round_down(double length) {
    const double ten = std::pow(10, std::floor(std::log10(length) + 1e-12));
    for (const double step : {5.0, 2.0})
        if (step * ten <= length * (1 + 1e-12)) return step * ten;
    return ten;
}

/// Whether a part of a picture is nearer to white than to black. What is transparent counts as
/// black.
bool is_bright(Canvas& canvas, int x, int y, int wide, int high) {
    const int colours = canvas.channels < 3 ? 1 : 3;
    const int right = std::min(x + wide, canvas.width), bottom = std::min(y + high, canvas.height);
    double sum = 0, count = 0;
    for (int row = std::max(y, 0); row < bottom; ++row)
        for (int column = std::max(x, 0); column < right; ++column, ++count)
            for (int c = 0; c < colours; ++c) sum += canvas.at(column, row)[c];
    return sum > 127.5 * colours * count;
}

/// Of a capital letter [pixel].
double letters_for(int side) { return std::clamp(side / 40.0, 8.0, 60.0); }

struct Unit {
    const char* name;
    double millimetres;
};
constexpr Unit kUnits[] = {{"m", 1e3}, {"cm", 10}, {"mm", 1}, {"µm", 1e-3}, {"nm", 1e-6}};

struct Length {
    double value;
    std::string unit;
};
/// In mm, µm or nm, the largest of which the length has one at least.
std::optional<Length> readable(double length, const std::string& unit) {
    const std::string known = unit == "um" ? "µm" : unit;
    const Unit* found = std::find_if(std::begin(kUnits), std::end(kUnits),
                                     [&](const Unit& each) { return known == each.name; });
    if (found == std::end(kUnits)) return std::nullopt;
    const double millimetres = length * found->millimetres;
    const Unit* read = std::begin(kUnits) + 2;
    while (read + 1 != std::end(kUnits) && millimetres < read->millimetres * (1 - 1e-9)) ++read;
    return Length{millimetres / read->millimetres, read->name};
}

}  // namespace

ScaleBar scale_bar_of(int width, double pixel, const std::string& unit) {
    const double length = round_down(width * pixel / 4);
    ScaleBar bar{length / pixel, {}};
    if (const std::optional<Length> read = readable(length, unit)) {
        bar.text = fmt::format("{:.6g} {}", read->value, read->unit);
        return bar;
    }
    bar.text = fmt::format("{:.12g} {}", length,
                           !unit.empty() ? unit
                           : pixel == 1  ? "px"
                                         : "")
                   .substr(0, 40);
    return bar;
}

Legend depth_legend(const Colormap& colours, double depth, const std::string& unit) {
    const std::optional<Length> read = readable(depth, unit);
    return {colours, 0, read ? read->value : depth, read ? read->unit : unit};
}

void draw_scale_bar(Canvas& canvas, const ScaleBar& bar) {
    const double letters = letters_for(std::min(canvas.width, canvas.height));
    const int margin = static_cast<int>(std::lround(letters)), rim = 1;
    const int thick = std::max(2, static_cast<int>(std::lround(letters / 3)));
    const int left = margin, bottom = canvas.height - margin;
    const int length = std::max(1, static_cast<int>(std::lround(bar.pixels)));
    const TextSize size = text_size(bar.text, letters);
    const int x = std::max(left, left + (length - size.width) / 2);
    const int y = bottom - thick - static_cast<int>(std::lround(letters / 2));
    const bool bright = is_bright(canvas, left, y - size.above, std::max(length, size.width),
                                  bottom - y + size.above);
    const Canvas::Colour& ink = bright ? kBlack : kWhite;
    const Canvas::Colour& edge = bright ? kWhite : kBlack;
    canvas.fill(left - rim, bottom - thick - rim, length + 2 * rim, thick + 2 * rim, edge);
    canvas.fill(left, bottom - thick, length, thick, ink);
    // A rim around letters: the same in the other colour, moved each way.
    for (int dy = -rim; dy <= rim; ++dy)
        for (int dx = -rim; dx <= rim; ++dx)
            draw_text(canvas, x + dx, y + dy, bar.text, letters, edge);
    draw_text(canvas, x, y, bar.text, letters, ink);
}

std::vector<double> ticks_between(double low, double high, int most) {
    if (low > high) std::swap(low, high);
    if (!(high > low)) return {low};
    double step = round_down((high - low) / most);
    while ((std::floor(high / step) - std::ceil(low / step)) + 1 > most)
        step = round_down(step * 2.5);
    std::vector<double> ticks;
    for (double k = std::ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k)
        ticks.push_back(k * step + 0.0);
    return ticks;
}

Canvas legend_of(const Legend& legend, int height, int channels) {
    const double letters = letters_for(height);
    const int line = static_cast<int>(std::lround(2.2 * letters));
    const int margin = static_cast<int>(std::lround(letters));
    const int wide = static_cast<int>(std::lround(1.5 * letters));
    const int top = line, bottom = std::max(top + 2, height - margin);
    const int most = std::clamp((bottom - top) / (2 * line), 2, 8);
    std::vector<std::pair<double, std::string>> labels;
    int widest = 0;
    for (const double value : ticks_between(legend.low, legend.high, most)) {
        labels.emplace_back(value, fmt::format("{:.6g}", value));
        widest = std::max(widest, text_size(labels.back().second, letters).width);
    }
    const std::string& unit = legend.unit;
    if (!unit.empty()) widest = std::max(widest, text_size(unit, letters).width - margin);
    Canvas canvas(3 * margin + wide + widest, height, channels);
    canvas.fill(0, 0, canvas.width, canvas.height, kBlack);
    const int left = margin;
    for (int y = top; y < bottom; ++y) {
        const double share = bottom - top > 1 ? double(bottom - 1 - y) / (bottom - 1 - top) : 0;
        canvas.fill(left, y, wide, 1, legend.colours.bytes_at(share));
    }
    const double range = legend.high - legend.low;
    for (const auto& [value, text] : labels) {
        const double share = range != 0 ? (value - legend.low) / range : 0.5;
        const int y = bottom - 1 - static_cast<int>(std::lround(share * (bottom - 1 - top)));
        canvas.fill(left + wide, y, margin / 2, 1, kWhite);
        draw_text(canvas, left + wide + margin, y + static_cast<int>(std::lround(letters / 2)),
                  text, letters, kWhite);
    }
    if (!unit.empty()) draw_text(canvas, left, top - margin / 2, unit, letters, kWhite);
    return canvas;
}

}  // namespace edgewise
