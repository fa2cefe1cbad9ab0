#include "transitions/warp/shear_chain.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace edgewise {
namespace {

using kernels::Affine;
using kernels::Shear;
using kernels::ShearChain;
using Matrix = std::array<std::array<double, 3>, 3>;

constexpr double kExact = 1e-12;   // a matrix this close to a signed permutation is one
constexpr double kProduct = 1e-9;  // a chain must give its matrix back within this
constexpr double kTie = 1e-9;      // bounds closer than this are equal; the first is kept
constexpr double kWholeShift = 1e-9;
// Turning by a farther quarter turn can lower the bound by 0.067, but makes the shears larger.
constexpr double kWorthAnotherTurn = 0.1;

struct SignedPermutation {
    std::array<int, 3> from, sign;
    double determinant;
};

constexpr std::array<std::array<int, 3>, 6> kOrders = {
    {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};
constexpr std::array<double, 6> kParity = {1, -1, -1, 1, 1, -1};

constexpr std::array<SignedPermutation, 48> signed_permutations() {
    std::array<SignedPermutation, 48> all{};
    int n = 0;
    for (int order = 0; order < 6; ++order)
        for (int signs = 0; signs < 8; ++signs) {
            const std::array<int, 3> sign = {signs & 1 ? -1 : 1, signs & 2 ? -1 : 1,
                                             signs & 4 ? -1 : 1};
            all[n++] = {kOrders[order], sign, kParity[order] * sign[0] * sign[1] * sign[2]};
        }
    return all;
}

constexpr std::array<SignedPermutation, 48> kSignedPermutations = signed_permutations();

double determinant(const Matrix& a) {
    return a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) -
           a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
           a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]);
}

/// Greatest difference between an entry of the chain's linear part and of a; infinite or NaN
/// coefficients give infinity.
double misses(const ShearChain& chain, const Matrix& a) {
    ShearChain linear = chain;
    for (Shear& shear : linear.shears) shear.offset = 0;
    double worst = 0;
    for (int column = 0; column < 3; ++column) {
        std::array<double, 3> unit{0, 0, 0};
        unit[column] = 1;
        const std::array<double, 3> image = kernels::sheared(linear, unit);
        for (int row = 0; row < 3; ++row) {
            const double difference = std::abs(image[row] - a[row][column]);
            if (!(difference <= worst))
                worst = std::isfinite(difference) ? difference
                                                  : std::numeric_limits<double>::infinity();
        }
    }
    return worst;
}

/// Puts the translation inside the rounding: each axis takes what is missing in its last shear.
void translate(ShearChain& chain, const std::array<double, 3>& by) {
    std::array<int, 3> last = {-1, -1, -1};
    for (int k = 0; k < chain.count; ++k) last[chain.shears[k].axis] = k;
    for (int axis = 0; axis < 3; ++axis)
        if (last[axis] < 0 && by[axis] != 0) {
            last[axis] = chain.count;
            chain.shears[chain.count++] = {.axis = axis};
        }
    std::array<double, 3> origin{0, 0, 0};  // where the origin is after the shears so far
    for (int k = 0; k < chain.count; ++k) {
        Shear& shear = chain.shears[k];
        if (last[shear.axis] == k)
            shear.offset = by[shear.axis] - origin[shear.axis] - shear.step(origin);
        origin[shear.axis] += shear.step(origin);
    }
}

std::optional<ShearChain> exact_permutation(const Matrix& a) {
    ShearChain chain;
    for (int row = 0; row < 3; ++row) {
        int column = 0;
        for (int c = 1; c < 3; ++c)
            if (std::abs(a[row][c]) > std::abs(a[row][column])) column = c;
        chain.from[row] = column;
        chain.sign[row] = a[row][column] < 0 ? -1 : 1;
    }
    if (misses(chain, a) > kExact) return {};
    return chain;
}

// ---- three shears of two axes ---------------------------------------------------------------

/// An axis that neither gives to the others nor takes from them: row and column of a that hold one
/// entry of +-1.
struct Loose {
    int row, column;
};

std::optional<Loose> loose_axis(const Matrix& a) {
    for (int row = 2; row >= 0; --row)  // z first: in an image it is the one that stays
        for (int column = 2; column >= 0; --column) {
            double rest = std::abs(std::abs(a[row][column]) - 1);
            for (int i = 0; i < 3; ++i) {
                if (i != column) rest = std::max(rest, std::abs(a[row][i]));
                if (i != row) rest = std::max(rest, std::abs(a[i][column]));
            }
            if (rest <= kExact) return Loose{row, column};
        }
    return {};
}

