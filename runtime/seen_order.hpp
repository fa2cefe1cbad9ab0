#pragma once

#if defined(__SANITIZE_THREAD__)
#include <sanitizer/tsan_interface.h>
#endif

namespace edgewise {

/// Tells ThreadSanitizer what oneTBB, which is not compiled with it, does unseen: what nodes of a
/// graph did is known to those that begin when they have ended. Else it is nothing.
class SeenOrder {
#if defined(__SANITIZE_THREAD__)
 public:
    void begins() noexcept { __tsan_acquire(this); }
    void ends() noexcept { __tsan_release(this); }

 private:
    char address_ = 0;
#else
 public:
    void begins() const noexcept {}
    void ends() const noexcept {}
#endif
};

}  // namespace edgewise
