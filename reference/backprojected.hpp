#pragma once

#include "graph/radon.hpp"
#include "reference/job_reference.hpp"

namespace edgewise {

/// Filtered backprojection as docs/radon.md defines it, in f64, offset by offset for each sample:
/// no row is filtered beforehand. Written without the edge that it judges.
class BackprojectedReference final : public JobReference {
 public:
    /// The field must stay alive.
    BackprojectedReference(const Request& want, const RadonSetting& setting,
                           const ReferenceField& field);

    std::vector<double> values(std::span<const OutputSample> samples) const override;
    double bytes(int threads) const noexcept override;
    void expect_affordable(double samples) const override;
    /// The range of the samples, over the length of a row.
    std::optional<double> range() const override;
    bool is_near_field() const noexcept override { return false; }

 private:
    double value(const OutputSample& at) const;

    const ReferenceField& field_;
    RadonBack back_;
    std::optional<double> given_range_;
};

}  // namespace edgewise
