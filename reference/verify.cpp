#include "reference/verify.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <tbb/parallel_for.h>
#include <tuple>

#include "reference/drawn_pixels.hpp"
#include "reference/random_draw.hpp"
#include "reference/ray_look.hpp"
#include "reference/stored.hpp"

namespace edgewise {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kExtremes = 32;     // places on either side
constexpr std::int64_t kChunk = 1 << 16;  // output samples that are scanned at once
constexpr std::int64_t kBox = 64;         // side of the boxes in which a whole warp is compared
constexpr std::size_t kPlacesAtOnce = 64;

std::int64_t place_in(const Extent& n, const OutputSample& at) {
    return at.x + n.x * (at.y + n.y * at.z);
}

OutputSample sample_at(const Extent& n, int view, std::int64_t place) {
    return {view, place % n.x, place / n.x % n.y, place / (n.x * n.y)};
}

auto key_of(const OutputSample& at) { return std::tuple(at.view, at.z, at.y, at.x); }
bool is_before(const OutputSample& a, const OutputSample& b) { return key_of(a) < key_of(b); }

/// Samples of a whole output that are remembered at most.
std::int64_t most_remembered(const Request& want) noexcept {
    return want.job->of_rays() ? 1 << 17 : 1 << 19;
}

/// The number of samples to estimate where `samples` are to be drawn. An estimate takes about a
/// twentieth of the time of the reference for a ray, and a smaller part for a point.
std::int64_t looks_for(const Request& want, std::int64_t samples) noexcept {
    const std::int64_t times = want.job->of_rays() ? 16 : 32;
    const std::int64_t most = want.job->of_rays() ? 1 << 16 : 1 << 20;
    return std::max(2 * samples, std::min(times * samples, most));
}

/// Whether all of them are compared, although fewer would do.
bool is_worth_all(const Request& want, std::int64_t there, std::int64_t samples) noexcept {
    return there <= samples ||
           (there <= Verifier::kWorthAll * samples && there <= most_remembered(want));
}

/// Labels are copied as they are; where values are slope x stored + offset, f32 rounds that.
bool differs(double a, double b, const ValueMap& map) {
    if (map.identity()) return static_cast<float>(a) != static_cast<float>(b);
    return !(std::abs(a - b) <= 1e-6 * std::max(1.0, std::abs(b)));
}

}  // namespace

std::int64_t samples_to_compare(const Request& want) noexcept {
    // A ray costs about as much as some dozens of points.
    return want.job->of_rays() ? 1 << 14 : 1 << 19;
}

double verifier_bytes(const Request& want, const ReferenceField& field, std::int64_t samples,
                      int threads) {
    const Reference reference(want, field, std::pmr::null_memory_resource());
    const Extent n = want.output();
    const std::int64_t there = n.samples() * want.frames;
    const double channels = reference.channels();
    // Of vectors that grow there are two for a moment.
    const double a_look =
        2 * (sizeof(OutputSample) + 4 * sizeof(double) + channels * (2 * sizeof(double)));
    const double a_comparison = 2 * (6 + channels) * sizeof(double);
    const auto bytes = [&](double looked, double compared) {
        return looked * a_look + compared * a_comparison + reference.bytes(compared, threads);
    };
    const bool all = samples <= 0 || is_worth_all(want, there, samples);
    if (all && there > most_remembered(want)) {
        const double box = static_cast<double>(n.z > 1 ? kBox * kBox * kBox : n.x * kBox);
        return bytes(box, box);
    }
    const std::int64_t drawn = all ? there : std::min(there, Verifier::kWorthAll * samples);
    const std::int64_t looked = std::max(drawn, std::min(there, looks_for(want, samples)));
    return bytes(static_cast<double>(looked), static_cast<double>(drawn));
}

