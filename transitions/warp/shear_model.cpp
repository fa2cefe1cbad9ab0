#include "transitions/warp/shear_model.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "transitions/filters/filter.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/warp/backward_model.hpp"
#include "transitions/warp/shear_chain.hpp"

namespace edgewise {
namespace {

/// Steps from node to node of the slanted lines that passes interpolate along [input index].
std::vector<Vec3> slanted_lines(const Request& want) {
    std::vector<Vec3> lines;
    if (want.eye || want.projective()) return lines;
    for (int variant = 0; variant < std::min(want.views.different(), 8); ++variant) {
        const auto chain =
            shear_chain(kernels::affine_of(want.views.at(want.views.first_view(variant)).matrix()));
        for (int pass = 0; chain && pass < chain->count; ++pass) {
            if (!kernels::is_slanted_pass(*chain, pass)) continue;
            const std::array<double, 3> line = kernels::line_of_pass(*chain, pass);
            const Vec3 step(line[0], line[1], line[2]);
            if (step.cwiseAbs().maxCoeff() <= kernels::kCoarsestLine) lines.push_back(step);
        }
    }
    return lines;
}

// Nodes on either side. Lines reach 1.25 samples from node to node (kCoarsestLine), so that four
// lie in the margin of the block.
constexpr int kReach = 4;

/// The natural spline through nodes, at f between the two in the middle: what it bends to at its
/// ends fades by 0.27 a node.
double spline_between(const double* value, double f) {
    std::array<double, 2 * kReach> bend{}, upper{};  // second derivatives
    for (int k = 1; k < 2 * kReach - 1; ++k) {
        const double pivot = 1 / (4 - upper[k - 1]);
        upper[k] = pivot;
        bend[k] = pivot * (6 * (value[k - 1] - 2 * value[k] + value[k + 1]) - bend[k - 1]);
    }
    for (int k = 2 * kReach - 2; k > 0; --k) bend[k] -= upper[k] * bend[k + 1];
    const int low = kReach - 1;
    const double g = 1 - f, linear = g * value[low] + f * value[low + 1];
    return linear + ((g * g * g - g) * bend[low] + (f * f * f - f) * bend[low + 1]) / 6;
}

double value_between(const Filter& filter, const double* value, double f) {
    if (filter.coefficients) return spline_between(value, f);
    std::array<double, 2 * kReach> weights{};
    filter.weights(f, weights.data());
    double sum = 0;
    for (int tap = 0; tap < filter.taps; ++tap)
        sum += weights[tap] * value[kReach - filter.taps / 2 + tap];
    return sum;
}

using Filters = std::vector<const Filter*>;

/// What one pass gets wrong at p: the field interpolated by each filter along a line through p,
/// which lies anywhere between two of its nodes. Channel 0; 0 where nodes are absent.
/// @param f  of p between the two, 0 to 1
void wrong_of_pass(const PreviewBlock& block, const Filters& by, const Vec3& p, const Vec3& line,
                   double f, std::span<double> wrong) {
    Places places;
    for (int k = 0; k < 2 * kReach; ++k) places.add(p + (k + 1 - kReach - f) * line);
    places.add(p);
    std::array<double, 2 * kReach + 1> value{};
    block.reference(places, value.data());
    if (!std::all_of(value.begin(), value.end(), [](double v) { return std::isfinite(v); }))
        return (void)std::ranges::fill(wrong, 0.0);
    for (std::size_t k = 0; k < by.size(); ++k)
        wrong[k] = value_between(*by[k], value.data(), f) - value.back();
}

/// At one of the lines, somewhere between two nodes: both drawn by a number of the place.
void wrong_at(const PreviewBlock& block, const Filters& by, const Vec3& p,
              const std::vector<Vec3>& lines, std::uint64_t drawn, std::span<double> wrong) {
    wrong_of_pass(block, by, p, lines[drawn % lines.size()], hashed(drawn), wrong);
}

class ShearedAlongRay final : public RayModel {
 public:
    ShearedAlongRay(const ReferenceField& field, const Filters& by, const std::vector<Vec3>& lines)
        : field_(field), by_(by), lines_(lines), squares_(by.size()), wrong_(by.size()) {}
    void take(double, RayPiece& piece) override {
        for_each_present(piece, field_, [&](std::size_t i, double) {
            if ((piece.cells().index[i] & 3) != 0) return;  // a few will do
            const Vec3 p = piece.places()[i];
            const auto drawn =
                static_cast<std::uint64_t>(std::abs(1e3 * (piece.cells().middle[i] + p.sum())));
            wrong_at(piece.block(), by_, p, lines_, drawn, wrong_);
            for (std::size_t k = 0; k < wrong_.size(); ++k)
                if (std::isfinite(wrong_[k])) squares_[k] += wrong_[k] * wrong_[k];
            ++points_;
        });
    }
    void finish(const RayAnswer&, RaySquares& squares) override {
        for (std::size_t k = 0; k < squares_.size(); ++k)
            squares.add_points(k, squares_[k], points_);
    }

 private:
    const ReferenceField& field_;
    const Filters& by_;
    const std::vector<Vec3>& lines_;
    std::vector<double> squares_, wrong_;  // by filter
    double points_ = 0;
};

class ShearModel final : public Model {
 public:
    ShearModel(const ModelSetting& setting, std::vector<Vec3> lines)
        : setting_(setting), lines_(std::move(lines)) {
        for (const Filter* filter : setting.filters) {
            if (filter->taps == 1) continue;
            by_.push_back(filter);
            facts_.push_back({.name = kShearedError(filter->name), .of_points = true});
        }
    }
    void at(const PointMade& point, std::span<double> squares) const override {
        if (point.labels) return;
        const auto drawn = static_cast<std::uint64_t>(std::abs(1e3 * point.p.sum()));
        std::vector<double> wrong(by_.size());
        wrong_at(point.block, by_, point.p, lines_, drawn, wrong);
        for (std::size_t k = 0; k < wrong.size(); ++k)
            if (std::isfinite(wrong[k])) squares[k] = wrong[k] * wrong[k];
    }
    std::vector<double> steps() const override { return {kFieldStep}; }
    std::unique_ptr<RayModel> follow(const RaySpan&, const OutputSample&) const override {
        return std::make_unique<ShearedAlongRay>(setting_.field, by_, lines_);
    }

 private:
    const ModelSetting& setting_;
    Filters by_;
    std::vector<Vec3> lines_;
};

}  // namespace

std::shared_ptr<const Model> shear_model(const ModelSetting& setting) {
    std::vector<Vec3> lines = slanted_lines(setting.want);
    if (lines.empty()) return nullptr;
    return std::make_shared<ShearModel>(setting, std::move(lines));
}

}  // namespace edgewise
