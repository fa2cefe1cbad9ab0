#pragma once

#include "graph/radon.hpp"
#include "reference/job_reference.hpp"

namespace edgewise {

/// Integrals along lines, and votes for them, as docs/radon.md defines them; of the frames in
/// graph/radon.hpp.
///
/// An integral goes from crossing to crossing of the line with the grid's rows and columns. Between
/// two of them the bilinear field is a parabola, and Simpson's rule is exact. Votes are counted
/// sample by sample. Written without the edges that it judges.
class LineReference final : public JobReference {
 public:
    /// Both must stay alive.
    LineReference(const Request& want, const RadonSetting& setting, const ReferenceField& field);

    std::vector<double> values(std::span<const OutputSample> samples) const override;
    double bytes(int threads) const noexcept override;
    void expect_affordable(double samples) const override;
    /// Of integrals the range of the samples, times the field's diagonal.
    std::optional<double> range() const override;
    bool is_near_field() const noexcept override { return false; }

 private:
    struct Line {
        double x, y;    // its point at the given offset that is nearest to the centre [sample]
        double dx, dy;  // along it, for one file unit [sample]
    };

    double sample(std::int64_t x, std::int64_t y, std::int64_t z) const;
    Line line_of(std::int64_t angle, std::int64_t offset) const;
    double field_at(double x, double y, std::int64_t z) const;
    double integral(const Line& line, std::int64_t z) const;
    /// One for each offset.
    std::vector<double> votes(std::int64_t angle, std::int64_t z) const;

    const RadonSetting& setting_;
    const ReferenceField& field_;
    RadonLines lines_;
    std::optional<double> given_range_;
};

}  // namespace edgewise
