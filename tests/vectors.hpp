#pragma once

#include <cstdint>
#include <hwy/targets.h>

#include "transitions/kernels/targets.hpp"

namespace edgewise {

/// Has Highway choose among these sets of instructions from now on.
/// @param targets  0: all that this processor has
inline void choose_vectors(std::int64_t targets) {
    hwy::SetSupportedTargetsForTest(targets);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

/// Whether this processor has them and kernels are compiled for them: as a rule for one alone.
inline bool has_vectors(std::int64_t targets) {
    choose_vectors(0);
    return (hwy::SupportedTargets() & kernels::compiled_targets() & targets) != 0;
}

}  // namespace edgewise
