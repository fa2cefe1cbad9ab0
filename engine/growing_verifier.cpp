#include "engine/growing_verifier.hpp"

#include <algorithm>
#include <chrono>

namespace edgewise {

bool GrowingVerifier::can_grow() const noexcept {
    return !has_all_ && more() <= room_for_ && static_cast<double>(samples_) < there();
}

double GrowingVerifier::seconds_to_grow() const noexcept {
    if (last_.samples < kSecond) return 0;
    const double next = std::min(static_cast<double>(more()), there());
    const double in_proportion = last_.seconds * next / last_.samples;
    if (before_.samples == 0 || want_.frames > 1) return in_proportion;
    const double each =
        std::max(0.0, last_.seconds - before_.seconds) / (last_.samples - before_.samples);
    return last_.seconds + each * (next - last_.samples);
}

void GrowingVerifier::grow() noexcept {
    samples_ = more();
    verifier_.reset();
}

bool GrowingVerifier::shrink() noexcept {
    if (samples_ == kFirst) return false;
    room_for_ = samples_ = samples_ == kSecond ? kFirst : samples_ / kTimes;
    verifier_.reset();
    return true;
}

void GrowingVerifier::begin() {
    if (verifier_) return;
    verifier_.emplace(want_, field_, samples_, 1, memory_);
    has_all_ = verifier_->all();
    is_new_ = true;
}

Verified GrowingVerifier::finish() {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point begin = Clock::now();
    const Verified verified = verifier_->finish();
    const double took = std::chrono::duration<double>(Clock::now() - begin).count();
    seconds_ += took;
    if (!is_new_) return verified;
    is_new_ = false;
    before_ = last_.samples < static_cast<double>(samples_) ? last_ : Took{};
    // Where all are compared these are more than were asked for.
    last_ = {static_cast<double>(std::max(samples_, verified.samples)), took};
    if (samples_ <= kSecond) early_ = took;
    return verified;
}

}  // namespace edgewise
