#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "reference/field.hpp"
#include "reference/view_geometry.hpp"

namespace edgewise {

/// What a job makes of samples, where that is neither the field at a point nor what a mode makes of
/// a ray. Worked out in f64 and as the job is defined, without the edges that are judged by it.
class JobReference {
 public:
    virtual ~JobReference() = default;

    /// [samples][channels]; NaN where the result is made of a value that is not finite. Runs in
    /// threads, for one caller at a time; the bytes do not depend on their number.
    virtual std::vector<double> values(std::span<const OutputSample> samples) const = 0;
    /// Bytes that values() takes at most beside what it returns, on so many threads.
    virtual double bytes(int threads) const noexcept = 0;
    /// @throws RequestError where so many samples would take hours
    virtual void expect_affordable(double samples) const = 0;
    /// The difference that counts as an error of 1, where it is not that of the results.
    virtual std::optional<double> range() const { return {}; }
    /// Whether the field at an output sample's place is a guess of its value.
    virtual bool is_near_field() const noexcept = 0;
};

/// Whether it is known what a job's results should be.
bool has_reference(Job job) noexcept;

/// Of a job that has one of its own, else null. Both must stay alive.
std::shared_ptr<const JobReference> job_reference(const Request& want, const ReferenceField& field);

}  // namespace edgewise
