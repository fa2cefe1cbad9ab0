#include "transitions/reference/verify.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <tbb/parallel_for.h>
#include <tuple>

#include "transitions/reference/interval.hpp"
#include "transitions/reference/stored.hpp"

namespace edgewise {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kExtremes = 32;     // places on either side
constexpr std::int64_t kChunk = 1 << 16;  // output samples that are scanned at once
constexpr std::int64_t kBox = 64;         // side of the boxes in which a whole warp is compared

std::int64_t place_in(const Extent& n, const OutputSample& at) {
    return at.x + n.x * (at.y + n.y * at.z);
}

OutputSample sample_at(const Extent& n, int view, std::int64_t place) {
    return {view, place % n.x, place / n.x % n.y, place / (n.x * n.y)};
}

/// Samples of a whole output that are remembered at most.
double most_remembered(const Request& want) noexcept {
    return want.job == Job::render ? 1 << 17 : 1 << 19;
}

/// All channels of the samples at some places, as the file will say them.
class Delivered {
 public:
    Delivered(const Data& result, const Request& want)
        : result_(result),
          written_(want.written),
          values_(static_cast<std::size_t>(result.what.channels)) {}

    void copy(std::int64_t place, float* to) {
        const auto channels = static_cast<std::int64_t>(values_.size());
        for (std::int64_t c = 0; c < channels; ++c)
            values_[static_cast<std::size_t>(c)] = value_at(result_, place * channels + c);
        if (written_) round_as(*written_, values_);
        for (std::int64_t c = 0; c < channels; ++c)
            to[c] = static_cast<float>(values_[static_cast<std::size_t>(c)]);
    }

 private:
    const Data& result_;
    const std::optional<WrittenAs>& written_;
    std::vector<double> values_;
};

/// Labels are copied as they are; where values are slope x stored + offset, f32 rounds that.
bool differs(float a, double b, const ValueMap& map) {
    if (map.identity()) return a != static_cast<float>(b);
    return !(std::abs(a - b) <= 1e-6 * std::max(1.0, std::abs(b)));
}

}  // namespace

double range_between(double low, double high) noexcept {
    if (!(low <= high)) return 1;
    if (high > low) return high - low;
    return low != 0 ? std::abs(low) : 1;
}

std::int64_t samples_to_compare(const Request& want) noexcept {
    // A ray costs about as much as some dozens of points.
    return want.job == Job::render ? 1 << 14 : 1 << 19;
}

double verifier_bytes(const Request& want, const ReferenceField& field, std::int64_t samples,
                      int threads) {
    const Reference reference(want, field, std::pmr::null_memory_resource());
    const double there = static_cast<double>(want.output().samples()) * want.frames;
    const bool all = samples <= 0 || static_cast<double>(samples) >= there;
    const Extent n = want.output();
    const double box = static_cast<double>(n.z > 1 ? kBox * kBox * kBox : n.x * kBox);
    const double at_once = !all                             ? static_cast<double>(samples)
                           : there <= most_remembered(want) ? there
                                                            : box;
    // Places, values delivered and expected, and squares.
    const double kept = sizeof(OutputSample) + sizeof(double) +
                        reference.channels() * (sizeof(float) + sizeof(double));
    return at_once * 2 * kept + reference.bytes(at_once, threads);
}

Verifier::Verifier(const Request& want, const ReferenceField& field, std::int64_t samples,
                   std::uint64_t seed, std::pmr::memory_resource* memory)
    : want_(want),
      reference_(want, field, memory),
      seed_(seed),
      labels_(want.job == Job::warp && field.kind() == Field::nearest),
      low_(kInfinity),
      high_(-kInfinity) {
    const double there = static_cast<double>(want.output().samples()) * want.frames;
    all_ = samples <= 0 || static_cast<double>(samples) >= there;
    remembers_ = !all_ || there <= most_remembered(want);
    if (remembers_) {
        if (all_)
            draw_all();
        else
            draw(samples);
        delivered_.resize(drawn_.size() * static_cast<std::size_t>(reference_.channels()),
                          std::numeric_limits<float>::quiet_NaN());
    }
}

