#include "transitions/project/level_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "graph/picture_facts.hpp"
#include "transitions/filters/filter.hpp"
#include "transitions/kernels/scalar_load.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/ray_cast.hpp"
#include "transitions/store/reduce.hpp"

namespace edgewise {
namespace {

/// What is measured: what planners try, and what is asked for.
struct Measured {
    std::set<int> levels = {1, 2};
    std::vector<double> steps = {2, 4};
    bool asked = false;

    explicit Measured(const ModelSetting& setting) {
        if (!setting.asked) return;
        const std::array<std::string, 2> ours = {reduce().name, level_cast().name};
        for (const Demand& demand : setting.asked->via) {
            if (std::find(ours.begin(), ours.end(), demand.name) == ours.end()) continue;
            asked = true;
            const Parameters& with = demand.with;
            if (with.contains("level")) levels.insert(std::stoi(with.word("level")));
            if (!with.contains("step")) continue;
            const double step = with.number("step");
            if (std::find(steps.begin(), steps.end(), step) == steps.end()) steps.push_back(step);
        }
    }
};

/// A level of the samples, whose cells are made when they are asked for.
class Level {
 public:
    Level(const Data& samples, const Request& want, int level)
        : samples_(samples),
          load_(kernels::scalar_load(samples.what.type)),
          grid_(reduced_grid(samples.what.extent, want.spacing, level)) {}

    /// From cell to cell [input index].
    Vec3 steps() const { return {1 / grid_.map(0, 0), 1 / grid_.map(1, 1), 1 / grid_.map(2, 2)}; }
    using Cells = std::unordered_map<std::int64_t, double>;
    /// Linear interpolation of cells. @param p  [input index]
    double at(const Vec3& p, Cells& cells) const {
        std::array<std::int64_t, 3> cell;
        std::array<double, 3> share;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto i = static_cast<int>(axis);
            const auto last = static_cast<double>(grid_.extent[i] - 1);
            const double q = std::clamp(grid_.map(i, i) * p[i] + grid_.map(i, 3), 0.0, last);
            const double below = std::min(std::floor(q), std::max(0.0, last - 1));
            cell[axis] = static_cast<std::int64_t>(below);
            share[axis] = q - below;
        }
        double sum = 0;
        for (int corner = 0; corner < 8; ++corner) {
            double weight = 1;
            std::array<std::int64_t, 3> at = cell;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const bool upper = (corner >> axis & 1) != 0;
                weight *= upper ? share[axis] : 1 - share[axis];
                if (upper) ++at[axis];
            }
            if (weight > 0) sum += weight * mean(at, cells);
        }
        return sum;
    }

 private:
    double mean(const std::array<std::int64_t, 3>& cell, Cells& cells) const {
        const Extent& n = grid_.extent;
        const auto [found, is_new] =
            cells.try_emplace((cell[2] * n.y + cell[1]) * n.x + cell[0], 0.0);
        if (is_new) found->second = samples_.what.values(sum(cell));
        return found->second;
    }
    double sum(const std::array<std::int64_t, 3>& cell) const {
        const auto& [along_x, along_y, along_z] = grid_.axes;
        const Extent& n = samples_.what.extent;
        const auto first = [](const kernels::ScaledAxis& axis, std::int64_t i) {
            return static_cast<std::size_t>(i * axis.taps);
        };
        const std::size_t x = first(along_x, cell[0]);
        double total = 0;
        for (std::size_t k = first(along_z, cell[2]); k < first(along_z, cell[2] + 1); ++k)
            for (std::size_t j = first(along_y, cell[1]); j < first(along_y, cell[1] + 1); ++j) {
                const std::int64_t row = (along_z.sample[k] * n.y + along_y.sample[j]) * n.x;
                double line = 0;
                for (std::size_t i = x; i < first(along_x, cell[0] + 1); ++i)
                    line += static_cast<double>(along_x.weight[i]) *
                            static_cast<double>(
                                load_(samples_.samples.data(), row + along_x.sample[i]));
                total += static_cast<double>(along_z.weight[k]) *
                         static_cast<double>(along_y.weight[j]) * line;
            }
        return total;
    }

