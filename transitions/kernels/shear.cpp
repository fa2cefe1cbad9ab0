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
    /// Whatever lay along an axis now goes from begin to the sample before end.
    void span(int axis, std::int64_t begin, std::int64_t end) {
        centre_[axis] = double(begin + end - 1) / 2;
        for (Vector& g : generators_) g[axis] = 0;
        widen(axis, double(end - 1 - begin) / 2);
    }
    double low(int axis) const { return centre_[axis] - half(axis); }
    double high(int axis) const { return centre_[axis] + half(axis); }
    Region bounds() const {
        Region box;
        for (int i = 0; i < 3; ++i) {
            box.begin[i] = std::int64_t(std::floor(low(i)));
            box.end[i] = std::int64_t(std::ceil(high(i))) + 1;
        }
        return box;
    }

 private:
    double half(int axis) const {
        double sum = 0;
        for (const Vector& g : generators_) sum += std::abs(g[axis]);
        return sum;
    }

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
double support(Hold hold, const Filter* filter) {
    if (hold == Hold::weighted) return filter->taps / 2;
    return hold == Hold::foh ? 1 : 16;
}

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
                                    const Extent& screen, Hold hold, const Filter* filter) {
    // Without any shear one pass still carries the samples over.
    const int count = std::max(chain.count, 1);
    std::vector<ShearPass> passes(static_cast<std::size_t>(count));
    // What the screen needs, from the last box to the first.
    Zonotope needed(Region::all(screen));
    for (int k = count - 1; k >= 0; --k) {
        passes[k].shear = chain.shears[k];
        passes[k].filter = filter;
        passes[k].to = k == count - 1 ? Region::all(screen) : needed.bounds();
        needed.shear(chain.shears[k], -1);
        needed.widen(chain.shears[k].axis, support(hold, filter));
    }
    // What the input reaches, with the samples that continue it: two, or as many as a filter
    // reads beyond the end, and one more a pass.
    const Region start = permuted_box(chain, input);
    Zonotope reached(start, hold == Hold::weighted ? std::max(2.0, support(hold, filter)) : 2);
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

std::vector<ShearPass> passes_of_box(std::vector<ShearPass> passes, Hold hold, const Region& box) {
    constexpr double kRounding = 1e-3;  // of places, and of maps that chains give back
    for (const ShearPass& pass : passes)
        if (pass.to.empty()) return {};
    // The needed part is an intersection: places that the box is made of, and places that the input
    // reaches.
    Zonotope seen(passes.front().from, 0.5 + kRounding);
    for (const ShearPass& pass : passes) seen.shear(pass.shear, 1);
    Region to = intersection(intersection(passes.back().to, box), seen.bounds());
    if (to.empty()) return {};
    Zonotope needed(to);
    for (std::size_t k = passes.size(); k-- > 0;) {
        ShearPass& pass = passes[k];
        const Region from = pass.from;
        const int axis = pass.shear.axis;
        const std::int64_t begin = from.begin[axis], end = from.end[axis];
        for (Zonotope* places : {&seen, &needed}) places->shear(pass.shear, -1);
        if (hold != Hold::bspline3 || moves_whole(pass.shear)) {
            // A place beyond the end of a line has the value of its last sample.
            const double before = double(begin) - std::max(seen.low(axis), needed.low(axis));
            const double behind = std::min(seen.high(axis), needed.high(axis)) - double(end - 1);
            const double taps = hold == Hold::bspline3 ? 1 : support(hold, pass.filter);
            const double reach = std::max({taps, before, behind}) + kRounding;
            for (Zonotope* places : {&seen, &needed}) places->widen(axis, reach);
        } else {
            // Recursions of the prefilter go over whole lines, and round as they go.
            for (Zonotope* places : {&seen, &needed}) places->span(axis, begin, end);
        }
        const Region both = intersection(seen.bounds(), needed.bounds());
        pass.to = to;
        pass.from = to;
        pass.from.begin[axis] = std::clamp(both.begin[axis], begin, end - 1);
        pass.from.end[axis] = std::clamp(both.end[axis], pass.from.begin[axis] + 1, end);
        to = pass.from;
    }
    return passes;
}

std::size_t shear_scratch(const ShearPass& pass) noexcept {
    // Sixteen lines with eight samples of padding, and one line more.
    const std::size_t n = std::size_t(pass.from.extent()[pass.shear.axis]) + 32;
    return 16 * n + n;
}

void mask_outside(const Affine& to_input, const Extent& input, float outside, float* out,
                  const Region& held, const Region& part) noexcept {
    const Extent n = held.extent();
    for (std::int64_t z = part.begin[2]; z < part.end[2]; ++z)
        for (std::int64_t y = part.begin[1]; y < part.end[1]; ++y) {
            Columns seen{part.begin[0], part.end[0]};
            for (int i = 0; i < 3; ++i) {
                const double* m = &to_input[4 * i];
                const double first = m[1] * double(y) + m[2] * double(z) + m[3];
                seen = columns_between(first, m[0], -0.5 - kBorderSlack,
                                       double(input[i]) - 0.5 + kBorderSlack, seen);
            }
            float* row = out + ((z - held.begin[2]) * n.y + y - held.begin[1]) * n.x;
            const auto fill = [&](std::int64_t begin, std::int64_t end) {
                std::fill(row + (begin - held.begin[0]), row + (end - held.begin[0]), outside);
            };
            fill(part.begin[0], seen.begin);
            fill(seen.end, part.end[0]);
        }
}

}  // namespace edgewise::kernels