Verifier::Verifier(const Request& want, const ReferenceField& field, std::int64_t samples,
                   std::uint64_t seed, std::pmr::memory_resource* memory)
    : want_(want),
      reference_(want, field, memory),
      channels_(static_cast<std::size_t>(written_channels(want, reference_.channels()))),
      seed_(seed),
      wanted_(samples),
      labels_(want.job->of_points() && field.kind() == Field::nearest) {
    const std::int64_t there = want.output().samples() * want.frames;
    reference_.expect_affordable(
        static_cast<double>(samples <= 0 ? there : std::min(there, kWorthAll * samples)));
    all_ = samples <= 0 || is_worth_all(want, there, samples);
    remembers_ = !all_ || there <= most_remembered(want);
    if (!remembers_) return;
    look_evenly(all_ ? there : std::max(looks_for(want, samples), kWorthAll * samples));
    // Of those that see the input there may be few.
    const auto seen = static_cast<std::int64_t>(looked_.size());
    all_ = all_ || (looked_at_all_ && is_worth_all(want, seen, samples));
    if (const auto looks = static_cast<std::size_t>(looks_for(want, samples));
        !all_ && looked_.size() > looks) {
        looked_.resize(looks);
        looked_at_all_ = false;
    }
    weigh_evenly();
    if (all_) draw_all();
    std::sort(looked_.begin(), looked_.end(),
              [](const Looked& a, const Looked& b) { return is_before(a.at, b.at); });
    delivered_.assign(looked_.size() * channels_, std::numeric_limits<double>::quiet_NaN());
}

bool Verifier::counts(const OutputSample& at) const {
    if (!reference_.sees_input(at)) return false;
    if (!want_.job->of_points()) return true;
    const ReferenceField& field = reference_.field();
    const Vec3 point = *reference_.geometry().point(at);
    if (field.kind() == Field::nearest && field.has_no_nearest(point)) return false;
    return !field.near_non_finite(point);
}

/// Some of the output samples that count, in random order; all where there are no more.
void Verifier::look_evenly(std::int64_t samples) {
    const Extent n = want_.output();
    const std::int64_t there = n.samples() * want_.frames;
    const RandomOrder order(there, seed_);
    // Where hardly any sample sees the input, what was found by then must do.
    const std::int64_t tries = std::min(there, 256 * samples + 4'000'000);
    std::int64_t tried = 0;
    for (; tried < tries && static_cast<std::int64_t>(looked_.size()) < samples; ++tried) {
        const std::int64_t place = order[tried];
        const OutputSample at =
            sample_at(n, static_cast<int>(place / n.samples()), place % n.samples());
        if (counts(at)) looked_.push_back({.at = at});
    }
    looked_at_all_ = tried == there;
    const auto found = static_cast<double>(looked_.size());
    population_ =
        found * static_cast<double>(there) / static_cast<double>(std::max<std::int64_t>(1, tried));
}

/// Of all that are looked at alike.
void Verifier::weigh_evenly() {
    for (Looked& looked : looked_) looked.weight = 1 / static_cast<double>(looked_.size());
}

void Verifier::draw_all() {
    for (std::size_t i = 0; i < looked_.size(); ++i)
        draws_.push_back({.looked = i, .weight = looked_[i].weight});
}

/// What lies around extremes of the first result stands for itself, the rest for all others.
void Verifier::look_around_extremes() {
    std::sort(nearby_.begin(), nearby_.end(),
              [](const Nearby& a, const Nearby& b) { return is_before(a.at, b.at); });
    nearby_.erase(
        std::unique(nearby_.begin(), nearby_.end(),
                    [](const Nearby& a, const Nearby& b) { return key_of(a.at) == key_of(b.at); }),
        nearby_.end());
    const auto near = static_cast<double>(nearby_.size());
    std::vector<Looked> joined;
    std::vector<double> delivered;
    const auto take = [&](const Looked& looked, const double* values) {
        joined.push_back(looked);
        delivered.insert(delivered.end(), values, values + channels_);
    };
    std::size_t even = 0;
    auto next = nearby_.begin();
    for (std::size_t i = 0; i <= looked_.size(); ++i) {
        for (;
             next != nearby_.end() && (i == looked_.size() || !is_before(looked_[i].at, next->at));
             ++next)
            take({.at = next->at, .is_certain = true}, next->values.data());
        if (i == looked_.size()) break;
        if (!joined.empty() && key_of(joined.back().at) == key_of(looked_[i].at)) continue;
        take(looked_[i], delivered_.data() + i * channels_);
        ++even;
    }
    population_ = std::max(population_, near + static_cast<double>(even));
    for (Looked& looked : joined)
        looked.weight = looked.is_certain ? 1 / population_
                                          : (1 - near / population_) / static_cast<double>(even);
    looked_ = std::move(joined);
    delivered_ = std::move(delivered);
    nearby_.clear();
}

