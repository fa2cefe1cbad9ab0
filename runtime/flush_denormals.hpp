#pragma once

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace edgewise {

/// While it lives, numbers of this thread below the normal ones of their type (1.2e-38 of f32)
/// count as zero. Arithmetic with them takes a trap in the processor, 13 to 20 times as long for a
/// whole volume of them, and the tails of smooth fields are full of them. An arena that is made
/// meanwhile hands the setting to its workers. Copies of samples keep their bytes. Elsewhere than
/// on x86 nothing is changed.
class FlushDenormals {
#if defined(__SSE2__)
 public:
    FlushDenormals() : before_(_mm_getcsr()) { _mm_setcsr(before_ | kFlushToZero | kAreZero); }
    ~FlushDenormals() { _mm_setcsr(before_); }

 private:
    static constexpr unsigned kFlushToZero = 0x8000, kAreZero = 0x0040;
    unsigned before_;
#else
 public:
    FlushDenormals() = default;
    ~FlushDenormals() {}
#endif

 public:
    FlushDenormals(const FlushDenormals&) = delete;
    FlushDenormals& operator=(const FlushDenormals&) = delete;
};

}  // namespace edgewise
