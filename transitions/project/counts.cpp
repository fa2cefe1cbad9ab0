#include "transitions/project/counts.hpp"

#include <algorithm>
#include <bit>

namespace edgewise {

double transparency_updates(Compositing how, int samples) noexcept {
    const auto last = static_cast<unsigned>(samples - 1);
    switch (how) {
        case Compositing::back_to_front:
            return 0;
        case Compositing::front_to_back:
        case Compositing::sum:
            return std::max(0, samples - 2);
        case Compositing::tree_from_back:  // internal nodes off the right spine, of ceil(log2 W)
            return samples - 1 - std::bit_width(last);
        case Compositing::tree_from_front:
            break;
    }
    double sum = 0;
    for (unsigned level = last >> 1; level > 0; level >>= 1) sum += level;
    return sum;
}

double multiplications(Compositing how, int samples) noexcept {
    return samples + composites(samples) + transparency_updates(how, samples);
}

double additions(int samples) noexcept { return 2 * composites(samples); }

double additions_with_opacity(Compositing how, int samples, bool kept) noexcept {
    return 2 * composites(samples) + (kept ? 1 : 2) * transparency_updates(how, samples);
}

Counts initial_counts(int samples, int colors) noexcept {
    return {static_cast<double>(samples) * colors, static_cast<double>(samples - 1)};
}

Counts counts_of(Compositing how, int samples, int colors) noexcept {
    const Counts initial = initial_counts(samples, colors);
    return {
        initial.multiplications + composites(samples) * colors + transparency_updates(how, samples),
        initial.additions + composites(samples) * colors};
}

Counts opacity_counts(Compositing how, int samples) noexcept {
    return {composites(samples) - transparency_updates(how, samples), 1};
}

}  // namespace edgewise