/// EQ 32: [a b; c d] = [1 b1; 0 1] [1 0; b2 1] [1 b3; 0 1]. Where c is nearly 0, b1 = (a - 1) / c
/// is noise, and any b1 serves, as b3 makes up for it: 0, so that one pass is left where c is 0
/// too.
std::array<double, 3> three_shears(double a, double b, double c, double d) {
    const bool nearly_upright = std::abs(c) < 1e-6 && std::abs(a - 1) < 1e-10;
    if (std::abs(a) < std::abs(d)) {
        const double b3 = nearly_upright ? b : (d - 1) / c;
        return {(b - b3) / d, c, b3};  // b = b1 (1 + b2 b3) + b3, and 1 + b2 b3 = d
    }
    const double b1 = nearly_upright ? 0 : (a - 1) / c;
    return {b1, c, (b - b1) / a};
}

/// Shears of the axes p, q, p after the permutation that the chain already has: those of the three
/// that move anything, for each pass interpolates once.
void shear_two_axes(ShearChain& chain, const Matrix& b, int p, int q) {
    const std::array<double, 3> by = three_shears(b[p][p], b[p][q], b[q][p], b[q][q]);
    chain.count = 0;
    const auto add = [&](int axis, int from, double step) {
        if (step == 0) return;
        Shear& shear = chain.shears[chain.count++];
        shear = {.axis = axis};
        shear.by[from] = step;
    };
    add(p, q, by[2]);
    add(q, p, by[1]);
    add(p, q, by[0]);
}

/// a P^T: what is left of a behind the permutation.
Matrix behind(const Matrix& a, const std::array<int, 3>& from, const std::array<int, 3>& sign) {
    Matrix b;
    for (int row = 0; row < 3; ++row)
        for (int i = 0; i < 3; ++i) b[row][i] = sign[i] * a[row][from[i]];
    return b;
}

std::optional<ShearChain> best_of_three_shears(const Matrix& a, const Loose& loose) {
    const double det = determinant(a) < 0 ? -1 : 1;
    std::optional<ShearChain> best;
    double best_bound = std::numeric_limits<double>::infinity(), best_trace = 0;
    for (const SignedPermutation& candidate : kSignedPermutations) {
        if (candidate.determinant != det || candidate.from[loose.row] != loose.column) continue;
        if (candidate.sign[loose.row] * a[loose.row][loose.column] < 0) continue;
        const Matrix b = behind(a, candidate.from, candidate.sign);
        const double trace = b[0][0] + b[1][1] + b[2][2];
        for (int swapped = 0; swapped < 2; ++swapped) {
            const int p = (loose.row + 1 + swapped) % 3, q = (loose.row + 2 - swapped) % 3;
            ShearChain chain;
            chain.from = candidate.from;
            chain.sign = candidate.sign;
            shear_two_axes(chain, b, p, q);
            if (misses(chain, a) > kProduct) continue;
            chain.displacement = kernels::displacement_bound(chain);
            const double bound = chain.bound();
            // The nearest permutation (greatest trace) wins unless another one gains enough.
            const double nearer = trace > best_trace + kTie   ? kWorthAnotherTurn
                                  : trace < best_trace - kTie ? -kWorthAnotherTurn
                                                              : -kTie;
            if (best && !(bound < best_bound + nearer)) continue;
            best = chain;
            best_bound = bound;
            best_trace = trace;
        }
    }
    return best;
}

// ---- four shears of three axes --------------------------------------------------------------

/// Coefficients of x += p y + q z, y += r x + s z, z += t x + u y, x += v y + w z.
struct FourShears {
    double p, q, r, s, t, u;

    /// b with its rows and columns in the order of the axes a, b, c.
    FourShears(const Matrix& m, const std::array<int, 3>& o) noexcept {
        const double a22 = m[o[1]][o[1]], a23 = m[o[1]][o[2]], a31 = m[o[2]][o[0]],
                     a32 = m[o[2]][o[1]], a33 = m[o[2]][o[2]];
        r = m[o[1]][o[0]];
        p = (a22 - 1) / r;
        u = a32 - p * a31;
        t = a31 - u * r;
        q = (a33 - 1 - u * a23) / t;
        s = a23 - r * q;
    }

