#include "transitions/project/counts.hpp"

#include <bit>

namespace edgewise {

double transparency_updates(Compositing how, int samples) noexcept {
    const auto last = static_cast<unsigned>(samples - 1);
    switch (how) {
        case Compositing::back_to_front:
            return 0;
        case Compositing::front_to_back:
        case Compositing::sum:
            return samples - 2;
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

}  // namespace edgewise