/// What the reference has at the samples that are looked at, about, as written.
std::vector<double> Verifier::guesses() const {
    std::vector<double> guesses(looked_.size() * channels_);
    const ReferenceField& field = reference_.field();
    const std::size_t batches = (looked_.size() + kPlacesAtOnce - 1) / kPlacesAtOnce;
    tbb::parallel_for(std::size_t{0}, batches, [&](std::size_t batch) {
        const std::size_t begin = batch * kPlacesAtOnce;
        const std::size_t end = std::min(looked_.size(), begin + kPlacesAtOnce);
        if (want_.job->of_rays()) {
            for (std::size_t i = begin; i < end; ++i) {
                std::array<double, 4> guess =
                    guess_at(*reference_.geometry().ray(looked_[i].at), want_, field);
                as_written(want_, guess.data());
                std::copy_n(guess.data(), channels_, guesses.data() + i * channels_);
            }
            return;
        }
        Places places;
        for (std::size_t i = begin; i < end; ++i)
            places.add(*reference_.geometry().point(looked_[i].at));
        PointLook look;
        look_at(places, field, look);
        // The first channel stands for all.
        for (std::size_t i = begin; i < end; ++i)
            std::fill_n(guesses.data() + i * channels_, channels_, look.guess[i - begin]);
    });
    return guesses;
}

/// How much each sample that is looked at is likely to add to the error, in terms of all.
std::vector<double> Verifier::roughness(const std::vector<double>& guesses) const {
    const std::size_t compared = want_.job->of_rays() ? channels_ : 1;
    std::vector<double> squares(looked_.size(), 0);
    double largest = 0;
    for (std::size_t i = 0; i < squares.size(); ++i) {
        double square = 0;
        for (std::size_t c = 0; c < compared; ++c)
            square += std::pow(delivered_[i * channels_ + c] - guesses[i * channels_ + c], 2);
        squares[i] = square;
        if (std::isfinite(square)) largest = std::max(largest, square);
    }
    // A result that is not finite, or a guess, must be looked into.
    for (double& square : squares)
        if (!std::isfinite(square)) square = std::max(1.0, largest);
    // In proportion to errors as they are guessed, and less so as guesses are off as well.
    double sum = 0, sum_of_roots = 0;
    for (std::size_t i = 0; i < squares.size(); ++i) {
        sum += looked_[i].weight * squares[i];
        sum_of_roots += looked_[i].weight * std::sqrt(squares[i]);
    }
    std::vector<double> rough(squares.size(), 0);
    for (std::size_t i = 0; i < rough.size() && sum > 0; ++i)
        rough[i] = looked_[i].weight * (squares[i] / sum + std::sqrt(squares[i]) / sum_of_roots);
    return rough;
}

