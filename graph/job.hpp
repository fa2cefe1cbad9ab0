#pragma once

#include <string_view>
#include <vector>

namespace edgewise {

struct JobTraits;

/// What is asked for: a handle to what it is. Edges, planner, runtime and reference read that and
/// know no job by name. A program may ask for one of its own: it needs traits and an edge that
/// leads to their target.
class Job {
 public:
    explicit constexpr Job(const JobTraits& traits) noexcept : traits_(&traits) {}
    const JobTraits& operator*() const noexcept { return *traits_; }
    const JobTraits* operator->() const noexcept { return traits_; }
    friend bool operator==(Job a, Job b) noexcept { return a.traits_ == b.traits_; }

    static const Job warp, render, mesh, filter;

 private:
    const JobTraits* traits_;
};

struct JobTraits {
    std::string_view name = {};
    std::string_view help = {};  // what it does, in a few words
    /// The kind of data that its paths end in ("screen/picture"), in memory or on ranks.
    std::string_view target = {};
    /// What one value of its result is: the field at a point, what a mode makes of a view ray, or
    /// neither. Of neither the reference knows nothing: such results are not measured or verified.
    enum class Values { points, rays, other };
    Values values = Values::other;
    /// Its result is samples as the input's are: written in its type, with its channels.
    bool samples = false;

    bool of_points() const noexcept { return values == Values::points; }
    bool of_rays() const noexcept { return values == Values::rays; }
};

/// Those that come with the library, in the order in which they are listed.
const std::vector<Job>& jobs();
std::string_view name_of(Job job) noexcept;

}  // namespace edgewise
