#include "charts/sweep_script.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <set>

#include "charts/axes.hpp"
#include "charts/courses.hpp"
#include "charts/families.hpp"
#include "charts/places.hpp"
#include "charts/words.hpp"

namespace edgewise::charts {
namespace {

constexpr int kWidth = 1100, kPanel = 380, kGap = 60, kTop = 50, kLine = 19;  // [pixel]
constexpr int kLeft = 110;                                                    // [pixel]
constexpr double kDigit = 8;                                                  // [pixel]
constexpr std::size_t kMostListed = 40, kMostTicks = 13;
constexpr double kEqual = 1.5;  // ends that are no farther apart share a text [pixel]

/// One of the two panels.
struct Panel {
    int top;  // [pixel]
    const char* label;
    int column;  // of the data
    LogAxis axis;
    std::optional<double> budget;
    std::string budget_text;
    double Peer::*peer;
    std::optional<double> Values::*value;

    double pixel(double of) const {
        return top + kPanel * std::log(axis.high / axis.place(of)) / std::log(axis.high / axis.low);
    }
};

/// The end of one line or of several that end together, and its text.
struct End {
    double at, value;  // what was swept; of the panel
    std::string text;
};

class Sweep {
 public:
    explicit Sweep(const Table& table)
        : table_(table), families_(families_of(table)), courses_(courses_of(table)) {
        for (const Point& point : table_.points)
            if (point.at) values_.insert(*point.at);
        if (values_.empty()) values_.insert(0);
        for (const Course& course : courses_) numbered_ += course.number > 0;
    }

    std::string script(Picture picture) {
        const Panel time = time_panel(), error = error_panel();
        right_ = room_for_ends({&time, &error});
        const auto listed = static_cast<int>(std::min(numbered_, kMostListed));
        height_ = error.top + kPanel + 70 + kLine * (listed + 3);
        std::string text = head_of(picture, kWidth, height_) + data();
        text += fmt::format("set multiplot title {} noenhanced\n",
                            quoted(shortened(table_.title, 120)));
        text += fmt::format("set lmargin at screen {:.4f}\nset rmargin at screen {:.4f}\n",
                            double(kLeft) / kWidth, right_ / kWidth);
        text += "unset key\n" + range() + drawn_panel(time, false);
        text += fmt::format(
            "set xlabel {} noenhanced\n"
            "set key at screen {:.4f},{:.4f} left top Left reverse samplen 4 noenhanced maxcols "
            "1\n",
            quoted(table_.swept), double(kLeft) / kWidth, screen_y(error.top + kPanel + 58));
        return text + drawn_panel(error, true) + "unset multiplot\n";
    }

 private:
    Panel time_panel() const {
        const auto& budget = table_.seconds_budget;
        return {kTop,
                "time",
                2,
                seconds_axis(table_),
                budget,
                budget ? "time budget " + seconds_text(*budget) : "",
                &Peer::seconds,
                &Values::seconds};
    }
    Panel error_panel() const {
        const auto& budget = table_.error_budget;
        return {kTop + kPanel + kGap,
                "error (NRMSE)",
                3,
                error_axis(table_),
                budget,
                budget ? "error budget " + plain_text(*budget) : "",
                &Peer::error,
                &Values::error};
    }

    double screen_y(double pixel) const { return 1 - pixel / height_; }
    double low() const { return *values_.begin() - beyond(); }
    double high() const { return *values_.rbegin() + beyond(); }
    double beyond() const {
        const double all = *values_.rbegin() - *values_.begin();
        return all > 0 ? 0.02 * all : 1;
    }

    /// Ticks at what was swept, so that threads have no halves.
    std::string range() const {
        std::string text = fmt::format("set xrange [{:.9g}:{:.9g}]\n", low(), high());
        if (values_.size() <= kMostTicks)
            text += fmt::format("set xtics ({:.9g})\n", fmt::join(values_, ", "));
        return text;
    }