/// Evaluates the reference where its estimate is lowest and highest.
void Verifier::add_extremes_of(const std::vector<double>& guesses) {
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < guesses.size(); ++i)
        if (std::isfinite(guesses[i])) order.push_back(i);
    std::vector<OutputSample> extremes;
    const std::size_t count = std::min(kExtremes / 2, order.size());
    const auto add = [&](auto before) {
        const auto end = order.begin() + static_cast<std::ptrdiff_t>(count);
        std::partial_sort(order.begin(), end, order.end(), [&](std::size_t a, std::size_t b) {
            return std::pair(before * guesses[a], a) < std::pair(before * guesses[b], b);
        });
        for (auto i = order.begin(); i != end; ++i) extremes.push_back(looked_[*i / channels_].at);
    };
    add(1.0);
    add(-1.0);
    reference_of_extremes_ = written_reference(extremes);
}

/// With the first result: which samples are compared.
void Verifier::draw() {
    if (!looked_at_all_ && !nearby_.empty()) look_around_extremes();
    nearby_.clear();
    std::vector<double> rough(looked_.size(), 0);
    // Labels either differ or not: shares of even draws have intervals of their own.
    if (!labels_ && reference_.is_near_field()) {
        const std::vector<double> guesses = this->guesses();
        rough = roughness(guesses);
        add_extremes_of(guesses);
    }
    std::vector<double> chances(looked_.size(), 1);
    const auto draws = static_cast<double>(wanted_);
    if (draws < static_cast<double>(rough.size())) chances = expected_draws(rough, draws);
    // Along growing roughness, so that rough and smooth are met in proportion; what is alike is in
    // random order, or patterns of the output would meet patterns of the draws.
    std::vector<std::size_t> order(looked_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const RandomOrder shuffled(static_cast<std::int64_t>(order.size()), seed_ + 1);
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        const auto key = [&](std::size_t i) {
            return std::pair(rough[i], shuffled[static_cast<std::int64_t>(i)]);
        };
        return key(a) < key(b);
    });
    std::vector<double> in_order;
    for (const std::size_t i : order) in_order.push_back(chances[i]);
    for (const std::size_t place : draw_by_chance(in_order, seed_)) {
        const std::size_t i = order[place];
        draws_.push_back(
            {.looked = i, .weight = looked_[i].weight / chances[i], .missing = 1 - chances[i]});
    }
    std::sort(draws_.begin(), draws_.end(),
              [](const Draw& a, const Draw& b) { return a.looked < b.looked; });
}

void Verifier::frame(int frame, const Data& result) {
    if (result.what.extent != want_.output() || result.what.channels != reference_.channels())
        throw std::invalid_argument("a result of another kind than the request's: " +
                                    result.what.text());
    if (!remembers_) {
        compare_whole(frame, result);
        return;
    }
    if (!all_ && !labels_) {
        find_extremes(frame, result);
        if (!is_drawn() && !looked_at_all_) keep_nearby(frame, result);
    }
    take_looked(frame, result);
}

void Verifier::take_looked(int frame, const Data& result) {
    const auto before = [](const Looked& looked, int view) { return looked.at.view < view; };
    const auto begin = std::lower_bound(looked_.begin(), looked_.end(), frame, before);
    for (auto looked = begin; looked != looked_.end() && looked->at.view == frame; ++looked)
        copy_written(
            result, place_in(result.what.extent, looked->at),
            delivered_.data() + static_cast<std::size_t>(looked - looked_.begin()) * channels_);
}

/// All written channels of the sample at a place.
void Verifier::copy_written(const Data& result, std::int64_t place, double* values) const {
    std::array<double, 4> delivered{};
    const auto channels = static_cast<std::size_t>(result.what.channels);
    for (std::size_t c = 0; c < channels; ++c)
        delivered[c] = value_at(result, place * result.what.channels + static_cast<int>(c));
    if (want_.written) round_as(*want_.written, {delivered.data(), channels});
    as_written(want_, delivered.data());
    for (std::size_t c = 0; c < channels_; ++c) values[c] = delivered[c];
}

