#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "graph/plan.hpp"
#include "graph/scene.hpp"
#include "graph/transform_graph.hpp"
#include "reference/answer.hpp"
#include "reference/phantoms.hpp"
#include "runtime/memory_budget.hpp"

namespace edgewise {

/// Rz(z) Ry(y) Rx(x), degrees (EQ 37); exact for quarter turns.
Mat4 rotation(double x, double y, double z);

/// A request about the centre of a volume: one rotation a view, unit spacing, a screen that cuts
/// nothing off (render) or the input's extent (warp).
Request request_of(Job job, Mode mode, const Representation& input, const std::vector<Mat4>& turns);

/// What models of a request ask for, measured; `formula` for Field::formula.
Scene scene_of(const Data& input, const Request& want, MemoryBudget& memory,
               const Phantom* formula = nullptr);

/// The results of a plan, one a frame.
std::vector<std::shared_ptr<const Data>> results_of(const Plan& plan, const Ask& ask,
                                                    std::shared_ptr<const Data> input, int threads,
                                                    MemoryBudget& memory);

/// Every simple path of a request, at most `limit`, with predictions of the default profile.
std::vector<Plan> paths_of(const Catalogue& catalogue, const Ask& ask, const Representation& input,
                           std::size_t limit, const Demands& demands = {});

/// Root of the mean squared difference of all samples of two results [value].
double rms_difference(const std::vector<std::shared_ptr<const Data>>& a,
                      const std::vector<std::shared_ptr<const Data>>& b);

/// The reference of a request, all of it, worked out once for many paths.
class Expected {
 public:
    /// Request and field must stay alive.
    Expected(const Request& want, const ReferenceField& field, std::pmr::memory_resource* memory);
    /// RMSE over the samples that see the input, over the reference's range.
    double error_of(const std::vector<std::shared_ptr<const Data>>& results) const;
    double range() const noexcept { return range_; }

 private:
    std::size_t channels_;
    std::vector<double> values_;  // [frames][samples][channels]; NaN: does not count
    double range_ = 1;
};

/// The values of a result: mapped, whatever their type.
std::vector<float> values_of(const Data& data);

}  // namespace edgewise