void Verifier::draw_all() {
    const Extent n = want_.output();
    for (int view = 0; view < want_.frames; ++view)
        for (std::int64_t place = 0; place < n.samples(); ++place) {
            const OutputSample at = sample_at(n, view, place);
            if (reference_.sees_input(at)) drawn_.push_back(at);
        }
}

void Verifier::draw(std::int64_t samples) {
    const Extent n = want_.output();
    const double there = static_cast<double>(n.samples()) * want_.frames;
    std::mt19937_64 bits(seed_);
    // Where hardly any sample sees the input, what was found by then must do.
    const std::int64_t tries = 256 * samples + 4'000'000;
    for (std::int64_t i = 0; i < tries && static_cast<std::int64_t>(drawn_.size()) < samples; ++i) {
        const auto place =
            static_cast<std::int64_t>(static_cast<double>(bits() >> 11) * 0x1p-53 * there);
        const OutputSample at =
            sample_at(n, static_cast<int>(place / n.samples()), place % n.samples());
        if (reference_.sees_input(at)) drawn_.push_back(at);
    }
    const auto key = [](const OutputSample& at) { return std::tuple(at.view, at.z, at.y, at.x); };
    std::sort(drawn_.begin(), drawn_.end(),
              [&](const OutputSample& a, const OutputSample& b) { return key(a) < key(b); });
}

void Verifier::frame(int frame, const Data& result) {
    if (result.what.extent != want_.output() || result.what.channels != reference_.channels())
        throw std::invalid_argument("a result of another kind than the request's: " +
                                    result.what.text());
    if (!remembers_) {
        compare_all(frame, result);
        return;
    }
    if (!all_ && !labels_) find_extremes(frame, result);
    const auto channels = static_cast<std::size_t>(reference_.channels());
    Delivered values(result, want_);
    const auto before = [](const OutputSample& at, int view) { return at.view < view; };
    const auto begin = std::lower_bound(drawn_.begin(), drawn_.end(), frame, before);
    for (auto at = begin; at != drawn_.end() && at->view == frame; ++at)
        values.copy(place_in(result.what.extent, *at),
                    delivered_.data() + static_cast<std::size_t>(at - drawn_.begin()) * channels);
}

