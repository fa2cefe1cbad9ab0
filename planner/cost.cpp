#include "planner/cost.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <tuple>
#include <vector>

namespace edgewise {
namespace {

constexpr int kViewsAsked = 8;  // of a long turntable; the mean stands for all

/// Views that an edge works on by one variant of its kernel.
struct Share {
    Work mean;
    int views = 0;
};

void add(Share& share, const Work& work, int views) {
    const double before = static_cast<double>(share.views) / (share.views + views);
    const double now = static_cast<double>(views) / (share.views + views);
    Work& mean = share.mean;
    const auto average = [&](double& of, double with) { of = before * of + now * with; };
    const auto most = [](double& of, double with) { of = std::max(of, with); };
    for (double Work::*count : {&Work::operations, &Work::masked, &Work::streamed, &Work::gathers})
        average(mean.*count, work.*count);
    for (double Traffic::*count : {&Traffic::local, &Traffic::global, &Traffic::congested,
                                   &Traffic::messages, &Traffic::sent})
        average(mean.traffic.*count, work.traffic.*count);
    for (Lines Work::*lines : {&Work::lines, &Work::other_lines}) {
        average((mean.*lines).count, (work.*lines).count);
        most((mean.*lines).span, (work.*lines).span);
    }
    for (double Work::*bytes : {&Work::swept, &Work::scratch, &Work::workspace})
        most(mean.*bytes, work.*bytes);
    // Views that go by different variants: the first one's word.
    if (share.views == 0) mean.variant = work.variant;
    share.views += views;
}

/// The work of the views that are asked, by variant, since counts do not show how these differ.
std::vector<Share> shares_of(const Transition& edge, const Offer& offer, const Ask& ask) {
    const int runs = offer.to.runs(), asked = std::min(runs, kViewsAsked);
    std::vector<Share> shares;
    for (int i = 0; i < asked; ++i) {
        const int variant = static_cast<int>(static_cast<std::int64_t>(i) * runs / asked);
        const Work work = edge.work(offer, ask, offer.to.placed.first_view(variant));
        auto same = std::find_if(shares.begin(), shares.end(), [&](const Share& share) {
            return share.mean.variant == work.variant;
        });
        if (same == shares.end()) same = shares.insert(shares.end(), Share{});
        add(*same, work, 1);
    }
    return shares;
}

/// Fills in the sets of bytes where an edge does not say them: reads at computed addresses fall
/// anywhere in the input, and what is streamed is input and output.
void place(Work& work, const Offer& offer, const StepCost& cost) {
    const double in = offer.from.bytes() / cost.from_ranks;
    if (!(work.lines.span > 0)) work.lines.span = in;
    if (!(work.swept > 0)) work.swept = in + offer.to.bytes() / cost.to_ranks;
}

/// Signed and unsigned samples of one width take as long.
Type timed_as(Type type) {
    switch (type) {
        case Type::i8:
            return Type::u8;
        case Type::u16:
            return Type::i16;
        case Type::u32:
            return Type::i32;
        default:
            return type;
    }
}

/// SplitMix64 (Steele, Lea, Flood 2014): spreads the bits of a hash.
double unit_random(std::uint64_t state) {
    state += 0x9e3779b97f4a7c15;
    state = (state ^ (state >> 30)) * 0xbf58476d1ce4e5b9;
    state = (state ^ (state >> 27)) * 0x94d049bb133111eb;
    state ^= state >> 31;
    return static_cast<double>((state >> 11) + 1) * 0x1p-53;
}

}  // namespace

std::string timing_name(const Transition& edge, const Offer& offer, const Request& want,
                        const Work& work) {
    // The box of a view is larger than the input, and its samples are spaced like the pixels.
    const bool of_view = want.job->of_rays() && offer.to.space == "screen";
    const std::string_view kind =
        offer.to.content == "picture"
            ? (want.mode->timed_as.empty() ? want.mode->name : want.mode->timed_as)
        : offer.from.axes == 2 ? "2d"
        : of_view              ? "view"
                               : "3d";
    return fmt::format("{}{}{}{} {} {}", edge.name, offer.with.text(),
                       work.variant.empty() ? "" : "/", work.variant, kind,
                       name_of(timed_as(offer.from.type)));
}

Error counted_error(const Transition& edge, const Offer& offer, const Ask& ask) {
    Error error = edge.error_of(offer, ask);
    const std::optional<WrittenAs>& written = ask.want.written;
    if (!written && !ask.want.budget.copied) error.copies = true;
    // A file in f32 rounds even copies, where samples have more digits.
    if (written && !written->rounds() && error.copies && is_target(offer.to, ask.want))
        error.noise = std::hypot(error.noise, rounding_of(ask));
    return error;
}

StepCost cost_of(const Transition& edge, const Offer& offer, const Ask& ask, const Profile& profile,
                 int threads) {
    StepCost cost;
    std::vector<Share> shares = shares_of(edge, offer, ask);
    Share all;
    for (const Share& share : shares) add(all, share.mean, share.views);
    cost.work = all.mean;
    cost.made = edge.attaches ? offer.to.facet_bytes - offer.from.facet_bytes
                              : offer.to.bytes() + offer.to.facet_bytes;
    if (offer.from.place == Place::ranks) cost.from_ranks = ask.want.ranks;
    if (offer.to.place == Place::ranks) cost.to_ranks = ask.want.ranks;
    place(cost.work, offer, cost);

    const int among = offer.from.place == Place::ranks ? ask.want.ranks : 1;
    for (Share& share : shares) {
        place(share.mean, offer, cost);
        const Seconds run = profile.seconds(timing_name(edge, offer, ask.want, share.mean),
                                            share.mean, threads, among, offer.to.runs());
        cost.seconds += run.seconds * offer.to.runs() * share.views / all.views;
        cost.spread = std::max(cost.spread, run.spread);
    }
    cost.scratch = cost.work.scratch * threads + cost.work.workspace +
                   part_bytes(edge.parts(offer, ask), offer);
    cost.error = counted_error(edge, offer, ask);
    // A negative or undefined number would let the search go round a cycle for ever.
    const Error& e = cost.error;
    for (const double number : {cost.seconds, cost.scratch, e.gain, e.noise_gain, e.bias, e.noise})
        if (!std::isfinite(number) || number < 0)
            throw RequestError(fmt::format("edge {}{} is priced {}; expected a finite number >= 0",
                                           edge.name, offer.with.text(), number));
    return cost;
}

double rounding_of(const Ask& ask) {
    const std::optional<WrittenAs>& written = ask.want.written;
    if (!written) return 0;
    // For f32 the measured error is an upper bound: most results are f32 already.
    if (!written->rounds()) return ask.scene.fact(kWritten).value_or(0);
    // Bennett, Spectra of quantized signals, Bell Syst. Tech. J. 27, 1948: step^2 / 12.
    const double largest = std::max(std::abs(ask.scene.low), std::abs(ask.scene.high));
    const double guess = is_integer(written->type) ? written->step() / std::sqrt(12.0)
                                                   : largest * 0x1p-10 / std::sqrt(12.0);
    return ask.scene.fact(kWritten).value_or(guess);
}

void randomise(StepCost& cost, const Transition& edge, const Offer& offer, std::uint64_t seed) {
    std::uint64_t hash = 1469598103934665603u ^ seed;  // FNV-1a
    for (unsigned char c : edge.name + offer.with.text() + offer.to.text())
        hash = (hash ^ c) * 1099511628211u;
    cost.seconds = unit_random(hash);
}

Label extend(const Label& label, const Offer& offer, const StepCost& cost, bool from_source,
             double pinned) {
    const double input = from_source ? 0 : offer.from.own_bytes() / cost.from_ranks;
    const bool kept = offer.to.runs() > offer.from.runs();  // the next views need the input again
    Label next = label;
    next.seconds += cost.seconds;
    next.held += kept ? input : 0;
    next.peak = std::max(label.peak, pinned + next.held + (kept ? 0 : input) +
                                         cost.made / cost.to_ranks + cost.scratch);
    next.bias = cost.error.gain * label.bias + cost.error.bias;
    next.known = label.known && cost.error.known;
    next.copied = label.copied && cost.error.copies;
    next.noise = std::hypot(cost.error.noise_gain * label.noise, cost.error.noise);
    if (!next.copied && cost.rounding > 0) next.noise = std::hypot(next.noise, cost.rounding);
    return next;
}

bool dominates(const Label& a, const Label& b) noexcept {
    // Equality must count as dominance: with "<", equal labels are all kept and every tie doubles
    // the work. Held bytes and noise count too: a later step may turn them into the peak or the
    // error that decides. An unknown error never beats a known one. It is beaten by a known error
    // no larger than its known part: if the two were not compared at all, a cycle through an edge
    // of unknown error would make a path that nothing dominates.
    return a.known >= b.known && a.copied >= b.copied && a.seconds <= b.seconds &&
           a.peak <= b.peak && a.held <= b.held && a.bias <= b.bias && a.noise <= b.noise;
}

bool before(const Label& a, const Label& b) noexcept {
    return std::tie(a.seconds, a.peak, a.held, a.bias, a.noise, b.known, b.copied) <
           std::tie(b.seconds, b.peak, b.held, b.bias, b.noise, a.known, a.copied);
}

}  // namespace edgewise
