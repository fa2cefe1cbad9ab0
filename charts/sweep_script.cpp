#include "charts/sweep_script.hpp"

#include <algorithm>
#include <fmt/format.h>

#include "charts/axes.hpp"
#include "charts/families.hpp"
#include "charts/words.hpp"

namespace edgewise::charts {
namespace {

constexpr int kWidth = 1100, kPanel = 380, kGap = 60, kTop = 50, kLine = 19;  // [pixel]
constexpr std::size_t kMostListed = 40;

/// A path over the values at which it was measured.
struct Line {
    std::string path, family;
    std::vector<const Point*> points;
};

std::vector<Line> lines_of(const Table& table) {
    std::vector<Line> lines;
    for (const Point& point : table.points) {
        if (!point.measured.seconds) continue;
        auto line = std::find_if(lines.begin(), lines.end(),
                                 [&](const Line& other) { return other.path == point.path; });
        if (line == lines.end()) line = lines.insert(lines.end(), {point.path, point.family, {}});
        line->points.push_back(&point);
    }
    return lines;
}

class Sweep {
 public:
    explicit Sweep(const Table& table)
        : table_(table), families_(families_of(table)), lines_(lines_of(table)) {}

    std::string script(Picture picture) {
        const std::size_t listed = std::min(lines_.size(), kMostListed);
        height_ = kTop + 2 * kPanel + kGap + 70 + kLine * static_cast<int>(listed + 2);
        std::string text = head_of(picture, kWidth, height_) + data();
        text += fmt::format("set multiplot title {} noenhanced\n",
                            quoted(shortened(table_.title, 120)));
        text += "set lmargin at screen 0.1\nset rmargin at screen 0.97\nunset key\n" + range();
        text += panel(kTop, "time", "2", seconds_axis(table_), table_.seconds_budget, false);
        text += fmt::format(
            "set xlabel {} noenhanced\n"
            "set key at screen 0.1,{:.4f} left top Left reverse samplen 3 noenhanced maxcols 1\n",
            quoted(table_.swept), 1 - double(kTop + 2 * kPanel + kGap + 58) / height_);
        text += panel(kTop + kPanel + kGap, "error (NRMSE)", "3", error_axis(table_),
                      table_.error_budget, true);
        return text + "unset multiplot\n";
    }

 private:
    std::string range() const {
        double low = 0, high = 0;
        bool first = true;
        for (const Point& point : table_.points) {
            if (!point.at) continue;
            low = first ? *point.at : std::min(low, *point.at);
            high = first ? *point.at : std::max(high, *point.at);
            first = false;
        }
        const double room = high > low ? 0.02 * (high - low) : 1;
        return fmt::format("set xrange [{:.9g}:{:.9g}]\n", low - room, high + room);
    }

    /// Value, seconds, error of every line; a path that could not serve a value has a gap there.
    std::string data() const {
        const LogAxis seconds = seconds_axis(table_), error = error_axis(table_);
        std::string text;
        const auto row = [&](const Point& point) {
            const auto& values = point.measured;
            return fmt::format(
                "{:.9g} {:.9g} {}\n", *point.at, seconds.place(*values.seconds),
                values.error ? fmt::format("{:.9g}", error.place(*values.error)) : "NaN");
        };
        std::string chosen;
        for (std::size_t i = 0; i < lines_.size(); ++i) {
            text += fmt::format("$line{} << END\n", i);
            for (const Point* point : lines_[i].points) text += row(*point);
            text += "END\n";
        }
        for (const Point& point : table_.points)
            if (point.chosen && point.measured.seconds) chosen += row(point);
        return chosen.empty() ? text : text + "$chosen << END\n" + chosen + "END\n";
    }

    std::string panel(int top, const char* label, const char* column, const LogAxis& axis,
                      const std::optional<double>& budget, bool with_key) const {
        std::vector<std::string> ticks, plots;
        for (const Tick& tick : axis.ticks)
            ticks.push_back(fmt::format("{} {:.9g}", quoted(tick.text), tick.at));
        std::string text = fmt::format(
            "set tmargin at screen {:.4f}\nset bmargin at screen {:.4f}\nset logscale y\n"
            "set yrange [{:.9g}:{:.9g}]\nset ytics ({}) nomirror\nset ylabel '{}, logarithmic'\n",
            1 - double(top) / height_, 1 - double(top + kPanel) / height_, axis.low, axis.high,
            fmt::join(ticks, ", "), label);
        text += "unset arrow\n";
        if (budget)
            text += fmt::format(
                "set arrow from graph 0,first {0:.9g} to graph 1,first {0:.9g} nohead dt 2 lc rgb "
                "'#b00000'\n",
                *budget);
        const bool has_chosen =
            std::any_of(table_.points.begin(), table_.points.end(),
                        [](const Point& point) { return point.chosen && point.measured.seconds; });
        if (has_chosen)
            plots.push_back(
                fmt::format("$chosen using 1:{} with points pt 6 ps 2 lw 1.5 lc rgb 'black'"
                            " title 'chosen by the planner'",
                            column));
        for (std::size_t i = 0; i < lines_.size(); ++i) plots.push_back(line(i, column, with_key));
        if (plots.empty()) plots.push_back("NaN notitle");
        return text + "plot " + fmt::format("{}", fmt::join(plots, ", \\\n     ")) + "\n";
    }

    /// Paths of one family share colour and shape; dashes tell them apart.
    std::string line(std::size_t i, const char* column, bool with_key) const {
        const auto family = static_cast<std::size_t>(
            std::find(families_.begin(), families_.end(), lines_[i].family) - families_.begin());
        const auto earlier =
            std::count_if(lines_.begin(), lines_.begin() + static_cast<std::ptrdiff_t>(i),
                          [&](const Line& other) { return other.family == lines_[i].family; });
        const Style style = style_of(family);
        const std::string title = with_key && i < kMostListed
                                      ? "title " + quoted(shortened(lines_[i].path, 120))
                                      : "notitle";
        return fmt::format("$line{} using 1:{} with linespoints pt {} ps 0.7 dt {} lc rgb '{}' {}",
                           i, column, style.gnuplot + 1, earlier % 5 + 1, style.colour, title);
    }

    const Table& table_;
    std::vector<std::string> families_;
    std::vector<Line> lines_;
    int height_ = 0;
};

}  // namespace

std::string sweep_script(const Table& table, Picture picture) {
    return Sweep(table).script(picture);
}

}  // namespace edgewise::charts