    /// Value, seconds, error of every line; a path that could not serve a value has a gap there.
    std::string data() const {
        const LogAxis seconds = seconds_axis(table_), error = error_axis(table_);
        const auto row = [&](const Point& point) {
            const auto& values = point.measured;
            return fmt::format(
                "{:.9g} {:.9g} {}\n", *point.at, seconds.place(*values.seconds),
                values.error ? fmt::format("{:.9g}", error.place(*values.error)) : "NaN");
        };
        std::string text, chosen;
        for (std::size_t i = 0; i < courses_.size(); ++i) {
            text += fmt::format("$line{} << END\n", i);
            // An empty line breaks the course.
            auto value = values_.begin();
            for (const std::size_t place : courses_[i].points) {
                const Point& point = table_.points[place];
                const auto here = values_.find(*point.at);
                if (place != courses_[i].points.front() && here != value) text += "\n";
                text += row(point);
                value = std::next(here);
            }
            text += "END\n";
        }
        for (const Point& point : table_.points)
            if (point.chosen && point.measured.seconds && point.at) chosen += row(point);
        return chosen.empty() ? text : text + "$chosen << END\n" + chosen + "END\n";
    }

    /// Where the numbered lines end; lines that end together have one text.
    std::vector<End> ends_of(const Panel& panel) const {
        std::vector<End> ends;
        for (const Course& course : courses_) {
            if (course.number == 0) break;
            const Point& point = table_.points[course.points.back()];
            const auto& value = point.measured.*panel.value;
            if (!value) continue;
            const auto same = std::find_if(ends.begin(), ends.end(), [&](const End& end) {
                return end.at == *point.at &&
                       std::abs(panel.pixel(end.value) - panel.pixel(*value)) <= kEqual;
            });
            if (same == ends.end())
                ends.push_back({*point.at, *value, std::to_string(course.number)});
            else
                same->text += fmt::format(", {}", course.number);
        }
        return ends;
    }

    /// The right end of the panels, so that all texts beside them are on the picture.
    double room_for_ends(std::initializer_list<const Panel*> panels) const {
        std::size_t longest = 2;
        for (const Panel* panel : panels)
            for (const End& end : ends_of(*panel)) longest = std::max(longest, end.text.size());
        return std::max(kWidth - 40 - kDigit * double(longest), 0.6 * kWidth);
    }

    /// Numbers at the ends of lines: beside the panel, moved where they would lie on each other.
    std::string numbers(const Panel& panel) const {
        std::string text;
        std::vector<End> beside;
        for (const End& end : ends_of(panel)) {
            if (end.at == *values_.rbegin())
                beside.push_back(end);
            else
                text += fmt::format(
                    "set label '{}' at first {:.9g},{:.9g} left offset 0.8,0 font ',11' front\n",
                    end.text, end.at, panel.axis.place(end.value));
        }
        std::vector<double> pixels;
        for (const End& end : beside) pixels.push_back(panel.pixel(end.value));
        const std::vector<double> places = spread(pixels, 14, panel.top + 2, panel.top + kPanel);
        for (std::size_t i = 0; i < beside.size(); ++i)
            text += fmt::format(
                "set label '{}' at screen {:.5f},{:.5f} left font ',11'\n"
                "set arrow from first {:.9g},{:.9g} to screen {:.5f},{:.5f} nohead lc rgb "
                "'#999999' lw 0.5\n",
                beside[i].text, (right_ + 16) / kWidth, screen_y(places[i]), beside[i].at,
                panel.axis.place(beside[i].value), (right_ + 13) / kWidth, screen_y(places[i]));
        return text;
    }

    /// A line over all values; what lies beyond the axis is said at its edge.
    std::string across(const Panel& panel, double value, const std::string& name,
                       const char* colour) const {
        const bool above = value > panel.axis.high, below = value > 0 && value < panel.axis.low;
        std::string text;
        if (!above && !below)
            text = fmt::format(
                "set arrow from graph 0,first {0:.9g} to graph 1,first {0:.9g} nohead dt 2 lc rgb "
                "'{1}'\n",
                panel.axis.place(value), colour);
        return text + fmt::format(
                          "set label {} at graph 0.012,{} left offset 0,{} noenhanced tc rgb '{}' "
                          "font ',11' front\n",
                          quoted(above   ? "↑ " + name
                                 : below ? "↓ " + name
                                         : name),
                          above   ? "graph 1"
                          : below ? "graph 0"
                                  : fmt::format("first {:.9g}", panel.axis.place(value)),
                          above ? -0.6 : 0.6, colour);
    }