    /// Greatest displacement: displacement_bound written out; the last shear does not enter.
    double bound() const noexcept {
        const double y4 = s * t - r;
        const double x = 1 + std::abs(p) + std::abs(p * s - q) + std::abs(1 - p * y4 + q * t);
        const double y = 1 + std::abs(s) + std::abs(y4);
        return 0.5 * std::max({x, y, 1 + std::abs(t)});
    }
};

ShearChain four_shear_chain(const SignedPermutation& permutation, const FourShears& c,
                            const Matrix& m, const std::array<int, 3>& o) {
    const double e = m[o[0]][o[0]] - 1, f = m[o[0]][o[1]] - c.p;
    const double a21 = m[o[1]][o[0]], a22 = m[o[1]][o[1]], a31 = m[o[2]][o[0]], a32 = m[o[2]][o[1]];
    const double d = a21 * a32 - a31 * a22;
    ShearChain chain;
    chain.from = permutation.from;
    chain.sign = permutation.sign;
    chain.count = 4;
    const auto set = [&](int k, int axis, int i, double by_i, int j, double by_j) {
        chain.shears[k] = {.axis = o[axis]};
        chain.shears[k].by[o[i]] = by_i;
        chain.shears[k].by[o[j]] = by_j;
    };
    set(0, 0, 1, c.p, 2, c.q);
    set(1, 1, 0, c.r, 2, c.s);
    set(2, 2, 0, c.t, 1, c.u);
    set(3, 0, 1, (e * a32 - f * a31) / d, 2, (a21 * f - a22 * e) / d);
    return chain;
}

/// What makes one chain of four shears better than another. Every rotation has chains within
/// kEnough; of these the one after the nearest quarter turns is best (greatest trace): its shears
/// vanish with the turn that is left, where those of the very least bound may shift lines by a
/// whole sample and back, and blur what hardly moves. Beyond that the bound decides.
struct FourShearRank {
    double bound = std::numeric_limits<double>::infinity(), trace = 0;

    /// False where the bound is NaN.
    bool before(const FourShearRank& other) const noexcept {
        constexpr double kEnough = (3 + std::numbers::sqrt2) / 4 + kTie;
        const bool enough = bound <= kEnough;
        if (enough != (other.bound <= kEnough)) return enough;
        if (enough && std::abs(trace - other.trace) > kTie) return trace > other.trace;
        return bound < other.bound - kTie;
    }
};

std::optional<ShearChain> best_of_four_shears(const Matrix& a) {
    const double det = determinant(a) < 0 ? -1 : 1;
    std::optional<ShearChain> best;
    FourShearRank best_rank;
    for (const SignedPermutation& candidate : kSignedPermutations) {
        if (candidate.determinant != det) continue;
        const Matrix b = behind(a, candidate.from, candidate.sign);
        for (const std::array<int, 3>& order : kOrders) {
            const FourShears shears(b, order);
            const FourShearRank rank{shears.bound(), b[0][0] + b[1][1] + b[2][2]};
            if (!rank.before(best_rank)) continue;
            const ShearChain chain = four_shear_chain(candidate, shears, b, order);
            if (misses(chain, a) > kProduct) continue;
            best = chain;
            best_rank = rank;
        }
    }
    if (best) best->displacement = kernels::displacement_bound(*best);
    return best;
}

}  // namespace

std::optional<ShearChain> shear_chain(const Affine& t) {
    const Matrix a = {{{t[0], t[1], t[2]}, {t[4], t[5], t[6]}, {t[8], t[9], t[10]}}};
    std::array<double, 3> translation = {t[3], t[7], t[11]};
    for (double entry : t)
        if (!std::isfinite(entry)) return {};
    if (!(std::abs(std::abs(determinant(a)) - 1) <= kProduct)) return {};

    std::optional<ShearChain> chain = exact_permutation(a);
    if (chain) {
        for (double& by : translation)  // cos(90 degrees) is 6e-17: whole shifts are meant whole
            if (std::abs(by - std::round(by)) <= kWholeShift) by = std::round(by);
        translate(*chain, translation);
        for (int i = 0; i < 3; ++i)
            chain->displacement[chain->from[i]] =
                std::abs(translation[i] - kernels::round_half_up(translation[i]));
        return chain;
    }
    if (const std::optional<Loose> loose = loose_axis(a)) chain = best_of_three_shears(a, *loose);
    if (!chain) chain = best_of_four_shears(a);
    if (!chain) return {};
    translate(*chain, translation);
    chain->displacement =
        kernels::displacement_bound(*chain);  // a loose axis rounds too if it moves
    return chain;
}

}  // namespace edgewise