/// Keeps the places of the largest and smallest values so far. Chunks are joined in order, and of
/// equal values the first stays, so that threads do not show.
void Verifier::find_extremes(int frame, const Data& result) {
    const Extent n = result.what.extent;
    const auto channels = static_cast<std::int64_t>(channels_);
    const std::int64_t chunks = (n.samples() + kChunk - 1) / kChunk;
    const bool is_plain = result.what.type == Type::f32 && result.what.values.identity() &&
                          channels == result.what.channels;
    std::vector<std::vector<Extreme>> large(static_cast<std::size_t>(chunks), largest_);
    std::vector<std::vector<Extreme>> small(static_cast<std::size_t>(chunks), smallest_);
    const auto larger = [](float a, float b) { return a > b; };
    const auto smaller = [](float a, float b) { return a < b; };
    const auto offer = [](std::vector<Extreme>& kept, const Extreme& next, auto beats) {
        if (kept.size() == kExtremes && !beats(next.value, kept.back().value)) return;
        const auto place = std::find_if(kept.begin(), kept.end(), [&](const Extreme& other) {
            return beats(next.value, other.value);
        });
        kept.insert(place, next);
        if (kept.size() > kExtremes) kept.pop_back();
    };
    const auto beaten = [](const std::vector<Extreme>& kept, float value, auto beats) {
        return kept.size() < kExtremes || beats(value, kept.back().value);
    };
    tbb::parallel_for(std::int64_t{0}, chunks, [&](std::int64_t chunk) {
        auto& most = large[static_cast<std::size_t>(chunk)];
        auto& least = small[static_cast<std::size_t>(chunk)];
        const std::int64_t end = std::min(n.samples(), (chunk + 1) * kChunk);
        std::vector<double> written(channels_);
        for (std::int64_t place = chunk * kChunk; place < end; ++place) {
            const float* plain = is_plain ? result.as<float>() + place * channels : nullptr;
            if (!plain) copy_written(result, place, written.data());
            for (std::int64_t c = 0; c < channels; ++c) {
                const auto value =
                    plain ? plain[c] : static_cast<float>(written[static_cast<std::size_t>(c)]);
                const bool up = beaten(most, value, larger), down = beaten(least, value, smaller);
                if (!(up || down) || !std::isfinite(value)) continue;
                const OutputSample at = sample_at(n, frame, place);
                if (!counts(at)) continue;
                if (up) offer(most, {value, at}, larger);
                if (down) offer(least, {value, at}, smaller);
            }
        }
    });
    // Chunks started from what was kept before, so that they see few candidates; each chunk's own
    // finds are those of this frame.
    for (std::int64_t chunk = 0; chunk < chunks; ++chunk) {
        for (const Extreme& next : large[static_cast<std::size_t>(chunk)])
            if (next.at.view == frame) offer(largest_, next, larger);
        for (const Extreme& next : small[static_cast<std::size_t>(chunk)])
            if (next.at.view == frame) offer(smallest_, next, smaller);
    }
}

/// What lies around the extremes of this frame, and no longer around those that others beat.
void Verifier::keep_nearby(int frame, const Data& result) {
    const auto is_kept = [&](const OutputSample& at) {
        const auto same = [&](const Extreme& extreme) { return key_of(extreme.at) == key_of(at); };
        return std::any_of(largest_.begin(), largest_.end(), same) ||
               std::any_of(smallest_.begin(), smallest_.end(), same);
    };
    std::erase_if(nearby_, [&](const Nearby& nearby) { return !is_kept(nearby.of); });
    const Extent n = result.what.extent;
    const std::int64_t reach = n.z > 1 ? 1 : 2;
    const auto keep_around = [&](const OutputSample& of) {
        for (std::int64_t z = std::max<std::int64_t>(0, of.z - reach);
             z <= std::min(n.z - 1, of.z + reach); ++z)
            for (std::int64_t y = std::max<std::int64_t>(0, of.y - reach);
                 y <= std::min(n.y - 1, of.y + reach); ++y)
                for (std::int64_t x = std::max<std::int64_t>(0, of.x - reach);
                     x <= std::min(n.x - 1, of.x + reach); ++x) {
                    const OutputSample at{of.view, x, y, z};
                    if (!counts(at)) continue;
                    Nearby nearby{of, at, std::vector<double>(channels_)};
                    copy_written(result, place_in(n, at), nearby.values.data());
                    nearby_.push_back(std::move(nearby));
                }
    };
    for (const auto* extremes : {&largest_, &smallest_})
        for (const Extreme& extreme : *extremes)
            if (extreme.at.view == frame) keep_around(extreme.at);
}

