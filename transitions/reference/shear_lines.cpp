#include "transitions/reference/shear_lines.hpp"

#include <algorithm>
#include <cmath>

#include "transitions/warp/shear_chain.hpp"

namespace edgewise {
namespace {

kernels::Affine affine_of(const Mat4& map) {
    kernels::Affine affine;
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 4; ++column) affine[4 * row + column] = map(row, column);
    return affine;
}

}  // namespace

std::vector<Vec3> shear_lines(const Request& want) {
    std::vector<Vec3> lines;
    if (want.eye || want.projective()) return lines;
    for (int variant = 0; variant < std::min(want.views.different(), 8); ++variant) {
        const auto chain = shear_chain(affine_of(want.views.at(want.views.first_view(variant))));
        for (int pass = 0; chain && pass < chain->count; ++pass) {
            if (!kernels::is_slanted_pass(*chain, pass)) continue;
            const std::array<double, 3> line = kernels::line_of_pass(*chain, pass);
            const Vec3 step(line[0], line[1], line[2]);
            if (step.cwiseAbs().maxCoeff() <= kernels::kCoarsestLine) lines.push_back(step);
        }
    }
    return lines;
}

}  // namespace edgewise
