#include "transitions/kernels/shear.hpp"

#include <algorithm>
#include <cmath>

#include "transitions/kernels/columns.hpp"

namespace edgewise::kernels {
namespace {

using Vector = std::array<double, 3>;

constexpr double kBorderSlack = 1e-9;  // of the backward warp, so that both see the same input

/// A centrally symmetric polytope: centre plus any part, -1 to 1, of each generator. A box that is
/// sheared and widened by a filter's support stays one, so that its bounds are exact.
class Zonotope {
 public:
    explicit Zonotope(const Region& box, double margin = 0) {
        for (int i = 0; i < 3; ++i) {
            centre_[i] = double(box.begin[i] + box.end[i] - 1) / 2;
            widen(i, double(box.end[i] - 1 - box.begin[i]) / 2 + margin);
        }
    }
    void widen(int axis, double by) {
        Vector generator{0, 0, 0};
        generator[axis] = by;
        generators_.push_back(generator);
    }
    void shear(const Shear& shear, double sign) {
        centre_[shear.axis] += sign * shear.step(centre_);
        for (Vector& g : generators_) g[shear.axis] += sign * (shear.step(g) - shear.offset);
    }
    Region bounds() const {
        Region box;
        for (int i = 0; i < 3; ++i) {
            double half = 0;
            for (const Vector& g : generators_) half += std::abs(g[i]);
            box.begin[i] = std::int64_t(std::floor(centre_[i] - half));
            box.end[i] = std::int64_t(std::ceil(centre_[i] + half)) + 1;
        }
        return box;
    }

 private:
    Vector centre_{};
    std::vector<Vector> generators_;
};

Region intersection(const Region& a, const Region& b) {
    Region both;
    for (int i = 0; i < 3; ++i) {
        both.begin[i] = std::max(a.begin[i], b.begin[i]);
        both.end[i] = std::min(a.end[i], b.end[i]);
    }
    return both;
}

/// Samples beside a position that its value depends on. The weights of a B-spline's prefilter fall
/// by 0.268 a sample: 14 samples farther, 1e-8 is left.
double support(Hold hold) { return hold == Hold::foh ? 1 : 16; }

Region permuted_box(const ShearChain& chain, const Extent& input) {
    Region box;
    for (int i = 0; i < 3; ++i) {
        const std::int64_t n = input[chain.from[i]];
        box.begin[i] = chain.sign[i] > 0 ? 0 : 1 - n;
        box.end[i] = chain.sign[i] > 0 ? n : 1;
    }
    return box;
}

}  // namespace

std::vector<ShearPass> shear_passes(const ShearChain& chain, const Extent& input,
                                    const Extent& screen, Hold hold) {
    // Without any shear one pass still carries the samples over.
    const int count = std::max(chain.count, 1);
    std::vector<ShearPass> passes(static_cast<std::size_t>(count));
    // What the screen needs, from the last box to the first.
    Zonotope needed(Region::all(screen));
    for (int k = count - 1; k >= 0; --k) {
        passes[k].shear = chain.shears[k];
        passes[k].to = k == count - 1 ? Region::all(screen) : needed.bounds();
        needed.shear(chain.shears[k], -1);
        needed.widen(chain.shears[k].axis, support(hold));
    }
    // What the input reaches, with the samples that continue it: two, and one more a pass.
    const Region start = permuted_box(chain, input);
    Zonotope reached(start, 2);
    for (int k = 0; k < count; ++k) {
        passes[k].from = k == 0 ? start : passes[k - 1].to;
        reached.shear(chain.shears[k], 1);
        reached.widen(chain.shears[k].axis, 1);
        Region to = intersection(passes[k].to, reached.bounds());
        for (int i = 0; i < 3; ++i) {
            if (i == chain.shears[k].axis) continue;
            to.begin[i] = std::max(to.begin[i], passes[k].from.begin[i]);
            to.end[i] = std::min(to.end[i], passes[k].from.end[i]);
        }
        passes[k].to = to;
    }
    return passes;
}

std::size_t shear_scratch(const ShearPass& pass) noexcept {
    // Sixteen lines with three samples of padding, and one line more.
    const std::size_t n = std::size_t(pass.from.extent()[pass.shear.axis]) + 32;
    return 16 * n + n;
}

void mask_outside(const Affine& to_input, const Extent& input, float outside, float* out,
                  const Extent& screen, const Region& part) noexcept {
    for (std::int64_t z = part.begin[2]; z < part.end[2]; ++z)
        for (std::int64_t y = part.begin[1]; y < part.end[1]; ++y) {
            Columns seen{part.begin[0], part.end[0]};
            for (int i = 0; i < 3; ++i) {
                const double* m = &to_input[4 * i];
                const double first = m[1] * double(y) + m[2] * double(z) + m[3];
                seen = columns_between(first, m[0], -0.5 - kBorderSlack,
                                       double(input[i]) - 0.5 + kBorderSlack, seen);
            }
            float* row = out + (z * screen.y + y) * screen.x;
            std::fill(row + part.begin[0], row + seen.begin, outside);
            std::fill(row + seen.end, row + part.end[0], outside);
        }
}

}  // namespace edgewise::kernels