    const Data& samples_;
    kernels::ScalarLoad load_;
    ReducedGrid grid_;
};

class LevelRay final : public RayModel {
 public:
    LevelRay(const Request& want, const std::vector<Level>& levels,
             const std::vector<double>& steps)
        : want_(want),
          levels_(levels),
          steps_(steps),
          cells_(levels.size()),
          casts_(levels.size(), std::vector(steps.size(), Stretch::empty(want.mode))) {}
    void take(double step, RayPiece& piece) override {
        const auto s = static_cast<std::size_t>(std::find(steps_.begin(), steps_.end(), step) -
                                                steps_.begin());
        for (std::size_t l = 0; l < levels_.size(); ++l) {
            const auto read = [&](const Places& at, double* values) {
                for (std::size_t i = 0; i < at.count; ++i)
                    values[i] = levels_[l].at(at[i], cells_[l]);
            };
            std::array<double, Places::kMost> values;
            read(piece.places(), values.data());
            piece.add_read({values.data(), piece.count()}, levels_[l].steps(), read, casts_[l][s],
                           want_);
        }
    }
    void finish(const RayAnswer& answer, RaySquares& squares) override {
        std::size_t fact = 0;
        for (const auto& steps : casts_)
            for (const Stretch& cast : steps) {
                const double square = answer.square(cast);
                squares.add(fact++, square, answer.fourth(square));
            }
    }

 private:
    const Request& want_;
    const std::vector<Level>& levels_;
    const std::vector<double>& steps_;
    std::vector<Level::Cells> cells_;          // by level: those that the ray has met
    std::vector<std::vector<Stretch>> casts_;  // by level, then by step
};

class LevelModel final : public Model {
 public:
    LevelModel(const ModelSetting& setting, const Measured& measured)
        : want_(setting.want), steps_(measured.steps) {
        for (const int level : measured.levels) {
            levels_.emplace_back(setting.field.samples(), setting.want, level);
            for (const double step : steps_)
                facts_.push_back(
                    {.name = level_fact(level, filter_of(kFoh), step), .like = RayLook::kFoh2});
        }
    }
    std::vector<double> steps() const override { return steps_; }
    std::unique_ptr<RayModel> follow(const RaySpan&, const OutputSample&) const override {
        return std::make_unique<LevelRay>(want_, levels_, steps_);
    }
    bool stands_for_neighbours() const override { return true; }

 private:
    const Request& want_;
    std::vector<double> steps_;
    std::vector<Level> levels_;
};

/// Whether levels could save more than it takes to measure them: half of the samples, against a
/// pass over the voxels, of which four cost as much as a sample, and the draws.
bool pays(const ModelSetting& setting) {
    constexpr double kVoxels = 0.25, kDraws = 4e6;  // [sample]
    const Request& want = setting.want;
    const Representation& input = setting.field.samples().what;
    const double samples =
        static_cast<double>(want.output().samples()) * want.frames * mean_length(input, want, 0);
    return samples / 2 > kVoxels * static_cast<double>(input.samples()) + kDraws;
}

}  // namespace

FactName level_fact(int level, const Filter& filter, double step) {
    return kPictureError(level_space(level), filter.name, step);
}

std::shared_ptr<const Model> level_model(const ModelSetting& setting) {
    const Request& want = setting.want;
    if (!want.job->of_rays() || want.field == Field::nearest || want.field == Field::formula ||
        want.mode->sampled_every > 0 || want.shading.has_shade() || want.smooths_gradients() ||
        setting.statistics.non_finite > 0)
        return nullptr;
    const Measured measured(setting);
    if (!measured.asked && (want.budget.like || want.minimize == Minimize::error || !pays(setting)))
        return nullptr;
    return std::make_shared<LevelModel>(setting, measured);
}

}  // namespace edgewise
