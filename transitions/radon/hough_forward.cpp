#include "transitions/radon/hough_forward.hpp"

#include <algorithm>

#include "transitions/radon/radon_edge.hpp"
#include "transitions/radon/votes.hpp"

namespace edgewise {
namespace {

constexpr Fact kVoters{"hough/voters"};

struct Voter {
    std::int32_t x, y;
};

std::int64_t voters_of(const RadonPlane& plane, const Extent& n, const RadonSetting& setting) {
    std::int64_t count = 0;
    for (std::int64_t y = 0; y < n.y; ++y)
        count += std::count_if(plane.row(y), plane.row(y) + n.x,
                               [&](float sample) { return votes(sample, setting); });
    return count;
}

/// How many samples vote.
void count_voters(const Data& input, const RadonSetting& setting,
                  std::map<std::string, double>& facts) {
    if (!input.samples.data() || input.what.channels != 1 || input.what.type == Type::c64) return;
    double voters = 0;
    const Extent n = input.what.extent;
    for (std::int64_t slice = 0; slice < n.z; ++slice) {
        const RadonPlane plane(input, slice, std::pmr::new_delete_resource());
        voters += static_cast<double>(voters_of(plane, n, setting));
    }
    facts[kVoters] = voters;
}

}  // namespace

Transition hough_forward() {
    return radon_edge({
        .name = "hough.forward",
        .source = "Duda and Hart 1972; [W93] 2.4",
        .to = RadonSetting::To::hough,
        .work = [](const RadonAsk& ask) -> Work {
            constexpr double kVote = 7, kLooked = 3, kAlone = 8, kShare = 0.5;
            const double all = static_cast<double>(ask.lines.input.samples());
            const double voters = ask.scene.fact(kVoters).value_or(kShare * all);
            const double most =  // of one slice
                std::min(voters, all / static_cast<double>(ask.lines.input.z));
            return {.operations = kAlone * (kVote * ask.lines.angles * voters + kLooked * all),
                    .scratch = static_cast<double>(ask.lines.offsets) * sizeof(std::int32_t),
                    .workspace = most * sizeof(Voter)};
        },
        .error = [](const RadonAsk&) -> Error { return {}; },
        .count = count_voters,
        .run =
            [](const RadonRun& run) {
                const Extent in = run.lines.input;
                const auto n = static_cast<std::size_t>(run.lines.offsets);
                const auto count = static_cast<std::size_t>(
                    std::max<std::int64_t>(1, voters_of(run.plane, in, run.setting)));
                kernels::Block<Voter> voters(count, run.context.memory);
                Voter* next = voters.data();
                for (std::int64_t y = 0; y < in.y; ++y)
                    for (std::int64_t x = 0; x < in.x; ++x)
                        if (votes(run.plane.row(y)[x], run.setting))
                            *next++ = {static_cast<std::int32_t>(x), static_cast<std::int32_t>(y)};
                for_each_angle(run, [&](int k) {
                    const VoteRule rule(run.lines, k);
                    kernels::Block<std::int32_t> counts(n, run.context.memory);
                    std::fill_n(counts.data(), n, 0);
                    for (const Voter* voter = voters.data(); voter < next; ++voter)
                        ++counts[static_cast<std::size_t>(rule.line(voter->x, voter->y))];
                    std::copy_n(counts.data(), n, run.row(k));
                });
            },
        .trials = [] { return line_trials(RadonSetting::To::hough); },
        .factors = {{"", 1.3}},
    });
}

}  // namespace edgewise
