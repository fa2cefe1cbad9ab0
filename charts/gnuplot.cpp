#include "charts/gnuplot.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "charts/axes.hpp"
#include "charts/families.hpp"
#include "charts/front.hpp"
#include "charts/front_numbers.hpp"
#include "charts/program.hpp"
#include "charts/sweep_script.hpp"
#include "charts/words.hpp"

namespace edgewise::charts {
namespace {

constexpr int kWidth = 1100, kPlotHeight = 640, kLine = 19, kMargin = 140;  // [pixel]
constexpr int kTop = 50, kLeft = 116, kRight = 1067;                        // of the frame [pixel]
constexpr std::size_t kMostListed = 24;                                     // of the front

/// All of a scatter plot's parts, in the order in which they lie on each other.
class Scatter {
 public:
    explicit Scatter(const Table& table)
        : table_(table),
          families_(families_of(table)),
          front_(front_of(table.points)),
          seconds_(seconds_axis(table)),
          error_(error_axis(table)) {}

    std::string script(Picture picture) {
        const std::size_t listed = std::min(front_.size(), kMostListed);
        const int rows = static_cast<int>(families_.size() + 4 + listed + (listed > 0));
        const int height = kPlotHeight + kMargin + kLine * rows;
        std::string text = head_of(picture, kWidth, height);
        // The plot keeps its height; legend and list have what is below.
        text += fmt::format("set tmargin at screen {:.4f}\nset bmargin at screen {:.4f}\n",
                            1 - double(kTop) / height, 1 - double(kTop + kPlotHeight) / height);
        text += fmt::format("set lmargin at screen {:.5f}\nset rmargin at screen {:.5f}\n",
                            double(kLeft) / kWidth, double(kRight) / kWidth);
        text += fmt::format("set title {} noenhanced\n", quoted(shortened(table_.title, 120)));
        text += axis_text("x", seconds_) + axis_text("y", error_);
        text += "set xlabel 'time, logarithmic'\nset ylabel 'error (NRMSE), logarithmic'\n";
        text += fmt::format(
            "set key at screen 0.105,{:.4f} left top Left reverse samplen 2 spacing 1 noenhanced "
            "maxcols 1\n",
            1 - double(kTop + kPlotHeight + 62) / height);
        if (listed > 0) text += list_of_front(listed, height);
        text += budgets() + numbers(height) + data();
        plot("NaN with points pt 7 lc rgb '#444444' title 'measured'");
        plot("NaN with points pt 6 lc rgb '#444444' title 'predicted, joined to measured'");
        add_points();
        add_front();
        add_peers();
        return text + "plot " + fmt::format("{}", fmt::join(plots_, ", \\\n     ")) + "\n";
    }

 private:
    void plot(const std::string& part) { plots_.push_back(part); }

    std::string axis_text(const char* name, const LogAxis& axis) const {
        std::vector<std::string> ticks;
        for (const Tick& tick : axis.ticks)
            ticks.push_back(fmt::format("{} {:.9g}", quoted(tick.text), tick.at));
        std::string text = fmt::format(
            "set logscale {0}\nset {0}range [{1:.9g}:{2:.9g}]\nset {0}tics ({3}) nomirror\n", name,
            axis.low, axis.high, fmt::join(ticks, ", "));
        // Between 0 and the other errors the axis is no longer a scale.
        if (axis.zero)
            text += fmt::format(
                "set arrow from graph 0,first {0:.9g} to graph 1,first {0:.9g} nohead lc rgb "
                "'#999999' dt 3\n",
                *axis.zero * 1.6);
        return text;
    }

    std::string list_of_front(std::size_t listed, int height) const {
        std::string text;
        const double foot = kTop + kPlotHeight + 72 + kLine * double(families_.size() + 4);
        const auto line = [&](std::size_t row, const std::string& words) {
            text += fmt::format("set label {} at screen 0.105,{:.4f} left noenhanced font ',11'\n",
                                quoted(words), 1 - (foot + kLine * double(row)) / height);
        };
        line(0, listed < front_.size()
                    ? fmt::format("the front, the first {} of {} paths:", listed, front_.size())
                    : "the front:");
        for (std::size_t i = 0; i < listed; ++i) {
            const Point& point = table_.points[front_[i]];
            line(i + 1, fmt::format("{}{}  {}, {}  {}", i + 1, point.chosen ? " (chosen)" : "",
                                    seconds_text(*point.measured.seconds),
                                    plain_text(*point.measured.error), shortened(point.path, 130)));
        }
        return text;
    }

    std::string budgets() const {
        std::string text;
        if (table_.seconds_budget)
            text += fmt::format(
                "set arrow from {0:.9g},graph 0 to {0:.9g},graph 1 nohead dt 2 lc rgb '#b00000'\n"
                "set label {1} at {0:.9g},graph 0.99 right rotate offset -1.9,0 tc rgb '#b00000'\n",
                *table_.seconds_budget, quoted("time " + seconds_text(*table_.seconds_budget)));
        if (table_.error_budget)
            text += fmt::format(
                "set arrow from graph 0,first {0:.9g} to graph 1,first {0:.9g} nohead dt 2 lc rgb "
                "'#b00000'\n"
                "set label {1} at graph 0.995,first {0:.9g} right offset 0,0.5 tc rgb '#b00000'\n",
                *table_.error_budget, quoted("error " + plain_text(*table_.error_budget)));
        return text;
    }

