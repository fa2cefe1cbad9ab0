#include "graph/scene.hpp"

#include <cmath>

namespace edgewise {

/// Between 1e-4 and 1 of the range, evenly in its logarithm: as far apart as errors of filters are.
double Scene::made_up(const std::string& name) const {
    std::uint64_t hash = 1469598103934665603u;  // FNV-1a
    const auto add = [&](unsigned char byte) { hash = (hash ^ byte) * 1099511628211u; };
    for (int byte = 0; byte < 8; ++byte)
        add(static_cast<unsigned char>(supposed.value_or(0) >> (8 * byte)));
    for (const char letter : name) add(static_cast<unsigned char>(letter));
    // The last steps of SplitMix64 (Steele, Lea, Flood 2014): all bits hang on all letters.
    hash = (hash ^ (hash >> 30)) * 0xbf58476d1ce4e5b9;
    hash = (hash ^ (hash >> 27)) * 0x94d049bb133111eb;
    hash ^= hash >> 31;
    return range * std::pow(10.0, -4 * (static_cast<double>(hash >> 11) * 0x1p-53));
}

}  // namespace edgewise
