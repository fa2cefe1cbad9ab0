#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>

#include "transitions/reference/preview.hpp"
#include "transitions/reference/stored.hpp"

namespace edgewise {
namespace {

/// Mean square over the lines of one layer of samples of what a ray along each would collect.
class Layer {
 public:
    Layer(const Data& input, double empty, int axis, bool last)
        : input_(input), empty_(empty), axis_(axis), at_(last ? input.what.extent[axis] - 1 : 0) {}

    double along(int axis) const {
        const int across = 3 - axis_ - axis;
        const Extent& n = input_.what.extent;
        double squares = 0;
        for (std::int64_t j = 0; j < n[across]; ++j) {
            double sum = 0;
            for (std::int64_t i = 0; i < n[axis]; ++i) sum += at(axis, i, across, j);
            squares += sum * sum;
        }
        return squares / static_cast<double>(n[across]);
    }

 private:
    double at(int axis, std::int64_t i, int across, std::int64_t j) const {
        const Extent& n = input_.what.extent;
        std::array<std::int64_t, 3> p{};
        p[axis_] = at_;
        p[axis] = i;
        p[across] = j;
        const double value = value_at(input_, p[0] + n.x * (p[1] + n.y * p[2]));
        return std::isfinite(value) ? value - empty_ : 0;
    }

    const Data& input_;
    double empty_;
    int axis_;
    std::int64_t at_;
};

}  // namespace

void measure_faces(const Request& want, const Data& input, double empty,
                   std::map<std::string, double>& facts) {
    const Extent& n = input.what.extent;
    for (int face = 0; face < 6; ++face) {
        const int axis = face / 2;
        const Layer layer(input, empty, axis, face % 2 == 1);
        double most = 0;
        for (int along = 0; along < 3; ++along) {
            if (along == axis) continue;
            const double unit =
                want.mode == Mode::mean ? 1 / static_cast<double>(n[along]) : want.spacing[along];
            most = std::max(most, std::sqrt(layer.along(along)) * unit);
        }
        facts[fmt::format("face/{}", face)] = most;
    }
}

}  // namespace edgewise