void Verifier::compare_whole(int frame, const Data& result) {
    const Extent n = result.what.extent;
    // Boxes of a volume, bands of a picture: what lies together meets few tiles of the input.
    const Extent box = n.z > 1 ? Extent{kBox, kBox, kBox} : Extent{n.x, kBox, 1};
    std::vector<OutputSample> samples;
    std::vector<double> delivered(channels_);
    for (std::int64_t z0 = 0; z0 < n.z; z0 += box.z)
        for (std::int64_t y0 = 0; y0 < n.y; y0 += box.y)
            for (std::int64_t x0 = 0; x0 < n.x; x0 += box.x) {
                samples.clear();
                for (std::int64_t z = z0; z < std::min(n.z, z0 + box.z); ++z)
                    for (std::int64_t y = y0; y < std::min(n.y, y0 + box.y); ++y)
                        for (std::int64_t x = x0; x < std::min(n.x, x0 + box.x); ++x)
                            if (const OutputSample at{frame, x, y, z}; counts(at))
                                samples.push_back(at);
                const std::vector<double> reference = written_reference(samples);
                take_range(reference);
                for (std::size_t i = 0; i < samples.size(); ++i) {
                    copy_written(result, place_in(n, samples[i]), delivered.data());
                    compare(delivered.data(), reference.data() + i * channels_, {.weight = 1});
                }
            }
}

/// [samples][channels]
std::vector<double> Verifier::written_reference(std::span<const OutputSample> samples) const {
    std::vector<double> values = reference_.values(samples);
    const auto delivered = static_cast<std::size_t>(reference_.channels());
    if (delivered == channels_) return values;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        as_written(want_, values.data() + i * delivered);
        std::copy_n(values.data() + i * delivered, channels_, values.data() + i * channels_);
    }
    values.resize(samples.size() * channels_);
    return values;
}

void Verifier::take_range(const std::vector<double>& reference) {
    for (double value : reference) {
        if (!std::isfinite(value)) continue;
        compared_.low = std::min(compared_.low, value);
        compared_.high = std::max(compared_.high, value);
    }
}

void Verifier::compare(const double* delivered, const double* expected, const Draw& draw) {
    if (std::isnan(expected[0])) {
        compared_.left_out += draw.weight;
        return;
    }
    double square = 0;
    bool other = false;
    for (std::size_t c = 0; c < channels_; ++c) {
        const double difference = std::abs(delivered[c] - expected[c]);
        const double counted = std::isfinite(difference) ? difference : kInfinity;
        compared_.largest_difference = std::max(compared_.largest_difference, counted);
        square += counted * counted / static_cast<double>(channels_);
        other =
            other || differs(delivered[c], expected[c], reference_.field().samples().what.values);
    }
    ++compared_.samples;
    compared_.differ += other;
    const double part = draw.weight * square;
    compared_.sum += part;
    compared_.squares += square;
    compared_.largest_square = std::max(compared_.largest_square, square);
    if (all_) return;
    // Of those that were looked at by chance it stands for as many as it was likely to be missed.
    const double looks = looked_[draw.looked].is_certain ? 0 : 1 / (1 - draw.missing);
    compared_.parts.push_back({part, draw.missing, square, looks});
}