    /// The places in the list of the front, where nothing else is; joined to marks that are far.
    std::string numbers(int height) const {
        const Frame frame{kLeft, kTop, kRight, kTop + kPlotHeight, seconds_, error_};
        std::string text;
        const auto numbers = front_numbers(table_, front_, kMostListed, frame);
        for (std::size_t i = 0; i < numbers.size(); ++i) {
            const auto [spot, far] = numbers[i];
            const std::string place =
                fmt::format("screen {:.5f},{:.5f}", spot.x / kWidth, 1 - spot.y / height);
            text += fmt::format("set label '{}' at {} center font ',11' front\n", i + 1, place);
            if (far)
                text += fmt::format("set arrow from {} to {} nohead lw 0.6 lc rgb '#777777' back\n",
                                    first(table_.points[front_[i]].measured), place);
        }
        return text;
    }

    std::string first(const Values& values) const {
        return fmt::format("first {:.9g},{:.9g}", seconds_.place(*values.seconds),
                           error_.place(*values.error));
    }

    /// Blocks of x, y, and for lines their other end.
    std::string data() const {
        std::string text;
        for (std::size_t f = 0; f < families_.size(); ++f) {
            std::string measured, predicted, joined;
            for (const Point& point : table_.points) {
                if (point.family != families_[f]) continue;
                const std::string from = at(point.predicted), to = at(point.measured);
                if (!to.empty()) measured += to + "\n";
                if (!from.empty()) predicted += from + "\n";
                if (!from.empty() && !to.empty()) joined += from + "\n" + to + "\n\n";
            }
            text += block(fmt::format("measured{}", f), measured) +
                    block(fmt::format("predicted{}", f), predicted) +
                    block(fmt::format("joined{}", f), joined);
        }
        return text + front_data() + peer_data();
    }

    std::string front_data() const {
        std::string steps, chosen;
        for (std::size_t i = 0; i < front_.size(); ++i) {
            const Values& values = table_.points[front_[i]].measured;
            if (i == 0)
                steps +=
                    fmt::format("{:.9g} {:.9g}\n", seconds_.place(*values.seconds), error_.high);
            steps += at(values) + "\n";
            if (i + 1 == front_.size())
                steps += fmt::format("{:.9g} {:.9g}\n", seconds_.high, error_.place(*values.error));
        }
        for (const Point& point : table_.points)
            if (point.chosen && !at(point.measured).empty()) chosen += at(point.measured) + "\n";
        return block("front", steps) + block("chosen", chosen);
    }

    /// A peer near the right end has its name on the left.
    std::string peer_data() const {
        std::string peers, names_right, names_left;
        const double middle = std::sqrt(seconds_.low * seconds_.high);
        for (const Peer& peer : table_.peers) {
            const std::string row = fmt::format("{:.9g} {:.9g} {}\n", seconds_.place(peer.seconds),
                                                error_.place(peer.error), double_quoted(peer.name));
            peers += row;
            (peer.seconds > middle ? names_left : names_right) += row;
        }
        return block("peers", peers) + block("names_right", names_right) +
               block("names_left", names_left);
    }

    std::string at(const Values& values) const {
        if (!values.seconds || !values.error) return "";
        return fmt::format("{:.9g} {:.9g}", seconds_.place(*values.seconds),
                           error_.place(*values.error));
    }

    void add_points() {
        for (std::size_t f = 0; f < families_.size(); ++f)
            if (has(fmt::format("joined{}", f)))
                plot(fmt::format("$joined{} with lines lw 0.7 lc rgb '#bbbbbb' notitle", f));
        for (std::size_t f = 0; f < families_.size(); ++f) {
            const Style style = style_of(f);
            if (has(fmt::format("predicted{}", f)))
                plot(fmt::format("$predicted{} with points pt {} ps 0.8 lc rgb '{}' notitle", f,
                                 style.gnuplot, style.colour));
        }
        for (std::size_t f = 0; f < families_.size(); ++f) {
            const Style style = style_of(f);
            const std::string name = fmt::format("measured{}", f);
            plot(fmt::format("{} with points pt {} ps 1.3 lc rgb '{}' title {}",
                             has(name) ? "$" + name : "NaN", style.gnuplot + 1, style.colour,
                             quoted(shortened(families_[f], 110))));
        }
    }

    void add_front() {
        if (has("front"))
            plot("$front with steps lw 1.5 lc rgb '#333333' title 'front of what was measured'");
        if (has("chosen"))
            plot(
                "$chosen with points pt 6 ps 2.6 lw 2 lc rgb 'black' title 'chosen by the "
                "planner'");
    }

    void add_peers() {
        if (!has("peers")) return;
        plot("$peers using 1:2 with points pt 3 ps 1.5 lw 2 lc rgb 'black' notitle");
        const char* form = "${} using 1:2:3 with labels {} offset {},0.7 boxed noenhanced notitle";
        if (has("names_right")) plot(fmt::format(fmt::runtime(form), "names_right", "left", 0.8));
        if (has("names_left")) plot(fmt::format(fmt::runtime(form), "names_left", "right", -0.8));
    }

    std::string block(const std::string& name, const std::string& rows) const {
        if (!rows.empty()) blocks_.push_back(name);
        return rows.empty() ? "" : fmt::format("${} << END\n{}END\n", name, rows);
    }
    bool has(const std::string& name) const {
        return std::find(blocks_.begin(), blocks_.end(), name) != blocks_.end();
    }

    const Table& table_;
    std::vector<std::string> families_;
    std::vector<std::size_t> front_;
    LogAxis seconds_, error_;
    std::vector<std::string> plots_;
    mutable std::vector<std::string> blocks_;  // that hold something: gnuplot takes no empty ones
};

}  // namespace

std::string gnuplot_script(const Table& table, Picture picture) {
    return table.swept.empty() ? Scatter(table).script(picture) : sweep_script(table, picture);
}

std::string drawn(const Table& table, Picture picture, const std::string& gnuplot) {
    return output_of({gnuplot, "-"}, gnuplot_script(table, picture));
}

}  // namespace edgewise::charts
