#include "transitions/radon/hough_backward.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "transitions/radon/radon_edge.hpp"
#include "transitions/radon/votes.hpp"

namespace edgewise {
namespace {

/// Running counts of voters along rows, and along columns.
class RunningVotes {
 public:
    RunningVotes(const RadonRun& run, bool by_rows)
        : long_(by_rows ? run.lines.input.x : run.lines.input.y),
          count_(by_rows ? run.lines.input.y : run.lines.input.x),
          sums_(static_cast<std::size_t>((long_ + 1) * count_), run.context.memory) {
        for (std::int64_t i = 0; i < count_; ++i)
            sums_[static_cast<std::size_t>(i * (long_ + 1))] = 0;
        for (std::int64_t y = 0; y < run.lines.input.y; ++y)
            for (std::int64_t x = 0; x < run.lines.input.x; ++x) {
                const std::size_t at =
                    static_cast<std::size_t>(by_rows ? y * (long_ + 1) + x : x * (long_ + 1) + y);
                sums_[at + 1] = sums_[at] + votes(run.plane.row(y)[x], run.setting);
            }
    }

    /// Voters before sample i of a row.
    const std::int32_t* row(std::int64_t j) noexcept { return sums_.data() + j * (long_ + 1); }

 private:
    std::int64_t long_, count_;
    kernels::Block<std::int32_t> sums_;
};

/// Rows or columns at an angle: offsets change with each sample by `along`, with each row by
/// `across`, and |along| <= |across|.
struct VotingRows {
    VoteRule rule;
    bool by_rows;
    std::int64_t length, count;
    double along, across;
    double per_line;  // samples of a row from one line to the next

    VotingRows(const RadonLines& lines, int k)
        : rule(lines, k), by_rows(std::abs(rule.across()) <= std::abs(rule.down())) {
        length = by_rows ? lines.input.x : lines.input.y;
        count = by_rows ? lines.input.y : lines.input.x;
        along = by_rows ? rule.across() : rule.down();
        across = by_rows ? rule.down() : rule.across();
        per_line = along != 0 ? 1 / along : 0;
    }

    double place(std::int64_t i, std::int64_t j) const noexcept {
        return by_rows ? rule.place(i, j) : rule.place(j, i);
    }
    /// Samples of row j with a line below m, or where lines fall along the row, not below m. They
    /// are the first ones.
    std::int64_t before(std::int64_t m, std::int64_t j) const noexcept {
        const auto is_before = [&](std::int64_t i) {
            return (static_cast<std::int64_t>(place(i, j)) < m) == (along >= 0);
        };
        // From a guess to the sample at which the rule itself changes.
        const double guess = (static_cast<double>(m) - place(0, j)) * per_line;
        auto i = static_cast<std::int64_t>(std::clamp(guess, 0.0, static_cast<double>(length)));
        while (i > 0 && !is_before(i - 1)) --i;
        while (i < length && is_before(i)) ++i;
        return i;
    }
    /// Rows that line m may meet, with one more at either end.
    std::array<std::int64_t, 2> met(std::int64_t m) const noexcept {
        const double ends[] = {place(0, 0), place(length - 1, 0)};
        const double p = (static_cast<double>(m) - std::max(ends[0], ends[1])) / across;
        const double q = (static_cast<double>(m + 1) - std::min(ends[0], ends[1])) / across;
        const auto within = [&](double at) {
            return static_cast<std::int64_t>(std::clamp(at, 0.0, static_cast<double>(count)));
        };
        return {within(std::min(p, q) - 1), within(std::max(p, q) + 2)};
    }
};

std::int32_t votes_for(std::int64_t m, const VotingRows& rows, RunningVotes& running) {
    std::int32_t sum = 0;
    const auto [begin, end] = rows.met(m);
    for (std::int64_t j = begin; j < end; ++j) {
        const std::int32_t* before = running.row(j);
        const std::int32_t to_next = before[rows.before(m + 1, j)];
        const std::int32_t to_this = before[rows.before(m, j)];
        sum += rows.along >= 0 ? to_next - to_this : to_this - to_next;
    }
    return sum;
}

}  // namespace

Transition hough_backward() {
    return radon_edge({
        .name = "hough.backward",
        .source = "[W93] FIGURE 10; Crow 1984",
        .to = RadonSetting::To::hough,
        .work = [](const RadonAsk& ask) -> Work {
            // Mean of min(|cos|, |sin|), operations of both ends, and of running counts.
            constexpr double kMet = 0.37, kEnds = 75, kSum = 4, kAlone = 8;
            const Extent n = ask.lines.input;
            const double all = static_cast<double>(n.samples());
            const double rows = 0.5 * static_cast<double>((n.x + n.y) * n.z) * ask.lines.angles;
            return {
                .operations = kAlone * (kEnds * (kMet * ask.visits() + 3 * rows) + kSum * all),
                .scratch = 64,
                .workspace = 2 * sizeof(std::int32_t) * static_cast<double>((n.x + 1) * (n.y + 1))};
        },
        .error = [](const RadonAsk&) -> Error { return {}; },
        .run =
            [](const RadonRun& run) {
                RunningVotes rows(run, true), columns(run, false);
                for_each_angle(run, [&](int k) {
                    const VotingRows at(run.lines, k);
                    for (std::int64_t m = 0; m < run.lines.offsets; ++m)
                        run.row(k)[m] =
                            static_cast<float>(votes_for(m, at, at.by_rows ? rows : columns));
                });
            },
        .trials = [] { return line_trials(RadonSetting::To::hough); },
    });
}

}  // namespace edgewise
