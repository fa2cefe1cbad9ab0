#include "transitions/kernels/load_values.hpp"

#include "graph/with_type.hpp"
#include "transitions/kernels/scalar_load.hpp"

namespace edgewise::kernels {

void load_values(const Grid& volume, std::int64_t first, std::int64_t n, double subtract,
                 double* out) {
    const double slope = volume.values.slope, offset = volume.values.offset - subtract;
    if (volume.type == Type::f16) {
        const auto* stored = volume.as<std::uint16_t>() + first;
        for (std::int64_t i = 0; i < n; ++i) out[i] = slope * float_of_half(stored[i]) + offset;
        return;
    }
    with_type(volume.type, [&]<class T>(T) {
        const T* stored = volume.as<T>() + first;
        for (std::int64_t i = 0; i < n; ++i)
            out[i] = slope * static_cast<double>(stored[i]) + offset;
    });
}

}  // namespace edgewise::kernels
