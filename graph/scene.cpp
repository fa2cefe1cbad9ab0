#include "graph/scene.hpp"

#include <cmath>

namespace edgewise {

/// Evenly in its logarithm, over four decades: as far apart as errors of filters are. In every
/// third scene these begin at the range of the data, in the others 1e-4 and 1e-8 of it below: a
/// result may have another range, and all errors may be small beside what is known.
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
    const auto decades = static_cast<double>(4 * (supposed.value_or(0) % 3));
    return range * std::pow(10.0, -decades - 4 * (static_cast<double>(hash >> 11) * 0x1p-53));
}

}  // namespace edgewise