    std::string drawn_panel(const Panel& panel, bool with_key) const {
        std::vector<std::string> ticks;
        for (const Tick& tick : panel.axis.ticks)
            ticks.push_back(fmt::format("{} {:.9g}", quoted(tick.text), tick.at));
        std::string text = fmt::format(
            "set tmargin at screen {:.4f}\nset bmargin at screen {:.4f}\nset logscale y\n"
            "set yrange [{:.9g}:{:.9g}]\nset ytics ({}) nomirror\nset ylabel '{}, logarithmic'\n"
            "unset arrow\nunset label\n",
            screen_y(panel.top), screen_y(panel.top + kPanel), panel.axis.low, panel.axis.high,
            fmt::join(ticks, ", "), panel.label);
        if (panel.budget) text += across(panel, *panel.budget, panel.budget_text, "#b00000");
        for (const Peer& peer : table_.peers)
            text += across(panel, peer.*panel.peer, peer.name, "#444444");
        text += numbers(panel);
        return text +
               fmt::format("plot {}\n", fmt::join(plots(panel.column, with_key), ", \\\n     "));
    }

    std::vector<std::string> plots(int column, bool with_key) const {
        std::vector<std::string> plots;
        // The others lie behind; of the legend they are the last.
        for (std::size_t i = numbered_; i < courses_.size(); ++i)
            plots.push_back(line(i, column, false));
        const bool has_chosen = std::any_of(
            table_.points.begin(), table_.points.end(),
            [](const Point& point) { return point.chosen && point.measured.seconds && point.at; });
        if (has_chosen)
            plots.push_back(
                fmt::format("$chosen using 1:{} with points pt 6 ps 2 lw 1.5 lc rgb 'black'"
                            " title 'chosen by the planner'",
                            column));
        for (std::size_t i = 0; i < numbered_; ++i) plots.push_back(line(i, column, with_key));
        const std::size_t others = courses_.size() - numbered_;
        if (with_key && others > 0)
            plots.push_back(
                fmt::format("NaN with lines lw 0.7 lc rgb '#b4b4b4' title '{} other{}: never "
                            "chosen, on the front of "
                            "fewer than half of the values'",
                            others, others == 1 ? "" : "s"));
        if (plots.empty()) plots.push_back("NaN notitle");
        return plots;
    }

    /// Paths of one family share colour and shape; numbers and dashes tell them apart.
    std::string line(std::size_t i, int column, bool with_key) const {
        const Course& course = courses_[i];
        const auto family = static_cast<std::size_t>(
            std::find(families_.begin(), families_.end(), course.family) - families_.begin());
        const Style style = style_of(family);
        if (course.number == 0)
            return fmt::format(
                "$line{} using 1:{} with linespoints pt {} ps 0.35 lw 0.7 lc rgb '#b4b4b4' notitle",
                i, column, style.gnuplot + 1);
        const std::string title = with_key && i < kMostListed
                                      ? "title " + quoted(fmt::format("{}  {}", course.number,
                                                                      shortened(course.path, 120)))
                                      : "notitle";
        return fmt::format(
            "$line{} using 1:{} with linespoints pt {} ps 0.8 lw 1.3 dt {} lc rgb '{}' {}", i,
            column, style.gnuplot + 1, course.dash % 5 + 1, style.colour, title);
    }

    const Table& table_;
    std::vector<std::string> families_;
    std::vector<Course> courses_;
    std::set<double> values_;  // that were swept
    std::size_t numbered_ = 0;
    double right_ = kWidth;  // end of the panels [pixel]
    int height_ = 0;
};

}  // namespace

std::string sweep_script(const Table& table, Picture picture) {
    return Sweep(table).script(picture);
}

}  // namespace edgewise::charts
