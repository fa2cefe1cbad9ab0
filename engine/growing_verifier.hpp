#pragma once

#include <cstdint>
#include <memory_resource>
#include <optional>

#include "reference/verify.hpp"

namespace edgewise {

/// Compares results of one request with the reference. The number of samples grows where they leave
/// open whether a budget is kept. The reference needs nearly all of the time. It is worked out once
/// for each number, with the first result that is compared.
class GrowingVerifier {
 public:
    static constexpr std::int64_t kFirst = 1024, kSecond = 8192;
    static constexpr std::int64_t kMost = 1 << 17, kTimes = 4;  // from the second on

    /// All must stay alive.
    GrowingVerifier(const Request& want, const ReferenceField& field,
                    std::pmr::memory_resource* memory)
        : want_(want), field_(field), memory_(memory) {}

    /// So many are drawn, or all where there are not many more.
    std::int64_t samples() const noexcept { return samples_; }
    /// Whether there are more samples, and memory for them as far as that is known.
    bool can_grow() const noexcept;
    /// [s] that the reference of the next number of samples may take: what the last one took, and
    /// for each further sample what its last samples took. The two are separate because a few
    /// samples already visit all of the data, and of several views each batch of a reference does.
    /// 0 after the first number alone, which cannot separate them.
    double seconds_to_grow() const noexcept;
    void grow() noexcept;
    /// Back to fewer samples, for good: memory has run out.
    /// @return false where there may be no fewer
    bool shrink() noexcept;

    /// Before the frames of each result. @throws std::bad_alloc
    void begin();
    /// Each frame once, as Verifier::frame().
    void frame(int frame, const Data& result) { verifier_->frame(frame, result); }
    /// After the last frame. @throws std::bad_alloc
    Verified finish();

    /// [s] that all comparing took, and the last reference of up to kSecond samples.
    double seconds() const noexcept { return seconds_; }
    double early_seconds() const noexcept { return early_; }

 private:
    struct Took {
        double samples = 0, seconds = 0;
    };

    /// Samples of all frames.
    double there() const { return double(want_.output().samples()) * want_.frames; }
    std::int64_t more() const noexcept { return samples_ < kSecond ? kSecond : kTimes * samples_; }

    const Request& want_;
    const ReferenceField& field_;
    std::pmr::memory_resource* memory_;
    std::int64_t samples_ = kFirst, room_for_ = kMost;
    std::optional<Verifier> verifier_;
    bool is_new_ = true;
    bool has_all_ = false;  // of the samples that see the input
    Took before_, last_;
    double seconds_ = 0, early_ = 0;
};

}  // namespace edgewise
