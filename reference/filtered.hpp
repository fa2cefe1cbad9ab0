#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "graph/filtering.hpp"
#include "reference/job_reference.hpp"

namespace edgewise {

/// What a filter makes of samples, in f64 and as graph/filtering.hpp defines it, place by place of
/// the kernel. Written without the edges that it judges.
class FilteredReference final : public JobReference {
 public:
    /// Both must stay alive.
    FilteredReference(const Filtering& filtering, const ReferenceField& field);

    /// NaN where a value within the kernel's reach is not finite; of medians where none is a
    /// number.
    std::vector<double> values(std::span<const OutputSample> samples) const override;
    double bytes(int threads) const noexcept override;
    void expect_affordable(double samples) const override;
    bool is_near_field() const noexcept override { return true; }

 private:
    enum class Rule { sum, most, least, middle };
    struct Pass {
        Rule rule;
        int sign;  // of the place in the kernel
    };
    /// A value at each sample of one channel.
    using Numbers = std::vector<double>;

    /// Of one channel: the samples, and what the last pass reads of them.
    struct Prepared {
        Numbers samples, last;
    };

    static std::vector<Pass> passes_of(FilterOp op);
    double sample_value(const Data& data, std::int64_t number) const;
    /// Of the second pass of an opening or closing: from all results that read a sample, or the
    /// sample itself where none does.
    double adjoint_at(const Pass& pass, const Prepared& of,
                      const std::array<std::int64_t, 3>& at) const;
    double gradient_at(const Numbers& in, const std::array<std::int64_t, 3>& at) const;
    double result_at(const Prepared& of, const std::array<std::int64_t, 3>& at) const;
    Prepared prepared(int channel) const;
    /// Of a pass at one place of a volume.
    double made_at(const Pass& pass, const Stencil& stencil, const Numbers& in,
                   const std::array<std::int64_t, 3>& at) const;
    Numbers made(const Pass& pass, const Stencil& stencil, const Numbers& in) const;
    Numbers made_everywhere(const Pass& pass, const Numbers& in) const;
    bool is_flat_box() const;
    double steps(double samples) const noexcept;

    const Filtering& filtering_;
    const ReferenceField& field_;
    double places_;  // of the kernel that count
    /// Made with the first values() and kept: a large output is compared box by box.
    mutable std::vector<Prepared> channels_;
};

}  // namespace edgewise