/// Keeps the places of the largest and smallest values so far. Chunks are joined in order, and of
/// equal values the first stays, so that threads do not show.
void Verifier::find_extremes(int frame, const Data& result) {
    const Extent n = result.what.extent;
    const int channels = result.what.channels;
    const std::int64_t chunks = (n.samples() + kChunk - 1) / kChunk;
    const bool is_plain = result.what.type == Type::f32 && result.what.values.identity();
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
    const auto value_of = [&](std::int64_t i) {
        return is_plain ? result.as<float>()[i] : static_cast<float>(value_at(result, i));
    };
    tbb::parallel_for(std::int64_t{0}, chunks, [&](std::int64_t chunk) {
        auto& most = large[static_cast<std::size_t>(chunk)];
        auto& least = small[static_cast<std::size_t>(chunk)];
        const std::int64_t end = std::min(n.samples(), (chunk + 1) * kChunk);
        for (std::int64_t place = chunk * kChunk; place < end; ++place)
            for (int c = 0; c < channels; ++c) {
                const float value = value_of(place * channels + c);
                const bool up = beaten(most, value, larger), down = beaten(least, value, smaller);
                if (!(up || down) || !std::isfinite(value)) continue;
                const OutputSample at = sample_at(n, frame, place);
                if (!reference_.sees_input(at)) continue;
                if (up) offer(most, {value, at}, larger);
                if (down) offer(least, {value, at}, smaller);
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

void Verifier::compare_all(int frame, const Data& result) {
    const Extent n = result.what.extent;
    const auto channels = static_cast<std::size_t>(result.what.channels);
    // Boxes of a volume, bands of a picture: what lies together meets few tiles of the input.
    const Extent box = n.z > 1 ? Extent{kBox, kBox, kBox} : Extent{n.x, 64, 1};
    std::vector<OutputSample> samples;
    std::vector<float> delivered;
    Delivered values(result, want_);
    for (std::int64_t z0 = 0; z0 < n.z; z0 += box.z)
        for (std::int64_t y0 = 0; y0 < n.y; y0 += box.y)
            for (std::int64_t x0 = 0; x0 < n.x; x0 += box.x) {
                samples.clear();
                delivered.clear();
                for (std::int64_t z = z0; z < std::min(n.z, z0 + box.z); ++z)
                    for (std::int64_t y = y0; y < std::min(n.y, y0 + box.y); ++y)
                        for (std::int64_t x = x0; x < std::min(n.x, x0 + box.x); ++x) {
                            const OutputSample at{frame, x, y, z};
                            if (!reference_.sees_input(at)) continue;
                            samples.push_back(at);
                            delivered.resize(delivered.size() + channels);
                            values.copy(place_in(n, at),
                                        delivered.data() + delivered.size() - channels);
                        }
                compare(samples, delivered, reference_.values(samples));
            }
}

void Verifier::take(const std::vector<double>& reference) {
    for (double value : reference) {
        if (!std::isfinite(value)) continue;
        low_ = std::min(low_, value);
        high_ = std::max(high_, value);
    }
}

void Verifier::compare(std::span<const OutputSample> samples, std::span<const float> delivered,
                       const std::vector<double>& reference) {
    const auto channels = static_cast<std::size_t>(reference_.channels());
    take(reference);
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const double* expected = reference.data() + i * channels;
        if (std::isnan(expected[0])) continue;
        if (want_.job == Job::warp &&
            reference_.field().near_non_finite(*reference_.geometry().point(samples[i])))
            continue;
        double square = 0;
        bool other = false;
        for (std::size_t c = 0; c < channels; ++c) {
            const double difference = std::abs(delivered[i * channels + c] - expected[c]);
            const double counted = std::isfinite(difference) ? difference : kInfinity;
            largest_difference_ = std::max(largest_difference_, counted);
            square += counted * counted / static_cast<double>(channels);
            other = other || differs(delivered[i * channels + c], expected[c],
                                     reference_.field().samples().what.values);
        }
        if (labels_) square = other ? 1 : 0;
        sum_ += square;
        ++compared_;
        if (!all_) squares_.push_back(square);
    }
}

void Verifier::begin_again() {
    std::fill(delivered_.begin(), delivered_.end(), std::numeric_limits<float>::quiet_NaN());
    largest_.clear();
    smallest_.clear();
    squares_.clear();
    sum_ = largest_difference_ = 0;
    low_ = kInfinity;
    high_ = -kInfinity;
    compared_ = 0;
}

Verified Verifier::finish() {
    if (remembers_) {
        if (reference_of_drawn_.empty()) reference_of_drawn_ = reference_.values(drawn_);
        compare(drawn_, delivered_, reference_of_drawn_);
        std::vector<OutputSample> extremes;
        for (const Extreme& extreme : largest_) extremes.push_back(extreme.at);
        for (const Extreme& extreme : smallest_) extremes.push_back(extreme.at);
        take(reference_.values(extremes));
    }
    Verified verified;
    verified.samples = compared_;
    verified.max = largest_difference_;
    verified.range = labels_ ? 1 : want_.range.value_or(range_between(low_, high_));
    if (compared_ > 0) {
        const double root = std::sqrt(sum_ / static_cast<double>(compared_));
        Interval interval{root, root};
        if (!all_ && std::isfinite(root))
            interval = labels_ ? root_share_interval(std::llround(sum_), compared_)
                               : root_mean_interval(squares_, seed_);
        verified.nrmse = root / verified.range;
        verified.low = interval.low / verified.range;
        verified.high = interval.high / verified.range;
    }
    begin_again();
    return verified;
}

}  // namespace edgewise