/// @param mean  square; of labels the share that differs
Interval Verifier::interval(double mean) const {
    const double root = std::sqrt(mean);
    if (all_ || !std::isfinite(root)) return {root, root};
    if (labels_) return root_share_interval(compared_.differ, compared_.samples);
    double looked = 0;
    for (const Looked& each : looked_) looked += each.is_certain ? 0 : 1;
    const Interval found =
        root_sum_interval(compared_.parts,
                          {.looked = looked,
                           .seen = looked_at_all_ ? 1 : std::min(1.0, looked / population_),
                           .least = compared_.squares / population_,
                           .most = compared_.largest_square},
                          seed_);
    // Where all that was found to err is certain, the draws have no spread, and still there may be
    // small errors elsewhere: with one peak in 40^3 samples they were up to 0.7 % where not all was
    // looked at, else 1e-6 (a guess in f32 does not see what is below its rounding).
    const double unseen = looked_at_all_ ? 1e-5 : 0.01;
    return {std::min(found.low, (1 - unseen) * root), std::max(found.high, (1 + unseen) * root)};
}

/// Pixels of modes with a threshold jump, and few may do: an upper bound of the share that jumps
/// where no draw did. If K pixels jump, each drawn with a chance of at least c, the draws miss all
/// of them with a probability of at most exp(-K c), which is 5 % at K = 3 / c (the rule of three:
/// Hanley, Lippman-Hand, JAMA 249, 1983). Pixels where the estimate shows no jump are drawn least
/// often; a jump that was drawn there is in the interval.
double Verifier::share_unseen() const {
    if (all_ || !want_.job->of_rays() || !want_.mode->threshold) return 0;
    double least = 1, looked = 0;
    for (const Part& part : compared_.parts)
        if (part.missing > 0) least = std::min(least, 1 - part.missing);
    for (const Looked& each : looked_) looked += each.is_certain ? 0 : 1;
    if (looked == 0 || (least == 1 && looked_at_all_)) return 0;
    const double jump = std::pow((compared_.high - compared_.low) / 4, 2);
    const bool met =
        std::any_of(compared_.parts.begin(), compared_.parts.end(), [&](const Part& p) {
            return p.missing > 0 && 1 - p.missing < 2 * least && p.square > jump;
        });
    return met ? 0 : std::min(1.0, 3 / (least * looked));
}

void Verifier::begin_again() {
    std::fill(delivered_.begin(), delivered_.end(), std::numeric_limits<double>::quiet_NaN());
    largest_.clear();
    smallest_.clear();
    compared_ = {};
}

Verified Verifier::finish() {
    if (remembers_) {
        if (!is_drawn()) draw();
        if (reference_of_drawn_.empty()) {
            std::vector<OutputSample> samples;
            for (const Draw& draw : draws_) samples.push_back(looked_[draw.looked].at);
            reference_of_drawn_ = written_reference(samples);
        }
        take_range(reference_of_drawn_);
        take_range(reference_of_extremes_);
        std::vector<OutputSample> extremes;
        for (const auto* found : {&largest_, &smallest_})
            for (const Extreme& extreme : *found) extremes.push_back(extreme.at);
        take_range(written_reference(extremes));
        for (std::size_t i = 0; i < draws_.size(); ++i)
            compare(delivered_.data() + draws_[i].looked * channels_,
                    reference_of_drawn_.data() + i * channels_, draws_[i]);
    }
    Verified verified;
    verified.samples = compared_.samples;
    verified.max = compared_.largest_difference;
    verified.range = reference_.range(compared_.low, compared_.high);
    if (compared_.samples > 0) {
        const double weight =
            remembers_ ? 1 - compared_.left_out : static_cast<double>(compared_.samples);
        const double mean =
            labels_ ? static_cast<double>(compared_.differ) / static_cast<double>(compared_.samples)
                    : compared_.sum / weight;
        const Interval interval = this->interval(mean);
        verified.nrmse = std::sqrt(mean) / verified.range;
        verified.low = interval.low / verified.range;
        verified.high = interval.high / verified.range;
        // None is larger than the range, which counts as 1.
        verified.at_most = std::sqrt(verified.high * verified.high + share_unseen());
    }
    begin_again();
    return verified;
}

}  // namespace edgewise
